"""Depth error of a stereo pair of views (docs/theory.md, section 5): first order, and what the second adds.

A point at horizontal distance D is seen by the lower viewpoint at slope m_l = tan(phi_l) and by the upper one at
m_u, and D = b / (m_l - m_u). With noise sigma_r in the image radius of each view, independent in the two,

    sigma_D / D = (D / b) sqrt(sigma_ml^2 + sigma_mu^2),   sigma_m = sigma_r (1 + m^2) / |dr/dphi|

To this comes the share of an image scale that is known only to a relative standard uncertainty u: as a systematic part,
u times the shift of :mod:`designer.evaluate.scale`, it is added in quadrature. The score is the root mean square of
sigma_D / D over the working volume, uniform in elevation (seen from the middle of the baseline) and log-uniform in
distance. First order takes D for linear in the noise, but it is the reciprocal of
the disparity m_l - m_u: see :func:`second_order`. Functions down to :func:`depth_error_rms` take floats, NumPy arrays
or CasADi symbols; the rest take floats and arrays. Lengths in mm, angles in radians. Where a view's gain carries a
ray beyond 90 degrees at the pinhole the numbers mean nothing; no zone inside an image circle does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design, PerView, Sense
from designer.evaluate.scale import relative_depth_shift_per_scale
from designer.optics.backend import Scalar, is_symbolic, row_by_row, sqrt, stack, tan, total
from designer.optics.image_law import PERSPECTIVE, ImageLaw, image_law_of
from designer.optics.view import (
    elevation_tangent,
    half_angle_tangent,
    image_half_tangent,
    image_radius,
    image_radius_slope,
)

# Gauss-Legendre nodes that hold the score to 1e-3 from -70 to 70 degrees and up to far / near = 30 (see the tests).
ELEVATION_NODES = 5
DISTANCE_NODES = 4

# The sigma_D / D at which first order, and first and second order together, are 2 percent off (see the tests).
FIRST_ORDER_BOUND = 0.065
SECOND_ORDER_BOUND = 0.149
# Fourth powers of the distance need more nodes than squares do.
SECOND_ORDER_NODES = 16


@dataclass(frozen=True, slots=True)
class StereoPair:
    """All that depth depends on: gains and senses of two views, baseline and principal distance (mm), the law."""

    gain_lower: Scalar
    sense_lower: Sense
    gain_upper: Scalar
    sense_upper: Sense
    baseline: Scalar
    principal_distance: Scalar
    law: ImageLaw = PERSPECTIVE


NoiseModel = Callable[[PerView[Scalar], Scalar], PerView[Scalar]]
"""Noise of the image radius, mm on the sensor, in each view, at the slopes of both and a distance."""


@dataclass(frozen=True, slots=True)
class Volume:
    """A working volume: elevations (rad) seen from the middle of the baseline, horizontal distances (mm) from the axis.

    Both as (low, high).
    """

    elevations: tuple[Scalar, Scalar]
    distances: tuple[Scalar, Scalar]


def stereo_pair_of(design: Design) -> StereoPair:
    """The stereo pair of a finished design."""
    lower, upper = design.views.lower, design.views.upper
    return StereoPair(
        gain_lower=lower.gain,
        sense_lower=lower.sense,
        gain_upper=upper.gain,
        sense_upper=upper.sense,
        baseline=design.baseline_mm,
        principal_distance=design.camera.focal_length_mm,
        law=image_law_of(design.camera),
    )


def volume_of(design: Design) -> Volume:
    """The working volume that a design was made for."""
    low_deg, high_deg = design.working_volume.elevation_deg
    return Volume((float(np.radians(low_deg)), float(np.radians(high_deg))), design.working_volume.distance_mm)


def noise_mm_of(design: Design) -> float:
    """The design's pixel noise as a length on the sensor."""
    return design.noise_px * design.camera.pixel_pitch_mm


def slope_error(
    slope: Scalar,
    gain: Scalar,
    sense: Sense,
    principal_distance: Scalar,
    noise_mm: Scalar,
    law: ImageLaw = PERSPECTIVE,
) -> Scalar:
    """Standard deviation of m = tan(phi) for noise of ``noise_mm`` in the image radius; carries the sign of dm/dr."""
    return noise_mm * (1.0 + slope * slope) / image_radius_slope(slope, gain, principal_distance, sense, law)


