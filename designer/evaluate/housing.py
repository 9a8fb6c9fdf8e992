"""What a housing does to a design: the shift of rays by a tube's wall and all that follows, azimuths behind struts.

Nothing here is traced. Lengths in mm, angles in degrees where a name says so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.depth import depth_error_map, noise_mm_of, stereo_pair_of, volume_of
from designer.evaluate.fabrication import ALUMINIUM_G_PER_MM3
from designer.housing import MATERIALS, Struts, Tube
from designer.optics.focus import (
    chief_ray,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from designer.optics.tube import (
    Wall,
    apparent_distances,
    shift_along_axis,
    slope_towards,
    transmitted,
    uncorrected_bias,
    wall_of,
)

Array = NDArray[np.float64]

ELEVATIONS = 33


@dataclass(frozen=True, slots=True)
class DepthBias:
    """The largest bias of depth at one distance where the wall is not corrected for, over the volume's elevations.

    ``bias_mm`` is negative for a point that comes out too near; ``bias_in_sigma`` is the largest in units of the
    predicted standard deviation of the same point. None where a number is not finite, as for points within the tube.
    """

    distance_mm: float
    bias_mm: float | None
    bias_in_sigma: float | None


@dataclass(frozen=True, slots=True)
class TubeScore:
    """A transparent tube, and what it does to what is seen through it.

    ``shift_mm`` are the least and the greatest shift of a ray along the axis over the elevations of each view, upwards
    positive, and ``smear_mm`` the difference: the length over which the wall spreads the viewpoint. Image columns are
    not changed. ``uncorrected_bias`` is that of depth at the nearest and the farthest distance. ``largest_blur_px`` is
    the largest blur through lens and wall, at the recorded focus; None where the record does not yield it.
    ``transmitted`` are the least and the greatest share of light that passes, by Fresnel's equations.
    """

    kind: Literal["tube"]
    outer_diameter_mm: float
    wall_mm: float
    length_mm: float
    refractive_index: float
    mass_g: float | None
    shift_mm: Mapping[ViewName, tuple[float, float]]
    smear_mm: Mapping[ViewName, float]
    uncorrected_bias: tuple[DepthBias, ...]
    largest_blur_px: float | None
    transmitted: tuple[float, float]

    @property
    def nearest_bias_mm(self) -> float | None:
        """The uncorrected bias at the nearest distance."""
        return self.uncorrected_bias[0].bias_mm


@dataclass(frozen=True, slots=True)
class StrutsScore:
    """Struts, and the azimuths that they hide: of each of them ``blocked_deg``, in all the share ``blocked_share``."""

    kind: Literal["struts"]
    number: int
    width_mm: float
    radius_mm: float
    length_mm: float
    mass_g: float
    azimuths_deg: tuple[float, ...]
    blocked_deg: float
    blocked_share: float


def housing_score(design: Design) -> TubeScore | StrutsScore | None:
    """What a design's housing is and does; None for a design without one."""
    housing = design.housing
    if isinstance(housing, Struts):
        return StrutsScore(
            kind="struts",
            number=housing.number,
            width_mm=housing.width_mm,
            radius_mm=housing.radius_mm,
            length_mm=housing.length_mm,
            mass_g=housing_mass_g(housing) or 0.0,
            azimuths_deg=housing.azimuths_deg,
            blocked_deg=2.0 * housing.half_width_deg,
            blocked_share=housing.blocked_share,
        )
    if housing is None:
        return None
    with np.errstate(all="ignore"):
        return _tube_score(design, housing)


def housing_mass_g(housing: Tube | Struts) -> float | None:
    """Mass of a tube, or of struts of aluminium; None for a tube of unknown material."""
    if isinstance(housing, Struts):
        return housing.volume_mm3 * ALUMINIUM_G_PER_MM3
    material = MATERIALS.get(housing.material)
    return None if material is None else housing.volume_mm3 * material.density_g_per_mm3


