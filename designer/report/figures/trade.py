"""Depth error against size: every feasible design by its rank, and the Pareto fronts of the best ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from designer.report.figures.style import BLUE, GREY, HALO, INK, SERIES, VERMILLION, new_figure
from designer.study.columns import COLUMNS
from designer.study.row import Row
from designer.study.study import ParetoRow
from designer.typesetting.markup import DASH

CLUSTER_DISTANCE_MM = 2.6
"""Points closer than this on paper are one near-tie and share a label."""

PARETO_SPAN = 2.0
"""Pareto fronts are shown up to this many times their least error; what lies beyond says only that the end is near."""

LONGEST_LABEL = 9
"""A near-tie whose ranks take more characters gets a letter, explained in the key."""


@dataclass(frozen=True, slots=True)
class TradePlot:
    """A finished plot and the key of its letters: the ranks behind each."""

    figure: Figure
    key: dict[str, str]


def draw_trade(rows: Iterable[Row], swept: str, limit_mm: float | None, width_mm: float, height_mm: float) -> TradePlot:
    """Draw depth error against a column of the results, each design labelled by its rank."""
    points = [
        (size, 100.0 * error, row)
        for row in rows
        if (size := row.number(swept)) is not None and (error := row.number("depth_error_rms")) is not None
    ]
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for family, colour, marker, size_pt in (("folded", VERMILLION, "s", 4.0), ("direct", BLUE, "o", 6.5)):
        chosen = [point for point in points if point[2].family == family]
        if chosen:
            axes.plot(
                [size for size, _, _ in chosen],
                [error for _, error, _ in chosen],
                linestyle="none",
                marker=marker,
                # Open rings about filled squares: both stay visible where designs of the two families coincide.
                markerfacecolor="none" if family == "direct" else colour + "90",
                markeredgecolor=colour,
                markersize=size_pt,
                label=f"{family} ({len(chosen)})",
                zorder=3,
            )
    _finish(axes, swept, limit_mm, [error for _, error, _ in points])
    if points:
        least, most = min(size for size, _, _ in points), max(size for size, _, _ in points)
        if most - least < 0.04 * most:
            # Values held at one bound differ by solver noise only.
            axes.set_xlim(0.9 * least, 1.1 * most)
    figure.legend(loc="outside upper center", ncols=3)
    key = _label_ranks(figure, axes, points, limit_mm)
    return TradePlot(figure, key)


def draw_pareto_fronts(
    pareto: Iterable[ParetoRow],
    ranks: dict[str, int],
    swept: str,
    limit_mm: float | None,
    width_mm: float,
    height_mm: float,
) -> Figure:
    """Draw the least depth error against the height or diameter allowed, a line for each of the best designs."""
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    errors: list[float] = []
    points = [point for point in pareto if point.swept == swept]
    names = sorted({point.configuration for point in points}, key=lambda name: ranks.get(name, len(ranks) + 1))
    for name, (colour, style, marker) in zip(names, SERIES, strict=False):
        line = sorted((p for p in points if p.configuration == name), key=lambda p: p.limit_mm)
        reached = [(p.limit_mm, 100.0 * p.depth_error_rms) for p in line if p.depth_error_rms is not None]
        if not reached:
            continue
        limits, line_errors = zip(*reached, strict=True)
        errors.extend(line_errors)
        label = f"{ranks.get(name, DASH)}  {name}"
        axes.plot(limits, line_errors, color=colour, linestyle=style, marker=marker, label=label)
    _finish(axes, swept, limit_mm, [error for error in errors if error <= PARETO_SPAN * min(errors)])
    axes.set_xlabel(f"allowed {_axis_title(swept)}")
    if errors:
        figure.legend(loc="outside upper center", ncols=2, columnspacing=1.5)
    return figure


def _axis_title(column: str) -> str:
    return f"{COLUMNS[column].label} ({COLUMNS[column].unit})"


def _finish(axes: Axes, swept: str, limit_mm: float | None, errors: list[float]) -> None:
    if errors:
        low, high = min(errors), max(errors)
        # Near-ties differ by solver noise: never zoom in until that looks like a trade.
        room = max(0.12 * (high - low), 0.02 * high)
        axes.set_ylim(low - room, high + room)
    axes.margins(x=0.08)
    axes.grid(True)
    axes.set_xlabel(_axis_title(swept))
    axes.set_ylabel("rms depth error $\\sigma_D/D$ (%)")
    left, right = axes.get_xlim()
    if limit_mm is not None and errors and limit_mm < right + 0.6 * (right - left):
        axes.set_xlim(left, max(right, limit_mm + 0.03 * (right - left)))
        axes.axvline(limit_mm, color=INK, linewidth=1.0, linestyle=(0, (5, 3)), label="envelope", zorder=2)


def _label_ranks(
    figure: Figure, axes: Axes, points: list[tuple[float, float, Row]], limit_mm: float | None
) -> dict[str, str]:
    """Write ranks beside the points, near-ties together, without overlaps; returns the key of the letters used.

    Labels stay off the line of the envelope, on which many designs lie.
    """
    if not points:
        return {}
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = axes.transData.transform([(size, error) for size, error, _ in points])
    pixels_per_mm = figure.dpi / 25.4
    clusters = _clusters(pixels, CLUSTER_DISTANCE_MM * pixels_per_mm)
    envelope = axes.transData.transform((limit_mm, 0.0))[0] if limit_mm is not None else -np.inf
    plot = _Plot(axes, canvas, pixels, pixels_per_mm, envelope)
    key: dict[str, str] = {}
    placed: list[Text] = []
    for cluster in sorted(clusters, key=lambda members: -len(members)):
        ranks = compress_ranks([points[index][2].rank or 0 for index in cluster])
        text = ranks
        if len(ranks) > LONGEST_LABEL:
            text = chr(ord("A") + len(key))
            key[text] = ranks
        centre = pixels[cluster].mean(axis=0)
        placed.append(_place(plot, text, centre, placed))
    # The constrained layout is fixed by now; drawing again must not move what was placed.
    figure.set_layout_engine("none")
    return key


def compress_ranks(ranks: list[int]) -> str:
    """Ranks as a short list, such as 1–3, 7."""
    runs: list[list[int]] = []
    for rank in sorted(ranks):
        if runs and rank == runs[-1][-1] + 1:
            runs[-1].append(rank)
        else:
            runs.append([rank])
    return ", ".join(
        str(run[0]) if len(run) == 1 else f"{run[0]}, {run[1]}" if len(run) == 2 else f"{run[0]}–{run[-1]}"
        for run in runs
    )


def _clusters(pixels: np.ndarray, distance: float) -> list[list[int]]:
    """Groups of points linked by steps no longer than ``distance`` (single linkage)."""
    remaining = list(range(len(pixels)))
    groups = []
    while remaining:
        group = [remaining.pop(0)]
        for index in group:
            near = [other for other in remaining if np.hypot(*(pixels[index] - pixels[other])) < distance]
            group.extend(near)
            remaining = [other for other in remaining if other not in near]
        groups.append(group)
    return groups


@dataclass(frozen=True, slots=True)
class _Plot:
    """What labels keep clear of: points (n, 2) and the envelope's line, in pixels."""

    axes: Axes
    canvas: Any
    pixels: np.ndarray
    pixels_per_mm: float
    envelope: float


