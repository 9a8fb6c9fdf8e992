"""The score: everything that can be said about one design without tracing a ray."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from pydantic import JsonValue

from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.depth import (
    FIRST_ORDER_BOUND,
    SECOND_ORDER_BOUND,
    StereoPair,
    Volume,
    depth_error_rms,
    depth_error_rms_second_order,
    depth_shift_per_scale_rms,
    noise_mm_of,
    second_order,
    stereo_pair_of,
    volume_of,
    worst_depth_error,
    worst_depth_shift_per_scale,
)
from designer.evaluate.fabrication import MirrorShape, mirror_shape, overall_diameter_mm, overall_height_mm
from designer.evaluate.fabrication_notes import fabrication_notes_on
from designer.evaluate.focus import FocusScore, focus_score
from designer.evaluate.housing import StrutsScore, TubeScore, housing_score
from designer.evaluate.limit import Arrangement, ImageBounds, depth_error_limit, limit_gains
from designer.evaluate.magnitudes import check_magnitudes
from designer.evaluate.points import PointScore, point_score
from designer.evaluate.resolution import (
    angular_resolution_px_per_deg,
    azimuthal_resolution_px_per_deg,
    image_rims,
    image_zones,
    quantisation_error_rms,
)
from designer.files import InputError, as_json, finite
from designer.optics.conversions import Shape
from designer.optics.image_law import image_law_of, widest_half_tangent
from designer.optics.view import elevation_tangents_of_views, half_angle_tangent

# Standard deviation of a number rounded to the nearest whole one.
ROUNDING_NOISE_PX = 1.0 / math.sqrt(12.0)


@dataclass(frozen=True, slots=True)
class DepthScore:
    """Relative depth errors over the working volume, and what the closed form allows.

    ``depth_error_rms`` is the score, of noise and scale together; it and ``depth_error_worst`` are first order, and
    valid (2 percent) if ``first_order_valid``; their ``_second_order`` companions if ``second_order_valid``; beyond
    that only a Monte Carlo is honest. ``depth_error_limit`` and ``limit_ratio`` are None where the outer zone leaves no
    room for the inner one; errors that would be infinite are None. ``depth_shift_per_scale`` is the rms over the
    working volume, and its ``_worst`` companion the largest value, of the relative depth shift per relative error of
    the image's scale.
    """

    depth_error_rms: float | None
    depth_error_worst: float | None
    first_order_valid: bool
    depth_error_rms_second_order: float | None
    depth_error_worst_second_order: float | None
    second_order_valid: bool
    depth_error_limit: float | None
    limit_ratio: float | None
    depth_shift_per_scale: float | None
    depth_shift_per_scale_worst: float | None

    def as_json(self) -> dict[str, JsonValue]:
        """The depth errors as a JSON object."""
        return {field.name: as_json(getattr(self, field.name)) for field in fields(self)}


@dataclass(frozen=True, slots=True)
class Quantisation:
    """Whole-pixel rounding by brute force beside first order at the same noise: the two should agree."""

    brute_force_rms: float | None
    first_order_rms: float | None


@dataclass(frozen=True, slots=True)
class AngularResolution:
    """Pixels per degree along the radius and along the circle, at one elevation of a view."""

    elevation_deg: float
    radial_px_per_deg: float
    azimuthal_px_per_deg: float


@dataclass(frozen=True, slots=True)
class MirrorScore:
    """One mirror as a workshop reads it; forms that do not exist for its kind are None."""

    name: str
    shape: Shape
    diameter_mm: float
    sag_mm: float
    sag_from_vertex_mm: float
    best_sphere_radius_mm: float | None
    sphere_departure_mm: float
    slope_deg: tuple[float, float]
    mass_g: float
    half_focal_distance_mm: float | None
    inverse_eccentricity: float | None
    baker_nayar_k: float | None
    semi_axis_a_mm: float | None
    semi_axis_b_mm: float | None
    eccentricity: float | None
    semi_latus_rectum_mm: float | None


@dataclass(frozen=True, slots=True)
class Score:
    """A design's score and a description of its views and mirrors.

    ``points`` are at the nearest and the farthest distance, ``resolution`` at the lowest, middle and highest elevation
    of each view. ``zones_px`` are the image radii of the elevations asked of each view, ``rims_px`` those of the edges
    of the first mirror on its path (None where infinite). ``fabrication_notes`` are sentences for whoever orders the
    mirrors.
    """

    depth: DepthScore
    focus: FocusScore | None
    quantisation: Quantisation
    points: tuple[PointScore, ...]
    resolution: Mapping[ViewName, tuple[AngularResolution, ...]]
    zones_px: Mapping[ViewName, tuple[float, float]]
    rims_px: Mapping[ViewName, tuple[float | None, float | None]]
    mirrors: tuple[MirrorScore, ...]
    height_mm: float
    diameter_mm: float
    fabrication_notes: tuple[str, ...]
    housing: TubeScore | StrutsScore | None = None

    def as_json(self) -> dict[str, JsonValue]:
        """The score as a design's file holds it: the depth errors stand beside the other keys."""
        parts = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "depth"}
        if self.housing is None:
            del parts["housing"]
        return self.depth.as_json() | {name: as_json(part) for name, part in parts.items()}


