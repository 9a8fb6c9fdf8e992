"""Analytic solids and how rays meet them.

Frame: the design's, millimetres. Rays are held as three rows (x, y, z) of n columns, directions as unit vectors.
Every solid here is convex, so that a ray is inside it over one interval: a ray that starts outside meets it where
it enters, and a ray that starts inside (a room, a pipe) where it leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Point = tuple[float, float, float]

# Surfaces nearer than this to the start of a ray are not met.
NEAREST_HIT_MM = 1e-6


class Shape(Protocol):
    """What rays can meet."""

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the first surface on each ray (3, n), infinite where the ray misses."""
        ...

    def normals(self, points: Array, directions: Array) -> Array:
        """Outward unit normals (3, n) where rays along ``directions`` meet the surface in ``points`` (3, n)."""
        ...

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the whole shape as seen along the z axis."""
        ...

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm between which the whole shape lies."""
        ...


@runtime_checkable
class Coloured(Protocol):
    """A shape that brings a colour of its own, in place of the world's texture."""

    def albedo(self, points: Array, directions: Array) -> Array:
        """Radiance (n,) from 0 to 1 where rays along ``directions`` meet the surface in ``points`` (3, n)."""
        ...


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A flat rectangle about ``centre``, spanned by two perpendicular half sides (vectors, mm)."""

    centre: Point
    half_width: Point
    half_height: Point

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the rectangle, infinite where the ray misses."""
        normal = self._normal()
        offset = np.asarray(self.centre)[:, None] - points
        with np.errstate(all="ignore"):
            distance = (normal @ offset) / (normal @ directions)
            inside = distance > NEAREST_HIT_MM
            for half in (np.asarray(self.half_width), np.asarray(self.half_height)):
                along = (half @ directions) * distance - half @ offset
                inside &= np.abs(along) <= half @ half
        return np.where(inside, distance, np.inf)

    def normals(self, points: Array, directions: Array) -> Array:
        """Unit normals (3, n): width x height."""
        return np.broadcast_to(self._normal()[:, None], points.shape)

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the rectangle seen along the z axis."""
        width, height = np.asarray(self.half_width[:2]), np.asarray(self.half_height[:2])
        return np.asarray(self.centre[:2]), float(max(np.hypot(*(width + height)), np.hypot(*(width - height))))

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        reach = abs(self.half_width[2]) + abs(self.half_height[2])
        return self.centre[2] - reach, self.centre[2] + reach

    def _normal(self) -> Array:
        # Asked for each block of rays: NumPy's own cross product takes longer than shading a block.
        (a, b, c), (d, e, f) = self.half_width, self.half_height
        normal = np.array([b * f - c * e, c * d - a * f, a * e - b * d])
        return np.asarray(normal / np.linalg.norm(normal))


@dataclass(frozen=True, slots=True)
class Box:
    """A box between two corners, then turned about the vertical through its centre; a room when seen from inside."""

    low: Point
    high: Point
    yaw_deg: float = 0.0

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the box, infinite where the ray misses."""
        start, heading = self._local(points), self._local(directions, is_direction=True)
        half = self._half()
        enter = np.full(points.shape[1], -np.inf)
        leave = np.full(points.shape[1], np.inf)
        with np.errstate(all="ignore"):
            for axis in range(3):
                first = (-half[axis] - start[axis]) / heading[axis]
                second = (half[axis] - start[axis]) / heading[axis]
                # A ray that runs in a slab's face gives 0/0: fmin and fmax leave that slab out.
                enter = np.fmax(enter, np.fmin(first, second))
                leave = np.fmin(leave, np.fmax(first, second))
        return _first_forward(enter, leave)

    def normals(self, points: Array, directions: Array) -> Array:
        """Outward unit normals (3, n)."""
        place = self._local(points) / self._half()[:, None]
        axis = np.argmax(np.abs(place), axis=0)
        columns = np.arange(points.shape[1])
        normal = np.zeros_like(place)
        normal[axis, columns] = np.sign(place[axis, columns])
        return _about_vertical(normal, float(np.radians(self.yaw_deg)))

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the box seen along the z axis."""
        return (np.asarray(self.high[:2]) + np.asarray(self.low[:2])) / 2.0, float(np.hypot(*self._half()[:2]))

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        return self.low[2], self.high[2]

    def _half(self) -> Array:
        return np.asarray((np.asarray(self.high) - np.asarray(self.low)) / 2.0)

    def _local(self, vectors: Array, is_direction: bool = False) -> Array:
        centre = (np.asarray(self.high) + np.asarray(self.low)) / 2.0
        shifted = vectors if is_direction else vectors - centre[:, None]
        return shifted if self.yaw_deg == 0.0 else _about_vertical(shifted, -float(np.radians(self.yaw_deg)))


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball, or a dome when seen from inside."""

    centre: Point
    radius: float

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the sphere, infinite where the ray misses."""
        offset = points - np.asarray(self.centre)[:, None]
        half_slope = np.einsum("in,in->n", offset, directions)
        foot = offset - half_slope * directions
        with np.errstate(invalid="ignore"):
            # From the distance of the line to the centre: exact also for small balls far away.
            root = np.sqrt(self.radius**2 - np.einsum("in,in->n", foot, foot))
        return _first_forward(-half_slope - root, -half_slope + root)

    def normals(self, points: Array, directions: Array) -> Array:
        """Outward unit normals (3, n)."""
        return np.asarray((points - np.asarray(self.centre)[:, None]) / self.radius)

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of the sphere's outline seen along the z axis."""
        return np.asarray(self.centre[:2]), self.radius

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        return self.centre[2] - self.radius, self.centre[2] + self.radius


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """A ball drawn out to ``radii`` along its axes, then turned about the vertical through its centre."""

    centre: Point
    radii: Point
    yaw_deg: float = 0.0

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the ellipsoid, infinite where the ray misses."""
        offset, ahead = self._as_ball(points - np.asarray(self.centre)[:, None]), self._as_ball(directions)
        speed = np.einsum("in,in->n", ahead, ahead)
        half_slope = np.einsum("in,in->n", offset, ahead) / speed
        # The squared distance of the centre from the ray, not the difference of large squares.
        foot = offset - half_slope * ahead
        with np.errstate(invalid="ignore"):
            root = np.sqrt((1.0 - np.einsum("in,in->n", foot, foot)) / speed)
        return _first_forward(-half_slope - root, -half_slope + root)

    def normals(self, points: Array, directions: Array) -> Array:
        """Outward unit normals (3, n)."""
        place = self._as_ball(points - np.asarray(self.centre)[:, None]) / np.asarray(self.radii)[:, None]
        return _about_vertical(place / np.linalg.norm(place, axis=0), float(np.radians(self.yaw_deg)))

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the ellipsoid seen along the z axis."""
        return np.asarray(self.centre[:2]), max(self.radii[:2])

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        return self.centre[2] - self.radii[2], self.centre[2] + self.radii[2]

    def _as_ball(self, vectors: Array) -> Array:
        turned = vectors if self.yaw_deg == 0.0 else _about_vertical(vectors, -float(np.radians(self.yaw_deg)))
        return np.asarray(turned / np.asarray(self.radii)[:, None])


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round bar between the centres of its two flat ends, in any direction; a pipe when seen from inside."""

    start: Point
    end: Point
    radius: float

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the cylinder, infinite where the ray misses."""
        axis, length = self._axis()
        offset = points - np.asarray(self.start)[:, None]
        along_start, along_heading = axis @ offset, axis @ directions
        across_start = offset - axis[:, None] * along_start
        across_heading = directions - axis[:, None] * along_heading
        speed = np.einsum("in,in->n", across_heading, across_heading)
        with np.errstate(all="ignore"):
            closest = -np.einsum("in,in->n", across_start, across_heading) / speed
            foot = across_start + closest * across_heading
            root = np.sqrt((self.radius**2 - np.einsum("in,in->n", foot, foot)) / speed)
            enter, leave = closest - root, closest + root
            inside = np.einsum("in,in->n", across_start, across_start) <= self.radius**2
            parallel = speed == 0.0
            enter[parallel] = np.where(inside[parallel], -np.inf, np.nan)
            leave[parallel] = np.where(inside[parallel], np.inf, np.nan)
            first, second = -along_start / along_heading, (length - along_start) / along_heading
            level = along_heading == 0.0
            between = (along_start >= 0.0) & (along_start <= length)
            first[level] = np.where(between[level], -np.inf, np.nan)
            second[level] = np.where(between[level], np.inf, np.nan)
            enter = np.maximum(enter, np.minimum(first, second))
            leave = np.minimum(leave, np.maximum(first, second))
        return _first_forward(enter, leave)

    def normals(self, points: Array, directions: Array) -> Array:
        """Outward unit normals (3, n)."""
        axis, length = self._axis()
        offset = points - np.asarray(self.start)[:, None]
        along = axis @ offset
        across = (offset - axis[:, None] * along) / self.radius
        beyond = np.abs(along - length / 2.0) - length / 2.0
        depth = (np.sqrt(np.einsum("in,in->n", across, across)) - 1.0) * self.radius
        cap = axis[:, None] * np.sign(along - length / 2.0)
        return np.asarray(np.where(beyond > depth, cap, across))

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the cylinder seen along the z axis."""
        start, end = np.asarray(self.start[:2]), np.asarray(self.end[:2])
        return (start + end) / 2.0, float(np.hypot(*(end - start)) / 2.0 + self.radius)

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        axis, _ = self._axis()
        reach = self.radius * float(np.hypot(axis[0], axis[1]))
        return min(self.start[2], self.end[2]) - reach, max(self.start[2], self.end[2]) + reach

    def _axis(self) -> tuple[Array, float]:
        axis = np.asarray(self.end) - np.asarray(self.start)
        length = float(np.linalg.norm(axis))
        return axis / length, length


def _first_forward(enter: Array, leave: Array) -> Array:
    """The first end of the interval that lies ahead; infinite where there is none or the interval is empty or NaN."""
    distance = np.where(enter > NEAREST_HIT_MM, enter, leave)
    return np.where((enter <= leave) & (distance > NEAREST_HIT_MM), distance, np.inf)


def _about_vertical(vectors: Array, angle: float) -> Array:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * vectors[0] - sine * vectors[1], sine * vectors[0] + cosine * vectors[1], vectors[2]])
