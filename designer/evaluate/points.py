"""What is known of a reconstructed point: deviations by noise and by the image's scale, steps, smallest object."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from designer.design import Design
from designer.evaluate.depth import (
    StereoPair,
    disparity_steps,
    noise_mm_of,
    point_covariance,
    slopes_of_point,
    stereo_pair_of,
    volume_of,
)
from designer.evaluate.resolution import smallest_object
from designer.evaluate.scale import slope_shift_per_scale
from designer.files import finite


@dataclass(frozen=True, slots=True)
class PointScore:
    """Standard deviations, disparity steps and the smallest object at mid-elevation and one distance.

    ``sigma_distance_mm`` and ``sigma_height_mm`` count what the score counts: the noise of the design and the
    uncertainty of the image's scale, added in quadrature. Those that end in ``by_noise`` and ``by_scale`` are the
    parts. The azimuth does not depend on the scale. None where a number is not finite.
    """

    distance_mm: float
    sigma_distance_mm: float | None
    sigma_distance_mm_by_noise: float | None
    sigma_distance_mm_by_scale: float | None
    sigma_height_mm: float | None
    sigma_height_mm_by_noise: float | None
    sigma_height_mm_by_scale: float | None
    sigma_azimuth_deg: float | None
    disparity_step_lower_mm: float | None
    disparity_step_upper_mm: float | None
    smallest_object_height_mm: float | None
    smallest_object_width_mm: float | None


def point_score(design: Design, distance: float) -> PointScore:
    """What is known of a point at mid-elevation of the working volume, seen from the middle, and a distance in mm."""
    pair, (low, high) = stereo_pair_of(design), volume_of(design).elevations
    slope = math.tan((low + high) / 2.0)
    covariance = point_covariance(pair, slope, distance, noise_mm_of(design))
    noise = [float(deviation) for deviation in np.sqrt(np.diagonal(covariance))]
    scale = [design.scale_uncertainty * abs(shift) for shift in point_shift_per_scale(pair, slope, distance)]
    steps = disparity_steps(pair, slope, distance, design.camera.pixel_pitch_mm)
    smallest = smallest_object(design, distance)
    return PointScore(
        distance_mm=distance,
        sigma_distance_mm=finite(math.hypot(noise[0], scale[0])),
        sigma_distance_mm_by_noise=finite(noise[0]),
        sigma_distance_mm_by_scale=finite(scale[0]),
        sigma_height_mm=finite(math.hypot(noise[1], scale[1])),
        sigma_height_mm_by_noise=finite(noise[1]),
        sigma_height_mm_by_scale=finite(scale[1]),
        sigma_azimuth_deg=finite(math.degrees(noise[2])),
        disparity_step_lower_mm=finite(steps.lower),
        disparity_step_upper_mm=finite(steps.upper),
        smallest_object_height_mm=finite(smallest.height_mm),
        smallest_object_width_mm=finite(smallest.width_mm),
    )


def point_shift_per_scale(pair: StereoPair, slope: float, distance: float) -> tuple[float, float]:
    """Shift of a point's distance and height, mm, per relative error of the image's scale, to first order.

    At tan(elevation) from the middle of the baseline and a distance in mm; see :mod:`designer.evaluate.scale`.
    """
    slopes = slopes_of_point(slope, distance, pair.baseline)
    by_lower = slope_shift_per_scale(slopes.lower, pair.gain_lower, pair.sense_lower, pair.law)
    by_upper = slope_shift_per_scale(slopes.upper, pair.gain_upper, pair.sense_upper, pair.law)
    # D = b / (m_l - m_u) and height = D (m_l + m_u) / 2.
    by_distance = distance**2 / pair.baseline * (by_upper - by_lower)
    return float(by_distance), float(slope * by_distance + distance * (by_lower + by_upper) / 2.0)
