"""The sheets of a design as DXF, drawn in true millimetres of the part, with dimensions that CAD programs measure.

What stands on paper at the sheet's scale is divided by it: printed at that scale the sheet is A4 again. The drawing's
origin is the lower left corner of the frame, y up.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.export.drawing.paper import (
    ARROW_MM,
    BEYOND_MM,
    FINE,
    TEXT_PT,
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
from designer.export.drawing.sheet import Sheet, sheets_of
from designer.export.dxf_document import dxf_document, text_of

WIDTH_MM, HEIGHT_MM = 267.0, 190.0
_TITLE_MM = 154.5
_TEXT_PT, _HEADING_PT = 6.5, 7.0
_LINE_MM = 2.75
_NAMES_MM = 27.0
# Of capital letters, and of an average character, for each point of a font's size.
_CAPITALS_MM, _CHARACTER_MM = 0.25, 0.188
_STYLE = "sheet"
_BALLOON_MM = 2.4
_LINETYPES: dict[Dash, str] = {"solid": "Continuous", "dashed": "DASHED", "chain": "CENTER"}
# The library's patterns are some two units long.
_PATTERN_MM = 4.0
_TRUE_COLOURS: dict[Colour, tuple[int, int, int]] = {
    "grey": (110, 110, 110),
    "light grey": (170, 170, 170),
    "light blue": (130, 170, 190),
    "blue": (0, 114, 178),
    "orange": (213, 94, 0),
}
_LAYERS = ("outlines", "lines", "hatching", "axis", "dimensions", "text", "sheet")


@dataclass(frozen=True, slots=True)
class _Page:
    """A document, and how many mm of the part a mm of paper is."""

    drawing: Any
    size: float

    def at(self, point: Point) -> Point:
        """A place on paper, y down from the frame's upper left corner, in the document."""
        return point[0] * self.size, (HEIGHT_MM - point[1]) * self.size


def dxf_sheets(design: Design, tolerances: NamedTolerances | None = None) -> dict[str, str]:
    """Every sheet as DXF, by the name of its mirror; last the assembly. Without tolerances these are to be agreed.

    Raises
    ------
    InputError
        A mirror cannot be drawn.
    """
    return {name: _document(sheet) for name, sheet in sheets_of(design, tolerances).items()}


def _document(sheet: Sheet) -> str:
    with dxf_document() as drawing:
        page = _Page(drawing, 1.0 / sheet.drawn.scale)
        _set_up(page)
        for mark in sheet.drawn.marks:
            _draw(page, mark)
        _frame(page, sheet.drawn.width_mm)
        left = sheet.drawn.width_mm + 2.0
        _words(page, sheet, left)
        _title_block(page, sheet, left)
        return text_of(drawing)


def _set_up(page: _Page) -> None:
    drawing, size = page.drawing, page.size
    drawing.header["$LTSCALE"] = _PATTERN_MM * size
    drawing.styles.add(_STYLE, font="arial.ttf")
    for layer in _LAYERS:
        drawing.layers.add(layer)
    drawing.dimstyles.new(
        _STYLE,
        dxfattribs={
            "dimtxt": _CAPITALS_MM * TEXT_PT * size,
            "dimasz": ARROW_MM * size,
            "dimexe": BEYOND_MM * size,
            "dimexo": 0.0,
            "dimgap": 0.6 * size,
            "dimtxsty": _STYLE,
            "dimtih": 0,
            "dimtoh": 0,
            "dimtad": 1,
        },
    )


def _draw(page: _Page, mark: Mark) -> None:
    space = page.drawing.modelspace()
    match mark:
        case Line():
            _polyline(page, mark.points, _layer_of(mark), mark)
        case Area() if mark.fill != "white" and mark.width > 0.0:
            _polyline(page, mark.points, "outlines", mark, closed=True)
        case Label():
            _text(page, mark.text, mark.at, mark.anchor, mark.size, upright=mark.upright)
        case Dot():
            space.add_circle(page.at(mark.at), mark.radius * page.size, dxfattribs={"layer": "text"})
        case Balloon():
            space.add_circle(page.at(mark.at), _BALLOON_MM * page.size, dxfattribs={"layer": "text"})
            _text(page, mark.text, mark.at)
        case Dimension():
            _dimension(page, mark)


def _layer_of(line: Line) -> str:
    if line.dash == "chain":
        return "axis"
    return "hatching" if line.width == FINE and line.colour == "black" else "lines"


def _polyline(page: _Page, points: Iterable[Point], layer: str, mark: Line | Area, closed: bool = False) -> None:
    import ezdxf

    attributes: dict[str, Any] = {"layer": layer, "lineweight": _lineweight(mark.width)}
    if mark.colour in _TRUE_COLOURS:
        attributes["true_color"] = ezdxf.rgb2int(_TRUE_COLOURS[mark.colour])
    if isinstance(mark, Line):
        attributes["linetype"] = _LINETYPES[mark.dash]
    page.drawing.modelspace().add_lwpolyline([page.at(point) for point in points], close=closed, dxfattribs=attributes)


