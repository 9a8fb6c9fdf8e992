"""Depth error against size of the 44 and of what else could be built."""

from __future__ import annotations

from collections.abc import Iterable

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from designer.comparators.row import ComparatorRow
from designer.report.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION, new_figure
from designer.study.row import Row

AXES = (("height_mm", "height (mm)"), ("diameter_mm", "diameter (mm)"))
MARKS = ((GREEN, "^"), (PURPLE, "D"), (ORANGE, "v"), (SKY, "P"), (INK, "X"))
FAMILIES = (("folded", VERMILLION, "s", 3.5), ("direct", BLUE, "o", 5.5))


def draw_comparators(
    rows: Iterable[Row],
    comparators: Iterable[ComparatorRow],
    envelope: dict[str, float],
    width_mm: float,
    height_mm: float,
) -> Figure:
    """Draw feasible rows and comparators with numbers, against height and against diameter.

    Filled marks keep to the envelope (mm by column), open ones of a comparator do not.
    """
    figure = new_figure(width_mm, height_mm)
    panels = figure.subplots(1, 2, sharey=True)
    designs, others = list(rows), list(comparators)
    for axes, (column, label) in zip(panels, AXES, strict=True):
        _draw_panel(axes, designs, others, column)
        axes.axvline(envelope[column], color=INK, linewidth=1.0, linestyle=(0, (5, 3)), label="envelope", zorder=2)
        axes.set_xlabel(label)
        axes.set_yscale("log")
        axes.grid(True)
        axes.margins(x=0.08, y=0.12)
    panels[0].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panels[0].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panels[0].yaxis.set_minor_formatter(NullFormatter())
    panels[0].set_ylabel("rms depth error $\\sigma_D/D$ (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, columnspacing=1.5)
    return figure


def _draw_panel(axes: Axes, designs: list[Row], others: list[ComparatorRow], column: str) -> None:
    for family, colour, marker, size in FAMILIES:
        points = [
            (extent, 100.0 * error)
            for row in designs
            if row.family == family
            and (extent := row.number(column)) is not None
            and (error := row.number("depth_error_rms")) is not None
        ]
        if points:
            axes.plot(
                *zip(*points, strict=True),
                linestyle="none",
                marker=marker,
                markerfacecolor="none" if family == "direct" else colour + "90",
                markeredgecolor=colour,
                markersize=size,
                label=f"{family} ({len(points)})",
                zorder=3,
            )
    for row, (colour, marker) in zip(others, MARKS, strict=False):
        extent, error = getattr(row, column), row.depth_error_rms
        if extent is None or error is None:
            continue
        axes.plot(
            [extent],
            [100.0 * error],
            linestyle="none",
            marker=marker,
            markerfacecolor=colour if row.status == "feasible" else "white",
            markeredgecolor=INK if row.status == "feasible" else colour,
            markeredgewidth=0.6 if row.status == "feasible" else 1.4,
            markersize=7.0,
            label=row.title if row.status == "feasible" else f"{row.title} (too large)",
            zorder=4,
        )
