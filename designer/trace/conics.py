"""A ray and a conic of revolution in the conic's own frame: where they meet, and how the ray is reflected.

The conic is c (x^2 + y^2 + k z^2) = 2 z, with c = 1/radius (0 for a plane) and k = 1 + conic constant. A ray has two
coordinates across the axis, or one, the signed distance from it, in a meridional plane. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Coordinates of points or vectors, (x, y, z) or (r, z): an array (3 or 2, n), or its rows.
Rows = Sequence[Array] | Array


@dataclass(frozen=True, slots=True)
class Rays:
    """Rays in the frame of a conic, or of several: arrays that broadcast against each other.

    ``across`` and ``heading`` hold the coordinates of starts and unit directions across the axis, ``height`` and
    ``climb`` those along it. ``across`` is empty if all rays start on the axis.
    """

    across: Rows
    height: Array
    heading: Rows
    climb: Array


def dot(left: Rows, right: Rows) -> Array:
    """Sum of the products of rows."""
    total = left[0] * right[0]
    for row, other in zip(left[1:], right[1:], strict=True):
        total += row * other
    return total


def ends(rays: Rays, distance: Array) -> list[Array]:
    """Rows of the points at distances along rays."""
    points = [distance * ahead for ahead in (*rays.heading, rays.climb)]
    starts = [*rays.across, rays.height]
    for row, start in zip(points[-len(starts) :], starts, strict=True):
        row += start
    return points


def quadratic(curvature: Array | float, one_plus_conic: Array | float, rays: Rays) -> tuple[Array, Array, Array]:
    """The terms b and v of a s^2 - 2 b s + v = 0 for a ray and a conic, and b^2 - a v.

    The discriminant is written with the moment of the ray about the vertex (Lagrange's identity): it then
    depends on the line alone, and does not lose digits when the ray starts far away or the conic is nearly
    parabolic or flat.
    """
    across, z, heading, dz = rays.across, rays.height, rays.heading, rays.climb
    height = curvature * one_plus_conic * z
    slope = (1.0 - height) * dz
    value = (height - 2.0) * z
    moments = [z * ahead for ahead in heading]
    if len(across):
        slope -= curvature * dot(across, heading)
        value += curvature * dot(across, across)
        for moment, start in zip(moments, across, strict=True):
            moment -= dz * start
    discriminant = dz * dz
    bend = np.multiply(curvature, curvature) * one_plus_conic
    for moment, ahead in zip(moments, heading, strict=True):
        discriminant = discriminant + moment * (2.0 * curvature * ahead - bend * moment)
    if len(across) == 2:
        twist = curvature * (across[0] * heading[1] - across[1] * heading[0])
        discriminant -= twist * twist
    return slope, value, discriminant


def along(curvature: Array | float, one_plus_conic: Array | float, rays: Rays) -> Array:
    """The term a of a s^2 - 2 b s + v = 0, for unit directions."""
    return curvature + (curvature * (one_plus_conic - 1.0)) * (rays.climb * rays.climb)


def reflecting_root(curvature: float, one_plus_conic: float, side: float, rays: Rays) -> Array:
    """Distance (n,) at which rays cross a conic from its reflecting side: a s - b = side sqrt(b^2 - a v)."""
    if curvature == 0.0:
        return np.where(side * rays.climb < 0.0, rays.height / -rays.climb, np.nan)
    slope, value, root = quadratic(curvature, one_plus_conic, rays)
    np.sqrt(root, out=root)
    if side > 0.0:
        np.negative(root, out=root)
        subtracts = slope > 0.0
    else:
        subtracts = slope < 0.0
    distance = value / (slope + root)
    if subtracts.any():
        distance = np.where(subtracts, (slope - root) / along(curvature, one_plus_conic, rays), distance)
    return distance


def mirrored(curvature: Array | float, one_plus_conic: Array | float, local: Rows, directions: Rows) -> list[Array]:
    """Directions d - 2 (d.n) n at points of conics, rows in the conics' frames."""
    normal = [curvature * row for row in local[:-1]]
    normal.append((curvature * one_plus_conic) * local[-1])
    normal[-1] -= 1.0
    share = dot(normal, directions)
    share /= dot(normal, normal)
    share *= 2.0
    for row, ahead in zip(normal, directions, strict=True):
        row *= share
        np.subtract(ahead, row, out=row)
    return normal
