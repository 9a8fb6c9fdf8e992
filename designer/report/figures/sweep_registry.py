"""The figures of a sweep's report: one entry each, with its file's name, its section, its caption and what draws it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from designer.report.figures.style import report_style, svg_bytes
from designer.report.figures.sweep import (
    NAMED_COLOURS,
    draw_heat_map,
    draw_parallel,
    draw_pareto,
    draw_winner_map,
    letters_of,
)
from designer.study.sweep.tables import axis_columns, pareto

WIDTH_MM = 168.0
WHO_WINS, HOW_GOOD, PARETO = "who wins where", "how good the winner is", "Pareto fronts over the whole sweep"
PARETO_COLUMNS = ("depth_error_rms", "height_mm", "diameter_mm")


@dataclass(frozen=True, slots=True)
class SweepTables:
    """What a sweep's figures are drawn from: all rows, the winners, and the designs that no other beats."""

    table: pd.DataFrame
    best: pd.DataFrame
    pareto: pd.DataFrame

    @property
    def axes(self) -> list[str]:
        """The axes that vary, or all if none does."""
        axes = axis_columns(self.table)
        return [axis for axis in axes if self.table[axis].nunique() > 1] or axes


@dataclass(frozen=True, slots=True)
class SweepFigure:
    """A figure of a sweep's report; the caption is plain text."""

    name: str
    place: str
    draw: Callable[[SweepTables], Figure]
    caption: Callable[[SweepTables], str]

    @property
    def file(self) -> str:
        """Name of the figure's file."""
        return f"{self.name}.svg"


def tables_of(table: pd.DataFrame, best: pd.DataFrame) -> SweepTables:
    """The tables of a sweep, given all its rows and the best of each point."""
    return SweepTables(table, best, pareto(table[table["status"] == "feasible"], PARETO_COLUMNS))


def draw_sweep(tables: SweepTables) -> dict[str, bytes]:
    """Every figure as SVG by the name of its file."""
    with report_style():
        return {figure.file: svg_bytes(figure.draw(tables)) for figure in SWEEP_FIGURES}


def _heat_map(column: str, label: str, factor: float = 1.0) -> Callable[[SweepTables], Figure]:
    def draw(tables: SweepTables) -> Figure:
        shown = tables.best.assign(shown=factor * tables.best[column])
        return draw_heat_map(shown, tables.table[tables.axes], "shown", label, WIDTH_MM)

    return draw


def _winner_map(tables: SweepTables) -> Figure:
    return draw_winner_map(tables.best, tables.table[tables.axes], letters_of(tables.best), WIDTH_MM)


def _pareto(tables: SweepTables) -> Figure:
    feasible = tables.table[tables.table["status"] == "feasible"]
    return draw_pareto(feasible, letters_of(tables.best), WIDTH_MM)


def _parallel(tables: SweepTables) -> Figure:
    return draw_parallel(tables.pareto, tables.axes, letters_of(tables.best), WIDTH_MM)


def _always(caption: str) -> Callable[[SweepTables], str]:
    return lambda tables: caption


SWEEP_FIGURES = (
    SweepFigure(
        "winners",
        WHO_WINS,
        _winner_map,
        _always(
            "Best configuration of each requirement. Letters as in the table; the "
            f"{len(NAMED_COLOURS)} that win most often are coloured, the rest grey. An empty cell or a cross: no "
            f"feasible design."
        ),
    ),
    SweepFigure(
        "depth-error",
        HOW_GOOD,
        _heat_map("depth_error_rms", "depth error of the winner (%)", 100.0),
        _always("Depth error of the best design: root mean square over the working volume."),
    ),
    SweepFigure(
        "limit-ratio",
        HOW_GOOD,
        _heat_map("limit_ratio", "depth error / limit"),
        _always("Ratio of this depth error to the closed-form limit at the same baseline and lens."),
    ),
    SweepFigure(
        "height", HOW_GOOD, _heat_map("height_mm", "height of the winner (mm)"), _always("Height of the best design.")
    ),
    SweepFigure(
        "pareto",
        PARETO,
        _pareto,
        _always(
            "Every feasible design of the sweep (grey) and the front of depth error against height and diameter, "
            "with the letter of its configuration where it wins somewhere."
        ),
    ),
    SweepFigure(
        "parallel",
        PARETO,
        _parallel,
        lambda tables: (
            f"The {len(tables.pareto)} Pareto-optimal designs in depth error, height and diameter: requirement and "
            f"result. Colours as in the map."
        ),
    ),
)
"""The figures in the order of the report."""
