"""Lines, hatching, text and dimensions on paper, as pieces of Typst that place themselves.

Points are (x, y) in mm on paper, y down, from the upper left corner of the box that holds the drawing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from designer.typesetting.markup import literal

Point = tuple[float, float]

THICK, THIN = 0.5, 0.2
"""Line widths in mm of visible edges, and of everything else."""
SOLID, DASHED = '"solid"', '"dashed"'
CHAIN = "(array: (6pt, 1.5pt, 1.5pt, 1.5pt), phase: 0pt)"
TEXT_PT = 8.0
ARROW_MM, ARROW_HALF_WIDTH_MM = 2.6, 0.4
BEYOND_MM = 1.5
"""How far extension lines go past the dimension line."""
HATCH_MM = 1.6

SCALES = (20.0, 10.0, 5.0, 2.0, 1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50, 1 / 100)
"""Paper mm for each mm of the part, as ISO 5455 recommends them."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A drawing as Typst, its scale (mm on paper for each mm of the part), and the width of its box."""

    source: str
    scale: float
    width_mm: float


Anchor = Literal["center", "left", "right"]


def scale_for(width_mm: float, height_mm: float, room: Point, scales: Sequence[float] = SCALES) -> float:
    """The largest scale at which so much fits into a room on paper; any scale if none is small enough."""
    fitting = min(room[0] / max(width_mm, 1e-9), room[1] / max(height_mm, 1e-9))
    return next((scale for scale in scales if scale <= fitting), fitting)


def scale_words(scale: float) -> str:
    """A scale as drawings write it: 2 : 1 or 1 : 2.5."""
    return f"{scale:.3g} : 1" if scale >= 1.0 else f"1 : {1.0 / scale:.3g}"


def text_width_mm(text: str) -> float:
    """About how wide a label is, a little too much rather than too little."""
    return 0.53 * TEXT_PT * 0.3528 * len(text)


def line(points: Sequence[Point], width: float = THIN, dash: str = SOLID, colour: str = "black") -> str:
    """A line through points."""
    (first, *others) = points
    steps = "".join(f", curve.line({_at(point)})" for point in others)
    stroke = f'(paint: {colour}, thickness: {width}mm, dash: {dash}, cap: "round")'
    return f"#place(top + left, curve(stroke: {stroke}, curve.move({_at(first)}){steps}))\n"


def area(points: Sequence[Point], width: float = THICK, fill: str = "none", colour: str = "black") -> str:
    """A closed outline."""
    corners = ", ".join(map(_at, points))
    return f"#place(top + left, polygon(stroke: {width}mm + {colour}, fill: {fill}, {corners}))\n"


def hatched(points: Sequence[Point], spacing: float = HATCH_MM, rising: bool = True) -> str:
    """Hatching at 45 degrees inside a closed outline, even-odd."""
    side = 1.0 if rising else -1.0
    closed = [*points, points[0]]
    # Along each line x + side y = level; the line's place along it is x.
    levels = [x + side * y for x, y in closed]
    drawn = []
    for number in range(math.ceil(min(levels) / spacing), math.floor(max(levels) / spacing) + 1):
        level = number * spacing
        crossings = []
        for (x0, _), (x1, _), a, b in zip(closed, closed[1:], levels, levels[1:], strict=False):
            if (a <= level) != (b <= level):
                crossings.append(x0 + (level - a) / (b - a) * (x1 - x0))
        crossings.sort()
        for start, end in zip(crossings[::2], crossings[1::2], strict=False):
            drawn.append(line([(start, side * (level - start)), (end, side * (level - end))], 0.13))
    return "".join(drawn)


def label(text: str, at: Point, anchor: Anchor = "center", upright: bool = False, size: float = TEXT_PT) -> str:
    """Text at a point, on white, vertically centred; ``upright`` reads from below and is centred."""
    turned = ", upright: true" if upright else ""
    return f"#label-at({at[0]:.3f}mm, {at[1]:.3f}mm, {literal(text)}, {anchor}{turned}, size: {size}pt)\n"


