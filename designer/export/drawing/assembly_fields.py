"""What the sheet of the assembly says in words and numbers."""

from __future__ import annotations

from designer.as_built.allowances import camera_allowance, mirror_allowance
from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.evaluate.fabrication import size_of
from designer.export.drawing.fields import OPEN, Groups, exactly, lens_law
from designer.export.housing_words import housing_material
from designer.files import shortened
from designer.housing import Tube
from designer.typesetting.markup import number

_DRAWN = {"upper": "blue, solid, to the right", "lower": "red, dashed, to the left"}


def vertex_rows(design: Design) -> tuple[tuple[str, str, str], ...]:
    """Heights of vertices above what a person can touch: lens front and lens seat."""
    camera = design.camera
    return tuple(
        (
            f"V{index} {mirror.name}, faces {mirror.faces}",
            number(mirror.vertex_mm - camera.lens_front_mm, 3),
            number(mirror.vertex_mm - camera.lens_seat_mm, 3),
        )
        for index, mirror in enumerate(design.mirrors, 1)
    )


def assembly_groups(design: Design, tolerances: NamedTolerances | None = None) -> Groups:
    """The fields below that table; without tolerances these are left to be agreed."""
    placed = [] if tolerances is None else [(_placing_title(tolerances), _placing(design, tolerances))]
    return [
        ("In full, in mm above the pinhole, for programs; the drawing is rounded", _in_full(design)),
        *placed,
        ("Views", _views(design)),
        ("Camera and lens", _camera(design)),
        ("Notes", _notes(design, tolerances)),
    ]


def _placing_title(tolerances: NamedTolerances) -> str:
    return f"Tolerances of position, of {tolerances.in_words}; largest departures"


def _placing(design: Design, tolerances: NamedTolerances) -> list[tuple[str, str]]:
    rows = []
    for mirror in design.mirrors:
        allowed = mirror_allowance(design, mirror.name, tolerances.values)
        rows.append(
            (
                f"{mirror.name} mirror",
                f"vertex within ±{allowed.decentre_mm:g} mm in x and in y, ±{allowed.axial_shift_mm:g} mm in height; "
                f"tilted by at most {allowed.tilt_deg:g}° about x and about y",
            )
        )
    camera = camera_allowance(design, tolerances.values)
    rows.append(
        (
            "camera to head",
            f"pinhole within ±{camera.shift_mm:g} mm in x and in y, ±{camera.axial_shift_mm:g} mm in height; axis "
            f"tilted by at most {camera.tilt_deg:g}° about x and about y",
        )
    )
    rows.append(("lens, as set", f"principal distance within ±{camera.principal_distance_mm:.3g} mm, then locked"))
    return rows


def _in_full(design: Design) -> list[tuple[str, str]]:
    return [(f"vertex of {mirror.name}", exactly(mirror.vertex_mm)) for mirror in design.mirrors]


def _views(design: Design) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for name, view in design.views.by_name.items():
        low, high = (number(elevation, 2) for elevation in view.elevation_deg)
        words = f"{low}° to {high}° in elevation, over {' and '.join(view.path)}, {view.zone} zone of the image"
        rows.append((name, f"{words}; {_DRAWN[name]}"))
    return rows


def _camera(design: Design) -> list[tuple[str, str]]:
    camera = design.camera
    focus = "infinity" if camera.focus_distance_mm is None else f"{number(camera.focus_distance_mm, 2)} mm"
    named = camera.model_extra or {}
    return [
        *(
            (kind, shortened(str(named[key]), 110))
            for kind, key in (("camera", "name"), ("lens", "lens"))
            if key in named
        ),
        ("sensor", f"{camera.width_px} × {camera.height_px} px of {1000.0 * camera.pixel_pitch_mm:g} µm"),
        ("principal distance", f"{exactly(camera.focal_length_mm)} mm"),
        *lens_law(camera),
        ("focus, f-number", f"{focus} from the pinhole, f/{number(camera.f_number, 2)}"),
    ]


def _notes(design: Design, tolerances: NamedTolerances | None) -> list[tuple[str, str]]:
    size, housing = size_of(design), design.housing
    lowest = "lens front" if float(size.bottom) == design.camera.lens_front_mm else "lowest edge"
    highest = "highest edge of a mirror"
    if housing is not None and float(size.top) == housing.high_mm:
        highest = f"upper end of the {housing.kind}"
    if housing is not None and float(size.bottom) == housing.low_mm < design.camera.lens_front_mm:
        lowest = f"foot of the {housing.kind}"
    return [
        ("pinhole", "centre of the lens's entrance pupil: origin of all heights, on the axis; not to be touched"),
        ("lens seat", "plane in which the barrel meets the camera's front (its flange)"),
        ("overall height", f"from the {lowest} to the {highest}"),
        (
            "signs",
            "on a mirror's sheet right is up for a mirror that faces down, and down for one that faces up; where up is "
            "positive, the radius of the latter has the other sign",
        ),
        ("what holds them", _what_holds_them(design)),
        *(
            [("tolerances", f"of position and tilt {OPEN}: run designer tolerance for what each departure costs")]
            if tolerances is None
            else []
        ),
    ]


def _what_holds_them(design: Design) -> str:
    housing = design.housing
    seats = f"seats, flanges and screws {OPEN}"
    if housing is None:
        return f"{OPEN}: not part of the design"
    if isinstance(housing, Tube):
        return (
            f"a tube of {housing_material(design)}, clear, ⌀{number(2.0 * housing.outer_radius_mm, 3)} × "
            f"{number(housing.wall_mm, 3)} wall, {number(housing.length_mm, 3)} long, on the axis; {seats}"
        )
    circle = f"on a circle of ⌀{number(2.0 * housing.radius_mm, 3)}, the first in +x"
    return (
        f"{housing.number} struts of {housing_material(design)}, ⌀{number(housing.width_mm, 3)} × "
        f"{number(housing.length_mm, 3)}, {circle}; {seats}"
    )
