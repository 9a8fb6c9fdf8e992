"""Figures of a sweep: who wins where, how good the winner is, fronts, and parallel coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
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
from designer.study.sweep.export import pareto

# Colour and a letter say who wins, so that the maps read in grey too; what wins less often is grey.
NAMED_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)
MOST_PANELS = 6
MOST_TICKS = 6
ASKED = "asked."
Paint = Callable[[Axes, float, float, "pd.Series[Any]", tuple[float, float]], None]


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
    return f"{allowed}{name.replace('_', ' ')}{suffix}"


def letters_of(winners: pd.DataFrame) -> dict[str, str]:
    """A letter for each configuration that wins somewhere, the most frequent first."""
    counts = winners["configuration"].value_counts()
    names = sorted(counts.index, key=lambda name: (-counts[name], name))
    return {name: chr(ord("A") + place) if place < 26 else f"{place + 1}" for place, name in enumerate(names)}


def draw_winner_map(winners: pd.DataFrame, axes: Sequence[str], letters: dict[str, str], width_mm: float) -> Figure:
    """Which configuration wins where: a panel for each value of the third axis, letters and colours for the winners."""
    names = list(letters)
    colours = {name: NAMED_COLOURS[place] for place, name in enumerate(names[: len(NAMED_COLOURS)])}

    def paint(panel: Axes, x: float, y: float, row: pd.Series[Any], size: tuple[float, float]) -> None:
        name = row["configuration"]
        colour = colours.get(name, LIGHT_GREY)
        corner = (x - size[0] / 2.0, y - size[1] / 2.0)
        panel.add_patch(Rectangle(corner, *size, facecolor=colour, edgecolor="white", linewidth=0.4))
        ink = INK if colour in {LIGHT_GREY, ORANGE, SKY} else "white"
        panel.text(x, y, letters[name], ha="center", va="center", fontsize=6.5, color=ink)

    return _panels(winners, axes, width_mm, paint)


def draw_heat_map(winners: pd.DataFrame, axes: Sequence[str], value: str, label: str, width_mm: float) -> Figure:
    """The winner's value at every point, in shades of one colour."""
    values = winners[value].astype(float)
    low, high = float(values.min()), float(values.max())
    scale = LogNorm(low, high) if low > 0.0 and high > 5.0 * low else Normalize(low, high)
    shades = ScalarMappable(scale, cmap="cividis")

    def paint(panel: Axes, x: float, y: float, row: pd.Series[Any], size: tuple[float, float]) -> None:
        corner = (x - size[0] / 2.0, y - size[1] / 2.0)
        panel.add_patch(Rectangle(corner, *size, facecolor=shades.to_rgba(row[value]), edgecolor="none"))

    figure = _panels(winners, axes, width_mm, paint)
    bar = figure.colorbar(shades, ax=figure.axes, fraction=0.05, pad=0.02)
    bar.set_label(label)
    return figure


def _panels(winners: pd.DataFrame, axes: Sequence[str], width_mm: float, paint: Paint) -> Figure:
    """One panel for each value of the third axis (a few of them if many), the first two axes across and up."""
    across, up = axes[0], axes[1] if len(axes) > 1 else None
    rest = list(axes[2:])
    groups = [((), winners)] if not rest else list(winners.groupby(rest, sort=True))
    if len(groups) > MOST_PANELS:
        groups = [groups[place] for place in np.linspace(0, len(groups) - 1, MOST_PANELS).round().astype(int)]
    columns = min(len(groups), 3)
    rows = -(-len(groups) // columns)
    figure = new_figure(width_mm, 12.0 + 52.0 * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    x_levels = np.sort(winners[across].unique())
    y_levels = np.sort(winners[up].unique()) if up else np.array([0.0])
    size = (_step(x_levels), _step(y_levels))
    for panel, (where, part) in zip(grid.ravel(), groups, strict=False):
        for _, row in part.iterrows():
            paint(panel, row[across], row[up] if up else 0.0, row, size)
        panel.set_xlim(x_levels[0] - size[0] / 2.0, x_levels[-1] + size[0] / 2.0)
        panel.set_ylim(y_levels[0] - size[1] / 2.0, y_levels[-1] + size[1] / 2.0)
        where = where if isinstance(where, tuple) else (where,)
        panel.set_title(", ".join(f"{short(key)}: {value:g}" for key, value in zip(rest, where, strict=True)))
    grid[0, 0].set_xticks(_ticks(x_levels))
    if up:
        grid[0, 0].set_yticks(_ticks(y_levels))
    for panel in grid.ravel()[len(groups) :]:
        panel.set_visible(False)
    for panel in grid[-1]:
        panel.set_xlabel(short(across))
    for panel in grid[:, 0]:
        if up:
            panel.set_ylabel(short(up))
        else:
            panel.set_yticks([])
    return figure


def _ticks(levels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values to write at an axis: all if they are few."""
    return levels if len(levels) <= MOST_TICKS else levels[:: -(-len(levels) // MOST_TICKS)]


def _step(levels: NDArray[np.float64]) -> float:
    """The width of a cell: the least distance between values that are there."""
    return float(np.diff(levels).min()) if len(levels) > 1 else 1.0


def draw_pareto(table: pd.DataFrame, letters: dict[str, str], width_mm: float) -> Figure:
    """All feasible designs of the sweep, and the front of depth error against height and against diameter."""
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
    """Parallel coordinates of the front in depth error, height and diameter: what was asked, what came of it."""
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
        panel.axvline(place, color=INK, linewidth=0.5)
        panel.text(place, 1.03, f"{high[place]:.4g}", ha="center", va="bottom", fontsize=7)
        panel.text(place, -0.03, f"{low[place]:.4g}", ha="center", va="top", fontsize=7)
    panel.set_xticks(range(len(columns)), [title.replace(" (", "\n(") for title in titles])
    panel.tick_params(axis="x", length=0, pad=10)
    panel.set_yticks([])
    panel.set_ylim(-0.1, 1.1)
    panel.spines[["left", "bottom"]].set_visible(False)
    return figure