def dot(at: Point, radius: float = 0.5) -> str:
    """A filled dot."""
    x, y = at
    return (
        f"#place(top + left, dx: {x - radius:.3f}mm, dy: {y - radius:.3f}mm, circle(radius: {radius}mm, fill: black))\n"
    )


def balloon(text: str, at: Point) -> str:
    """A number in a circle."""
    return f"#balloon-at({at[0]:.3f}mm, {at[1]:.3f}mm, {literal(text)})\n"


def upright_dimension(x: float, ends: tuple[float, float], starts: tuple[float, float], text: str) -> str:
    """A dimension between two heights ``ends`` (upper first) at ``x``, extension lines from ``starts`` (x)."""
    high, low = ends
    reach = math.copysign(BEYOND_MM, x - starts[0])
    drawn = [line([(start, end), (x + reach, end)], 0.13) for start, end in zip(starts, ends, strict=True)]
    length, wide = low - high, text_width_mm(text)
    if length > 2.0 * ARROW_MM + 1.0:
        drawn += [line([(x, high), (x, low)]), _arrow((x, high), (0.0, 1.0)), _arrow((x, low), (0.0, -1.0))]
    else:
        drawn += [line([(x, high - 2.0 * ARROW_MM), (x, low + 2.0 * ARROW_MM)])]
        drawn += [_arrow((x, high), (0.0, -1.0)), _arrow((x, low), (0.0, 1.0))]
    if length > 2.0 * wide + 4.0 * ARROW_MM:
        # Off the middle, where the axis runs.
        return "".join([*drawn, label(text, (x, high + 0.25 * length), upright=True)])
    if length > wide + 2.0 * ARROW_MM + 2.0:
        return "".join([*drawn, label(text, (x, (high + low) / 2.0), upright=True)])
    outside = high - 2.0 * ARROW_MM - 1.0
    drawn.append(line([(x, high), (x, outside)]))
    return "".join([*drawn, label(text, (x, outside - wide / 2.0), upright=True)])


def level_dimension(
    y: float, ends: tuple[float, float], starts: tuple[float, float], text: str, right: bool = True
) -> str:
    """A dimension between two places ``ends`` (left first) at height ``y``, extension lines from ``starts`` (y).

    Text that does not fit between the arrows stands on the right, or on the left.
    """
    first, last = ends
    reach = math.copysign(BEYOND_MM, y - starts[0])
    drawn = [line([(end, start), (end, y + reach)], 0.13) for start, end in zip(starts, ends, strict=True)]
    length, wide = last - first, text_width_mm(text)
    if length > wide + 2.0 * ARROW_MM + 2.0:
        drawn += [line([(first, y), (last, y)]), _arrow((first, y), (1.0, 0.0)), _arrow((last, y), (-1.0, 0.0))]
        return "".join([*drawn, label(text, ((first + last) / 2.0, y))])
    inside = length > 2.0 * ARROW_MM + 1.0
    away = 1.0 if inside else 2.0 * ARROW_MM
    drawn.append(line([(first - away, y), (last + away, y)]))
    drawn += [
        _arrow((first, y), (1.0 if inside else -1.0, 0.0)),
        _arrow((last, y), (-1.0 if inside else 1.0, 0.0)),
    ]
    place = (last + away + 0.6, y) if right else (first - away - 0.6, y)
    return "".join([*drawn, label(text, place, "left" if right else "right")])


def _arrow(tip: Point, into: Point) -> str:
    """A filled arrowhead whose body runs from the tip along ``into``."""
    (x, y), (a, b) = tip, into
    foot = (x + a * ARROW_MM, y + b * ARROW_MM)
    corners = [tip, *((foot[0] + s * ARROW_HALF_WIDTH_MM * b, foot[1] + s * ARROW_HALF_WIDTH_MM * a) for s in (1, -1))]
    return area(corners, 0.05, "black")


def _at(point: Point) -> str:
    return f"({point[0]:.3f}mm, {point[1]:.3f}mm)"
