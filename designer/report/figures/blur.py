"""Blur of both views against elevation, at the nearest and the farthest distance of the working volume."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.design import Design, ViewName
from designer.evaluate.focus import ViewFocus, focus_of_design
from designer.report.figures.style import INK, VIEW_COLOUR, new_figure
from designer.typesetting.markup import plain_number

ELEVATIONS = 121


def draw_blur(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the blur's diameter in pixels and as an angle in the scene over the elevations asked of each view."""
    focus = focus_of_design(design, ELEVATIONS)
    views: dict[ViewName, ViewFocus] = {"upper": focus.upper, "lower": focus.lower}
    figure = new_figure(width_mm, height_mm)
    on_sensor, in_scene = figure.subplots(1, 2)
    near, far = design.working_volume.distance_mm
    asked = design.sharpness
    for axes, blurs, most in (
        (on_sensor, {name: view.blur_px for name, view in views.items()}, asked and asked.max_blur_px),
        (in_scene, {name: view.blur_deg for name, view in views.items()}, asked and asked.max_blur_deg),
    ):
        for name, view in views.items():
            for index, style in enumerate(("-", "--")):
                axes.plot(view.elevations_deg, np.abs(blurs[name][:, index]), color=VIEW_COLOUR[name], linestyle=style)
        if most:
            axes.axhline(most, color=INK, linewidth=0.8, linestyle=":")
        axes.set_ylim(bottom=0.0)
        axes.grid(True)
        axes.set_xlabel("elevation at the viewpoint $\\varphi$ (deg)")
    on_sensor.set_ylabel("blur on the sensor (px)")
    in_scene.set_ylabel("blur in the scene (deg)")
    figure.legend(
        handles=[
            *(Line2D([], [], color=VIEW_COLOUR[name], label=f"{name} view") for name in views),
            Line2D([], [], color=INK, linestyle="-", label=f"at {plain_number(near)} mm"),
            Line2D([], [], color=INK, linestyle="--", label=f"at {plain_number(far)} mm"),
            Line2D([], [], color=INK, linewidth=0.8, linestyle=":", label="largest allowed"),
        ],
        loc="outside upper center",
        ncols=5,
        columnspacing=1.2,
    )
    return figure
