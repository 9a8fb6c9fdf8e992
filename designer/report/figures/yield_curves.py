"""How many of the sensors built to one set of tolerances stay below which depth error."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from designer.report.figures.style import GREY, SERIES, new_figure
from designer.study.tolerances import SHARES, Forgiveness

# Beyond this many times the least median a curve says only that its sensors are poor.
SPAN = 2.0


def draw_yield_curves(
    designs: tuple[Forgiveness, ...], ranks: dict[str, int], width_mm: float, height_mm: float
) -> Figure:
    """One curve for each design: the share of its sensors with at most that depth error; dots: as designed."""
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    shown = [each for each in designs if each.median is not None]
    for place, each in enumerate(shown):
        colour, line, _ = SERIES[place % len(SERIES)]
        errors = np.array([np.inf if value is None else 100.0 * value for value in each.depth_errors])
        label = f"{ranks.get(each.configuration, '')}  {each.configuration}".strip()
        axes.plot(errors, 100.0 * SHARES, color=colour, linestyle=line, linewidth=1.3, label=label)
        if each.depth_error_as_designed is not None:
            axes.plot(100.0 * each.depth_error_as_designed, 0.0, "o", color=colour, markersize=4.0, clip_on=False)
    for level in (50.0, 95.0):
        axes.axhline(level, color=GREY, linewidth=0.6, linestyle=":")
    least = min(100.0 * (each.depth_error_as_designed or 0.0) for each in shown)
    most = max(min(100.0 * (each.high or np.inf), SPAN * 100.0 * (each.median or 0.0)) for each in shown)
    axes.set_xlim(least - 0.04 * (most - least), most + 0.08 * (most - least))
    axes.set_ylim(0.0, 100.0)
    axes.set_xlabel("depth error, calibrated (%)")
    axes.set_ylabel("share of the sensors (%)")
    axes.legend(loc="lower right", fontsize=6.5, frameon=False)
    return figure
