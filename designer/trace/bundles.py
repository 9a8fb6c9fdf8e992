"""Bundles of rays: their directions at the pinhole, and the blocks in which they are traced.

Frame: pinhole at the origin, optical axis +z, millimetres, radians. Batches are arrays (n, 3) of origins and unit
directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from designer.trace.arrays import Array, Rows
from designer.trace.instrument import Instrument

# Rays per block: the working arrays of a block stay in the processor's cache.
BLOCK = 16384


def pinhole_directions(psi: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
    """Unit directions (n, 3) at angles psi from +z and azimuths atan2(y, x), in radians."""
    psi, azimuth = np.broadcast_arrays(np.asarray(psi, dtype=float), np.asarray(azimuth, dtype=float))
    sine = np.sin(psi)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(psi)], axis=-1)


@dataclass(frozen=True, slots=True)
class Bundle:
    """A block of rays as the surfaces take them: three coordinates, or two in the meridional plane.

    ``direction`` are 3 or 2 rows (n,) of unit directions and ``start`` (3, n) their starts, or (1, 1) the height from
    which all of them start on the axis. Then ``azimuth`` (2, n) are the horizontal unit vectors along which r counts.
    """

    start: Array
    direction: Rows
    azimuth: Array | None

    @classmethod
    def of(cls, instrument: Instrument, directions: Array, origins: Array | None, block: slice) -> Bundle:
        """The rays of one block of directions and origins (n, 3); from the pinhole if there are no origins."""
        direction = np.ascontiguousarray(directions[block].T)
        if origins is not None:
            return cls(np.ascontiguousarray(origins[block].T), direction, None)
        if not instrument.is_aligned:
            return cls(np.zeros_like(direction), direction, None)
        across = np.sqrt(direction[0] * direction[0] + direction[1] * direction[1])
        # A ray along the axis stays there, whatever its azimuth.
        azimuth = direction[:2] / np.maximum(across, np.finfo(float).tiny)
        return cls(np.zeros((1, 1)), [across, direction[2]], azimuth)

    def in_world(self, rows: Rows, out: Array | None = None) -> Array:
        """World coordinates (3, n) of points or vectors in rows (3 or 2, n)."""
        world = np.empty((3, self.direction[0].size)) if out is None else out
        if self.azimuth is None:
            world[:] = rows
        else:
            np.multiply(self.azimuth, rows[0], out=world[:2])
            world[2] = rows[1]
        return world


def blocks_of(number: int) -> list[slice]:
    """Slices of at most ``BLOCK`` rays that cover so many; one empty slice if there are none."""
    return [slice(low, low + BLOCK) for low in range(0, max(number, 1), BLOCK)]


def elevation_angles(directions: Array) -> Array:
    """Elevation in radians, from the horizontal plane, up positive, of directions (n, 3)."""
    return np.asarray(np.arctan2(directions[:, 2], np.hypot(directions[:, 0], directions[:, 1])))
