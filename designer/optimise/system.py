"""From a variant's numbers to its layout, its constraints and what it scores.

Written once for floats, NumPy arrays (screening, independent check) and CasADi symbols (the program). A constraint is
a value in its own unit that must not be negative; ``scale`` says how much of that unit weighs as much as one of any
other constraint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from designer.evaluate.depth import StereoPair, Volume, depth_error_rms
from designer.optics.backend import Scalar, absolute, arctan, degrees, maximum, minimum, sqrt, tan
from designer.optics.conic import FocalConic
from designer.optics.kinds import ELLIPSOID_GAINS
from designer.optics.layout import Layout, OpticalPath, PlacedMirror, Reflection, Surroundings, lay_out
from designer.optics.view import elevation_tangents_of_views, half_angle_tangent
from designer.optimise.specification import Specification
from designer.optimise.variants import Variant

# |kappa| t^2 = 1 is where a conic's vertex sheet ends for a ray from its focus; stay this far below.
SHEET_MARGIN = 0.02
SHORTEST_VERTEX_DISTANCE_MM = 0.05

# Units of what misses a fixed parameter, and how much of each weighs as much as 1 mm. A radius is compared by its
# curvature, which is finite for a plane too.
_FIXED_UNITS = {
    "vertex_mm": ("mm", 1.0),
    "radius_mm": ("(a share of its curvature)", 0.01),
    "conic": ("(in the conic constant)", 0.01),
}

Values = Mapping[str, Scalar]
"""The physical variables of a variant by name; see ``VARIABLES``."""

VARIABLES = (
    "baseline",
    "principal_distance",
    "lower_viewpoint",
    "lower_gain",
    "upper_gain",
    "secondary_height",
    "secondary_inverse_gain",
    "top",
    "bottom",
    "radius",
)
"""Lengths in mm; gains signed. Top, bottom and radius enclose the mirror system."""


@dataclass(frozen=True, slots=True)
class Constraint:
    """A value in its own unit that must not be negative (or, for an equality, must be zero)."""

    name: str
    unit: str
    scale: float
    value: Scalar
    equality: bool = False


@dataclass(frozen=True, slots=True)
class System:
    """A system put together: where everything is, what it must obey (clearances apart), and what it scores."""

    layout: Layout
    constraints: tuple[Constraint, ...]
    depth_error: Scalar
    height: Scalar
    diameter: Scalar

    @property
    def volume(self) -> Scalar:
        """Volume of the cylinder that the mirror system spans, mm^3."""
        return 0.7853981633974483 * self.diameter * self.diameter * self.height


def assemble(variant: Variant, values: Values, specification: Specification, fixed: Mapping[str, float]) -> System:
    """Put a system together.

    Parameters
    ----------
    variant
        Decides the structure.
    values
        The physical variables; the secondary's are ignored for direct configurations.
    rules
        The requirement's numbers.
    fixed
        Parameters that must have a given value, by names such as ``primary.radius_mm`` or ``upper.gain``.
    """
    views = _views(values, specification)
    paths = _paths(variant, values, views)
    layout = lay_out(paths, _sides(variant), _surroundings(specification))
    constraints = [
        *_image_constraints(variant, values, specification, views),
        *_mirror_constraints(layout, specification),
        *_sheet_constraints(variant, paths),
        *_first_mirror_constraints(paths, specification),
        *_envelope_constraints(layout, values, specification),
        *_fixed_constraints(variant, layout, paths, values, fixed),
    ]
    pair = StereoPair(
        values["lower_gain"],
        variant.sense("lower"),
        values["upper_gain"],
        variant.sense("upper"),
        values["baseline"],
        values["principal_distance"],
    )
    volume = Volume(
        (specification.elevation_low, specification.elevation_high),
        (specification.distance_near, specification.distance_far),
    )
    return System(
        layout,
        tuple(constraints),
        depth_error=depth_error_rms(pair, volume, specification.noise),
        height=values["top"] - values["bottom"],
        diameter=2.0 * values["radius"],
    )


def enclosing(variant: Variant, values: Values, specification: Specification) -> dict[str, Scalar]:
    """Top, bottom and radius of a mirror system as they are (docs/theory.md, section 7), for floats and arrays."""
    layout = lay_out(
        _paths(variant, values, _views(values, specification)), _sides(variant), _surroundings(specification)
    )
    heights = [height for mirror in layout.mirrors for height in _extreme_heights(mirror)]
    top, bottom, radius = heights[0], specification.lens_front, layout.mirrors[0].outer_radius
    for height in heights:
        top, bottom = maximum(top, height), minimum(bottom, height)
    for mirror in layout.mirrors:
        radius = maximum(radius, mirror.outer_radius)
    return {"top": top, "bottom": bottom, "radius": radius}


def _views(values: Values, specification: Specification) -> dict[str, tuple[Scalar, Scalar]]:
    """Lowest and highest tan(phi) that each view needs."""
    upper, lower = elevation_tangents_of_views(
        (tan(specification.elevation_low), tan(specification.elevation_high)),
        (specification.distance_near, specification.distance_far),
        values["baseline"],
    )
    return {"upper": upper, "lower": lower}


def _paths(variant: Variant, values: Values, views: dict[str, tuple[Scalar, Scalar]]) -> tuple[OpticalPath, ...]:
    """The lower and the upper view's path."""
    upper = _direct_path(variant, "upper", values, views["upper"])
    if variant.fold is None:
        return _direct_path(variant, "lower", values, views["lower"]), upper
    return _folded_path(variant, values, views["lower"]), upper