def evaluate_design(design: Design) -> Score:
    """Score a design and describe its views and mirrors; nothing is traced.

    Parameters
    ----------
    design
        Any design record, also one typed in by hand, whatever its score says.

    Raises
    ------
    InputError
        The design cannot be scored: a number of absurd size, no baseline, no gain, an inverted or empty volume, a view
        whose rays would reach the pinhole from behind, or a mirror cut beyond its equator.
    """
    check_scorable(design)
    with np.errstate(all="ignore"):
        pair, volume = stereo_pair_of(design), volume_of(design)
        return Score(
            depth=_depth_score(design, pair, volume),
            focus=focus_score(design),
            quantisation=_quantisation(design, pair, volume),
            points=tuple(point_score(design, distance) for distance in design.working_volume.distance_mm),
            resolution={name: _resolution(design, name) for name in VIEW_NAMES},
            zones_px={name: image_zones(design)[name] for name in VIEW_NAMES},
            rims_px={name: _finite_pair(image_rims(design)[name]) for name in VIEW_NAMES},
            mirrors=tuple(_mirror_score(mirror_shape(design, mirror.name)) for mirror in design.mirrors),
            height_mm=overall_height_mm(design),
            diameter_mm=overall_diameter_mm(design),
            fabrication_notes=tuple(fabrication_notes_on(design)),
            housing=housing_score(design),
        )


def depth_score(design: Design) -> DepthScore:
    """The depth errors alone; raises as :func:`evaluate_design`."""
    check_scorable(design)
    with np.errstate(all="ignore"):
        return _depth_score(design, stereo_pair_of(design), volume_of(design))


def recorded_fabrication_notes(design: Design) -> tuple[str, ...]:
    """The fabrication notes that a design's file holds; files of version 0.1 call them remarks."""
    notes = design.score.get("fabrication_notes", design.score.get("remarks"))
    return tuple(str(note) for note in notes) if isinstance(notes, list) else ()


def _depth_score(design: Design, pair: StereoPair, volume: Volume) -> DepthScore:
    uncertainties = (noise_mm_of(design), design.scale_uncertainty)
    rms = float(depth_error_rms(pair, volume, *uncertainties))
    worst = worst_depth_error(pair, volume, *uncertainties)
    limit = limit_of_design(design)
    return DepthScore(
        depth_error_rms=finite(rms),
        depth_error_worst=finite(worst),
        first_order_valid=worst <= FIRST_ORDER_BOUND,
        depth_error_rms_second_order=finite(depth_error_rms_second_order(pair, volume, *uncertainties)),
        depth_error_worst_second_order=finite(second_order(worst)),
        second_order_valid=worst <= SECOND_ORDER_BOUND,
        depth_error_limit=limit,
        limit_ratio=None if limit is None else finite(rms / limit),
        depth_shift_per_scale=finite(depth_shift_per_scale_rms(pair, volume)),
        depth_shift_per_scale_worst=finite(worst_depth_shift_per_scale(pair, volume)),
    )


