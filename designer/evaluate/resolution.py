"""What a pixel is worth: image zones, angular resolution, the smallest object, and figure 6 of the paper.

The lattice of figure 6 takes every pair of pixels in one epipolar plane to the point that it reconstructs: no
derivative is involved, so it checks the first-order depth error. Lengths in mm on the object side, pixels in the
image, degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design, View, ViewName
from designer.evaluate.depth import slopes_of_point, stereo_pair_of, volume_grid, volume_of
from designer.evaluate.fabrication import surface_of
from designer.optics.image_law import PERSPECTIVE, image_law_of
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius, image_radius_slope

# An object counts as resolved when it covers this many pixels, in height and in width, in both views.
PIXELS_TO_RESOLVE = 2.0


@dataclass(frozen=True, slots=True)
class SmallestObject:
    """Height and width (mm) that cover two pixels in the coarser view, at each distance asked for."""

    height_mm: NDArray[np.float64]
    width_mm: NDArray[np.float64]


def image_zones(design: Design) -> dict[ViewName, tuple[float, float]]:
    """Inner and outer image radius, in pixels, of the elevations asked of each view."""
    return {name: _zone(design, view) for name, view in design.views.by_name.items()}


def image_rims(design: Design) -> dict[ViewName, tuple[float, float]]:
    """Image radius, in pixels, of the inner and the outer edge of the first mirror on each view's path.

    A mirror reaches beyond its used zone by the edge margin, so its rims lie beyond :func:`image_zones`. Infinite for
    an edge that does not lie above the pinhole; whether another part hides it from the camera is not looked at.
    """
    return {name: _rims(design, view) for name, view in design.views.by_name.items()}


def angular_resolution_px_per_deg(design: Design, view_name: ViewName, elevation_deg: ArrayLike) -> NDArray[np.float64]:
    """Pixels per degree of elevation along the radius, at elevations of that view."""
    view = _view(design, view_name)
    law = image_law_of(design.camera)
    slope = image_radius_slope(_slopes(elevation_deg), view.gain, design.camera.focal_length_mm, view.sense, law)
    return np.asarray(np.abs(slope) / design.camera.pixel_pitch_mm * np.pi / 180.0)


def azimuthal_resolution_px_per_deg(
    design: Design, view_name: ViewName, elevation_deg: ArrayLike
) -> NDArray[np.float64]:
    """Pixels per degree of azimuth along the circle, at elevations of that view."""
    return _radii_px(design, _view(design, view_name), _slopes(elevation_deg)) * np.pi / 180.0


def smallest_object(design: Design, distance_mm: ArrayLike) -> SmallestObject:
    """The smallest upright object that both views resolve at mid-elevation: two pixels in height and in width."""
    distance = np.asarray(distance_mm, dtype=float)
    pair = stereo_pair_of(design)
    low, high = volume_of(design).elevations
    slopes = slopes_of_point(np.tan((low + high) / 2.0), distance, pair.baseline)
    heights, widths = [], []
    for name, view in design.views.by_name.items():
        slope = slopes[name]
        radians_per_px = design.camera.pixel_pitch_mm / np.abs(
            image_radius_slope(slope, view.gain, design.camera.focal_length_mm, view.sense, pair.law)
        )
        heights.append(distance * (1.0 + slope**2) * radians_per_px)
        widths.append(distance / _radii_px(design, view, slope))
    return SmallestObject(PIXELS_TO_RESOLVE * np.maximum(*heights), PIXELS_TO_RESOLVE * np.maximum(*widths))


def epipolar_lattice(design: Design) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Reconstruct every pair of pixels on the image's middle row, each within its view's zone (the paper's figure 6).

    Returns
    -------
    Distance and height z (from the pinhole) in mm, both of shape (lower pixels, upper pixels), ordered so that the
    disparity falls along both axes; NaN where the two rays do not meet at a finite distance in front of the axis.
    """
    slopes_lower = np.sort(_slopes_of_pixels(design, design.views.lower))[::-1, None]
    slopes_upper = np.sort(_slopes_of_pixels(design, design.views.upper))[None, :]
    disparity = slopes_lower - slopes_upper
    meets = disparity > 0
    distance = np.where(meets, design.baseline_mm / np.where(meets, disparity, 1.0), np.nan)
    return distance, design.views.lower.viewpoint_mm + distance * slopes_lower


