"""Angular resolution of both views against elevation."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.design import Design
from designer.evaluate.resolution import angular_resolution_px_per_deg, azimuthal_resolution_px_per_deg
from designer.report.figures.style import GREY, INK, VIEW_COLOUR, VIEW_LINE, new_figure


def draw_resolution(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw pixels per degree in elevation (thick) and in azimuth (thin) over the elevations asked of each view."""
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for name in ("upper", "lower"):
        low, high = design.views.by_name[name].elevation_deg
        elevation_deg = np.linspace(low, high, 161)
        style: dict[str, Any] = {"color": VIEW_COLOUR[name], "linestyle": VIEW_LINE[name]}
        axes.plot(elevation_deg, angular_resolution_px_per_deg(design, name, elevation_deg), linewidth=1.6, **style)
        axes.plot(elevation_deg, azimuthal_resolution_px_per_deg(design, name, elevation_deg), linewidth=0.6, **style)
    axes.set_ylim(bottom=0.0)
    axes.grid(True)
    axes.set_xlabel("elevation at the viewpoint $\\varphi$ (deg)")
    axes.set_ylabel("resolution (px/deg)")
    figure.legend(handles=_legend(), loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure


def _legend() -> list[Line2D]:
    views = [
        Line2D([], [], color=VIEW_COLOUR[name], linestyle=VIEW_LINE[name], label=f"{name} view")
        for name in ("upper", "lower")
    ]
    kinds = [
        Line2D([], [], color=INK, linewidth=1.6, label="in elevation"),
        Line2D([], [], color=GREY, linewidth=0.6, label="in azimuth"),
    ]
    return [*views, *kinds]
