"""From a variant's variables to a whole system: its views, paths of light, layout, and what goals are measured on.

Written once for floats, NumPy arrays (screening, independent evaluation) and CasADi symbols (the program).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from designer.design import PerView, ViewName
from designer.evaluate.depth import NoiseModel, StereoPair, Volume
from designer.evaluate.predicted_noise import noise_model
from designer.optics.backend import Scalar, absolute, maximum, tan
from designer.optics.conic import FocalConic
from designer.optics.focus import (
    ChiefRay,
    FocusedLens,
    LightPath,
    chief_ray,
    light_path_of_layout,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from designer.optics.layout import Layout, OpticalPath, Reflection, Surroundings, lay_out
from designer.optics.overall_size import Sight, housing_about
from designer.optics.view import elevation_tangents_of_views, half_angle_tangent, image_radius_slope
from designer.optics.width import widened
from designer.optimise.limit import conditions_of, volume_of
from designer.optimise.required_numbers import Specification
from designer.optimise.variants import Variant

Values = Mapping[str, Scalar]
"""The physical variables of a variant by name; see :data:`designer.optimise.variables.VARIABLES`."""

Slopes = tuple[Scalar, Scalar]
"""Lowest and highest tan(phi) of a view."""


@dataclass(frozen=True, slots=True)
class Blur:
    """The blur of one view at one slope of its range (0 lowest, 1 middle, 2 highest) and one distance.

    ``reciprocal_depth`` is 1 / z_V of the virtual image in 1/mm. ``along`` and ``across`` are the signed diameters of
    the blur on the sensor in mm, along the radius and across it; None for the same through a perspective lens.
    ``image_scale`` is what a radian of elevation measures there on the sensor, mm.
    """

    view: ViewName
    place: int
    reciprocal_depth: Scalar
    along: Scalar
    across: Scalar | None
    image_scale: Scalar

    @property
    def on_sensor(self) -> Scalar:
        """Diameter of the blur on the sensor, the larger of the two, mm."""
        if self.across is None:
            return absolute(self.along)
        return maximum(absolute(self.along), absolute(self.across))

    @property
    def in_scene(self) -> Scalar:
        """The blur as a signed angle of elevation, radians."""
        return self.along / self.image_scale


@dataclass(frozen=True, slots=True)
class System:
    """A system put together: what constraints and goals are evaluated on.

    Attributes
    ----------
    variant, values, specification
        What it was put together from.
    slopes
        Lowest and highest tan(phi) that each view needs, by the view's name.
    lens
        The lens as it is focused and stopped down.
    light
        What focusing needs of each view, by its name.
    blurs
        The blur of both views at the ends and the middle of their elevations, near and far.
    paths
        The lower and the upper view's path, as wide as the light of the full pupil.
    layout
        Mirrors, legs of light and solids.
    """

    variant: Variant
    values: Values
    specification: Specification
    slopes: PerView[Slopes]
    lens: FocusedLens
    light: Mapping[ViewName, LightPath]
    blurs: tuple[Blur, ...]
    paths: tuple[OpticalPath, OpticalPath]
    layout: Layout

    def largest_blur_at_end(self, view: ViewName, end: int) -> Scalar:
        """Extent along the radius of the larger blur, near or far, at a zone's inner (0) or outer (1) end, mm."""
        # A folded view has its highest elevation inside.
        place = 2 if (end == 1) == (self.variant.sense(view) == "direct") else 0
        near, far = (blur for blur in self.blurs if blur.view == view and blur.place == place)
        return maximum(absolute(near.along), absolute(far.along))

    @property
    def pair(self) -> StereoPair:
        """The two views as the depth error has them."""
        return StereoPair(
            self.values["lower_gain"],
            self.variant.sense("lower"),
            self.values["upper_gain"],
            self.variant.sense("upper"),
            self.values["baseline"],
            self.values["principal_distance"],
            self.specification.law,
        )

    @property
    def sights(self) -> tuple[Sight, ...]:
        """What each view looks through a tube at."""
        return tuple(Sight(path.viewpoint, self.slopes[path.view]) for path in self.paths)

    @property
    def volume(self) -> Volume:
        """The working volume."""
        return volume_of(self.specification)

    @property
    def noise(self) -> NoiseModel:
        """Standard deviation of an image point in each view, mm on the sensor, wherever it lies."""
        return noise_model(conditions_of(self.specification), self.pair, self.lens, self.light)

    @property
    def scale_uncertainty(self) -> Scalar:
        """Relative standard uncertainty of the image's scale."""
        return self.specification.scale_uncertainty

    @property
    def height(self) -> Scalar:
        """Overall height by the variables that enclose the mirrors, mm."""
        return self.values["top"] - self.values["bottom"]

    @property
    def diameter(self) -> Scalar:
        """Overall diameter by the variable that encloses the mirrors, mm."""
        return 2.0 * self.values["radius"]


