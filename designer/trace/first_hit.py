"""Rays followed to the first surface they meet, whatever it is, and held against an intended path of mirrors.

Frame: pinhole at the origin, optical axis +z, millimetres. Batches are arrays (n, 3) of origins and unit directions.
Nothing is stored on surfaces: a trace is what a function returns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.trace.arrays import Array, Indices
from designer.trace.bundles import Bundle, blocks_of
from designer.trace.instrument import Instrument
from designer.trace.intersections import first_hits, reflect

# Light caught between mirrors is followed no further.
MOST_MIRRORS = 6


class Status(IntEnum):
    """What became of a ray."""

    OK = 0
    """It met the intended mirrors, each first, and left."""
    MISSED = 1
    """It left without meeting the mirror that it should have met."""
    BLOCKED = 2
    """Something else stood in the way."""
    ESCAPED = 3
    """It left, and no path was asked of it."""


@dataclass(frozen=True, slots=True)
class FirstHitTrace:
    """Rays followed from surface to surface until they leave or are blocked.

    ``status`` (n,) holds ESCAPED or BLOCKED. ``sequence`` (n, k) holds the indices of the mirrors met, -1 after the
    last; ``hits`` (n, k, 3) the points, NaN after the last. ``element`` (n,) is the row of ``instrument.elements`` that
    blocked the ray, or -1, ``blocked_at`` (n, 3) the point where, NaN if it left, and ``leg`` (n,) the number of
    mirrors met before. ``exit_point`` and ``exit_direction`` (n, 3) are start and direction of the last leg.
    """

    status: NDArray[np.int8]
    leg: Indices
    element: Indices
    blocked_at: Array
    sequence: Indices
    hits: Array
    exit_point: Array
    exit_direction: Array


@dataclass(frozen=True, slots=True)
class PathReport:
    """First-hit rays compared with an intended path; arrays (n,).

    ``leg`` is the leg on which the ray ended (0: from the pinhole to the first mirror). ``element`` is the row of
    ``instrument.elements`` of what blocked a BLOCKED ray, and the mirror that a MISSED ray should have met; -1 if OK.
    """

    status: NDArray[np.int8]
    leg: Indices
    element: Indices


def trace_first_hits(
    instrument: Instrument,
    directions: ArrayLike,
    origins: ArrayLike | None = None,
    *,
    starts_in_lens: bool = True,
    most_mirrors: int = MOST_MIRRORS,
) -> FirstHitTrace:
    """Follow rays to the first surface they meet, mirror by mirror.

    Parameters
    ----------
    directions
        Unit vectors (n, 3), world frame.
    origins
        Points (n, 3) in mm; the pinhole if not given.
    starts_in_lens
        Whether the first leg starts inside the lens, and so passes lens barrel and camera body.
    most_mirrors
        A ray that has met this many mirrors counts as blocked by the last.
    """
    given = np.asarray(directions, dtype=float).reshape(-1, 3)
    start = None if origins is None else np.broadcast_to(np.asarray(origins, dtype=float), given.shape)

    blocks = [
        _trace_block(instrument, Bundle.of(instrument, given, start, block), starts_in_lens, most_mirrors)
        for block in blocks_of(len(given))
    ]
    if len(blocks) == 1:
        return blocks[0]
    return FirstHitTrace(
        *(np.concatenate([getattr(block, name) for block in blocks]) for name in FirstHitTrace.__slots__)
    )


def _trace_block(instrument: Instrument, bundle: Bundle, starts_in_lens: bool, most_mirrors: int) -> FirstHitTrace:
    direction = np.array(bundle.direction)
    rows, number = direction.shape
    point = np.zeros((rows, number))
    point[-len(bundle.start) :] = bundle.start
    status = np.full(number, Status.ESCAPED, dtype=np.int8)
    leg = np.zeros(number, dtype=np.intp)
    element = np.full(number, -1, dtype=np.intp)
    blocked_at = np.full((rows, number), np.nan)
    sequence = np.full((number, most_mirrors), -1, dtype=np.intp)
    hits = np.full((most_mirrors, rows, number), np.nan)
    left = np.full(number, -1, dtype=np.intp)
    going = np.arange(number)
    with np.errstate(all="ignore"):
        for met in range(most_mirrors + 1):
            if not going.size:
                break
            here, ahead = (point[:, going] if met else bundle.start), direction[:, going]
            inside_lens = starts_in_lens and met == 0
            distance, row = first_hits(instrument, here, ahead, left[going], camera=not inside_lens)
            leg[going] = met
            is_face = (row >= 0) & (row < len(instrument.mirrors)) & (met < most_mirrors)
            stopped = (row >= 0) & ~is_face
            reached = distance * ahead
            reached[-len(here) :] += here
            status[going[stopped]] = Status.BLOCKED
            element[going[stopped]] = row[stopped]
            blocked_at[:, going[stopped]] = reached[:, stopped]
            rays, faces, landed = going[is_face], row[is_face], reached[:, is_face]
            point[:, rays] = landed
            direction[:, rays] = reflect(instrument, faces, landed, ahead[:, is_face])
            left[rays] = faces
            if met < most_mirrors:
                sequence[rays, met] = faces
                hits[met][:, rays] = landed
            going = rays
    return FirstHitTrace(
        status,
        leg,
        element,
        bundle.in_world(blocked_at).T,
        sequence,
        np.stack([bundle.in_world(hit).T for hit in hits], axis=1),
        bundle.in_world(point).T,
        bundle.in_world(direction).T,
    )


def compare_with_path(trace: FirstHitTrace, path: Sequence[int]) -> PathReport:
    """Say of each ray whether it met the mirrors of a path (indices, in order), each first, and then left."""
    number, recorded = trace.sequence.shape
    status = np.full(number, Status.OK, dtype=np.int8)
    leg = np.full(number, len(path), dtype=np.intp)
    element = np.full(number, -1, dtype=np.intp)
    undecided = np.ones(number, dtype=bool)
    for place, expected in enumerate((*path, -1)):
        if place >= recorded:
            break
        met = trace.sequence[:, place]
        ends = undecided & (met != expected) if expected >= 0 else undecided & ((met >= 0) | (trace.element >= 0))
        blocker = np.where(met >= 0, met, trace.element)
        blocked = ends & (blocker >= 0)
        missed = ends & (blocker < 0)
        status[blocked], status[missed] = Status.BLOCKED, Status.MISSED
        element[blocked], element[missed] = blocker[blocked], expected
        leg[ends] = place
        undecided &= ~ends
    return PathReport(status, leg, element)
