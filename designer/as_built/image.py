"""Where lenses image rays: the one module of this room that knows the lens's law, r = f tan(psi).

Places on the sensor are in mm from the principal point, slopes are dx/dz and dy/dz of rays at the pinhole.
"""

from __future__ import annotations

import numpy as np

from designer.as_built.dual import Array, Number
from designer.as_built.tracing import PosedCamera
from designer.design import Camera, View
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius, image_radius_slope


def slopes_towards(view: View, elevation_slope: Array, azimuth: Array) -> Array:
    """Slopes (2, n) of the rays that a design's view sends to tan(elevation) and azimuth (n,), whatever the lens."""
    tangent = image_radius(elevation_slope, view.gain, 1.0, view.sense)
    return np.asarray(tangent * np.stack([np.cos(azimuth), np.sin(azimuth)]))


def designed_places(camera: Camera, slopes: Array) -> Array:
    """Where the lens of a design images rays of slopes (2, ...)."""
    return camera.focal_length_mm * slopes


def direction_at(camera: Camera, view: View, places: Array) -> tuple[Array, Array]:
    """tan(elevation) and azimuth (rad) that a design's view shows at places (2, ...); undoes the two above."""
    across, down = places
    half = image_half_tangent(np.hypot(across, down), camera.focal_length_mm)
    slope = elevation_tangent(half / abs(view.gain), view.sense)
    turn = 1.0 if view.gain > 0.0 else -1.0
    return np.asarray(slope), np.arctan2(turn * down, turn * across)


def radius_and_slope(camera: Camera, view: View, elevation_slope: Array) -> tuple[Array, Array]:
    """Signed image radius in mm of a design's view at tan(elevation), and how it changes with tan(elevation)."""
    given = (elevation_slope, view.gain, camera.focal_length_mm, view.sense)
    return np.asarray(image_radius(*given)), np.asarray(image_radius_slope(*given) / (1.0 + elevation_slope**2))


def built_places(camera: PosedCamera, slopes: tuple[Number, Number]) -> tuple[Number, Number]:
    """Where the lens of a built sensor images rays, its own radial distortion included."""
    squared = slopes[0] * slopes[0] + slopes[1] * slopes[1]
    scale = camera.principal_distance * (1.0 + camera.radial_distortion * squared)
    return slopes[0] * scale, slopes[1] * scale
