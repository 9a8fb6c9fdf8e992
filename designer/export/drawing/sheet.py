"""What each sheet of a design holds, whichever file it is written to."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from designer import __version__
from designer.as_built.named import NamedTolerances
from designer.design import Design, Mirror, design_to_json
from designer.export.assembly_name import ASSEMBLY, check_names_of_parts
from designer.export.drawing.assembly import assembly_drawing
from designer.export.drawing.assembly_fields import assembly_groups, vertex_rows
from designer.export.drawing.fields import Groups
from designer.export.drawing.mirror_fields import mirror_groups
from designer.export.drawing.paper import Drawn, scale_words
from designer.export.drawing.section import section_of
from designer.files import InputError, shortened
from designer.trace.instrument import sag

LARGEST_MM, SMALLEST_MM, LARGEST_RADIUS_MM = 1e5, 1e-2, 1e9


@dataclass(frozen=True, slots=True)
class Title:
    """The fields of a sheet's title block, as they are printed; ``digest`` is that of the design's file."""

    part: str
    number: str
    configuration: str
    variant: str
    scale: str
    provenance: str
    digest: str


@dataclass(frozen=True, slots=True)
class Sheet:
    """A drawing, the words beside it, and its title block.

    ``vertices`` are rows of a vertex's name and its heights above lens front and lens seat, on the assembly's sheet.
    """

    title: Title
    drawn: Drawn
    groups: Groups
    vertices: tuple[tuple[str, str, str], ...] = ()


def sheets_of(design: Design, tolerances: NamedTolerances | None = None) -> dict[str, Sheet]:
    """Every sheet by the name of its mirror; last the assembly. Without tolerances these are to be agreed.

    Raises
    ------
    InputError
        A mirror cannot be drawn.
    """
    check_names_of_parts(design)
    _check_surroundings(design)
    for mirror in design.mirrors:
        _check(mirror)
    count = len(design.mirrors) + 1
    sheets = {}
    for index, mirror in enumerate(design.mirrors, 1):
        drawn = section_of(design, mirror.name)
        title = _title(design, f"{mirror.name} mirror", f"{index} of {count}", drawn)
        sheets[mirror.name] = Sheet(title, drawn, mirror_groups(design, mirror.name, tolerances))
    drawn = assembly_drawing(design)
    title = _title(design, ASSEMBLY, f"{count} of {count}", drawn)
    sheets[ASSEMBLY] = Sheet(title, drawn, assembly_groups(design, tolerances), vertex_rows(design))
    return sheets


def design_digest(design: Design) -> str:
    """SHA-256 of a design's file as the designer writes it, in hexadecimal digits."""
    return hashlib.sha256(design_to_json(design).encode("utf-8")).hexdigest()


def _title(design: Design, part: str, number: str, drawn: Drawn) -> Title:
    return Title(
        part=shortened(part, 40),
        number=number,
        configuration=shortened(design.configuration, 40),
        variant=shortened(design.variant, 160) or "–",
        scale=scale_words(drawn.scale),
        provenance=f"catadioptric-designer {__version__}",
        digest=design_digest(design),
    )


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
