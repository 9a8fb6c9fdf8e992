"""Where the directions of a view lie in the raw image of a camera that is never exactly centred.

A view is four numbers (docs/theory.md, section 4), so nothing here knows a mirror. Directions are given by the slope
m = tan(elevation) at the view's effective viewpoint and by the azimuth in radians, counter-clockwise about +z from
+x; pixels as (u, v) with pixel centres at whole coordinates. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Camera, Design, Sense, ViewName
from designer.optics.image_law import PERSPECTIVE, ImageLaw, image_law_of
from designer.optics.tube import Wall, slope_towards, wall_of
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius, image_radius_slope

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ImagePlacement:
    """How the image of a real camera lies against the design's own.

    ``center_px`` is the pixel (u, v) that the axis of the mirrors hits, ``rotation_rad`` turns the image from +u
    towards +v, and ``scale`` magnifies it: a scale of 1.01 puts everything 1 percent farther from the centre.
    """

    center_px: tuple[float, float]
    rotation_rad: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewPlacements:
    """How the image of each view lies, where the mirrors of a built sensor do not share an axis."""

    upper: ImagePlacement
    lower: ImagePlacement


Placement = ImagePlacement | ViewPlacements
"""One placement for both views, or one for each."""


@dataclass(frozen=True, slots=True)
class ViewImage:
    """One view's image on the sensor: its four numbers in pixels, its placement, and the elevations asked of it.

    ``gain``, ``sense`` and ``viewpoint_mm`` are the design's; ``principal_distance_px`` is f in pixels, magnified, and
    ``law`` the lens's.
    ``slopes`` are the lowest and highest tan(elevation) asked, ``largest_radius_px`` the radius of the usable image;
    ``wall`` is that of a tube about the mirrors.
    """

    viewpoint_mm: float
    gain: float
    sense: Sense
    principal_distance_px: float
    placement: ImagePlacement
    slopes: tuple[float, float]
    largest_radius_px: float
    size_px: tuple[int, int]
    law: ImageLaw = PERSPECTIVE
    wall: Wall | None = None

    def slope_towards(self, rise_mm: ArrayLike, distance_mm: ArrayLike) -> Floats:
        """Slope of the ray to points so far above the viewpoint and from the axis, through the wall if there is one."""
        rise, distance = np.asarray(rise_mm, dtype=float), np.asarray(distance_mm, dtype=float)
        return np.asarray(rise / distance if self.wall is None else slope_towards(rise, distance, self.wall))

    def radius_px(self, slope: ArrayLike) -> Floats:
        """Signed image radius of a direction; negative where the image lies on the other side of the axis."""
        slope = np.asarray(slope, dtype=float)
        return np.asarray(image_radius(slope, self.gain, self.principal_distance_px, self.sense, self.law))

    def radius_per_elevation_px(self, slope: ArrayLike) -> Floats:
        """Signed dr/dphi in pixels per radian of elevation."""
        slope = np.asarray(slope, dtype=float)
        return np.asarray(image_radius_slope(slope, self.gain, self.principal_distance_px, self.sense, self.law))

    def pixel_of(self, slope: ArrayLike, azimuth: ArrayLike) -> tuple[Floats, Floats]:
        """Pixel (u, v) of a direction; slope and azimuth broadcast."""
        radius = self.radius_px(slope)
        angle = np.asarray(azimuth, dtype=float) + self.placement.rotation_rad
        u0, v0 = self.placement.center_px
        return u0 + radius * np.cos(angle), v0 + radius * np.sin(angle)

    def direction_of(self, u_px: ArrayLike, v_px: ArrayLike) -> tuple[Floats, Floats]:
        """Slope and azimuth (from -pi to pi) seen at a pixel; inverse of :meth:`pixel_of`."""
        across = np.asarray(u_px, dtype=float) - self.placement.center_px[0]
        down = np.asarray(v_px, dtype=float) - self.placement.center_px[1]
        half_tangent = image_half_tangent(np.hypot(across, down), self.principal_distance_px, self.law)
        slope = elevation_tangent(half_tangent / abs(self.gain), self.sense)
        turned = np.pi if self.gain < 0 else 0.0
        azimuth = np.arctan2(down, across) - self.placement.rotation_rad + turned
        return np.asarray(slope), np.asarray(np.remainder(azimuth + np.pi, 2.0 * np.pi) - np.pi)

    def project(self, points_mm: ArrayLike) -> tuple[Floats, Floats]:
        """Pixel (u, v) of points of shape (..., 3) in the frame of the pinhole."""
        points = np.asarray(points_mm, dtype=float)
        distance = np.hypot(points[..., 0], points[..., 1])
        slope = self.slope_towards(points[..., 2] - self.viewpoint_mm, distance)
        return self.pixel_of(slope, np.arctan2(points[..., 1], points[..., 0]))

    def is_imaged(self, slope: ArrayLike, azimuth: ArrayLike) -> NDArray[np.bool_]:
        """Whether a direction lies in the elevations asked of the view, in the image circle and on the sensor."""
        u, v = self.pixel_of(slope, azimuth)
        width, height = self.size_px
        low, high = self.slopes
        # A panorama's outermost rows may touch the ends of the range but for rounding.
        tolerance = 1e-9
        slope = np.asarray(slope, dtype=float)
        in_range = (slope >= low - tolerance) & (slope <= high + tolerance)
        in_circle = np.abs(self.radius_px(slope)) <= self.largest_radius_px
        on_sensor = (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
        return np.asarray(in_range & in_circle & on_sensor)


def centred(camera: Camera) -> ImagePlacement:
    """The placement of a camera that is exactly as designed."""
    return ImagePlacement(camera.principal_point_px)


def placement_of_view(placement: Placement, name: ViewName) -> ImagePlacement:
    """The placement of the upper or the lower view."""
    if isinstance(placement, ImagePlacement):
        return placement
    return placement.upper if name == "upper" else placement.lower


def view_image(design: Design, name: ViewName, placement: Placement | None = None) -> ViewImage:
    """The image of the upper or lower view of a design, in a camera placed as given (as designed by default)."""
    camera = design.camera
    view = design.views.by_name[name]
    placement = placement_of_view(placement or centred(camera), name)
    low, high = (float(np.tan(np.radians(angle))) for angle in view.elevation_deg)
    return ViewImage(
        viewpoint_mm=view.viewpoint_mm,
        gain=view.gain,
        sense=view.sense,
        principal_distance_px=camera.focal_length_mm / camera.pixel_pitch_mm * placement.scale,
        placement=placement,
        slopes=(low, high),
        largest_radius_px=camera.image_radius_mm / camera.pixel_pitch_mm * placement.scale,
        size_px=(camera.width_px, camera.height_px),
        law=image_law_of(camera),
        wall=wall_of(design),
    )
