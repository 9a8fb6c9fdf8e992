"""What a system must obey, clearances apart: one tuple of builders.

A constraint is a value in its own unit that must not be negative; ``scale`` says how much of that unit weighs as much
as one of any other constraint. To add a constraint, write a function from a system to constraints and add it to
``CONSTRAINTS`` (docs/contributing.md). Everything takes floats, NumPy arrays or CasADi symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from designer.design import VIEW_NAMES, ViewName
from designer.optics.backend import Scalar, absolute, arctan, degrees, maximum, minimum, sqrt
from designer.optics.image_law import pinhole_tangent
from designer.optics.kinds import ELLIPSOID_GAINS
from designer.optimise.system import System, zone_tangents

# |kappa| t^2 = 1 is where a conic's vertex sheet ends for a ray from its focus; stay this far below.
SHEET_MARGIN = 0.02
SHORTEST_VERTEX_DISTANCE_MM = 0.05

FIXED = "fixed "
"""How the names of constraints on fixed parameters begin; these can be missed on either side."""

# Units of what misses a fixed parameter, and how much of each weighs as much as 1 mm. A radius is compared by its
# curvature, which is finite for a plane too.
_FIXED_UNITS = {
    "vertex_mm": ("mm", 1.0),
    "radius_mm": ("(relative curvature)", 0.01),
    "conic": ("(in the conic constant)", 0.01),
}


@dataclass(frozen=True, slots=True)
class Constraint:
    """A value in its own unit that must not be negative (or, for an equality, must be zero).

    ``kind`` says which rule it comes from, in a word for programs; ``name`` is for people.
    """

    kind: str
    name: str
    unit: str
    scale: float
    value: Scalar
    equality: bool = False


ConstraintBuilder = Callable[[System], Iterable[Constraint]]


def image_constraints(system: System) -> Iterable[Constraint]:
    """Zones inside the image circle and apart, blur included; the cone of light passes the lens front."""
    variant, values, specification = system.variant, system.values, system.specification
    outer, inner = variant.configuration.outer_view, variant.configuration.inner_view
    tangents = {view: zone_tangents(variant, view, system.slopes[view]) for view in VIEW_NAMES}

    def half_tangent(view: ViewName, end: int) -> Scalar:
        return variant.gain_sign(view) * values[f"{view}_gain"] * tangents[view][end]

    def image_ratio(view: ViewName, end: int) -> Scalar:
        return specification.law.ratio(half_tangent(view, end))

    distance, pitch = values["principal_distance"], specification.pixel_pitch
    rim = image_ratio(outer, 1)
    # The light of the two zones' ends spreads beyond them by half its blur.
    mixing = (system.largest_blur_at_end(outer, 0) + system.largest_blur_at_end(inner, 1)) / 2.0
    gap = distance * (image_ratio(outer, 0) - image_ratio(inner, 1)) - specification.zone_gap - mixing
    spare = (specification.image_radius - distance * rim) / pitch
    yield Constraint("image_circle", f"{outer} view inside the image circle", "px", 10.0, spare)
    yield Constraint("zone_gap", "gap between the image zones", "px", 10.0, gap / pitch)
    steepest = rim if specification.law.is_perspective else pinhole_tangent(half_tangent(outer, 1))
    barrel = specification.lens_radius - system.lens.pupil_diameter / 2.0 - specification.lens_front * steepest
    yield Constraint("lens_barrel", "lens barrel clear of the light", "mm", 1.0, barrel)
    if not specification.law.is_perspective:
        # Farther out the image radius may fall again, and lie within the image circle once more.
        beyond = specification.law.widest - 2.0 * arctan(half_tangent(outer, 1))
        yield Constraint("lens_field", f"{outer} view within the lens's field", "deg", 1.0, degrees(beyond))


def mirror_constraints(system: System) -> Iterable[Constraint]:
    """Each mirror can be made: neither too small nor too wide nor too steep, and it has a face."""
    asked = system.specification.asked
    for mirror in system.layout.mirrors:
        name, radius, surface = mirror.name, mirror.outer_radius, mirror.surface
        discriminant = maximum(1.0 - surface.conic_term * radius * radius, 1e-4)
        slope = degrees(arctan(absolute(surface.curvature) * radius / sqrt(discriminant)))
        ring = mirror.used_radii[1] - mirror.used_radii[0]
        least, most = asked.manufacture.smallest_mirror_radius_mm, asked.envelope.mirror_diameter_mm
        yield Constraint("smallest_radius", f"smallest radius of the {name} mirror", "mm", 1.0, radius - least)
        yield Constraint("largest_diameter", f"largest diameter of the {name} mirror", "mm", 1.0, most - 2.0 * radius)
        steepest = asked.manufacture.largest_slope_deg - slope
        yield Constraint("steepest_slope", f"steepest slope of the {name} mirror", "deg", 1.0, steepest)
        yield Constraint("used_ring", f"width of the used annulus of the {name} mirror", "mm", 1.0, ring)


def sheet_constraints(system: System) -> Iterable[Constraint]:
    """Every ray meets the vertex sheets, forwards, on the side the variant says."""
    for path in system.paths:
        for reflection in path.reflections:
            reach = absolute(reflection.conic.tangent_ratio) * reflection.half_tangents[1] ** 2
            name = f"reflection on the vertex sheet of the {reflection.mirror} mirror"
            yield Constraint("vertex_sheet", name, "(a ratio)", 0.05, 1.0 - SHEET_MARGIN - reach)


def folding_pair_constraints(system: System) -> Iterable[Constraint]:
    """The light of a folding pair runs down from the secondary to the primary, which stays of its kind."""
    fold = system.variant.fold
    if fold is None:
        return
    from_secondary, from_primary = system.paths[0].reflections
    secondary, primary = from_secondary.conic, from_primary.conic
    for end in (0, 1):
        # The line through the shared focus meets the primary above the secondary too, where no light comes.
        below = (
            secondary.point(from_secondary.half_tangents[end])[1] - primary.point(from_primary.half_tangents[end])[1]
        )
        yield Constraint("primary_below_secondary", "primary below the secondary", "mm", 1.0, below)
    distance = fold.primary_side * primary.vertex_distance - SHORTEST_VERTEX_DISTANCE_MM
    name = "primary's vertex on the correct side of the viewpoint"
    yield Constraint("primary_vertex_side", name, "mm", 1.0, distance)
    if fold.primary_gains is not None:
        low, high = fold.primary_gains
        kind = "ellipsoid" if fold.primary_gains == ELLIPSOID_GAINS else "hyperboloid"
        for side, spare in (("below", primary.tangent_ratio - low), ("above", high - primary.tangent_ratio)):
            name = f"primary remains a {kind} (gain from {side})"
            yield Constraint("primary_kind", name, "(in the gain)", 0.05, spare)


def first_mirror_constraints(system: System) -> Iterable[Constraint]:
    """The first mirror of each path is far enough from the pinhole to be focused on."""
    for path in system.paths:
        first = path.reflections[0]
        for tangent in first.half_tangents:
            spare = first.conic.point(tangent)[1] - system.specification.asked.camera.nearest_mirror_mm
            yield Constraint(
                "nearest_mirror",
                f"axial distance of the {first.mirror} mirror from the entrance pupil",
                "mm",
                1.0,
                spare,
            )


def envelope_constraints(system: System) -> Iterable[Constraint]:
    """Top, bottom and radius enclose the mirrors, the lens front and the housing, and fit into the envelope."""
    values, specification = system.values, system.specification
    envelope, lens_front = specification.asked.envelope, specification.lens_front
    beyond = specification.housing_gap + specification.housing_thickness
    top, bottom, radius = values["top"], values["bottom"], values["radius"]
    name = "height of the mirror system"
    yield Constraint("envelope_height", name, "mm", 1.0, envelope.height_mm - (top - bottom))
    name = "diameter of the mirror system"
    yield Constraint("envelope_diameter", name, "mm", 1.0, envelope.diameter_mm - 2.0 * radius)
    yield Constraint("encloses", "bottom encloses the lens front", "mm", 1.0, lens_front - bottom)
    for mirror in system.layout.mirrors:
        # A back is never lower than a face that looks down, nor higher than one that looks up.
        shift = mirror.direction * mirror.thickness
        above, below = (shift, 0.0) if mirror.direction > 0 else (0.0, shift)
        for rim, height in zip(("inner", "outer"), mirror.rim_heights, strict=True):
            where = f"the {rim} rim of the {mirror.name} mirror"
            yield Constraint("encloses", f"top encloses {where}", "mm", 1.0, top - (height + above))
            yield Constraint("encloses", f"bottom encloses {where}", "mm", 1.0, height + below - bottom)
        name = f"radius encloses the {mirror.name} mirror"
        yield Constraint("encloses", name, "mm", 1.0, radius - mirror.outer_radius - beyond)


def housing_constraints(system: System) -> Iterable[Constraint]:
    """A housing goes about the lens and stays off the camera's body; a tube reaches past the light of both views."""
    values, specification = system.values, system.specification
    if specification.housing == "none":
        return
    top, bottom, radius = values["top"], values["bottom"], values["radius"]
    gap, thickness = specification.housing_gap, specification.housing_thickness
    spare = radius - specification.lens_radius - gap - thickness
    yield Constraint("encloses", "radius encloses the lens in its housing", "mm", 1.0, spare)
    over = bottom - (specification.lens_front - specification.lens_length)
    around = radius - thickness - specification.asked.camera.body_radius_mm
    name = f"{specification.housing} clear of the camera body"
    yield Constraint("housing_body", name, "mm", 1.0, maximum(over, around) - gap)
    if specification.housing != "tube":
        return
    for path, sight in zip(system.paths, system.sights, strict=True):
        lowest, highest = sight.heights(radius)
        where = f"the light of the {path.view} view at the tube"
        yield Constraint("encloses", f"top encloses {where}", "mm", 1.0, top - highest - gap)
        yield Constraint("encloses", f"bottom encloses {where}", "mm", 1.0, lowest - gap - bottom)