def depth_error_of_slopes(pair: StereoPair, slopes: PerView[Scalar], noise_mm: Scalar | PerView[Scalar]) -> Scalar:
    """sigma_D / D by noise alone, to first order, of the point that the views see at the given slopes.

    Parameters
    ----------
    slopes
        tan(phi) at each viewpoint; the distance is baseline / (lower - upper).
    noise_mm
        Standard deviation of the image radius, in mm on the sensor: of both views alike, or of each.
    """
    noise = noise_mm if isinstance(noise_mm, PerView) else PerView(lower=noise_mm, upper=noise_mm)
    principal_distance, law = pair.principal_distance, pair.law
    error_lower = slope_error(slopes.lower, pair.gain_lower, pair.sense_lower, principal_distance, noise.lower, law)
    error_upper = slope_error(slopes.upper, pair.gain_upper, pair.sense_upper, principal_distance, noise.upper, law)
    distance_per_baseline = 1.0 / (slopes.lower - slopes.upper)
    # sqrt(x^2 + y^2) of the two never vanishes, so its derivative stays finite for the optimiser.
    return distance_per_baseline * sqrt(error_lower * error_lower + error_upper * error_upper)


def slopes_of_point(elevation_slope: Scalar, distance: Scalar, baseline: Scalar) -> PerView[Scalar]:
    """tan(phi) at either viewpoint of a point given by tan(elevation) from the middle and D."""
    parallax = baseline / (2.0 * distance)
    return PerView(lower=elevation_slope + parallax, upper=elevation_slope - parallax)


def depth_error_rms(
    pair: StereoPair, volume: Volume, noise_mm: Scalar | NoiseModel, scale_uncertainty: Scalar = 0.0
) -> Scalar:
    """Root mean square of sigma_D / D over the working volume: the score.

    Of the noise of the image radius, in mm on the sensor, and of the relative standard uncertainty of the image's
    scale. Uniform in elevation, log-uniform in distance. Broadcasts over arrays of designs: gains, baseline, principal
    distance and volume may have shape (n,).
    """

    def error_at(slopes: Scalar, distances: Scalar) -> Scalar:
        return _relative_depth_error_at(pair, slopes, distances, noise_mm, scale_uncertainty)

    given = [*_numbers_of(pair), scale_uncertainty, *([] if callable(noise_mm) else [noise_mm])]
    return rms_over_volume(volume, error_at, given)


def depth_shift_per_scale_rms(pair: StereoPair, volume: Volume) -> Scalar:
    """Root mean square of :func:`depth_shift_per_scale` over the working volume, averaged as the score is.

    Times the uncertainty of the scale it is the systematic part of the score. Broadcasts over arrays of designs.
    """
    return rms_over_volume(
        volume, lambda slopes, distances: depth_shift_per_scale(pair, slopes, distances), _numbers_of(pair)
    )


def rms_over_volume(
    volume: Volume, value_at: Callable[[Scalar, Scalar], Scalar], given: Sequence[Scalar] = ()
) -> Scalar:
    """Root mean square over a volume of a value that depends on tan(elevation), distance and whatever is ``given``.

    By tensor Gauss-Legendre quadrature in the logarithms of the distance and of t = tan(pi/4 + elevation/2): the depth
    error is a short sum of powers of t, so few nodes hold it even for steep volumes.
    """
    near, far = volume.distances
    low, high = (half_angle_tangent(tan(elevation), "direct") for elevation in volume.elevations)
    numbers = [low, high, near, far, *given]
    dimensions = max(map(np.ndim, numbers)) if not any(map(is_symbolic, numbers)) else 1
    nodes = volume_nodes(volume)
    weights = _rows([node.weight for node in nodes], dimensions)
    slopes = _rows([node.slope for node in nodes], dimensions)
    distances = _rows([node.distance for node in nodes], dimensions)
    value = row_by_row(value_at, slopes, distances)
    return sqrt(total(weights * value * value) / total(weights))


@dataclass(frozen=True, slots=True)
class VolumeNode:
    """A node of the score's quadrature: tan(elevation) from the middle of the baseline, distance in mm, its weight."""

    slope: Scalar
    distance: Scalar
    weight: Scalar


def volume_nodes(volume: Volume) -> list[VolumeNode]:
    """The nodes at which the score is taken; the weights do not add up to 1."""
    low, high = (half_angle_tangent(tan(elevation), "direct") for elevation in volume.elevations)
    near, far = volume.distances
    elevation_rule, distance_rule = _unit_gauss_legendre(ELEVATION_NODES), _unit_gauss_legendre(DISTANCE_NODES)
    along_elevation = [(low * (high / low) ** node, weight) for node, weight in elevation_rule]
    along_distance = [(near * (far / near) ** node, weight) for node, weight in distance_rule]
    # d(elevation) = cos(elevation) d(log t), and 1 / cos(elevation) = (t + 1/t) / 2.
    return [
        VolumeNode(elevation_tangent(t, "direct"), distance, 2.0 * w / (t + 1.0 / t) * v)
        for t, w in along_elevation
        for distance, v in along_distance
    ]


