"""The sheets of a design: a PDF for each mirror and one for the assembly, the same bytes for the same design."""

from __future__ import annotations

import hashlib
from importlib import resources

from designer import __version__
from designer.as_built.named import NamedTolerances
from designer.design import Design, Mirror, design_to_json
from designer.export.assembly_name import ASSEMBLY, check_names_of_parts
from designer.export.drawing.assembly import assembly_drawing
from designer.export.drawing.assembly_fields import assembly_groups, vertex_table
from designer.export.drawing.fields import fields
from designer.export.drawing.mirror_fields import mirror_groups
from designer.export.drawing.paper import Drawn, scale_words
from designer.export.drawing.section import section_of
from designer.files import InputError, shortened
from designer.trace.instrument import sag
from designer.typesetting.markup import literal

LARGEST_MM, SMALLEST_MM, LARGEST_RADIUS_MM = 1e5, 1e-2, 1e9


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
    check_names_of_parts(design)
    _check_surroundings(design)
    for mirror in design.mirrors:
        _check(mirror)
    count = len(design.mirrors) + 1
    sources = {}
    for index, mirror in enumerate(design.mirrors, 1):
        sources[mirror.name] = _sheet(
            design,
            f"{mirror.name} mirror",
            f"{index} of {count}",
            section_of(design, mirror.name),
            fields(mirror_groups(design, mirror.name, tolerances)),
        )
    tables = vertex_table(design) + fields(assembly_groups(design, tolerances))
    sources[ASSEMBLY] = _sheet(design, ASSEMBLY, f"{count} of {count}", assembly_drawing(design), tables)
    return sources


def design_digest(design: Design) -> str:
    """SHA-256 of a design's file as the designer writes it, in hexadecimal digits."""
    return hashlib.sha256(design_to_json(design).encode("utf-8")).hexdigest()


def _check_surroundings(design: Design) -> None:
    camera = design.camera
    lengths = {
        "camera.lens_front_mm": camera.lens_front_mm,
        "camera.lens_length_mm": camera.lens_length_mm,
        "camera.lens_radius_mm": camera.lens_radius_mm,
        "camera.body_radius_mm": camera.body_radius_mm,
        **{f"views.{name}.viewpoint_mm": view.viewpoint_mm for name, view in design.views.by_name.items()},
    }
    for key, length in lengths.items():
        if abs(length) > LARGEST_MM:
            raise InputError(f"{key} = {length:g}: cannot be drawn; must be within ±{LARGEST_MM:g} mm")


def _check(mirror: Mirror) -> None:
    rim = abs(float(sag(mirror, mirror.outer_radius_mm)))
    largest = max(abs(mirror.vertex_mm), mirror.outer_radius_mm, mirror.thickness_mm, rim)
    radius = abs(mirror.radius_mm or 0.0)
    if not (mirror.outer_radius_mm >= SMALLEST_MM and largest <= LARGEST_MM and radius <= LARGEST_RADIUS_MM):
        raise InputError(
            f"mirror {mirror.name}: cannot be drawn; its size and height must be between {SMALLEST_MM:g} and "
            f"{LARGEST_MM:g} mm, its radius of curvature at most {LARGEST_RADIUS_MM:g} mm"
        )


def _sheet(design: Design, part: str, number: str, drawn: Drawn, body: str) -> str:
    """One sheet's source."""
    named = {
        "part": literal(shortened(part, 40)),
        "configuration": literal(shortened(design.configuration, 40)),
        "variant": literal(shortened(design.variant, 160) or "–"),
        "scale": literal(scale_words(drawn.scale)),
        "number": literal(number),
        "provenance": literal(f"catadioptric-designer {__version__}"),
        "digest": literal(design_digest(design)),
        "drawing-width": f"{drawn.width_mm}mm",
        "drawing": f"[\n{drawn.source}]",
    }
    arguments = ",\n  ".join(f"{name}: {value}" for name, value in named.items())
    return f'#import "sheet.typ": *\n#show: sheet.with(\n  {arguments},\n)\n{body}'
