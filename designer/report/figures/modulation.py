"""Modulation of patterns of the matcher's scale against elevation: defocus, diffraction and pixel."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.design import VIEW_NAMES, Design
from designer.evaluate.modulation import FINEST_ROWS, modulation_of_design
from designer.evaluate.noise import MatcherPerformance
from designer.report.figures.style import GREY, INK, VIEW_COLOUR, VIEW_LINE, new_figure


def draw_modulation(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the modulation of a pattern as long as the matching window (thick) and as two rows (thin) over elevation.

    At the nearest or the farthest distance of the working volume, whichever leaves less.
    """
    matching = MatcherPerformance()
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    lowest = 0.0
    modulation = modulation_of_design(design, matching)
    for name in VIEW_NAMES:
        view = modulation[name]
        for pattern, width in ((view.of_window, 1.6), (view.of_rows, 0.6)):
            least = np.min(pattern, axis=1)
            lowest = min(lowest, float(least.min()))
            axes.plot(view.elevations_deg, least, color=VIEW_COLOUR[name], linestyle=VIEW_LINE[name], linewidth=width)
    axes.axhline(0.0, color=INK, linewidth=0.6)
    axes.set_ylim(min(1.1 * lowest, 0.0), 1.0)
    axes.grid(True)
    axes.set_xlabel("elevation at the viewpoint $\\varphi$ (deg)")
    axes.set_ylabel("modulation")
    row_deg = 360.0 / matching.columns
    handles = [
        Line2D([], [], color=VIEW_COLOUR[name], linestyle=VIEW_LINE[name], label=f"{name} view") for name in VIEW_NAMES
    ]
    handles += [
        Line2D([], [], color=INK, linewidth=1.6, label=f"period {matching.window * row_deg:g}° (window)"),
        Line2D([], [], color=GREY, linewidth=0.6, label=f"period {FINEST_ROWS * row_deg:g}° (two rows)"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure
