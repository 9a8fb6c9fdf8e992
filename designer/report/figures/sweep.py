"""Figures of a sweep: who wins where, how good the winner is, fronts, and parallel coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, ScalarFormatter
from numpy.typing import NDArray

from designer.report.figures.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LIGHT_GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    new_figure,
)
from designer.study.sweep.tables import ASKED, pareto

# Colour and a letter say who wins, so that the maps read in grey too; what wins less often is grey.
NAMED_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)
MOST_PANELS = 6
MOST_TICKS = 6


def short(key: str) -> str:
    """A key as an axis title: its last words and its unit."""
    words = key.removeprefix(ASKED).split(".")
    last = words[-2] + (" (high)" if words[-1] == "1" else " (low)") if words[-1].isdecimal() else words[-1]
    # A design has a height of its own beside the one the envelope allows.
    allowed = "allowed " if words[0] == "envelope" else ""
    name, _, side = last.partition(" ")
    stem, _, unit = name.rpartition("_")
    suffix = f" {side}" if side else ""
    if unit in {"mm", "px", "deg"}:
        return f"{allowed}{stem.replace('_', ' ')}{suffix} ({unit})"
    return f"{allowed}{name.replace('f_number', 'f-number').replace('_', ' ')}{suffix}"


def letters_of(winners: pd.DataFrame) -> dict[str, str]:
    """A letter for each configuration that wins somewhere, the most frequent first."""
    counts = winners["configuration"].value_counts()
    names = sorted(counts.index, key=lambda name: (-counts[name], name))
    return {name: chr(ord("A") + place) if place < 26 else f"{place + 1}" for place, name in enumerate(names)}


def draw_winner_map(winners: pd.DataFrame, asked: pd.DataFrame, letters: dict[str, str], width_mm: float) -> Figure:
    """Which configuration wins where, by letters and colours.

    Parameters
    ----------
    winners
        The best design of each point that has one.
    asked
        A column for each axis to draw, a row for each point of the sweep, feasible or not (repetitions do no harm).
    """
    known = dict(zip(letters, NAMED_COLOURS, strict=False))
    names = [str(name) for name in winners["configuration"]]
    return _map(winners, asked, width_mm, [known.get(name, LIGHT_GREY) for name in names], [letters[n] for n in names])


def draw_heat_map(winners: pd.DataFrame, asked: pd.DataFrame, value: str, label: str, width_mm: float) -> Figure:
    """The winner's value at every point, in shades of one colour; parameters as :func:`draw_winner_map`."""
    values = winners[value].to_numpy(dtype=float)
    low, high = float(values.min()), float(values.max())
    scale = LogNorm(low, high) if low > 0.0 and high > 5.0 * low else Normalize(low, high)
    shades = ScalarMappable(scale, cmap="cividis")
    colours = [to_hex((red, green, blue)) for red, green, blue, _ in shades.to_rgba(values)]
    figure = _map(winners, asked, width_mm, colours, [""] * len(values))
    bar = figure.colorbar(shades, ax=figure.axes, fraction=0.05, pad=0.02)
    bar.set_label(label)
    if isinstance(scale, LogNorm):
        for format_with in (bar.ax.yaxis.set_major_formatter, bar.ax.yaxis.set_minor_formatter):
            format_with(FuncFormatter(lambda value, _: f"{value:.3g}"))
    return figure


def _map(winners: pd.DataFrame, asked: pd.DataFrame, width_mm: float, colours: list[str], letters: list[str]) -> Figure:
    """Cells where the sweep is a grid, else dots over every pair of axes."""
    marked = winners.assign(colour=colours, letter=letters)
    points = asked.drop_duplicates()
    is_grid = len(points) == np.prod([points[axis].nunique() for axis in points])
    return (_cells if is_grid else _dots)(marked, points, width_mm)