def quantisation_error_rms(design: Design, elevation_count: int = 401, distance_count: int = 101) -> float:
    """Root mean square of the relative distance error when both image points snap to the nearest pixel centre.

    Brute force over the working volume, uniform in elevation and log-uniform in distance. A rounded coordinate is
    wrong by 1/sqrt(12) pixel rms, so first order predicts the score at that noise. Infinite where rounding takes a
    point of the volume to infinity or beyond.
    """
    pair = stereo_pair_of(design)
    elevations, distances = volume_grid(volume_of(design), elevation_count, distance_count)
    slopes = slopes_of_point(np.tan(elevations), distances, pair.baseline)
    seen_lower = _rounded_to_pixels(design, design.views.lower, slopes.lower)
    seen_upper = _rounded_to_pixels(design, design.views.upper, slopes.upper)
    disparity = seen_lower - seen_upper
    if np.any(disparity <= 0):
        return float("inf")
    relative_error = pair.baseline / disparity / distances - 1.0
    return float(np.sqrt(np.mean(relative_error**2)))


def _view(design: Design, name: ViewName) -> View:
    if name not in design.views.by_name:
        raise ValueError(f"no view {name!r}: the views are upper and lower")
    return design.views.by_name[name]


def _slopes(elevation_deg: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(np.tan(np.radians(np.asarray(elevation_deg, dtype=float))))


def _radii_px(design: Design, view: View, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    law = image_law_of(design.camera)
    radius_mm = image_radius(slopes, view.gain, design.camera.focal_length_mm, view.sense, law)
    return np.asarray(np.abs(radius_mm) / design.camera.pixel_pitch_mm)


def _zone(design: Design, view: View) -> tuple[float, float]:
    ends = _radii_px(design, view, _slopes(view.elevation_deg))
    return float(ends.min()), float(ends.max())


def _rims(design: Design, view: View) -> tuple[float, float]:
    mirror, camera = design.mirror(view.path[0]), design.camera
    radii = np.array([mirror.inner_radius_mm, mirror.outer_radius_mm])
    heights = surface_of(mirror).height(radii)
    ahead = heights > 0
    tangents = np.where(ahead, radii / np.where(ahead, heights, 1.0), np.inf)
    law = image_law_of(camera)
    if not law.is_perspective:
        within = np.where(ahead, tangents, 0.0)
        tangents = np.where(ahead, law.ratio(PERSPECTIVE.half_tangent(within)), np.inf)
    inner, outer = tangents * camera.focal_length_mm / camera.pixel_pitch_mm
    return float(inner), float(outer)


def _slopes_of_pixels(design: Design, view: View) -> NDArray[np.float64]:
    """Slopes seen by the pixel centres within a view's zone, on the row through the principal point."""
    inner, outer = _zone(design, view)
    offset = _centre_offset_px(design)
    radii_px = np.arange(np.ceil(inner - offset), np.floor(outer - offset) + 1.0) + offset
    return _slopes_of_radii(design, view, radii_px)


def _centre_offset_px(design: Design) -> float:
    """Radius of the pixel centre next to the axis: a half where the image has an even number of columns."""
    return design.camera.principal_point_px[0] % 1.0


def _slopes_of_radii(design: Design, view: View, radii_px: NDArray[np.float64]) -> NDArray[np.float64]:
    camera = design.camera
    half_tangent = image_half_tangent(radii_px * camera.pixel_pitch_mm, camera.focal_length_mm, image_law_of(camera))
    return np.asarray(elevation_tangent(half_tangent / abs(view.gain), view.sense))


def _rounded_to_pixels(design: Design, view: View, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    offset = _centre_offset_px(design)
    radii_px = np.round(_radii_px(design, view, slopes) - offset) + offset
    return _slopes_of_radii(design, view, radii_px)
