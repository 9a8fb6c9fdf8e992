"""Where depth is resolved: the points that pairs of pixels of one epipolar plane give (the paper's figure 6)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from designer.design import Design
from designer.evaluate.resolution import epipolar_lattice
from designer.report.figures.style import INK, LIGHT_GREY, VIEW_COLOUR, length_unit, new_figure

IMAGE_CIRCLE_PX = 400
"""Diameter of the image circle, in pixels, for which the map is drawn: few enough for the points to stay apart."""


def draw_depth_map(design: Design, width_mm: float, height_mm: float, image_circle_px: int = IMAGE_CIRCLE_PX) -> Figure:
    """Draw the reconstructed point of every pair of pixels of an image circle coarsened to so many pixels across.

    The outline is the working volume, the triangles on the axis are the viewpoints. Heights are measured from the
    middle of the baseline.
    """
    distance_mm, level_mm = epipolar_lattice(coarsened(design, image_circle_px))
    middle = design.views.middle_mm
    far = design.working_volume.distance_mm[1]
    unit_mm, unit = length_unit(far)
    outline = _outline(design)
    low, high = _shown_levels(outline, design.baseline_mm)
    shown = (distance_mm < 1.02 * far) & (level_mm - middle > low) & (level_mm - middle < high)
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    axes.fill(*(outline.T / unit_mm), facecolor=LIGHT_GREY + "60", edgecolor=LIGHT_GREY, linewidth=0.8, zorder=1)
    points = (distance_mm[shown] / unit_mm, (level_mm[shown] - middle) / unit_mm)
    axes.plot(*points, ".", color=INK, markersize=1.3, mew=0, zorder=2)
    for name, view in design.views.by_name.items():
        level = (view.viewpoint_mm - middle) / unit_mm
        axes.plot(
            [0],
            [level],
            marker="^" if name == "upper" else "v",
            color=VIEW_COLOUR[name],
            clip_on=False,
            markersize=4,
            zorder=3,
        )
    axes.set_xlim(0, 1.02 * far / unit_mm)
    axes.set_ylim(low / unit_mm, high / unit_mm)
    axes.set_xlabel(f"distance from the axis $D$ ({unit})")
    axes.set_ylabel(f"height ({unit})")
    return figure


def _shown_levels(outline: np.ndarray, baseline_mm: float) -> tuple[float, float]:
    """Heights, from the middle of the baseline, between which the volume and both viewpoints are seen, mm."""
    low, high = min(outline[:, 1].min(), -baseline_mm / 2), max(outline[:, 1].max(), baseline_mm / 2)
    room = 0.05 * (high - low)
    return low - room, high + room


def coarsened(design: Design, image_circle_px: int = IMAGE_CIRCLE_PX) -> Design:
    """The same design on a sensor with pixels so large that the image circle is so many pixels across."""
    camera = design.camera
    radius_px = camera.image_radius_mm / camera.pixel_pitch_mm
    factor = 2 * radius_px / image_circle_px
    coarse = camera.model_copy(
        update={
            "pixel_pitch_mm": camera.pixel_pitch_mm * factor,
            "width_px": max(round(camera.width_px / factor), 1),
            "height_px": max(round(camera.height_px / factor), 1),
            "image_circle_radius_px": image_circle_px / 2,
        }
    )
    return design.model_copy(update={"camera": coarse})


def _outline(design: Design) -> np.ndarray:
    """Corners (distance, height from the middle of the baseline) of the working volume, mm."""
    low, high = np.tan(np.radians(design.working_volume.elevation_deg))
    near, far = design.working_volume.distance_mm
    return np.array([(near, near * low), (far, far * low), (far, far * high), (near, near * high)])