def _cells(marked: pd.DataFrame, points: pd.DataFrame, width_mm: float) -> Figure:
    """The first two axes across and up, a panel for each value of the others (a few of them if many)."""
    across, up, *rest = [*points, None, None][: max(2, points.shape[1])]
    groups = list(points.groupby(rest, sort=True)) if rest else [((), points)]
    if len(groups) > MOST_PANELS:
        groups = [groups[place] for place in np.linspace(0, len(groups) - 1, MOST_PANELS).round().astype(int)]
    columns = min(len(groups), 3)
    rows = -(-len(groups) // columns)
    figure = new_figure(width_mm, (12.0 + 52.0 * rows) if up else 46.0)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    x_levels = np.sort(points[across].unique())
    y_levels = np.sort(points[up].unique()) if up else np.array([0.0])
    x_edges, y_edges = _edges(x_levels), _edges(y_levels)
    for panel, (where, part) in zip(grid.ravel(), groups, strict=False):
        for _, row in part.merge(marked, on=list(points)).iterrows():
            column = int(np.searchsorted(x_levels, row[across]))
            line = int(np.searchsorted(y_levels, row[up])) if up else 0
            (left, right), (low, high) = x_edges[column : column + 2], y_edges[line : line + 2]
            panel.add_patch(
                Rectangle((left, low), right - left, high - low, facecolor=row["colour"], edgecolor="white", lw=0.3)
            )
            _letter(panel, (left + right) / 2.0, (low + high) / 2.0, row)
        panel.set_xlim(x_edges[0], x_edges[-1])
        panel.set_ylim(y_edges[0], y_edges[-1])
        values = where if isinstance(where, tuple) else (where,)
        panel.set_title(", ".join(f"{short(key)}: {value:g}" for key, value in zip(rest, values, strict=True)))
    grid[0, 0].set_xticks(_ticks(x_levels))
    grid[0, 0].set_yticks(_ticks(y_levels) if up else [])
    for panel in grid.ravel()[len(groups) :]:
        panel.set_visible(False)
    for panel in grid[-1]:
        panel.set_xlabel(short(across))
    for panel in grid[:, 0]:
        panel.set_ylabel(short(up) if up else "")
    return figure


def _dots(marked: pd.DataFrame, points: pd.DataFrame, width_mm: float) -> Figure:
    """Every pair of axes (the first few), all points in each panel; a cross where nothing is feasible."""
    axes = [str(axis) for axis in points]
    pairs: list[tuple[str, str | None]] = [*combinations(axes, 2), (axes[0], None)]
    # An axis alone is drawn alone.
    pairs = pairs[: max(1, min(len(pairs) - 1, MOST_PANELS))]
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    figure = new_figure(width_mm, 8.0 + 54.0 * rows)
    grid = figure.subplots(rows, columns, squeeze=False)
    missing = points.merge(marked, on=list(points), how="left")
    missing = missing[missing["configuration"].isna()]
    for panel, (across, up) in zip(grid.ravel(), pairs, strict=False):
        height = marked[up] if up else np.zeros(len(marked))
        panel.scatter(marked[across], height, c=marked["colour"].tolist(), s=46, linewidths=0.3, edgecolors="white")
        panel.scatter(missing[across], missing[up] if up else 0.0 * missing[across], marker="x", s=14, color=GREY)
        for (_, row), y in zip(marked.iterrows(), height, strict=True):
            _letter(panel, row[across], y, row)
        panel.set_xlabel(short(across))
        panel.set_ylabel(short(up) if up else "")
        if not up:
            panel.set_yticks([])
    for panel in grid.ravel()[len(pairs) :]:
        panel.set_visible(False)
    return figure


def _letter(panel: Axes, x: float, y: float, row: pd.Series[Any]) -> None:
    ink = INK if row["colour"] in {LIGHT_GREY, ORANGE, SKY} else "white"
    panel.text(x, y, row["letter"], ha="center", va="center", fontsize=6.5, color=ink)


def _ticks(levels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values to write at an axis: all if they are few."""
    return levels if len(levels) <= MOST_TICKS else levels[:: -(-len(levels) // MOST_TICKS)]


def _edges(levels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges of the cells around rising levels, halfway between neighbours, so that no cell is missing between two."""
    if len(levels) == 1:
        return np.array([levels[0] - 0.5, levels[0] + 0.5])
    middles = (levels[1:] + levels[:-1]) / 2.0
    return np.concatenate([[2.0 * levels[0] - middles[0]], middles, [2.0 * levels[-1] - middles[-1]]])


def draw_pareto(table: pd.DataFrame, letters: dict[str, str], width_mm: float) -> Figure:
    """All feasible designs of the sweep, and the Pareto front of depth error against height and against diameter."""
    figure = new_figure(width_mm, 72.0)
    panels = figure.subplots(1, 2, sharey=True)
    colours = dict(zip(letters, NAMED_COLOURS, strict=False))
    for panel, size in zip(panels, ("height_mm", "diameter_mm"), strict=True):
        panel.scatter(
            table[size], 100.0 * table["depth_error_rms"], s=3, color=LIGHT_GREY, linewidths=0, rasterized=True
        )
        front = pareto(table, (size, "depth_error_rms"))
        panel.step(front[size], 100.0 * front["depth_error_rms"], where="post", color=GREY, linewidth=0.8)
        for name, part in front.groupby("configuration"):
            panel.scatter(
                part[size],
                100.0 * part["depth_error_rms"],
                s=14,
                color=colours.get(str(name), INK),
                marker=f"${letters[str(name)]}$" if name in letters else "x",
                zorder=3,
                linewidths=0.3,
            )
        panel.set_xlabel(short(size))
        panel.set_yscale("log")
        panel.yaxis.set_major_formatter(ScalarFormatter())
        panel.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    panels[0].set_ylabel("depth error (% RMS)")
    return figure


def draw_parallel(front: pd.DataFrame, axes: Sequence[str], letters: dict[str, str], width_mm: float) -> Figure:
    """Parallel coordinates of the Pareto front in depth error, height and diameter: what was asked, what came of it."""
    columns = [*axes, "depth_error_rms", "height_mm", "diameter_mm"]
    titles = [*(short(axis) for axis in axes), "depth error (%)", "height (mm)", "diameter (mm)"]
    values = front[columns].to_numpy(dtype=float) * np.array(
        [100.0 if c == "depth_error_rms" else 1.0 for c in columns]
    )
    low, high = values.min(axis=0), values.max(axis=0)
    shares = (values - low) / np.where(high > low, high - low, 1.0)
    colours = dict(zip(letters, NAMED_COLOURS, strict=False))
    figure = new_figure(width_mm, 68.0)
    panel = figure.subplots()
    for line, name in zip(shares, front["configuration"], strict=True):
        panel.plot(range(len(columns)), line, color=colours.get(name, LIGHT_GREY), linewidth=0.6, alpha=0.7)
    for place in range(len(columns)):
        panel.vlines(place, 0.0, 1.0, color=INK, linewidth=0.5)
        panel.text(place, 1.03, f"{high[place]:.4g}", ha="center", va="bottom", fontsize=7)
        panel.text(place, -0.03, f"{low[place]:.4g}", ha="center", va="top", fontsize=7)
    panel.set_xticks(range(len(columns)), [title.replace(" (", "\n(") for title in titles])
    panel.tick_params(axis="x", length=0, pad=10)
    panel.set_yticks([])
    panel.set_ylim(-0.1, 1.1)
    panel.spines[["left", "bottom"]].set_visible(False)
    return figure