def check_scorable(design: Design) -> None:
    """Raise InputError, naming key and value, for a design whose numbers describe no stereo pair."""
    check_magnitudes(design)
    low, high = design.working_volume.elevation_deg
    near, far = design.working_volume.distance_mm
    if design.baseline_mm <= 0:
        raise InputError(f"baseline_mm = {design.baseline_mm:g}: must be above zero")
    if not -90 < low < high < 90:
        raise InputError(f"working_volume.elevation_deg = [{low:g}, {high:g}]: must be increasing, between -90 and 90")
    if not 0 < near < far:
        raise InputError(f"working_volume.distance_mm = [{near:g}, {far:g}]: must be increasing and above zero")
    check_image_law(design)
    slopes = (math.tan(math.radians(low)), math.tan(math.radians(high)))
    ranges = elevation_tangents_of_views(slopes, (near, far), design.baseline_mm)
    for name, view in design.views.by_name.items():
        if view.gain == 0:
            raise InputError(f"views.{name}.gain = 0: must not be zero")
        if not -90 < view.elevation_deg[0] < view.elevation_deg[1] < 90:
            raise InputError(
                f"views.{name}.elevation_deg = {list(view.elevation_deg)}: must be increasing, between -90 and 90"
            )
        ends = [*ranges[name], *(math.tan(math.radians(end)) for end in view.elevation_deg)]
        if any(abs(view.gain) * half_angle_tangent(end, view.sense) >= 1 for end in ends):
            raise InputError(f"views.{name}.gain = {view.gain:g}: its rays would reach the pinhole from behind")


def check_image_law(design: Design) -> None:
    """Raise InputError for a lens whose image radius stops rising before the edge of the image circle."""
    camera, law = design.camera, image_law_of(design.camera)
    if law.is_perspective:
        return
    reached = float(law.ratio(widest_half_tangent(law))) * camera.focal_length_mm
    if not reached > camera.image_radius_mm:
        key = "distortion" if camera.distortion else "projection"
        raise InputError(
            f"camera.{key}: the image radius rises up to {reached:.4g} mm only, at {math.degrees(law.widest):.4g} "
            f"degrees; the image circle's is {camera.image_radius_mm:.4g} mm"
        )


def limit_of_design(design: Design) -> float | None:
    """The closed-form limit at the design's own baseline, principal distance, zones and gap; None if no room."""
    camera = design.camera
    arrangement = Arrangement(
        sense_lower=design.views.lower.sense,
        sense_upper=design.views.upper.sense,
        outer_view=design.views.outer,
    )
    law = image_law_of(camera)
    bounds = ImageBounds(camera.image_radius_mm, design.zone_gap_px * camera.pixel_pitch_mm, law)
    at = (arrangement, volume_of(design), design.baseline_mm, camera.focal_length_mm, bounds)
    gains = limit_gains(*at)
    if min(gains.lower, gains.upper) <= 0:
        return None
    return float(depth_error_limit(*at, noise_mm_of(design), design.scale_uncertainty))


def _quantisation(design: Design, pair: StereoPair, volume: Volume) -> Quantisation:
    first_order = float(depth_error_rms(pair, volume, ROUNDING_NOISE_PX * design.camera.pixel_pitch_mm))
    return Quantisation(finite(quantisation_error_rms(design)), finite(first_order))


def _resolution(design: Design, view_name: ViewName) -> tuple[AngularResolution, ...]:
    view = design.views.by_name[view_name]
    low, high = view.elevation_deg
    elevations = np.array([low, (low + high) / 2.0, high])
    radial = angular_resolution_px_per_deg(design, view_name, elevations)
    azimuthal = azimuthal_resolution_px_per_deg(design, view_name, elevations)
    return tuple(
        AngularResolution(float(elevation), float(along), float(across))
        for elevation, along, across in zip(elevations, radial, azimuthal, strict=True)
    )


def _mirror_score(shape: MirrorShape) -> MirrorScore:
    focal, nayar, axes, eccentricity = shape.focal, shape.baker_nayar, shape.semi_axes, shape.eccentricity
    return MirrorScore(
        name=shape.name,
        shape=shape.shape,
        diameter_mm=shape.diameter_mm,
        sag_mm=shape.sag_mm,
        sag_from_vertex_mm=shape.sag_from_vertex_mm,
        best_sphere_radius_mm=shape.best_sphere_radius_mm,
        sphere_departure_mm=shape.sphere_departure_mm,
        slope_deg=shape.slope_deg,
        mass_g=shape.mass_g,
        half_focal_distance_mm=focal.half_focal_distance if focal else None,
        inverse_eccentricity=focal.inverse_eccentricity if focal else None,
        baker_nayar_k=nayar.k if nayar else None,
        semi_axis_a_mm=axes.a if axes else None,
        semi_axis_b_mm=axes.b if axes else None,
        eccentricity=eccentricity.eccentricity if eccentricity else None,
        semi_latus_rectum_mm=eccentricity.semi_latus_rectum if eccentricity else None,
    )


def _finite_pair(values: tuple[float, float]) -> tuple[float | None, float | None]:
    return finite(values[0]), finite(values[1])