def _lineweight(width_mm: float) -> int:
    from ezdxf.lldxf.const import VALID_DXF_LINEWEIGHTS

    return min(VALID_DXF_LINEWEIGHTS, key=lambda weight: abs(weight - 100.0 * width_mm))


def _dimension(page: _Page, mark: Dimension) -> None:
    is_level = mark.direction == "level"
    one, other = ((end, start) if is_level else (start, end) for start, end in zip(mark.starts, mark.ends, strict=True))
    # From left to right, and from below upwards, as the text reads: else the arrows stand outside.
    first, second = (one, other) if is_level else (other, one)
    base = (mark.ends[0], mark.place) if is_level else (mark.place, mark.ends[0])
    drawn = page.drawing.modelspace().add_linear_dim(
        base=page.at(base),
        p1=page.at(first),
        p2=page.at(second),
        angle=0.0 if is_level else 90.0,
        text=_plain(mark.text),
        dimstyle=_STYLE,
        dxfattribs={"layer": "dimensions"},
    )
    length = mark.ends[1] - mark.ends[0]
    if not is_level and length > 2.0 * text_width_mm(mark.text) + 4.0 * ARROW_MM:
        # Off the middle, where the axis runs.
        drawn.shift_text(0.25 * length * page.size, 0.0)
    drawn.render()


def _text(
    page: _Page,
    words: str,
    at: Point,
    anchor: str = "center",
    size: float = TEXT_PT,
    upright: bool = False,
    layer: str = "text",
) -> None:
    from ezdxf.enums import TextEntityAlignment

    aligned = {
        "left": TextEntityAlignment.MIDDLE_LEFT,
        "center": TextEntityAlignment.MIDDLE_CENTER,
        "right": TextEntityAlignment.MIDDLE_RIGHT,
    }[anchor]
    text = page.drawing.modelspace().add_text(
        _plain(words),
        height=_CAPITALS_MM * size * page.size,
        rotation=90.0 if upright else 0.0,
        dxfattribs={"layer": layer, "style": _STYLE},
    )
    text.set_placement(page.at(at), align=aligned)


def _plain(words: str) -> str:
    """Words in one line; a diameter by the sign that fonts of CAD programs have."""
    return " ".join(words.replace("⌀", "Ø").split())


def _frame(page: _Page, split_mm: float) -> None:
    corners = ((0.0, 0.0), (WIDTH_MM, 0.0), (WIDTH_MM, HEIGHT_MM), (0.0, HEIGHT_MM))
    _polyline(page, corners, "sheet", Area(corners), closed=True)
    for line in (((split_mm, 0.0), (split_mm, HEIGHT_MM)), ((split_mm, _TITLE_MM), (WIDTH_MM, _TITLE_MM))):
        _polyline(page, line, "sheet", Line(line, 0.25))


def _words(page: _Page, sheet: Sheet, left: float) -> None:
    """Vertices and groups of fields, from the top down."""
    y = _LINE_MM
    if sheet.vertices:
        for row in (("vertices on the axis", "above lens front", "above lens seat"), *sheet.vertices):
            for words, x in zip(row, (left, left + 50.0, left + 80.0), strict=True):
                _text(page, words, (x, y), "left", _TEXT_PT, layer="sheet")
            y += _LINE_MM
    characters = int((WIDTH_MM - left - _NAMES_MM - 2.0) / (_CHARACTER_MM * _TEXT_PT))
    for heading, rows in sheet.groups:
        y += 0.3 * _LINE_MM
        for line in textwrap.wrap(heading, int((WIDTH_MM - left - 2.0) / (_CHARACTER_MM * _HEADING_PT))):
            _text(page, line, (left, y), "left", _HEADING_PT, layer="sheet")
            y += _LINE_MM
        for name, words in rows:
            _text(page, name, (left, y), "left", _TEXT_PT, layer="sheet")
            for line in textwrap.wrap(words, characters, break_long_words=False, break_on_hyphens=False) or [""]:
                _text(page, line, (left + _NAMES_MM, y), "left", _TEXT_PT, layer="sheet")
                y += _LINE_MM


def _title_block(page: _Page, sheet: Sheet, left: float) -> None:
    title = sheet.title
    rows = (
        ("part", f"{title.part}, sheet {title.number}"),
        ("configuration", title.configuration),
        ("variant", title.variant),
        ("scale", f"1 : 1 in this file; printed at {title.scale}, the sheet is A4"),
        ("dimensions", "mm, angles in degrees; first-angle projection"),
        ("drawn by", title.provenance),
        ("SHA-256", f"{title.digest} (the design's file)"),
    )
    y = _TITLE_MM + 1.2 * _LINE_MM
    for name, words in rows:
        _text(page, name, (left, y), "left", _TEXT_PT, layer="sheet")
        for line in textwrap.wrap(words, int((WIDTH_MM - left - _NAMES_MM - 2.0) / (_CHARACTER_MM * _TEXT_PT))):
            _text(page, line, (left + _NAMES_MM, y), "left", _TEXT_PT, layer="sheet")
            y += _LINE_MM
        y += 0.35 * _LINE_MM
