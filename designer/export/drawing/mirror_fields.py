"""What a mirror's sheet says in words and numbers, in the style of ISO 10110."""

from __future__ import annotations

import math

import numpy as np

from designer.as_built.allowances import mirror_allowance
from designer.as_built.named import NamedTolerances
from designer.design import Design, Mirror
from designer.evaluate.coatings import ALUMINIUM_6061, COATINGS
from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.face_dimensions import FaceDimensions, depth_mm, face_dimensions
from designer.export.drawing.fields import OPEN, Groups, exactly, tolerances_title
from designer.typesetting.markup import number

_CHECK_RADII = 3
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def mirror_groups(design: Design, name: str, tolerances: NamedTolerances | None = None) -> Groups:
    """All fields of a mirror's sheet; without tolerances these are left to be agreed."""
    mirror, face = design.mirror(name), face_dimensions(design, name)
    return [
        ("Reflecting face, in the style of ISO 10110", _surface(design, mirror, face)),
        (tolerances_title(tolerances), _tolerances(design, name, tolerances)),
        ("Blank", _blank(design, mirror)),
        ("In full, in mm, for programs; the drawing is rounded", _in_full(mirror)),
    ]


def _surface(design: Design, mirror: Mirror, face: FaceDimensions) -> list[tuple[str, str]]:
    shape = mirror_shape(design, mirror.name)
    clear = [] if face.has_margin else [("clear aperture", "the whole face: the design's file has no edge margin")]
    if face.radius_mm is None:
        return [("shape", "plane"), ("vertex radius R", "∞"), ("conic constant K", "none"), *clear]
    hollow = "convex" if face.radius_mm > 0.0 else "concave"
    by_radius, by_conic = face.decimals
    slope = max(shape.slope_deg)
    return [
        ("shape", f"{mirror.kind}, {hollow}{_nearly_words(face, shape.sag_mm)}; about the axis, vertex V"),
        ("vertex radius R", f"{_signed(face.radius_mm)} mm; positive: centre of curvature right of V (convex)"),
        ("conic constant K", f"{exactly(mirror.conic)}; {_kinds(mirror.conic)}"),
        (
            "digits that matter",
            f"R to {by_radius}, K to {by_conic} decimals: rounded there, the sag moves by at most 1 nm",
        ),
        ("sag", "z = r² / (R (1 + √(1 − (1 + K) r² / R²)))"),
        ("", "z: distance right of the plane through V, at the distance r from the axis"),
        ("with numbers", _with_numbers(face.radius_mm, mirror.conic)),
        (
            "sag at r: r → z",
            "; ".join(f"{number(r, 3)} → {number(depth_mm(mirror, r), 6)}" for r in _check_radii(face))
            + " (ends and middle of the clear aperture)",
        ),
        ("best-fit sphere", _sphere_words(shape.best_sphere_radius_mm, shape.sphere_departure_mm, hollow)),
        ("steepest slope", f"{number(slope, 3)}° from the plane across the axis"),
        *clear,
    ]


def _nearly_words(face: FaceDimensions, sag_mm: float) -> str:
    if face.nearly == "plane":
        return f", nearly a plane ({number(1000.0 * sag_mm, 2)} µm from rim to rim)"
    return ", nearly a sphere (see the best-fit sphere)" if face.nearly else ""


def _sphere_words(radius: float | None, departure: float, hollow: str) -> str:
    if radius is None:
        return "none"
    return (
        f"radius {number(abs(radius), 4)} mm, {hollow}, over the whole face, by area; "
        f"departure {number(1000.0 * departure, 2)} µm, peak to valley along its normal"
    )


def _kinds(conic: float) -> str:
    if conic == -1.0:
        return "−1: paraboloid"
    if conic == 0.0:
        return "0: sphere"
    return "below −1: hyperboloid" if conic < -1.0 else "above −1: ellipsoid"


def _signed(value: float) -> str:
    return exactly(value) if value < 0.0 else f"+{exactly(value)}"


