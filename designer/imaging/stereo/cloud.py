"""Pictures of a point cloud as arrays: the floor plan of a slab of heights, and views from any direction.

They correspond to the paper's figures 12 and 11. Lengths in mm, in the frame of the pinhole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.imaging.images import Image
from designer.imaging.stereo.placement import Floats
from designer.imaging.stereo.reconstruction import PointCloud


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """How many points of a slab of heights stand over each cell of the floor.

    ``counts`` (cells, cells) has y running upwards from the last row and x to the right; ``extent_mm`` is the
    distance from the axis, in its middle, to each side.
    """

    counts: NDArray[np.int64]
    extent_mm: float
    heights_mm: tuple[float, float]

    def picture(self) -> Image:
        """Black points on white, darker the more points a cell has, with a grey dot for the sensor."""
        densest = max(1.0, float(np.percentile(self.counts[self.counts > 0], 90))) if self.counts.any() else 1.0
        darkness = np.minimum(1.0, np.sqrt(self.counts / densest))
        image = np.rint(255.0 * (1.0 - darkness)).astype(np.uint8)
        middle = len(image) // 2
        image[middle - 2 : middle + 2, middle - 2 : middle + 2] = 128
        return image


def floor_plan(cloud: PointCloud, heights_mm: tuple[float, float], extent_mm: float, cells: int = 600) -> FloorPlan:
    """Project the points between two heights (z, mm) onto the floor (figure 12)."""
    x, y, z = cloud.positions_mm.T
    low, high = heights_mm
    inside = (z >= low) & (z <= high)
    edges = np.linspace(-extent_mm, extent_mm, cells + 1)
    counts, _, _ = np.histogram2d(y[inside], x[inside], bins=(edges, edges))
    return FloorPlan(counts[::-1].astype(np.int64), extent_mm, heights_mm)


def heights_at_every_distance(design: Design) -> tuple[float, float]:
    """Heights z (mm) that the working volume holds at all its distances, or at the nearest if there is none."""
    low, high = (float(np.tan(np.radians(angle))) for angle in design.working_volume.elevation_deg)
    near, far = design.working_volume.distance_mm
    middle = design.views.middle_mm
    bottom, top = max(low * near, low * far), min(high * near, high * far)
    if bottom >= top:
        bottom, top = low * near, high * near
    return middle + bottom, middle + top


def view_of_cloud(
    cloud: PointCloud,
    eye_mm: tuple[float, float, float],
    azimuth_deg: float,
    elevation_deg: float,
    field_deg: float = 70.0,
    size_px: tuple[int, int] = (800, 600),
    point_px: int = 2,
) -> Image:
    """A perspective picture of the cloud from an eye that looks in a direction (figure 11), z upwards.

    Returns
    -------
    Red, green, blue of shape (height, width, 3), black where there is no point; near points hide far ones.
    """
    width, height = size_px
    right, up, ahead = _axes(np.radians(azimuth_deg), np.radians(elevation_deg))
    offsets = cloud.positions_mm - np.asarray(eye_mm)
    depth = offsets @ ahead
    in_front = depth > 0
    offsets, depth, colours = offsets[in_front], depth[in_front], cloud.colours[in_front]
    scale = width / 2.0 / np.tan(np.radians(field_deg) / 2.0)
    u = np.rint((width - 1) / 2.0 + scale * (offsets @ right) / depth).astype(int)
    v = np.rint((height - 1) / 2.0 - scale * (offsets @ up) / depth).astype(int)
    # Far points first: the last written stays.
    order = np.argsort(-depth, kind="stable")
    u, v, colours = u[order], v[order], colours[order]
    image = np.zeros((height, width, 3), np.uint8)
    nearest = np.full((height, width), -1)
    for down in range(point_px):
        for across in range(point_px):
            inside = (u + across >= 0) & (u + across < width) & (v + down >= 0) & (v + down < height)
            rank = np.flatnonzero(inside)
            np.maximum.at(nearest, (v[rank] + down, u[rank] + across), rank)
    shown = nearest >= 0
    image[shown] = colours[nearest[shown]]
    return image


def _axes(azimuth: float, elevation: float) -> tuple[Floats, Floats, Floats]:
    """Right, up and ahead of an eye that looks in a direction, as unit vectors."""
    ahead = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    return right, np.cross(right, ahead), ahead