def _zone_tangents(variant: Variant, view: str, slopes: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
    """Half-angle tangents of the zone's inner and outer end: a folded view has its highest elevation inside."""
    inner, outer = slopes if variant.sense(view) == "direct" else (slopes[1], slopes[0])
    sense = variant.sense(view)
    return half_angle_tangent(inner, sense), half_angle_tangent(outer, sense)


def _direct_path(variant: Variant, view: str, values: Values, slopes: tuple[Scalar, Scalar]) -> OpticalPath:
    gain = values[f"{view}_gain"]
    viewpoint = values["lower_viewpoint"] + (values["baseline"] if view == "upper" else 0.0)
    tangents = _zone_tangents(variant, view, slopes)
    conic = FocalConic(0.0, viewpoint / (1.0 + gain), 1.0 / gain)
    crossing = viewpoint if variant.crosses_at_viewpoint(view) else None
    at_pinhole = (gain * tangents[0], gain * tangents[1])
    reflection = Reflection(variant.last_mirror(view), 1, conic, at_pinhole, crossing)
    return OpticalPath(view, viewpoint, slopes, (reflection,))


def _folded_path(variant: Variant, values: Values, slopes: tuple[Scalar, Scalar]) -> OpticalPath:
    """The folding pair from four numbers that stay finite through planes and paraboloids.

    With the secondary's vertex at v and inverse gain mu, the pair's gain kappa and the viewpoint z_F, a shared focus
    asks for a primary of gain kappa mu whose vertex lies w = kappa (v (1 + mu) - mu z_F) / (1 + kappa mu) above the
    viewpoint. mu = 0 is the pair of paraboloids.
    """
    fold = variant.fold
    assert fold is not None
    gain, viewpoint, height = values["lower_gain"], values["lower_viewpoint"], values["secondary_height"]
    inverse_gain = 1.0 / gain if fold.primary_is_plane else values["secondary_inverse_gain"]
    primary_gain = gain * inverse_gain
    vertex_distance = gain * (height * (1.0 + inverse_gain) - inverse_gain * viewpoint) / (1.0 + primary_gain)
    tangents = _zone_tangents(variant, "lower", slopes)
    secondary = FocalConic(0.0, height, inverse_gain)
    primary = FocalConic(viewpoint, vertex_distance, primary_gain)
    between = secondary.other_focus_height if fold.gain_sign != fold.primary_side else None
    after = viewpoint if variant.crosses_at_viewpoint("lower") else None
    at_pinhole = (gain * tangents[0], gain * tangents[1])
    return OpticalPath(
        "lower",
        viewpoint,
        (slopes[1], slopes[0]),
        (
            Reflection("secondary", 1, secondary, at_pinhole, between),
            Reflection("primary", -1, primary, tangents, after),
        ),
    )


def _sides(variant: Variant) -> dict[str, int]:
    sides = dict(variant.direct_gain_signs)
    if variant.fold is not None:
        sides |= {"secondary": variant.fold.gain_sign, "primary": variant.fold.primary_side}
    return sides


def _surroundings(specification: Specification) -> Surroundings:
    return Surroundings(
        specification.substrate_thickness,
        specification.edge_margin,
        specification.lens_radius,
        specification.lens_front,
        specification.lens_length,
        specification.body_radius,
        specification.reach_radius,
    )


def _image_constraints(
    variant: Variant, values: Values, specification: Specification, views: dict[str, tuple[Scalar, Scalar]]
) -> list[Constraint]:
    """Zones inside the image circle and apart; the cone of light passes the lens front."""
    outer, inner = ("upper", "lower") if variant.configuration.topology == "upper_outer" else ("lower", "upper")
    tangents = {view: _zone_tangents(variant, view, slopes) for view, slopes in views.items()}

    def image_slope(view: str, end: int) -> Scalar:
        half = variant.gain_sign(view) * values[f"{view}_gain"] * tangents[view][end]
        return 2.0 * half / (1.0 - half * half)

    distance, pitch = values["principal_distance"], specification.pixel_pitch
    rim = image_slope(outer, 1)
    gap = distance * (image_slope(outer, 0) - image_slope(inner, 1)) - specification.zone_gap
    return [
        Constraint(
            f"image circle holds the {outer} view", "px", 10.0, (specification.image_radius - distance * rim) / pitch
        ),
        Constraint("gap between the image zones", "px", 10.0, gap / pitch),
        Constraint(
            "lens barrel passes the light", "mm", 1.0, specification.lens_radius - specification.lens_front * rim
        ),
    ]


def _mirror_constraints(layout: Layout, specification: Specification) -> list[Constraint]:
    constraints = []
    for mirror in layout.mirrors:
        name, radius, surface = mirror.name, mirror.outer_radius, mirror.surface
        discriminant = maximum(1.0 - surface.conic_term * radius * radius, 1e-4)
        slope = degrees(arctan(absolute(surface.curvature) * radius / sqrt(discriminant)))
        constraints += [
            Constraint(
                f"smallest radius of the {name} mirror", "mm", 1.0, radius - specification.smallest_mirror_radius
            ),
            Constraint(
                f"largest diameter of the {name} mirror", "mm", 1.0, specification.mirror_diameter - 2.0 * radius
            ),
            Constraint(
                f"steepest slope of the {name} mirror", "deg", 1.0, degrees(specification.largest_slope) - slope
            ),
            Constraint(f"used ring of the {name} mirror", "mm", 1.0, mirror.used_radii[1] - mirror.used_radii[0]),
        ]
    return constraints


def _sheet_constraints(variant: Variant, paths: tuple[OpticalPath, ...]) -> list[Constraint]:
    """Every ray meets the vertex sheets, forwards, on the side the variant says; a primary stays of its kind."""
    constraints = []
    for path in paths:
        for reflection in path.reflections:
            reach = absolute(reflection.conic.tangent_ratio) * reflection.half_tangents[1] ** 2
            name = f"light meets the vertex sheet of the {reflection.mirror} mirror"
            constraints.append(Constraint(name, "(a ratio)", 0.05, 1.0 - SHEET_MARGIN - reach))
    fold = variant.fold
    if fold is not None:
        secondary, primary = paths[0].reflections[0].conic, paths[0].reflections[1].conic
        for end in (0, 1):
            # The line through the shared focus meets the primary above the secondary too, where no light comes.
            below = (
                secondary.point(paths[0].reflections[0].half_tangents[end])[1]
                - primary.point(paths[0].reflections[1].half_tangents[end])[1]
            )
            constraints.append(Constraint("primary below the secondary", "mm", 1.0, below))
        distance = fold.primary_side * primary.vertex_distance - SHORTEST_VERTEX_DISTANCE_MM
        constraints.append(Constraint("primary's vertex on its side of the viewpoint", "mm", 1.0, distance))
        if fold.primary_gains is not None:
            low, high = fold.primary_gains
            kind = "ellipsoid" if fold.primary_gains == ELLIPSOID_GAINS else "hyperboloid"
            constraints += [
                Constraint(
                    f"primary stays a {kind} (gain from below)", "(in the gain)", 0.05, primary.tangent_ratio - low
                ),
                Constraint(
                    f"primary stays a {kind} (gain from above)", "(in the gain)", 0.05, high - primary.tangent_ratio
                ),
            ]
    return constraints


def _first_mirror_constraints(paths: tuple[OpticalPath, ...], specification: Specification) -> list[Constraint]:
    constraints = []
    for path in paths:
        first = path.reflections[0]
        for tangent in first.half_tangents:
            height = first.conic.point(tangent)[1]
            name = f"nearest distance of the {first.mirror} mirror"
            constraints.append(Constraint(name, "mm", 1.0, height - specification.nearest_mirror))
    return constraints


def _extreme_heights(mirror: PlacedMirror) -> list[Scalar]:
    """Heights of both rims, on the face and on the back."""
    shift = mirror.direction * mirror.thickness
    return [height + offset for height in mirror.rim_heights for offset in (0.0, shift)]


def _envelope_constraints(layout: Layout, values: Values, specification: Specification) -> list[Constraint]:
    top, bottom, radius = values["top"], values["bottom"], values["radius"]
    constraints = [
        Constraint("height of the mirror system", "mm", 1.0, specification.envelope_height - (top - bottom)),
        Constraint("diameter of the mirror system", "mm", 1.0, specification.envelope_diameter - 2.0 * radius),
        Constraint("bottom encloses the lens front", "mm", 1.0, specification.lens_front - bottom),
    ]
    for mirror in layout.mirrors:
        # A back is never lower than a face that looks down, nor higher than one that looks up.
        shift = mirror.direction * mirror.thickness
        above, below = (shift, 0.0) if mirror.direction > 0 else (0.0, shift)
        for rim, height in zip(("inner", "outer"), mirror.rim_heights, strict=True):
            where = f"the {rim} rim of the {mirror.name} mirror"
            constraints += [
                Constraint(f"top encloses {where}", "mm", 1.0, top - (height + above)),
                Constraint(f"bottom encloses {where}", "mm", 1.0, height + below - bottom),
            ]
        name = f"radius encloses the {mirror.name} mirror"
        constraints.append(Constraint(name, "mm", 1.0, radius - mirror.outer_radius))
    return constraints


def _fixed_constraints(
    variant: Variant, layout: Layout, paths: tuple[OpticalPath, ...], values: Values, fixed: Mapping[str, float]
) -> list[Constraint]:
    constraints = []
    for key, wanted in fixed.items():
        owner, _, quantity = key.partition(".")
        name = f"fixed {quantity} of the {owner}"
        if owner in {"upper", "lower"} and quantity in {"viewpoint_mm", "gain"}:
            path = next(path for path in paths if path.view == owner)
            if quantity == "viewpoint_mm":
                constraints.append(Constraint(f"{name} view", "mm", 1.0, path.viewpoint - wanted, equality=True))
            else:
                off = values[f"{owner}_gain"] / wanted - 1.0
                constraints.append(Constraint(f"{name} view", "(a share of it)", 0.01, off, equality=True))
            continue
        surface = next(mirror.surface for mirror in layout.mirrors if mirror.name == owner)
        unit, scale = _FIXED_UNITS[quantity]
        off = {
            "vertex_mm": lambda surface=surface, wanted=wanted: surface.vertex_height - wanted,
            "radius_mm": lambda surface=surface, wanted=wanted: surface.curvature * wanted - 1.0,
            "conic": lambda surface=surface, wanted=wanted: surface.conic_term / surface.curvature**2 - 1.0 - wanted,
        }[quantity]()
        constraints.append(Constraint(f"{name} mirror", unit, scale, off, equality=True))
    return constraints
