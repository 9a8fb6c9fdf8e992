"""How many of the sensors built to one set of tolerances stay below which depth error."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from designer.report.figures.style import GREY, SERIES, new_figure
from designer.study.tolerances import Forgiveness

SPAN = 2.0
"""Designs whose sensors have more than this many times the least median depth error are not shown."""


def draw_yield_curves(
    designs: tuple[Forgiveness, ...], ranks: dict[str, int], width_mm: float, height_mm: float
) -> Figure:
    """One curve for each design: the share of its sensors with at most that depth error; dots: as designed."""
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    least = min(each.median for each in designs if each.median is not None)
    shown = [each for each in designs if each.median is not None and each.median <= SPAN * least]
    for place, each in enumerate(shown):
        colour, line, _ = SERIES[place % len(SERIES)]
        errors = np.array([np.inf if value is None else 100.0 * value for value in each.depth_errors])
        label = f"{ranks.get(each.configuration, '')}  {each.configuration}".strip()
        axes.plot(errors, np.arange(len(errors)), color=colour, linestyle=line, linewidth=1.3, label=label)
        if each.depth_error_as_designed is not None:
            axes.plot(100.0 * each.depth_error_as_designed, 0.0, "o", color=colour, markersize=4.0, clip_on=False)
    for level in (50.0, 95.0):
        axes.axhline(level, color=GREY, linewidth=0.6, linestyle=":")
    first = min(100.0 * (each.depth_error_as_designed or 0.0) for each in shown)
    last = 100.0 * max(min(each.high or np.inf, SPAN * (each.median or 0.0)) for each in shown)
    axes.set_xlim(first - 0.04 * (last - first), last + 0.08 * (last - first))
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel("depth error, calibrated (%)")
    axes.set_ylabel("share of the sensors (%)")
    axes.legend(loc="lower right", fontsize=6.5, frameon=False)
    return figure
