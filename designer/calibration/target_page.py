"""The target as a PDF page at true scale: squares and markers as shapes, and what to do with the print."""

from __future__ import annotations

from itertools import groupby

from designer.calibration.target import MARKER_MODULES, MODULES, Target, modules_of
from designer.typesetting.markup import literal, plain_number
from designer.typesetting.pdf import compile_pdf

MARGIN_MM = 12.0
CAPTION_MM = 10.0
POINTS_OF_CAPTION = 8
RULER_MM = 100.0


def target_pdf(target: Target) -> bytes:
    """PDF bytes of a page that holds the board, with a white margin, a caption and a ruler of 100 mm."""
    width, height = target.size_mm
    page = (width + 2.0 * MARGIN_MM, height + 2.0 * MARGIN_MM + CAPTION_MM)
    caption = (
        f"{target.columns} x {target.rows} squares of {plain_number(target.square_mm)} mm, ChArUco 4 x 4. Print at "
        "100 %, measure the ruler and the board, glue it to a flat plate."
    )
    ruler = min(RULER_MM, width)
    source = [
        f"#set page(width: {page[0]}mm, height: {page[1]}mm, margin: 0mm)",
        f"#set text(size: {POINTS_OF_CAPTION}pt)",
        *(_rectangle(*shape) for shape in _shapes(target)),
        f"#place(dx: {MARGIN_MM}mm, dy: {height + MARGIN_MM + 5.0}mm, line(length: {ruler}mm, stroke: 0.3mm))",
        f"#place(dx: {MARGIN_MM}mm, dy: {height + MARGIN_MM + 7.0}mm, "
        f"block(width: {width}mm)[#text({literal(f'Ruler: {plain_number(ruler)} mm. {caption}')})])",
    ]
    return compile_pdf("\n".join(source), {})


def _shapes(target: Target) -> list[tuple[float, float, float, float, str]]:
    """Left, top, width, height in mm and colour: black squares, then markers as black squares with white on them."""
    modules, module = modules_of(target), target.square_mm / MODULES
    edge = (MODULES - MARKER_MODULES) // 2
    shapes = []
    for row in range(target.rows):
        for column in range(target.columns):
            top, left = MODULES * row, MODULES * column
            square = modules[top : top + MODULES, left : left + MODULES]
            if not square.any():
                shapes.append((left, top, MODULES, MODULES, "black"))
                continue
            shapes.append((left + edge, top + edge, MARKER_MODULES, MARKER_MODULES, "black"))
            inside = square[edge:-edge, edge:-edge]
            for line, bits in enumerate(inside):
                place = 0
                for is_white, run in groupby(bits):
                    length = len(list(run))
                    if is_white:
                        shapes.append((left + edge + place, top + edge + line, length, 1, "white"))
                    place += length
    return [(x * module, y * module, wide * module, high * module, colour) for x, y, wide, high, colour in shapes]


def _rectangle(left: float, top: float, width: float, height: float, colour: str) -> str:
    return (
        f"#place(dx: {left + MARGIN_MM:.6f}mm, dy: {top + MARGIN_MM:.6f}mm, "
        f"rect(width: {width:.6f}mm, height: {height:.6f}mm, fill: {colour}, stroke: none))"
    )