def blur_constraints(system: System) -> Iterable[Constraint]:
    """No point of the working volume blurs more than asked, on the sensor and in the scene."""
    specification = system.specification
    for blur in system.blurs:
        in_scene = specification.largest_blur_angle * blur.image_scale
        if specification.law.is_perspective:
            spare = minimum(specification.largest_blur, in_scene) - blur.on_sensor
        else:
            spare = minimum(specification.largest_blur - blur.on_sensor, in_scene - absolute(blur.along))
        yield Constraint("blur", f"blur of the {blur.view} view", "px", 2.0, spare / specification.pixel_pitch)


CONSTRAINTS: tuple[ConstraintBuilder, ...] = (
    image_constraints,
    mirror_constraints,
    sheet_constraints,
    folding_pair_constraints,
    first_mirror_constraints,
    envelope_constraints,
    blur_constraints,
    housing_constraints,
)
"""Every builder, in the order of the solver's rows."""


def constraints_of(system: System, fixed: Mapping[str, float]) -> tuple[Constraint, ...]:
    """All constraints of a system, and that its fixed parameters are kept.

    Parameters
    ----------
    fixed
        Parameters that must have a given value, by names such as ``primary.radius_mm`` or ``upper.gain``.
    """
    rules = [constraint for build in CONSTRAINTS for constraint in build(system)]
    return (*rules, *_fixed_constraints(system, fixed))


def _fixed_constraints(system: System, fixed: Mapping[str, float]) -> Iterable[Constraint]:
    for key, wanted in fixed.items():
        owner, _, quantity = key.partition(".")
        name = f"{FIXED}{quantity} of the {owner}"
        if owner in {"upper", "lower"} and quantity in {"viewpoint_mm", "gain"}:
            path = next(path for path in system.paths if path.view == owner)
            if quantity == "viewpoint_mm":
                unit, scale, off = "mm", 1.0, path.viewpoint - wanted
            else:
                unit, scale, off = "(relative)", 0.01, system.values[f"{owner}_gain"] / wanted - 1.0
            yield Constraint("fixed", f"{name} view", unit, scale, off, equality=True)
            continue
        surface = next(mirror.surface for mirror in system.layout.mirrors if mirror.name == owner)
        unit, scale = _FIXED_UNITS[quantity]
        if quantity == "vertex_mm":
            off = surface.vertex_height - wanted
        elif quantity == "radius_mm":
            off = surface.curvature * wanted - 1.0
        else:
            off = surface.conic_term / surface.curvature**2 - 1.0 - wanted
        yield Constraint("fixed", f"{name} mirror", unit, scale, off, equality=True)