def _numbers_of(pair: StereoPair) -> list[Scalar]:
    return [pair.gain_lower, pair.gain_upper, pair.baseline, pair.principal_distance]


def _rows(values: list[Scalar], dimensions: int) -> Scalar:
    """Values as rows that broadcast against arrays of so many dimensions; symbols as a column."""
    if any(map(is_symbolic, values)):
        return stack(values)
    rows = np.stack(np.broadcast_arrays(*values))
    return rows.reshape(len(rows), *(1,) * (dimensions - rows.ndim + 1), *rows.shape[1:])


def depth_error_map(
    pair: StereoPair,
    elevations: NDArray[np.float64],
    distances: NDArray[np.float64],
    noise_mm: float | NoiseModel,
    scale_uncertainty: float = 0.0,
) -> NDArray[np.float64]:
    """sigma_D / D at points given by elevation from the middle of the baseline (rad) and distance (mm), broadcast."""
    return np.asarray(_relative_depth_error_at(pair, np.tan(elevations), distances, noise_mm, scale_uncertainty))


def worst_depth_error(
    pair: StereoPair, volume: Volume, noise_mm: float | NoiseModel, scale_uncertainty: float = 0.0
) -> float:
    """The largest sigma_D / D on a grid over the working volume that includes its corners."""
    elevations, distances = volume_grid(volume)
    return float(np.max(depth_error_map(pair, elevations, distances, noise_mm, scale_uncertainty)))


def depth_shift_per_scale(pair: StereoPair, elevation_slope: Scalar, distance: Scalar) -> Scalar:
    """(dD / D) / epsilon at points given by tan(elevation) from the middle of the baseline and by distance in mm."""
    slopes = slopes_of_point(elevation_slope, distance, pair.baseline)
    return relative_depth_shift_per_scale(
        slopes.lower,
        slopes.upper,
        pair.gain_lower,
        pair.sense_lower,
        pair.gain_upper,
        pair.sense_upper,
        pair.law,
    )


def worst_depth_shift_per_scale(pair: StereoPair, volume: Volume) -> float:
    """The largest magnitude of :func:`depth_shift_per_scale` on a grid over the working volume with its corners."""
    elevations, distances = volume_grid(volume)
    return float(np.max(np.abs(depth_shift_per_scale(pair, np.tan(elevations), distances))))


def second_order(first_order: ArrayLike) -> NDArray[np.float64]:
    """Root mean square relative depth error s sqrt(1 + 9 s^2) where first order says s = sigma_D / D; any shape.

    Noise and scale change the disparity by a Gaussian fraction x of deviation s, and D'/D - 1 = 1/(1 + x) - 1 =
    -x + x^2 - x^3, whence a bias of s^2, a variance of s^2 (1 + 8 s^2) and a mean square of s^2 (1 + 9 s^2); the next
    term of the last is 75 s^6. That each slope bends with its image radius adds less than 2e-4 of the error in the
    shipped studies and is left out. Within 2 percent of the truth up to ``SECOND_ORDER_BOUND``.
    """
    error = np.asarray(first_order, dtype=float)
    return np.asarray(error * np.sqrt(1.0 + 9.0 * error * error))


def depth_error_rms_second_order(
    pair: StereoPair, volume: Volume, noise_mm: float | NoiseModel, scale_uncertainty: float = 0.0
) -> float:
    """Root mean square relative depth error over the working volume, averaged as the score is, to second order."""
    nodes, weights = (np.array(part) for part in zip(*_unit_gauss_legendre(SECOND_ORDER_NODES), strict=True))
    low, high = volume.elevations
    near, far = volume.distances
    elevations, distances = (low + (high - low) * nodes)[:, None], near * (far / near) ** nodes
    first_order = depth_error_map(pair, elevations, distances, noise_mm, scale_uncertainty)
    return float(np.sqrt(weights @ second_order(first_order) ** 2 @ weights))


