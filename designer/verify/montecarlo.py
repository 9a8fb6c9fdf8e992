"""Depth error by brute force: noisy projections through the tracer, and nothing but the tracer.

Random points of the working volume are projected by finding, for each view, the pinhole ray that the traced mirrors
send to the point; each image radius gets its own Gaussian noise, and both are scaled by the same Gaussian error of the
image's scale, if the design counts one; both noisy rays are traced back out, and their
lines meet at a depth. Rays stay in one meridional plane, which loses nothing: the mirrors are round, and noise
across the plane turns both views' lines without moving their depth to first order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from designer.design import Design
from designer.trace.aiming import exit_lines, project
from designer.trace.arrays import Array
from designer.trace.image_law import image_radius, is_perspective, pinhole_angle
from designer.trace.instrument import build_instrument


@dataclass(frozen=True, slots=True)
class DepthErrors:
    """Depths recovered from noisy projections.

    ``relative_errors`` (n,) are (measured - true) / true horizontal distances from the axis; ``elevation_rad`` and
    ``distance_mm`` (n,) say of which points, elevation seen from the middle of the baseline. ``rms`` is their root
    mean square, ``rms_standard_error`` its standard error. ``lost`` counts points that are not in the arrays because
    a view has no ray to them.
    """

    relative_errors: Array
    elevation_rad: Array
    distance_mm: Array
    rms: float
    rms_standard_error: float
    lost: int


def depth_error_monte_carlo(
    design: Design, samples: int = 100_000, seed: int = 0, noise_px: float | None = None
) -> DepthErrors:
    """Relative depth errors over the working volume: elevation uniform, distance log-uniform.

    Parameters
    ----------
    noise_px
        Standard deviation of the image radius in each view, in pixels; the design's own if not given.
    """
    random = np.random.default_rng(seed)
    low, high = np.radians(design.working_volume.elevation_deg)
    near, far = np.log(design.working_volume.distance_mm)
    elevations = random.uniform(low, high, samples)
    distances = np.exp(random.uniform(near, far, samples))
    return _measure(design, elevations, distances, noise_px, random)


def depth_error_by_distance(
    design: Design, distances_mm: ArrayLike, samples: int = 20_000, seed: int = 0, noise_px: float | None = None
) -> Array:
    """Root mean square relative depth error (n,) at each distance, over the volume's elevations, uniform.

    ``samples`` points for each distance; the standard error of a value is about the value / sqrt(2 samples).
    """
    random = np.random.default_rng(seed)
    low, high = np.radians(design.working_volume.elevation_deg)
    return np.array(
        [
            _measure(design, random.uniform(low, high, samples), np.full(samples, distance), noise_px, random).rms
            for distance in np.atleast_1d(np.asarray(distances_mm, dtype=float))
        ]
    )


def middle_of(found: DepthErrors, share: float = 0.6827) -> tuple[float | None, float | None, float]:
    """The ends of the middle share of relative depth errors, and the share of points that have no distance.

    A negative distance is none: the two rays part. The ends are None where no point has a distance.
    """
    errors = found.relative_errors[found.relative_errors > -1.0]
    samples = found.relative_errors.size + found.lost
    lost = 1.0 - errors.size / samples if samples else 1.0
    if not errors.size:
        return None, None, lost
    low, high = np.quantile(errors, ((1.0 - share) / 2.0, (1.0 + share) / 2.0))
    return float(low), float(high), lost


def _measure(
    design: Design, elevations: Array, distances: Array, noise_px: float | None, random: np.random.Generator
) -> DepthErrors:
    camera, views = design.camera, design.views
    scale = 1.0 + design.scale_uncertainty * random.standard_normal(distances.size) if design.scale_uncertainty else 1.0
    sigma = (design.noise_px if noise_px is None else noise_px) * camera.pixel_pitch_mm
    middle = views.middle_mm
    heights = middle + distances * np.tan(elevations)
    instrument = build_instrument(design)
    lines: list[tuple[Array, Array]] = []
    for name, view in views.by_name.items():
        psi = project(design, name, distances, heights)
        imaged = (
            scale * camera.focal_length_mm * np.tan(psi)
            if is_perspective(camera)
            else scale * image_radius(camera, psi)
        )
        noisy = pinhole_angle(camera, imaged + sigma * random.standard_normal(psi.size))
        path = instrument.path(view.path)
        (start_x, start_z), (ahead_x, ahead_z) = exit_lines(instrument, path, noisy, design.tube)
        slope = ahead_z / ahead_x
        side = 1.0 if view.gain > 0.0 else -1.0
        lines.append((start_z - slope * start_x, side * slope))
    (upper_height, upper_slope), (lower_height, lower_slope) = lines
    with np.errstate(all="ignore"):
        measured = (upper_height - lower_height) / (lower_slope - upper_slope)
    found = np.isfinite(measured)
    errors = (measured[found] - distances[found]) / distances[found]
    squares = errors**2
    rms = float(np.sqrt(squares.mean())) if errors.size else np.nan
    spread = float(squares.std(ddof=1) / np.sqrt(errors.size) / (2.0 * rms)) if errors.size > 1 and rms > 0 else np.nan
    return DepthErrors(errors, elevations[found], distances[found], rms, spread, int(np.sum(~found)))