def put_together(variant: Variant, values: Values, specification: Specification) -> System:
    """Put a system together; the secondary's variables are ignored for direct configurations."""
    slopes = _needed_slopes(values, specification)
    lens = FocusedLens(values["principal_distance"], values["f_number"], values["reciprocal_focus"], specification.law)
    paths, blurs, light_paths = [], [], {}
    for chief in _paths(variant, values, slopes):
        light = light_path_of_layout(chief, values[f"{chief.view}_gain"], variant.sense(chief.view))
        light_paths[chief.view] = light
        rays = [chief_ray(light, slope) for slope in _sampled(slopes[chief.view])]
        ends = (rays[0], rays[2]) if light.sense == "direct" else (rays[2], rays[0])
        paths.append(widened(chief, ends, lens.pupil_diameter / 2.0, specification.distances))
        blurs += [
            blur
            for place, ray in enumerate(rays)
            for blur in _blurs(chief.view, place, light, ray, lens, specification.distances)
        ]
    layout = lay_out(tuple(paths), _sides(variant), _surroundings(specification))
    return System(variant, values, specification, slopes, lens, light_paths, tuple(blurs), (paths[0], paths[1]), layout)


def _blurs(
    view: ViewName, place: int, light: LightPath, ray: ChiefRay, lens: FocusedLens, distances: tuple[Scalar, Scalar]
) -> list[Blur]:
    """The blur along one chief ray, near and far."""
    scale = absolute(image_radius_slope(ray.slope, light.gain, lens.principal_distance, light.sense, lens.law))
    depths = [reciprocal_image_depth(ray, reciprocal_along_ray(ray.slope, distance)) for distance in distances]
    blurs = [lens.blur(depth) for depth in depths]
    if lens.law.is_perspective:
        return [Blur(view, place, depth, blur, None, scale) for depth, blur in zip(depths, blurs, strict=True)]
    along, across = lens.law.stretch(ray.half_tangent)
    return [
        Blur(view, place, depth, blur * along, blur * across, scale) for depth, blur in zip(depths, blurs, strict=True)
    ]


def enclosure(system: System) -> dict[str, Scalar]:
    """Top, bottom and radius of a head as they are (docs/theory.md, section 7), for floats and arrays."""
    asked = system.specification
    size = system.layout.size(asked.lens_front)
    if asked.housing == "none":
        return {"top": size.top, "bottom": size.bottom, "radius": size.radius}
    sights = system.sights if asked.housing == "tube" else ()
    ring = housing_about(size, asked.lens_radius, asked.housing_gap, asked.housing_thickness, sights)
    return {"top": ring.high, "bottom": ring.low, "radius": ring.outer_radius}


def zone_tangents(variant: Variant, view: ViewName, slopes: Slopes) -> tuple[Scalar, Scalar]:
    """Half-angle tangents of the zone's inner and outer end: a folded view has its highest elevation inside."""
    sense = variant.sense(view)
    inner, outer = slopes if sense == "direct" else (slopes[1], slopes[0])
    return half_angle_tangent(inner, sense), half_angle_tangent(outer, sense)


def _sampled(slopes: Slopes) -> tuple[Scalar, Scalar, Scalar]:
    """Lowest, middle and highest slope."""
    return slopes[0], (slopes[0] + slopes[1]) / 2.0, slopes[1]


def _needed_slopes(values: Values, specification: Specification) -> PerView[Slopes]:
    low, high = specification.elevations
    return elevation_tangents_of_views((tan(low), tan(high)), specification.distances, values["baseline"])


def _paths(variant: Variant, values: Values, slopes: PerView[Slopes]) -> tuple[OpticalPath, OpticalPath]:
    upper = _direct_path(variant, "upper", values, slopes["upper"])
    if variant.fold is None:
        return _direct_path(variant, "lower", values, slopes["lower"]), upper
    return _folded_path(variant, values, slopes["lower"]), upper


def _direct_path(variant: Variant, view: ViewName, values: Values, slopes: Slopes) -> OpticalPath:
    gain = values[f"{view}_gain"]
    viewpoint = values["lower_viewpoint"] + (values["baseline"] if view == "upper" else 0.0)
    tangents = zone_tangents(variant, view, slopes)
    conic = FocalConic(0.0, viewpoint / (1.0 + gain), 1.0 / gain)
    crossing = viewpoint if variant.crosses_at_viewpoint(view) else None
    at_pinhole = (gain * tangents[0], gain * tangents[1])
    reflection = Reflection(variant.last_mirror(view), 1, conic, at_pinhole, crossing)
    return OpticalPath(view, viewpoint, slopes, (reflection,))


def _folded_path(variant: Variant, values: Values, slopes: Slopes) -> OpticalPath:
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
    tangents = zone_tangents(variant, "lower", slopes)
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
        specification.asked.manufacture.substrate_thickness_mm,
        specification.asked.manufacture.edge_margin_mm,
        specification.lens_radius,
        specification.lens_front,
        specification.lens_length,
        specification.asked.camera.body_radius_mm,
        specification.reach_radius,
    )
