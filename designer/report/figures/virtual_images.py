"""Where the camera must look: depths of the virtual images along the image radius, and those that the lens holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike, NDArray

from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.focus import ViewFocus, focus_of_design, refocused
from designer.evaluate.through_focus import blur_limit_deg, sharpest_focus
from designer.optics.focus import blur_in_scene, light_path_of_design
from designer.optics.view import image_radius
from designer.report.figures.style import GREY, INK, VIEW_COLOUR, new_figure
from designer.report.typst.markup import plain_number

ELEVATIONS = 81
FARTHEST_MM = 2000.0
"""Images beyond this depth, infinity included, are drawn there: nothing changes for the lens."""


def draw_virtual_images(designs: Sequence[Design], width_mm: float, height_mm: float) -> Figure:
    """Draw the depth z_V of both views' virtual images against the image radius, a panel for each design.

    Solid for the nearest and dashed for the farthest distance of the working volume. The lens has its recorded f-number
    and is focused where the largest blur in the scene is least (dotted). Shaded: the depths that it then blurs by no
    more than the limit.
    """
    figure = new_figure(width_mm, height_mm)
    panels = figure.subplots(1, len(designs), sharey=True, squeeze=False)[0]
    for axes, design in zip(panels, designs, strict=True):
        _draw_design(axes, design)
    panels[0].set_ylabel("depth of the virtual image $z_V$ (mm)")
    near, far = designs[0].working_volume.distance_mm
    handles: list[Line2D | Patch] = [
        *(Line2D([], [], color=VIEW_COLOUR[name], label=f"{name} view") for name in VIEW_NAMES),
        Line2D([], [], color=INK, linestyle="-", label=f"at {plain_number(near)} mm"),
        Line2D([], [], color=INK, linestyle="--", label=f"at {plain_number(far)} mm"),
        Line2D([], [], color=GREY, linewidth=0.9, linestyle=":", label="best focus"),
        Patch(facecolor=GREY, alpha=0.25, label=f"blur within {plain_number(blur_limit_deg(designs[0]))}°"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=6, columnspacing=1.1, handlelength=1.8)
    return figure


def _draw_design(axes: Axes, design: Design) -> None:
    focus = focus_of_design(design, ELEVATIONS)
    views: dict[ViewName, ViewFocus] = {"upper": focus.upper, "lower": focus.lower}
    reciprocal_focus, blur_deg = sharpest_focus(design)
    lens, camera = refocused(focus.lens, reciprocal_focus), design.camera
    for name, view in views.items():
        recorded, path = design.views.by_name[name], light_path_of_design(design, name)
        slope = np.tan(np.radians(view.elevations_deg))
        radius_mm = image_radius(slope, recorded.gain, camera.focal_length_mm, recorded.sense, lens.law)
        radius = np.abs(radius_mm) / camera.pixel_pitch_mm
        allowed_mm = np.radians(blur_limit_deg(design)) / blur_in_scene(path, slope, lens, 1.0)
        half = allowed_mm / (lens.pupil_diameter * lens.principal_distance)
        nearest, farthest = (_depth(lens.reciprocal_focus + side * half) for side in (1.0, -1.0))
        axes.fill_between(radius, nearest, farthest, color=GREY, alpha=0.25, linewidth=0.0)
        for index, style in enumerate(("-", "--")):
            depth = _depth(view.reciprocal_depths[:, index])
            axes.plot(radius, depth, color=VIEW_COLOUR[name], linestyle=style)
    at = float(_depth(lens.reciprocal_focus))
    axes.axhline(at, color=GREY, linewidth=0.9, linestyle=":")
    axes.grid(True)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("image radius (px)")
    told = f"{at:.0f} mm" if lens.reciprocal_focus > 1.0 / FARTHEST_MM else "far away"
    axes.set_title(f"{design.configuration}\nbest focus {told}: blur up to {blur_deg:.2f}°")


def _depth(reciprocal: ArrayLike) -> NDArray[np.float64]:
    """Depths in mm, those beyond infinity (negative) drawn where the farthest are."""
    return np.asarray(1.0 / np.maximum(np.asarray(reciprocal, dtype=float), 1.0 / FARTHEST_MM))