def _with_numbers(radius: float, conic: float) -> str:
    """The equation for a calculator, to ten digits."""
    term = (1.0 + conic) / radius**2
    if term == 0.0:
        return f"z = r² / {number(2.0 * radius, 7)}"
    digits, exponent = f"{abs(term):.9e}".split("e")
    power = str(int(exponent)).translate(_RAISED)
    return f"z = r² / ({number(radius, 7)} (1 + √(1 {'−' if term > 0.0 else '+'} {digits} · 10{power} r²)))"


def _check_radii(face: FaceDimensions) -> list[float]:
    """The ends of the clear aperture and its middle, to a thousandth of a mm."""
    radii = np.linspace(*face.clear_radii_mm, _CHECK_RADII).round(3)
    return [float(radius) for radius in radii if radius > 0.0]


def _tolerances(design: Design, name: str, tolerances: NamedTolerances | None) -> list[tuple[str, str]]:
    others = [
        ("5/ imperfections", OPEN),
        ("roughness Rq", OPEN),
        ("dimensions", OPEN),
        ("edges", f"protective chamfer outside the clear aperture, {OPEN}"),
    ]
    if tolerances is None:
        return [
            ("3/ surface form", f"{OPEN}; over the clear aperture, of the shape above"),
            ("4/ centring", f"{OPEN}; axis of the face to the outer edge"),
            *others,
        ]
    allowed = mirror_allowance(design, name, tolerances.values)
    if allowed.curvature_per_m is not None:
        form = f"curvature within ±{allowed.curvature_per_m:.3g} 1/m"
    else:
        form = f"R within ±{allowed.radius_mm:.3g} mm, K within ±{allowed.conic:.3g}"
    return [
        (
            "3/ surface form",
            f"{form}: sag within ±{1000.0 * allowed.sag_mm:.3g} µm over the clear aperture, vertices together; "
            f"irregularity {OPEN}",
        ),
        (
            "4/ centring",
            f"axis of the face to the outer edge and the seat: a share, {OPEN}, of what the assembly allows, which is "
            f"{allowed.decentre_mm:g} mm and {allowed.tilt_deg:g}° in x and in y",
        ),
        *others,
    ]


def _blank(design: Design, mirror: Mirror) -> list[tuple[str, str]]:
    mass = mirror_shape(design, mirror.name).mass_g
    first, *others = COATINGS
    alternatives = ", ".join(f"{coating.name} {100 * coating.reflectivity:g} %" for coating in others)
    if mirror.thickness_mm > 0.0:
        back = (
            "the face shifted along the axis by the thickness, not optical. Another back must stay inside this "
            "outline, as light passes close to it"
        )
    else:
        back = "none: the design's file gives the mirror no thickness"
    thickness = (
        []
        if mirror.thickness_mm == 0.0
        else [("thickness", f"as dimensioned, along the axis, everywhere; {_across(design, mirror)}")]
    )
    return [
        ("material", f"{ALUMINIUM_6061.name}, {ALUMINIUM_6061.process}, unless agreed otherwise"),
        ("mass", f"{number(mass, 2)} g, without what holds it"),
        (
            "coating",
            f"{first.name}, reflects at least {100 * first.reflectivity:g} % (mean, 400 to 700 nm); or {alternatives}",
        ),
        *thickness,
        ("back", back),
        ("seat, fixing", f"{OPEN}: the design does not say what holds the mirror"),
    ]


def _across(design: Design, mirror: Mirror) -> str:
    slope = max(mirror_shape(design, mirror.name).slope_deg)
    return f"across the wall at least {number(mirror.thickness_mm * math.cos(math.radians(slope)), 3)} mm"


def _in_full(mirror: Mirror) -> list[tuple[str, str]]:
    return [
        (
            "radius of the hole",
            exactly(mirror.inner_radius_mm) + ("" if mirror.inner_radius_mm > 0.0 else " (no hole)"),
        ),
        ("radius of the edge", exactly(mirror.outer_radius_mm)),
        ("thickness", exactly(mirror.thickness_mm)),
    ]