def volume_grid(
    volume: Volume, elevation_count: int = 65, distance_count: int = 17
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Elevations of shape (n, 1) and log-spaced distances of shape (m,) that span a volume, ends included."""
    elevations = np.linspace(*volume.elevations, elevation_count)[:, None]
    return elevations, np.geomspace(*volume.distances, distance_count)


def point_covariance(
    pair: StereoPair, elevation_slope: Scalar, distance: Scalar, noise_mm: float
) -> NDArray[np.float64]:
    """Covariance of a reconstructed point in (distance mm, height mm, azimuth rad), to first order.

    Each view measures an image point with isotropic noise: along the radius it gives the slope, across it the
    azimuth, with standard deviation noise / |r|; the two azimuths are averaged by weight, so 1 / sigma^2 adds.

    Parameters
    ----------
    elevation_slope, distance
        tan(elevation) from the middle of the baseline, and horizontal distance in mm; they broadcast.
    noise_mm
        Standard deviation of an image coordinate, in mm on the sensor.

    Returns
    -------
    Array of shape (..., 3, 3).
    """
    slopes = slopes_of_point(elevation_slope, distance, pair.baseline)
    lower, upper = slopes.lower, slopes.upper
    errors = (
        slope_error(lower, pair.gain_lower, pair.sense_lower, pair.principal_distance, noise_mm, pair.law),
        slope_error(upper, pair.gain_upper, pair.sense_upper, pair.principal_distance, noise_mm, pair.law),
    )
    # D = b / (m_l - m_u) and height = D (m_l + m_u) / 2, differentiated by m_l and by m_u.
    distance_by_slope = (-(distance**2) / pair.baseline, distance**2 / pair.baseline)
    height_by_slope = tuple(distance / 2.0 + elevation_slope * derivative for derivative in distance_by_slope)
    radii = (
        image_radius(lower, pair.gain_lower, pair.principal_distance, pair.sense_lower, pair.law),
        image_radius(upper, pair.gain_upper, pair.principal_distance, pair.sense_upper, pair.law),
    )
    terms = list(zip(errors, distance_by_slope, height_by_slope, strict=True))
    variance_distance = sum((by_distance * error) ** 2 for error, by_distance, _ in terms)
    variance_height = sum((by_height * error) ** 2 for error, _, by_height in terms)
    mixed = sum(error**2 * by_distance * by_height for error, by_distance, by_height in terms)
    variance_azimuth = noise_mm**2 / (radii[0] ** 2 + radii[1] ** 2)
    zero = np.zeros(np.broadcast(variance_distance, variance_azimuth).shape)
    rows = [
        [variance_distance + zero, mixed + zero, zero],
        [mixed + zero, variance_height + zero, zero],
        [zero, zero, variance_azimuth + zero],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def disparity_steps(
    pair: StereoPair, elevation_slope: Scalar, distance: Scalar, pixel_pitch_mm: float
) -> PerView[NDArray[np.float64]]:
    """How far a point recedes (mm) when its disparity shrinks by one pixel, in either view.

    Exact, not first order; infinite where one pixel less puts the point at infinity.
    """
    slopes = slopes_of_point(elevation_slope, distance, pair.baseline)
    lower = _slope_one_pixel_on(slopes.lower, pair.gain_lower, pair.sense_lower, pair, pixel_pitch_mm, -1.0)
    upper = _slope_one_pixel_on(slopes.upper, pair.gain_upper, pair.sense_upper, pair, pixel_pitch_mm, 1.0)
    return PerView(
        lower=_distance_at(lower, slopes.upper, pair.baseline) - distance,
        upper=_distance_at(slopes.lower, upper, pair.baseline) - distance,
    )


def _relative_depth_error_at(
    pair: StereoPair, slope: Scalar, distance: Scalar, noise_mm: Scalar | NoiseModel, scale_uncertainty: Scalar
) -> Scalar:
    slopes = slopes_of_point(slope, distance, pair.baseline)
    noise = noise_mm(slopes, distance) if callable(noise_mm) else noise_mm
    by_noise = depth_error_of_slopes(pair, slopes, noise)
    if isinstance(scale_uncertainty, float) and scale_uncertainty == 0.0:
        return by_noise
    by_scale = scale_uncertainty * depth_shift_per_scale(pair, slope, distance)
    return sqrt(by_noise * by_noise + by_scale * by_scale)


@lru_cache
def _unit_gauss_legendre(count: int) -> list[tuple[float, float]]:
    """Nodes and weights on (0, 1); the weights add up to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return [(float(node + 1.0) / 2.0, float(weight) / 2.0) for node, weight in zip(nodes, weights, strict=True)]


def _slope_one_pixel_on(
    slope: Scalar, gain: Scalar, sense: Sense, pair: StereoPair, pixel_pitch_mm: float, towards: float
) -> Scalar:
    """The slope seen one pixel further along the radius, in the direction in which the slope changes by ``towards``."""
    radius = image_radius(slope, gain, pair.principal_distance, sense, pair.law)
    rising = 1.0 if sense == "direct" else -1.0
    # A negative gain flips the sign of the radius, and of dr/dm with it.
    moved = radius + towards * rising * np.sign(gain) * pixel_pitch_mm
    half_tangent = image_half_tangent(moved, pair.principal_distance, pair.law) / gain
    return elevation_tangent(half_tangent, sense)


def _distance_at(slope_lower: Scalar, slope_upper: Scalar, baseline: Scalar) -> NDArray[np.float64]:
    disparity = np.asarray(slope_lower - slope_upper, dtype=float)
    apart = disparity > 0
    return np.where(apart, baseline / np.where(apart, disparity, 1.0), np.inf)