def depth_bias_at(design: Design, distance_mm: float) -> DepthBias:
    """The largest bias at one distance of a design with a tube; see :class:`DepthBias`."""
    wall = wall_of(design)
    assert wall is not None
    pair, volume = stereo_pair_of(design), volume_of(design)
    elevations = np.linspace(*volume.elevations, ELEVATIONS)
    rises = distance_mm * np.tan(elevations)
    lower, upper = (slope_towards(rises + side * design.baseline_mm / 2.0, distance_mm, wall) for side in (1.0, -1.0))
    biases = np.asarray(uncorrected_bias(lower, upper, wall))
    if not np.isfinite(biases).all() or distance_mm <= design.diameter_mm / 2.0:
        return DepthBias(distance_mm, None, None)
    errors = depth_error_map(pair, elevations, np.array(distance_mm), noise_mm_of(design), design.scale_uncertainty)
    in_sigma = biases / (errors * distance_mm)
    return DepthBias(distance_mm, _largest(biases), _largest(in_sigma) if np.isfinite(in_sigma).all() else None)


def _largest(values: Array) -> float:
    """The value of largest magnitude, with its sign."""
    return float(values[np.argmax(np.abs(values))])


def largest_blur_px(design: Design) -> float | None:
    """Largest blur of both views through the lens and, if there is one, the wall of the tube; None if unknown.

    Over recorded elevations at the nearest and the farthest distance, the larger diameter of the ellipse: along the
    radius the wall acts as a plate, across it as a diverging lens.
    """
    try:
        with np.errstate(all="ignore"):
            largest = max(float(np.max(np.abs(blurs_mm(design, name)))) for name in VIEW_NAMES)
    except (ValueError, ArithmeticError):
        return None
    return largest / design.camera.pixel_pitch_mm if math.isfinite(largest) else None


def blurs_mm(design: Design, name: ViewName) -> Array:
    """Signed blurs (2, n, k) on the sensor, mm, along and across the radius, at n elevations and the two distances."""
    wall, lens = wall_of(design), lens_of_camera(design.camera)
    path = light_path_of_design(design, name)
    slope = np.tan(np.radians(np.linspace(*design.views.by_name[name].elevation_deg, ELEVATIONS)))[:, None]
    ray = chief_ray(path, slope)
    distances = np.broadcast_to(np.array(design.working_volume.distance_mm), (ELEVATIONS, 2))
    seen = (distances, distances)
    if wall is not None and design.tube is not None:
        seen = apparent_distances(slope, distances, design.tube.inner_radius_mm, wall)
    blurs = [lens.blur(reciprocal_image_depth(ray, reciprocal_along_ray(slope, each))) for each in seen]
    return np.stack([blur * stretch for blur, stretch in zip(blurs, lens.law.stretch(ray.half_tangent), strict=True)])


def _tube_score(design: Design, tube: Tube) -> TubeScore:
    wall = Wall(tube.wall_mm, tube.refractive_index)
    slopes = {
        name: np.tan(np.radians(np.linspace(*view.elevation_deg, ELEVATIONS)))
        for name, view in design.views.by_name.items()
    }
    shifts = {name: shift_along_axis(slope, wall) for name, slope in slopes.items()}
    passed = np.concatenate([transmitted(slope, tube.refractive_index) for slope in slopes.values()])
    return TubeScore(
        kind="tube",
        outer_diameter_mm=2.0 * tube.outer_radius_mm,
        wall_mm=tube.wall_mm,
        length_mm=tube.length_mm,
        refractive_index=tube.refractive_index,
        mass_g=housing_mass_g(tube),
        shift_mm={name: (float(np.min(shift)), float(np.max(shift))) for name, shift in shifts.items()},
        smear_mm={name: float(np.ptp(shift)) for name, shift in shifts.items()},
        uncorrected_bias=tuple(depth_bias_at(design, distance) for distance in design.working_volume.distance_mm),
        largest_blur_px=largest_blur_px(design),
        transmitted=(float(passed.min()), float(passed.max())),
    )
