"""Through focus: the largest blur of each view against the focus distance, and the depth of field at each elevation."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from designer.design import VIEW_NAMES, Design
from designer.evaluate.focus import focus_of_design
from designer.evaluate.through_focus import blur_limit_deg, largest_blur_through_focus, sharp_range
from designer.report.figures.style import GREY, INK, VIEW_COLOUR, VIEW_LINE, length_unit, new_figure

_STEPS = 801
_FOCUS_TICKS = (
    *range(20, 110, 5), *range(110, 200, 10), 200, 220, 250, 300, 350, 400, 500, 600, 800, 1000, 1500,
    2000, 5000,
)  # fmt: skip
# Ticks closer than this share of the axis are left out.
_TICK_ROOM = 0.13
_FARTHEST = 4.0
"""Depth of field is drawn up to this many times the farthest distance of the working volume."""


def draw_through_focus(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the largest blur in the scene of both views against the focus distance, nominal lens and stop kept."""
    focus = focus_of_design(design)
    chosen, limit = focus.lens.reciprocal_focus, blur_limit_deg(design)
    farthest = max(chosen, focus.best_reciprocal_focus, 0.01 / design.camera.focal_length_mm)
    reciprocal = np.unique(np.append(np.linspace(0.0, 3.0 * farthest, _STEPS), chosen))
    largest = largest_blur_through_focus(design, reciprocal)
    top = max(3.0 * limit, 1.3 * focus.largest_blur_deg)
    shown = reciprocal[np.min([largest[name] for name in VIEW_NAMES], axis=0) <= top]
    low, high = float(shown.min()), float(shown.max())
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for name in VIEW_NAMES:
        axes.plot(reciprocal, largest[name], color=VIEW_COLOUR[name], linestyle=VIEW_LINE[name], label=f"{name} view")
    axes.axhline(limit, color=INK, linewidth=0.8, linestyle=":", label="limit")
    at = "∞" if chosen == 0.0 else f"{1.0 / chosen:.0f} mm"
    axes.axvline(chosen, color=GREY, linewidth=1.0, label=f"focus: {at}")
    # In 1/u, in which blur is linear; the ticks name the distances, shortest to the left.
    ticks = _ticks(low, high)
    axes.set_xlim(high, low)
    axes.set_xticks([1.0 / tick for tick in ticks], [f"{tick:g}" for tick in ticks])
    axes.set_ylim(0.0, top)
    axes.grid(True)
    axes.set_xlabel("focus distance $u$ (mm, scale of $1/u$)")
    axes.set_ylabel("largest blur (deg)")
    figure.legend(loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure


def draw_depth_of_field(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the nearest and the farthest distance that stay within the blur limit, over both views' elevations."""
    near, far = design.working_volume.distance_mm
    unit_mm, unit = length_unit(far)
    bottom, top = 0.2 * near, _FARTHEST * far
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    volume: dict[str, Any] = {"color": INK, "linewidth": 0.8, "linestyle": ":"}
    axes.axhline(near / unit_mm, label="working volume", **volume)
    axes.axhline(far / unit_mm, **volume)
    for name in VIEW_NAMES:
        ends = sharp_range(design, name)
        colour, style = VIEW_COLOUR[name], VIEW_LINE[name]
        near_end, far_end = (
            np.clip(end, bottom / 2.0, 2.0 * top) / unit_mm for end in (ends.nearest_mm, ends.farthest_mm)
        )
        axes.fill_between(ends.elevations_deg, near_end, far_end, color=colour, alpha=0.12, linewidth=0.0)
        axes.plot(ends.elevations_deg, near_end, color=colour, linestyle=style, label=f"{name} view")
        axes.plot(ends.elevations_deg, far_end, color=colour, linestyle=style)
    # Where a view is sharp nowhere, its elevations stay on the axis, empty.
    ends_deg = [end for view in design.views.by_name.values() for end in view.elevation_deg]
    axes.set_xlim(min(ends_deg) - 1.0, max(ends_deg) + 1.0)
    axes.set_yscale("log")
    axes.set_ylim(bottom / unit_mm, top / unit_mm)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: ""))
    axes.grid(True)
    axes.set_xlabel("elevation at the viewpoint $\\varphi$ (deg)")
    axes.set_ylabel(f"sharp distances $D$ ({unit})")
    figure.legend(loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure


def _ticks(low: float, high: float) -> list[int]:
    """Round focus distances within a range of 1/u, apart enough to be read."""
    found: list[int] = []
    for tick in _FOCUS_TICKS:
        is_apart = not found or 1.0 / found[-1] - 1.0 / tick > _TICK_ROOM * (high - low)
        if low <= 1.0 / tick <= high and is_apart:
            found.append(tick)
    return found
