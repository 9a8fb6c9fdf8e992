"""A ray and a conic of revolution in the conic's own frame: where they meet, and how the ray is reflected.

The conic is c (x^2 + y^2 + k z^2) = 2 z, with c = 1/radius (0 for a plane) and k = 1 + conic constant. A ray has two
coordinates across the axis, or one, the signed distance from it, in a meridional plane. Lengths in mm.

A point at distance s along the ray meets the conic where a s^2 - 2 b s + v = 0 (W. T. Welford, Aberrations of Optical
Systems, 1986, chapter 4; G. H. Spencer and M. V. R. K. Murty, J. Opt. Soc. Am. 52, 672, 1962), and of the two roots
the one at which a s - b has a given sign lies on a given side of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.trace.arrays import Array, Rows


@dataclass(frozen=True, slots=True)
class Rays:
    """Rays in the frame of a conic, or of several: arrays that broadcast against each other.

    ``across`` and ``height`` hold the starts' coordinates across and along the axis, ``direction_across`` and
    ``direction_along`` the components of their unit directions. ``across`` is empty if all rays start on the axis.
    """

    across: Rows
    height: Array
    direction_across: Rows
    direction_along: Array


def dot_product(left: Rows, right: Rows) -> Array:
    """Sum of the products of rows."""
    total = left[0] * right[0]
    for row, other in zip(left[1:], right[1:], strict=True):
        total += row * other
    return total


def points_along(rays: Rays, distance: Array) -> list[Array]:
    """Rows of the points at distances along rays."""
    points = [distance * component for component in (*rays.direction_across, rays.direction_along)]
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
    across, z, lateral, dz = rays.across, rays.height, rays.direction_across, rays.direction_along
    reduced_height = curvature * one_plus_conic * z
    slope = (1.0 - reduced_height) * dz
    value = (reduced_height - 2.0) * z
    moments = [z * component for component in lateral]
    if len(across):
        slope -= curvature * dot_product(across, lateral)
        value += curvature * dot_product(across, across)
        for moment, start in zip(moments, across, strict=True):
            moment -= dz * start
    discriminant = dz * dz
    conic_term = np.multiply(curvature, curvature) * one_plus_conic
    for moment, component in zip(moments, lateral, strict=True):
        discriminant = discriminant + moment * (2.0 * curvature * component - conic_term * moment)
    if len(across) == 2:
        # The component of the moment along the axis: zero for a meridional ray.
        skewness = curvature * (across[0] * lateral[1] - across[1] * lateral[0])
        discriminant -= skewness * skewness
    return slope, value, discriminant


def leading_term(curvature: Array | float, one_plus_conic: Array | float, rays: Rays) -> Array:
    """The term a of a s^2 - 2 b s + v = 0, for unit directions."""
    return curvature + (curvature * (one_plus_conic - 1.0)) * (rays.direction_along * rays.direction_along)


def reflecting_root(curvature: float, one_plus_conic: float, side: float, rays: Rays) -> Array:
    """Distance (n,) at which rays cross a conic from its reflecting side: a s - b = side sqrt(b^2 - a v)."""
    if curvature == 0.0:
        return np.where(side * rays.direction_along < 0.0, rays.height / -rays.direction_along, np.nan)
    slope, value, root = quadratic(curvature, one_plus_conic, rays)
    np.sqrt(root, out=root)
    if side > 0.0:
        np.negative(root, out=root)
        subtracts = slope > 0.0
    else:
        subtracts = slope < 0.0
    distance = value / (slope + root)
    if subtracts.any():
        distance = np.where(subtracts, (slope - root) / leading_term(curvature, one_plus_conic, rays), distance)
    return distance


def mirrored(curvature: Array | float, one_plus_conic: Array | float, local: Rows, directions: Rows) -> list[Array]:
    """Directions d - 2 (d.n) n at points of conics, rows in the conics' frames."""
    normal = [curvature * row for row in local[:-1]]
    normal.append((curvature * one_plus_conic) * local[-1])
    normal[-1] -= 1.0
    share = dot_product(normal, directions)
    share /= dot_product(normal, normal)
    share *= 2.0
    for row, component in zip(normal, directions, strict=True):
        row *= share
        np.subtract(component, row, out=row)
    return normal
