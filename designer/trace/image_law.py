"""Where a camera images its rays, for any projection: the judge's own reckoning, from the design record alone.

psi is the angle of a ray at the pinhole from +z, and r the image radius on the sensor. Rays beside the pinhole land
where a thin lens images the point in which they cross the plane in focus, as seen from the pinhole. Angles in radians,
lengths in mm; ``camera.focal_length_mm`` is the principal distance.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from designer.design import Camera, Projection
from designer.trace.arrays import Array

# No ray farther from the axis is imaged: a flat pupil is seen edge-on at 90 degrees.
FARTHEST = np.radians(85.0)
TABLE_SIZE = 4097
SECANT_STEPS = 4


def is_perspective(camera: Camera) -> bool:
    """Whether r = f tan(psi)."""
    return camera.projection == "perspective" and not any(camera.distortion)


def image_radius(camera: Camera, psi: ArrayLike) -> Array:
    """Image radii r in mm of rays at angles psi."""
    angle = np.asarray(psi, dtype=float)
    if is_perspective(camera):
        return np.asarray(camera.focal_length_mm * np.tan(angle))
    return camera.focal_length_mm * _radius(camera.projection, camera.distortion, angle)


def pinhole_angle(camera: Camera, radius_mm: ArrayLike) -> Array:
    """Angles psi of the rays at image radii r, of their sign; those beyond the lens's field stay at its end."""
    radius = np.asarray(radius_mm, dtype=float)
    if is_perspective(camera):
        return np.asarray(np.arctan2(radius, camera.focal_length_mm))
    angles, radii = _table(camera.projection, camera.distortion)
    wanted = np.clip(np.abs(radius) / camera.focal_length_mm, 0.0, radii[-1])
    cell = np.clip(np.searchsorted(radii, wanted) - 1, 0, len(radii) - 2)
    last, angle = angles[cell], angles[cell + 1]
    last_error, error = radii[cell] - wanted, radii[cell + 1] - wanted
    for _ in range(SECANT_STEPS):
        with np.errstate(all="ignore"):
            step = error * (angle - last) / (error - last_error)
        last, last_error = angle, error
        angle = np.clip(angle - np.where(np.isfinite(step), step, 0.0), 0.0, angles[-1])
        error = _radius(camera.projection, camera.distortion, angle) - wanted
    return np.asarray(np.copysign(angle, radius))


def largest_radius_mm(camera: Camera) -> float:
    """The image radius at which the lens's field ends; infinite for r = f tan(psi)."""
    if is_perspective(camera):
        return float("inf")
    return camera.focal_length_mm * float(_table(camera.projection, camera.distortion)[1][-1])


def plane_slopes(camera: Camera, x: Array, y: Array) -> tuple[Array, Array]:
    """Slopes dx/dz, dy/dz at the pinhole of the rays through places on the sensor, in mm from its centre."""
    if is_perspective(camera):
        return x / camera.focal_length_mm, y / camera.focal_length_mm
    radius = np.hypot(x, y)
    centre = radius == 0.0
    per_mm = np.where(centre, 1.0 / camera.focal_length_mm, np.tan(pinhole_angle(camera, radius)) / (radius + centre))
    return x * per_mm, y * per_mm


def sensor_places(camera: Camera, slopes: Array) -> Array:
    """Places (..., 2) on the sensor in mm of points seen from the pinhole at slopes (..., 2); undoes the above."""
    if is_perspective(camera):
        return np.asarray(camera.focal_length_mm * slopes)
    tangent = np.hypot(slopes[..., 0], slopes[..., 1])
    centre = tangent == 0.0
    scale = np.where(centre, camera.focal_length_mm, image_radius(camera, np.arctan(tangent)) / (tangent + centre))
    return np.asarray(slopes * scale[..., None])


def stretches(camera: Camera, psi: ArrayLike) -> tuple[Array, Array]:
    """How much longer the image is at angles psi than a perspective one, along the radius and across it."""
    angle = np.maximum(np.abs(np.asarray(psi, dtype=float)), 1e-6)
    if is_perspective(camera):
        return np.ones_like(angle), np.ones_like(angle)
    flat = camera.focal_length_mm * np.tan(angle)
    # Differences over a share of the angle small enough for the law's curvature and large enough for rounding.
    step = 1e-6 * angle
    rise = image_radius(camera, angle + step) - image_radius(camera, angle - step)
    along = rise / (2.0 * step) * np.cos(angle) ** 2 / camera.focal_length_mm
    return np.asarray(along), np.asarray(image_radius(camera, angle) / flat)


def _radius(projection: Projection, distortion: tuple[float, ...], psi: Array) -> Array:
    """The image radius in principal distances."""
    if projection == "equisolid":
        return np.asarray(2.0 * np.sin(psi / 2.0))
    if projection == "stereographic":
        return np.asarray(2.0 * np.tan(psi / 2.0))
    plain = np.tan(psi) if projection == "perspective" else psi
    squared = plain * plain
    factor, power = np.ones_like(plain), np.ones_like(plain)
    for coefficient in distortion:
        power = power * squared
        factor = factor + coefficient * power
    return np.asarray(plain * factor)


@lru_cache(maxsize=64)
def _table(projection: Projection, distortion: tuple[float, ...]) -> tuple[Array, Array]:
    """Angles from the axis to where the image radius no longer rises, and the radius there in principal distances."""
    angles = np.linspace(0.0, FARTHEST, TABLE_SIZE)
    radii = _radius(projection, distortion, angles)
    falls = np.flatnonzero(~(np.diff(radii) > 0.0))
    count = max(int(falls[0]) + 1, 2) if falls.size else TABLE_SIZE
    return angles[:count], radii[:count]
