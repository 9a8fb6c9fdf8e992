"""The sheets of a design as PDF, the same bytes for the same design."""

from __future__ import annotations

from dataclasses import asdict
from importlib import resources

from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.export.drawing.fields import fields
from designer.export.drawing.sheet import Sheet, sheets_of
from designer.export.drawing.typst_marks import typst_of
from designer.typesetting.markup import cell, literal


def drawing_sheets(design: Design, tolerances: NamedTolerances | None = None) -> dict[str, bytes]:
    """Every sheet as PDF, by the name of its mirror; last the assembly. Without tolerances these are to be agreed.

    Raises
    ------
    InputError
        A mirror cannot be drawn.
    """
    from designer.typesetting.glyphs import missing_characters, without_characters
    from designer.typesetting.pdf import compile_pdf

    style = resources.files("designer.export.drawing").joinpath("sheet.typ").read_bytes()
    sheets = {}
    for name, source in sheet_sources(design, tolerances).items():
        missing = missing_characters(source)
        sheets[name] = compile_pdf(without_characters(source, missing), {"sheet.typ": style})
    return sheets


def sheet_sources(design: Design, tolerances: NamedTolerances | None = None) -> dict[str, str]:
    """The Typst source of every sheet, by its name."""
    return {name: _source(sheet) for name, sheet in sheets_of(design, tolerances).items()}


def _source(sheet: Sheet) -> str:
    named = {key: literal(value) for key, value in asdict(sheet.title).items()}
    named |= {
        "drawing-width": f"{sheet.drawn.width_mm}mm",
        "drawing": f"[\n{typst_of(sheet.drawn.marks)}]",
    }
    arguments = ",\n  ".join(f"{name}: {value}" for name, value in named.items())
    body = _heights(sheet.vertices) + fields(sheet.groups)
    return f'#import "sheet.typ": *\n#show: sheet.with(\n  {arguments},\n)\n{body}'


def _heights(vertices: tuple[tuple[str, str, str], ...]) -> str:
    """The table of vertices; nothing without any."""
    if not vertices:
        return ""
    rows = "".join("".join(f"{cell(value)}, " for value in row) for row in vertices)
    return f"#heights(({rows}))\n"
