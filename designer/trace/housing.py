"""Rays behind the last mirror: refracted at a tube's two walls, or stopped by struts.

Snell's law as vectors (W. T. Welford, Aberrations of Optical Systems, 1986, chapter 4), at cylinders about the axis of
the design; nothing is known here of meridional planes. Frame: pinhole at the origin, optical axis +z, millimetres.
Batches are arrays (n, 3) of points and unit directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.housing import Struts, Tube
from designer.trace.arrays import Array


@dataclass(frozen=True, slots=True)
class Refracted:
    """Rays through a tube's wall: where they enter and leave it, and their directions behind it; all (n, 3).

    NaN for a ray that starts outside, or does not come to the wall.
    """

    at_inner: Array
    at_outer: Array
    direction: Array

    def meets(self, tube: Tube) -> NDArray[np.bool_]:
        """Which rays (n,) pass the wall between the tube's ends."""
        heights = np.stack([self.at_inner[:, 2], self.at_outer[:, 2]])
        return np.asarray(((heights >= tube.low_mm) & (heights <= tube.high_mm)).all(axis=0))


@dataclass(frozen=True, slots=True)
class Left:
    """Rays that have left a sensor: as if they came in a straight line from ``point`` (n, 3), along ``direction``.

    The point is as far behind the place where a ray leaves the housing as its way within it is long. ``is_free`` (n,)
    is false where a strut or the end of a tube stops the light.
    """

    point: Array
    direction: Array
    is_free: NDArray[np.bool_]


def leave_housing(housing: Tube | Struts | None, points: ArrayLike, directions: ArrayLike) -> Left:
    """Follow rays from the last mirror out of a housing; as they are where there is none.

    A ray that passes a tube above or below its ends is not refracted; one that passes one wall but not the other meets
    the tube's end and is stopped.
    """
    start, ahead = (np.asarray(given, dtype=float).reshape(-1, 3) for given in (points, directions))
    if isinstance(housing, Struts):
        return Left(start, ahead, ~strikes_struts(housing, start, ahead))
    if housing is None:
        return Left(start, ahead, np.ones(len(start), dtype=bool))
    tube = housing
    through = refract(tube, start, ahead)
    inside, outside = (
        (place[:, 2] >= tube.low_mm) & (place[:, 2] <= tube.high_mm) for place in (through.at_inner, through.at_outer)
    )
    # Without the wall: whether the ray meets the outer cylinder between the tube's ends.
    past = _forward_to(start, ahead, tube.outer_radius_mm)
    straight = (past[:, 2] >= tube.low_mm) & (past[:, 2] <= tube.high_mm)
    is_refracted = inside & outside
    way = np.linalg.norm(through.at_inner - start, axis=1) + np.linalg.norm(through.at_outer - through.at_inner, axis=1)
    behind = through.at_outer - way[:, None] * through.direction
    return Left(
        np.where(is_refracted[:, None], behind, start),
        np.where(is_refracted[:, None], through.direction, ahead),
        is_refracted | ~(inside | straight),
    )


def refract(tube: Tube, points: Array, directions: Array) -> Refracted:
    """Rays (n, 3) from within a tube through its wall, which here has no ends."""
    at_inner = _forward_to(points, directions, tube.inner_radius_mm)
    in_wall = _refracted(directions, _outwards(at_inner), 1.0 / tube.refractive_index)
    at_outer = _forward_to(at_inner, in_wall, tube.outer_radius_mm)
    return Refracted(at_inner, at_outer, _refracted(in_wall, _outwards(at_outer), tube.refractive_index))


def strikes_struts(struts: Struts, points: Array, directions: Array) -> NDArray[np.bool_]:
    """Which rays (n,) meet one of the struts, between its ends, or the top of one."""
    azimuths = np.radians(struts.azimuths_deg)
    x, y = (struts.radius_mm * wave(azimuths)[:, None] for wave in (np.cos, np.sin))
    off_x, off_y = points[:, 0] - x, points[:, 1] - y
    with np.errstate(all="ignore"):
        across = directions[:, 0] ** 2 + directions[:, 1] ** 2
        towards = -(off_x * directions[:, 0] + off_y * directions[:, 1]) / across
        aside = (off_x * directions[:, 1] - off_y * directions[:, 0]) ** 2 / across
        half = np.sqrt((struts.width_mm / 2.0) ** 2 - aside) / np.sqrt(across)
        heights = points[:, 2] + np.stack([np.maximum(towards - half, 0.0), towards + half]) * directions[:, 2]
        low, high = heights.min(axis=0), heights.max(axis=0)
        met = (towards + half > 0.0) & (high >= struts.low_mm) & (low <= struts.high_mm)
    return np.asarray(met.any(axis=0))


def _forward_to(points: Array, directions: Array, radius: float) -> Array:
    """Where rays from within a cylinder about the axis reach it; NaN for those from outside or along the axis."""
    with np.errstate(all="ignore"):
        squared = directions[:, 0] ** 2 + directions[:, 1] ** 2
        outwards = points[:, 0] * directions[:, 0] + points[:, 1] * directions[:, 1]
        inside = radius**2 - points[:, 0] ** 2 - points[:, 1] ** 2
        root = np.sqrt(outwards**2 + squared * np.where(inside > 0.0, inside, np.nan))
        # Neither form subtracts like quantities.
        distance = np.where(outwards > 0.0, inside / (root + outwards), (root - outwards) / squared)
        distance = np.where(squared > 0.0, distance, np.nan)
        return np.asarray(points + distance[:, None] * directions)


def _outwards(points: Array) -> Array:
    """Unit normals (n, 3) of cylinders about the axis."""
    radial = points * (1.0, 1.0, 0.0)
    with np.errstate(all="ignore"):
        return np.asarray(radial / np.linalg.norm(radial, axis=1)[:, None])


def _refracted(directions: Array, normals: Array, ratio: float) -> Array:
    """Directions behind a surface; ``ratio`` is the index before it over that behind, normals point along the rays."""
    with np.errstate(all="ignore"):
        along = np.einsum("ni,ni->n", directions, normals)
        behind = np.sqrt(1.0 - ratio**2 * (1.0 - along**2))
        return np.asarray(ratio * directions + (behind - ratio * along)[:, None] * normals)
