"""Rays through mirrors that sit anywhere: from the camera's pinhole, mirror by mirror, with or without derivatives.

Many built systems are traced at once. A coordinate is a number of :mod:`designer.as_built.dual`, whose shape (systems,
rays), or one that broadcasts to it, every function here keeps; points and directions are triples of them. World frame
of the design, lengths in mm. Apertures and blockage are ignored: a built sensor's departures are small beside both.

The conic of a mirror, in its own frame, is c (x^2 + y^2 + k z^2) = 2 z with k = 1 + conic constant; only the sheet that
holds the vertex counts, met from the reflecting side. The intersection is Welford's (Aberrations of Optical
Systems, 1986, chapter 4) in the form that does not subtract like quantities, the reflection d - 2 (d.n) n.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Number, sqrt, value_of, where
from designer.optics.image_law import PERSPECTIVE, ImageLaw

Triple = tuple[Number, Number, Number]
Turn = tuple[Triple, Triple, Triple]
"""A rotation matrix by rows: it turns directions of a part's own frame into the world's."""


@dataclass(frozen=True, slots=True)
class PosedMirror:
    """One mirror of many systems: vertex in the world, rotation, curvature (1/mm), k and side (+1 faces up)."""

    vertex: Triple
    turn: Turn
    curvature: Number
    one_plus_conic: Number
    side: float


@dataclass(frozen=True, slots=True)
class PosedCamera:
    """The cameras of many systems: pinhole in the world, rotation, principal distance in mm, radial distortion, law."""

    pinhole: Triple
    turn: Turn
    principal_distance: Number
    radial_distortion: Number
    law: ImageLaw = PERSPECTIVE


def leave_camera(camera: PosedCamera, slopes: tuple[Number, Number], start: tuple[Number, Number]) -> list[Triple]:
    """Start and unit direction of rays of slopes dx/dz, dy/dz in the camera's frame.

    ``start`` is the place beside the pinhole, across the camera's axis, from which they start.
    """
    length = 1.0 / sqrt(slopes[0] * slopes[0] + slopes[1] * slopes[1] + 1.0)
    direction = (slopes[0] * length, slopes[1] * length, length)
    return [_moved(_turned(camera.turn, (*start, 0.0)), camera.pinhole), _turned(camera.turn, direction)]


def follow_rays(mirrors: Sequence[PosedMirror], point: Triple, direction: Triple) -> tuple[Triple, Triple]:
    """Exit points and directions of rays after mirrors, in order; NaN where a mirror is missed."""
    for mirror in mirrors:
        point, direction = reflect_at(mirror, point, direction)
    return point, direction


def reflect_at(mirror: PosedMirror, point: Triple, direction: Triple) -> tuple[Triple, Triple]:
    """Points on a mirror that rays meet, and their unit directions after it; NaN where they miss it."""
    curvature, side = mirror.curvature, mirror.side
    along_curvature = curvature * mirror.one_plus_conic
    offset = (point[0] - mirror.vertex[0], point[1] - mirror.vertex[1], point[2] - mirror.vertex[2])
    x, y, z = _turned_back(mirror.turn, offset)
    dx, dy, dz = _turned_back(mirror.turn, direction)
    # a s^2 - 2 b s + v = 0, with the discriminant from the ray's moment about the vertex.
    reduced = along_curvature * z
    b = (1.0 - reduced) * dz - curvature * (x * dx + y * dy)
    v = (reduced - 2.0) * z + curvature * (x * x + y * y)
    moment_x, moment_y = z * dx - dz * x, z * dy - dz * y
    squared = curvature * along_curvature
    skew = curvature * (x * dy - y * dx)
    discriminant = (
        dz * dz
        + moment_x * (2.0 * curvature * dx - squared * moment_x)
        + moment_y * (2.0 * curvature * dy - squared * moment_y)
        - skew * skew
    )
    root = sqrt(discriminant) * -side
    distance = v / (b + root)
    subtracts = value_of(b) * side > 0.0
    if subtracts.any():
        a = curvature + (along_curvature - curvature) * (dz * dz)
        distance = where(subtracts, (b - root) / a, distance)
    x, y, z = x + distance * dx, y + distance * dy, z + distance * dz
    met = (value_of(distance) > 0.0) & (value_of(along_curvature) * value_of(z) <= 1.0)
    normal = (curvature * x, curvature * y, along_curvature * z - 1.0)
    share = 2.0 * _dot(normal, (dx, dy, dz)) / _dot(normal, normal)
    after = (dx - share * normal[0], dy - share * normal[1], dz - share * normal[2])
    # One coordinate without a value is enough: whatever is computed from the ray has none either.
    after = (after[0], after[1], after[2] + np.where(met, 0.0, np.nan))
    return _moved(_turned(mirror.turn, (x, y, z)), mirror.vertex), _turned(mirror.turn, after)


def _dot(left: Triple, right: Triple) -> Number:
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def _turned(turn: Turn, vector: Triple) -> Triple:
    return _dot(turn[0], vector), _dot(turn[1], vector), _dot(turn[2], vector)


def _turned_back(turn: Turn, vector: Triple) -> Triple:
    first, second, third = turn
    return (
        first[0] * vector[0] + second[0] * vector[1] + third[0] * vector[2],
        first[1] * vector[0] + second[1] * vector[1] + third[1] * vector[2],
        first[2] * vector[0] + second[2] * vector[1] + third[2] * vector[2],
    )


def _moved(vector: Triple, shift: Triple) -> Triple:
    return vector[0] + shift[0], vector[1] + shift[1], vector[2] + shift[2]