def _place(plot: _Plot, text: str, centre: np.ndarray, placed: list[Text]) -> Text:
    """Write a label at the first free place on growing circles about a point, with a leader line if far."""
    axes, renderer = plot.axes, plot.canvas.get_renderer()
    frame = axes.get_window_extent(renderer)
    boxes = [other.get_window_extent(renderer).padded(1.0) for other in placed]
    to_data = axes.transData.inverted()
    x, y = to_data.transform(centre)
    label = axes.text(x, y, text, fontsize=8.0, color=INK, ha="center", va="center", zorder=5, clip_on=False)
    label.set_path_effects(HALO)
    for radius in (3.0, 4.0, 5.5, 7.0, 9.0, 11.0, 14.0):
        for angle in np.radians([45, 135, -45, -135, 90, -90, 0, 180, 20, 160, -20, -160]):
            step = radius * plot.pixels_per_mm * np.array([np.cos(angle), np.sin(angle)])
            label.set_position(tuple(to_data.transform(centre + step)))
            box = label.get_window_extent(renderer).padded(1.5)
            inside = frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
            on_point = any(box.padded(2.0).contains(*point) for point in plot.pixels)
            on_line = box.x0 < plot.envelope < box.x1
            if inside and not on_point and not on_line and not any(box.overlaps(other) for other in boxes):
                _leader(axes, centre, centre + step, radius)
                return label
    return label


def _leader(axes: Axes, centre: np.ndarray, place: np.ndarray, radius: float) -> None:
    if radius <= 4.0:
        return
    to_data = axes.transData.inverted()
    ends = to_data.transform(np.array([centre, centre + 0.7 * (place - centre)]))
    axes.add_line(Line2D(ends[:, 0], ends[:, 1], color=GREY, linewidth=0.5, zorder=2))
