"""Where lenses image rays, by the law of the lens: r = f tan(psi), or another projection (docs/theory.md, section 10).

Places on the sensor are in mm from the principal point, slopes are dx/dz and dy/dz of rays at the pinhole.
"""

from __future__ import annotations

import numpy as np

from designer.as_built.dual import Array, Number, applied, value_of
from designer.as_built.tracing import PosedCamera
from designer.design import Camera, View
from designer.optics.image_law import ImageLaw, image_law_of
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius, image_radius_slope


def slopes_towards(view: View, elevation_slope: Array, azimuth: Array) -> Array:
    """Slopes (2, n) of the rays that a design's view sends to tan(elevation) and azimuth (n,), whatever the lens."""
    tangent = image_radius(elevation_slope, view.gain, 1.0, view.sense)
    return np.asarray(tangent * np.stack([np.cos(azimuth), np.sin(azimuth)]))


def designed_places(camera: Camera, slopes: Array) -> Array:
    """Where the lens of a design images rays of slopes (2, ...)."""
    law = image_law_of(camera)
    if law.is_perspective:
        return camera.focal_length_mm * slopes
    _, across = _stretches(law, np.hypot(*slopes))
    return np.asarray(camera.focal_length_mm * across * slopes)


def direction_at(camera: Camera, view: View, places: Array) -> tuple[Array, Array]:
    """tan(elevation) and azimuth (rad) that a design's view shows at places (2, ...); undoes the two above."""
    across, down = places
    half = image_half_tangent(np.hypot(across, down), camera.focal_length_mm, image_law_of(camera))
    slope = elevation_tangent(half / abs(view.gain), view.sense)
    turn = 1.0 if view.gain > 0.0 else -1.0
    return np.asarray(slope), np.arctan2(turn * down, turn * across)


def radius_and_slope(camera: Camera, view: View, elevation_slope: Array) -> tuple[Array, Array]:
    """Signed image radius in mm of a design's view at tan(elevation), and how it changes with tan(elevation)."""
    given = (elevation_slope, view.gain, camera.focal_length_mm, view.sense, image_law_of(camera))
    return np.asarray(image_radius(*given)), np.asarray(image_radius_slope(*given) / (1.0 + elevation_slope**2))


def built_places(camera: PosedCamera, slopes: tuple[Number, Number]) -> tuple[Number, Number]:
    """Where the lens of a built sensor images rays, its own radial distortion included."""
    squared = slopes[0] * slopes[0] + slopes[1] * slopes[1]
    stretch: Number = 1.0
    if not camera.law.is_perspective:
        tangent = np.sqrt(value_of(squared))
        along, across = _stretches(camera.law, tangent)
        # The image radius is across tan(psi), and along is its derivative by tan(psi).
        stretch = applied(squared, across, (along - across) / (2.0 * tangent**2))
    scale = camera.principal_distance * stretch * (1.0 + camera.radial_distortion * squared * stretch * stretch)
    return slopes[0] * scale, slopes[1] * scale


def stretched(law: ImageLaw, slopes: Array, spread: Array) -> Array:
    """Small changes of slope (2, k, ...) about slopes (2, ...) as the lens images them, in principal distances."""
    if law.is_perspective:
        return spread
    tangent = np.hypot(*slopes)
    along, across = _stretches(law, tangent)
    outwards = slopes / tangent
    radial = np.einsum("i...,ik...->k...", outwards, spread)
    return np.asarray(across * spread + (along - across) * outwards[:, None] * radial)


def elongation(camera: Camera, slopes: Array) -> Array:
    """The larger diameter (n,) of the ellipse that the lens makes of a small disc, over that along the radius."""
    law = image_law_of(camera)
    if law.is_perspective:
        return np.ones(slopes.shape[1:])
    along, across = _stretches(law, np.hypot(*slopes))
    return np.asarray(np.maximum(along, across) / along)


def _stretches(law: ImageLaw, tangent: Array) -> tuple[Array, Array]:
    """How much longer the image is than a perspective one at tan(psi), along the radius and across it."""
    along, across = law.stretch(tangent / (1.0 + np.sqrt(1.0 + tangent**2)))
    return np.asarray(along), np.asarray(across)
