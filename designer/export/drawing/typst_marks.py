"""Marks on paper as pieces of Typst that place themselves."""

from __future__ import annotations

import math
from collections.abc import Iterable

from designer.export.drawing.paper import (
    ARROW_HALF_WIDTH_MM,
    ARROW_MM,
    BEYOND_MM,
    FINE,
    Area,
    Balloon,
    Colour,
    Dash,
    Dimension,
    Dot,
    Label,
    Line,
    Mark,
    Point,
    text_width_mm,
)
from designer.typesetting.markup import literal

_DASHES: dict[Dash, str] = {
    "solid": '"solid"',
    "dashed": '"dashed"',
    "chain": "(array: (6pt, 1.5pt, 1.5pt, 1.5pt), phase: 0pt)",
}
_COLOURS: dict[Colour, str] = {
    "black": "black",
    "white": "white",
    "grey": "luma(110)",
    "light grey": 'rgb("#f2f2f2")',
    "light blue": 'rgb("#e3eff5")',
    "blue": 'rgb("#0072B2")',
    "orange": 'rgb("#D55E00")',
}


def typst_of(marks: Iterable[Mark]) -> str:
    """The marks in their order, later ones over earlier ones."""
    return "".join(map(_typst, marks))


def _typst(mark: Mark) -> str:
    match mark:
        case Line():
            return _line(mark)
        case Area():
            return _area(mark)
        case Label():
            turned = ", upright: true" if mark.upright else ""
            at = f"{mark.at[0]:.3f}mm, {mark.at[1]:.3f}mm"
            return f"#label-at({at}, {literal(mark.text)}, {mark.anchor}{turned}, size: {mark.size}pt)\n"
        case Dot():
            x, y = (place - mark.radius for place in mark.at)
            return f"#place(top + left, dx: {x:.3f}mm, dy: {y:.3f}mm, circle(radius: {mark.radius}mm, fill: black))\n"
        case Balloon():
            return f"#balloon-at({mark.at[0]:.3f}mm, {mark.at[1]:.3f}mm, {literal(mark.text)})\n"
        case Dimension():
            return typst_of(_upright(mark) if mark.direction == "upright" else _level(mark))


def _line(mark: Line) -> str:
    (first, *others) = mark.points
    steps = "".join(f", curve.line({_at(point)})" for point in others)
    paint, dash = _COLOURS[mark.colour], _DASHES[mark.dash]
    stroke = f'(paint: {paint}, thickness: {mark.width}mm, dash: {dash}, cap: "round")'
    return f"#place(top + left, curve(stroke: {stroke}, curve.move({_at(first)}){steps}))\n"


def _area(mark: Area) -> str:
    corners = ", ".join(map(_at, mark.points))
    fill = "none" if mark.fill is None else _COLOURS[mark.fill]
    stroke = f"{mark.width}mm + {_COLOURS[mark.colour]}"
    return f"#place(top + left, polygon(stroke: {stroke}, fill: {fill}, {corners}))\n"


def _upright(dimension: Dimension) -> list[Mark]:
    x, (high, low), starts, text = dimension.place, dimension.ends, dimension.starts, dimension.text
    reach = math.copysign(BEYOND_MM, x - starts[0])
    drawn: list[Mark] = [
        Line(((start, end), (x + reach, end)), FINE) for start, end in zip(starts, dimension.ends, strict=True)
    ]
    length, wide = low - high, text_width_mm(text)
    if length > 2.0 * ARROW_MM + 1.0:
        drawn += [Line(((x, high), (x, low))), _arrow((x, high), (0.0, 1.0)), _arrow((x, low), (0.0, -1.0))]
    else:
        drawn += [Line(((x, high - 2.0 * ARROW_MM), (x, low + 2.0 * ARROW_MM)))]
        drawn += [_arrow((x, high), (0.0, -1.0)), _arrow((x, low), (0.0, 1.0))]
    if length > 2.0 * wide + 4.0 * ARROW_MM:
        # Off the middle, where the axis runs.
        return [*drawn, Label(text, (x, high + 0.25 * length), upright=True)]
    if length > wide + 2.0 * ARROW_MM + 2.0:
        return [*drawn, Label(text, (x, (high + low) / 2.0), upright=True)]
    outside = high - 2.0 * ARROW_MM - 1.0
    return [*drawn, Line(((x, high), (x, outside))), Label(text, (x, outside - wide / 2.0), upright=True)]


def _level(dimension: Dimension) -> list[Mark]:
    y, (first, last), starts, text = dimension.place, dimension.ends, dimension.starts, dimension.text
    reach = math.copysign(BEYOND_MM, y - starts[0])
    drawn: list[Mark] = [
        Line(((end, start), (end, y + reach)), FINE) for start, end in zip(starts, dimension.ends, strict=True)
    ]
    length, wide = last - first, text_width_mm(text)
    if length > wide + 2.0 * ARROW_MM + 2.0:
        drawn += [Line(((first, y), (last, y))), _arrow((first, y), (1.0, 0.0)), _arrow((last, y), (-1.0, 0.0))]
        return [*drawn, Label(text, ((first + last) / 2.0, y))]
    inside = length > 2.0 * ARROW_MM + 1.0
    away = 1.0 if inside else 2.0 * ARROW_MM
    drawn += [
        Line(((first - away, y), (last + away, y))),
        _arrow((first, y), (1.0 if inside else -1.0, 0.0)),
        _arrow((last, y), (-1.0 if inside else 1.0, 0.0)),
    ]
    place = (last + away + 0.6, y) if dimension.right else (first - away - 0.6, y)
    return [*drawn, Label(text, place, "left" if dimension.right else "right")]


def _arrow(tip: Point, into: Point) -> Area:
    """A filled arrowhead whose body runs from the tip along ``into``."""
    (x, y), (a, b) = tip, into
    foot = (x + a * ARROW_MM, y + b * ARROW_MM)
    sides = ((foot[0] + s * ARROW_HALF_WIDTH_MM * b, foot[1] + s * ARROW_HALF_WIDTH_MM * a) for s in (1, -1))
    return Area((tip, *sides), 0.05, "black")


def _at(point: Point) -> str:
    return f"({point[0]:.3f}mm, {point[1]:.3f}mm)"
