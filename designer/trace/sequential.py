"""Rays traced along one path of mirrors, whatever else may stand in the way.

Frame: pinhole at the origin, optical axis +z, millimetres. Batches are arrays (n, 3) of origins and unit directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from designer.trace.arrays import Array, Indices, Rows
from designer.trace.bundles import Bundle, blocks_of
from designer.trace.instrument import Instrument
from designer.trace.intersections import meet_face


@dataclass(frozen=True, slots=True)
class SequentialTrace:
    """Rays traced along one path, whatever else may stand in the way.

    ``hits`` holds an array (n, 3) for each mirror of the path, ``direction`` (n, 3) the exit directions; both are
    NaN from the first miss on. ``missed`` (n,) is the place in the path of the first mirror missed, or -1.
    """

    hits: tuple[Array, ...]
    direction: Array
    missed: Indices

    @property
    def point(self) -> Array:
        """Where the exit rays start: the points (n, 3) on the last mirror."""
        return self.hits[-1]


def trace_sequential(
    instrument: Instrument,
    path: Sequence[int],
    directions: ArrayLike,
    origins: ArrayLike | None = None,
    *,
    apertures: bool = True,
) -> SequentialTrace:
    """Trace rays along a path of mirrors (indices), ignoring blockage; with or without their apertures.

    Each mirror is met on its reflecting side and on its vertex sheet only. ``directions`` are unit vectors (n, 3),
    ``origins`` points (n, 3) in mm, the pinhole if not given.
    """
    given = np.asarray(directions, dtype=float).reshape(-1, 3)
    start = None if origins is None else np.broadcast_to(np.asarray(origins, dtype=float), given.shape)
    number = len(given)
    # In one array: memory for one of this size is kept and used again, where smaller ones go back to the system.
    results = np.empty((len(path) + 1, 3, number))
    missed = np.full(number, -1, dtype=np.intp)
    with np.errstate(all="ignore"):
        for block in blocks_of(number):
            bundle = Bundle.of(instrument, given, start, block)
            point: Rows = bundle.start
            direction: Rows = bundle.direction
            for place, face in enumerate(path):
                point, direction = meet_face(instrument, face, point, direction, aperture=apertures)
                lost = np.isnan(point[-1])
                if lost.any():
                    missed[block][lost & (missed[block] < 0)] = place
                bundle.in_world(point, out=results[place, :, block])
            bundle.in_world(direction, out=results[-1, :, block])
    *hits, exits = results.transpose(0, 2, 1)
    return SequentialTrace(tuple(hits), exits, missed)
