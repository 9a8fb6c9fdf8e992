"""Depth error of any two views, from traced rays of the same scene point (docs/comparators.md).

At a horizontal distance D the rays of the two views pass heights h_l and h_u; the point lies where both are equal. A
match that is off by dr in a view displaces its ray by dr / a there, with a = dr/dh at that distance, and the point by

    dD = -(dr_l / a_l - dr_u / a_u) / (m_l - m_u)

with the slopes m of the two rays. Where both views have single viewpoints this is docs/theory.md, section 5: there
a = (dr/dphi) / (D (1 + m^2)) and 1 / (m_l - m_u) = D / b. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.comparators.sight import SceneView, Sight
from designer.design import PerView
from designer.evaluate.depth import Volume, rms_over_volume, volume_grid
from designer.evaluate.noise import CameraSetting, ImagePoint, matching_noise
from designer.evaluate.predicted_noise import Conditions
from designer.optics.backend import Scalar
from designer.optics.illumination import relative_illumination
from designer.trace.arrays import Array
from designer.trace.image_law import stretches


@dataclass(frozen=True, slots=True)
class Azimuth:
    """An azimuth in radians at which a rig is scored, and its weight; the weights of all add up to 1."""

    angle: float
    weight: float


@dataclass(frozen=True, slots=True)
class Rig:
    """Two views of one scene.

    ``middle_mm`` is the height of the middle of the baseline, from which elevations are seen. With one camera an error
    of the image's scale is the same in both views; with two cameras it is independent in each. ``azimuths`` are those
    at which the depth error is averaged: one for a rig that is round.
    """

    lower: SceneView
    upper: SceneView
    middle_mm: float
    has_one_camera: bool = True
    azimuths: tuple[Azimuth, ...] = (Azimuth(0.0, 1.0),)


def depth_error_rms(rig: Rig, volume: Volume, conditions: Conditions, scale_uncertainty: float) -> float:
    """Root mean square of sigma_D / D over the working volume, averaged as the study's score; NaN if a view is cut."""

    def squared(azimuth: Azimuth) -> float:
        def error_at(slopes: Array, distances: Array) -> Array:
            return relative_errors(rig, slopes, distances, conditions, scale_uncertainty, azimuth.angle)

        return float(rms_over_volume(volume, error_at)) ** 2

    return float(np.sqrt(sum(azimuth.weight * squared(azimuth) for azimuth in rig.azimuths)))


def worst_depth_error(rig: Rig, volume: Volume, conditions: Conditions, scale_uncertainty: float) -> float:
    """The largest sigma_D / D on a grid over the working volume that includes its corners."""
    elevations, distances = volume_grid(volume, 17, 9)
    slopes, distances = (part.ravel() for part in np.broadcast_arrays(np.tan(elevations), distances))
    return max(
        float(np.max(relative_errors(rig, slopes, distances, conditions, scale_uncertainty, azimuth.angle)))
        for azimuth in rig.azimuths
    )


def relative_errors(
    rig: Rig, slopes: Array, distances: Array, conditions: Conditions, scale_uncertainty: float, azimuth: float = 0.0
) -> Array:
    """sigma_D / D, to first order, at points (n,) given by tan(elevation) from the middle and by distance."""
    shape = np.broadcast_shapes(np.shape(slopes), np.shape(distances))
    flat_slopes, flat = (np.broadcast_to(part, shape).ravel() for part in (slopes, distances))
    heights = rig.middle_mm + flat_slopes * flat
    lower, upper = (view.sight(flat, heights, azimuth) for view in (rig.lower, rig.upper))
    with np.errstate(all="ignore"):
        noise_lower, noise_upper = _noise(rig, lower, upper, flat, conditions)
        disparity = (lower.slope - upper.slope) * flat
        matched = np.hypot(noise_lower / lower.along, noise_upper / upper.along)
        shift_lower, shift_upper = lower.place / lower.along, upper.place / upper.along
        scaled = shift_lower - shift_upper if rig.has_one_camera else np.hypot(shift_lower, shift_upper)
        error = np.hypot(matched, scale_uncertainty * scaled) / disparity
    return np.asarray(np.where(disparity > 0.0, error, np.nan)).reshape(shape)


def _noise(rig: Rig, lower: Sight, upper: Sight, distances: Array, conditions: Conditions) -> tuple[Array, Array]:
    """Standard deviations of the image place in mm on the sensor, in the lower and in the upper view."""
    constant = np.full(distances.shape, float(conditions.constant))
    if not conditions.predicted_share:
        return constant, constant
    points = PerView(
        lower=_image_point(rig.lower, lower, distances, float(conditions.mirror_reflectivity)),
        upper=_image_point(rig.upper, upper, distances, float(conditions.mirror_reflectivity)),
    )

    def matched_through(view: SceneView) -> PerView[Scalar]:
        setting = CameraSetting(
            float(conditions.pixel_pitch), view.camera.f_number, wavelength=float(conditions.wavelength)
        )
        return matching_noise(points, distances, conditions.texture, conditions.light, setting, conditions.matching)

    # Two cameras may be stopped down differently: each view's noise is that of its own setting.
    through_lower = matched_through(rig.lower)
    through_upper = through_lower if rig.has_one_camera else matched_through(rig.upper)
    return np.hypot(constant, through_lower.lower), np.hypot(constant, through_upper.upper)


def _image_point(view: SceneView, sight: Sight, distances: Array, reflectivity: float) -> ImagePoint:
    along, across = stretches(view.camera, sight.psi)
    return ImagePoint(
        slope=sight.slope,
        radius=sight.across * distances,
        radius_slope=sight.along * distances * (1.0 + sight.slope**2),
        # The blurs along and across differ where a mirror has no foci: as stretches of a disc of 1 mm.
        defocus=1.0,
        illumination=relative_illumination(np.cos(sight.psi), view.reflections, reflectivity, along * across),
        stretch=(sight.disc_along, sight.disc_across),
    )
