"""Lines, hatching, text and dimensions on paper, as data: what a sheet shows, whichever file it is written to.

Points are (x, y) in mm on paper, y down, from the upper left corner of the box that holds the drawing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float]
Dash = Literal["solid", "dashed", "chain"]
Colour = Literal["black", "white", "grey", "light grey", "light blue", "blue", "orange"]
Anchor = Literal["center", "left", "right"]
Direction = Literal["level", "upright"]

THICK, THIN, FINE = 0.5, 0.2, 0.13
"""Line widths in mm of visible edges, of everything else, and of hatching and extension lines."""
TEXT_PT = 8.0
ARROW_MM, ARROW_HALF_WIDTH_MM = 2.6, 0.4
BEYOND_MM = 1.5
"""How far extension lines go past the dimension line."""
HATCH_MM = 1.6

SCALES = (20.0, 10.0, 5.0, 2.0, 1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50, 1 / 100)
"""Paper mm for each mm of the part, as ISO 5455 recommends them."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line through points."""

    points: tuple[Point, ...]
    width: float = THIN
    dash: Dash = "solid"
    colour: Colour = "black"


@dataclass(frozen=True, slots=True)
class Area:
    """A closed outline, filled or not."""

    points: tuple[Point, ...]
    width: float = THICK
    fill: Colour | None = None
    colour: Colour = "black"


@dataclass(frozen=True, slots=True)
class Label:
    """Text at a point, on white, vertically centred; ``upright`` reads from below and is centred."""

    text: str
    at: Point
    anchor: Anchor = "center"
    upright: bool = False
    size: float = TEXT_PT


@dataclass(frozen=True, slots=True)
class Dot:
    """A filled dot."""

    at: Point
    radius: float = 0.5


@dataclass(frozen=True, slots=True)
class Balloon:
    """A number in a circle."""

    text: str
    at: Point


@dataclass(frozen=True, slots=True)
class Dimension:
    """A length between two places, ``level`` or ``upright``.

    ``place`` is where the dimension line lies (y of a level one, x of an upright one), ``ends`` the two places that it
    joins, the left or upper one first, ``starts`` where their extension lines begin. Text that does not fit between the
    arrows of a level one stands on the right, or on the left.
    """

    direction: Direction
    place: float
    ends: tuple[float, float]
    starts: tuple[float, float]
    text: str
    right: bool = True


Mark = Line | Area | Label | Dot | Balloon | Dimension


@dataclass(frozen=True, slots=True)
class Drawn:
    """A drawing, its scale (mm on paper for each mm of the part), and the width of its box."""

    marks: tuple[Mark, ...]
    scale: float
    width_mm: float


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


def hatched(points: Sequence[Point], spacing: float = HATCH_MM, rising: bool = True) -> list[Line]:
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
            drawn.append(Line(((start, side * (level - start)), (end, side * (level - end))), FINE))
    return drawn
