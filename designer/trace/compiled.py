"""Millions of rays from the pinhole along a path of mirrors, in compiled loops; needs Numba (the extra ``compiled``).

As in :func:`designer.trace.rays.trace_sequential`, whose results a test holds these to. A ray of direction
(dx, dy, dz) stays in its meridional plane. Its distance from the axis is counted in units of sqrt(dx^2 + dy^2): at
``reach`` such units it is at x = reach dx, y = reach dy, and a ray along the axis is like any other. Loops have no
branches and run over blocks that stay in the processor's cache, so that the compiler takes several rays at a time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.trace.conics import Array
from designer.trace.instrument import Instrument
from designer.trace.intersections import NEAREST_HIT_MM
from designer.trace.sequential import SequentialTrace

BLOCK = 256
# The cache knows when this file changes and no other: what comes from elsewhere goes in as arguments.
# Division by zero gives infinity, as in NumPy: a check would keep the compiler from taking several rays at a time.
_compile = numba.njit(error_model="numpy", cache=True)


def trace_many(
    instrument: Instrument, path: Sequence[int], directions: ArrayLike, *, apertures: bool = True
) -> SequentialTrace:
    """Trace rays from the pinhole along a path of mirrors (indices), ignoring blockage.

    Parameters
    ----------
    directions
        Unit vectors (n, 3).
    apertures
        Whether a ray must meet a mirror inside its aperture.

    Raises
    ------
    ValueError
        A mirror is posed away from the axis.
    """
    if not instrument.is_aligned:
        raise ValueError("compiled loops trace mirrors on the axis only")
    given = np.ascontiguousarray(directions, dtype=float).reshape(-1, 3)
    faces, conics = list(path), instrument.conics
    mirrors = np.column_stack(
        [
            conics.curvature[faces],
            conics.one_plus_conic[faces],
            instrument.facing[faces],
            instrument.origins[faces, 2],
            conics.inner[faces] ** 2 if apertures else np.zeros(len(faces)),
            conics.outer[faces] ** 2 if apertures else np.full(len(faces), np.inf),
        ]
    )
    results = np.empty((len(faces) + 1, 3, len(given)))
    missed = np.full(len(given), -1, dtype=np.intp)
    _follow(mirrors, NEAREST_HIT_MM, given, results, missed)
    *hits, exits = results.transpose(0, 2, 1)
    return SequentialTrace(tuple(hits), exits, missed)


@_compile
def _follow(mirrors: Array, nearest: float, directions: Array, results: Array, missed: NDArray[np.intp]) -> None:
    """Fill ``results`` (mirrors + 1, 3, n) with points and exit directions, ``missed`` (n,) with places in the path."""
    across = np.empty((3, BLOCK))
    before, after = np.empty((4, BLOCK)), np.empty((4, BLOCK))
    for low in range(0, len(directions), BLOCK):
        count = min(BLOCK, len(directions) - low)
        block = slice(low, low + count)
        for ray in range(count):
            dx, dy, dz = directions[low + ray, 0], directions[low + ray, 1], directions[low + ray, 2]
            across[0, ray], across[1, ray], across[2, ray] = dx, dy, dx * dx + dy * dy
            before[0, ray], before[1, ray], before[2, ray], before[3, ray] = 0.0, 0.0, 1.0, dz
        for place in range(len(mirrors)):
            misses = _meet(
                mirrors[place], nearest, across[2, :count], before[0], before[1], before[2], before[3], after
            )
            before, after = after, before
            _spread(across, before[0], before[1], results[place, :, block])
            if misses:
                for ray in range(count):
                    if np.isnan(before[0, ray]) and missed[low + ray] < 0:
                        missed[low + ray] = place
        _spread(across, before[2], before[3], results[len(mirrors), :, block])


@_compile
def _meet(
    mirror: Array,
    nearest: float,
    weights: Array,
    reaches: Array,
    heights: Array,
    drifts: Array,
    climbs: Array,
    after: Array,
) -> int:
    """Rays (reach, height) with directions (drift, climb) meet a mirror; returns how many miss it.

    The same four after it go to ``after`` (4, n), NaN for a ray that misses. ``weights`` turn products of reaches
    into mm^2. With c the curvature, k = 1 + conic constant and the vertex as
    origin, the ray meets c (r^2 + k z^2) = 2 z where a s^2 - 2 b s + v = 0, and a s - b has the sign of the mirror's
    side.
    """
    curvature, one_plus_conic, side, vertex, least, most = mirror
    bend = curvature * one_plus_conic
    misses = 0
    for ray in range(weights.size):
        weight, reach, height = weights[ray], reaches[ray], heights[ray] - vertex
        drift, climb = drifts[ray], climbs[ray]
        slope = (1.0 - bend * height) * climb - curvature * weight * reach * drift
        value = (bend * height - 2.0) * height + curvature * weight * reach * reach
        # b^2 - a v by the moment about the vertex, which loses no digits far away or where the conic is nearly flat.
        moment = height * drift - climb * reach
        root = side * np.sqrt(climb * climb + curvature * weight * moment * (2.0 * drift - bend * moment))
        # Neither form subtracts like quantities.
        subtracts = side * slope > 0.0
        above = slope + root if subtracts else value
        below = curvature + (bend - curvature) * climb * climb if subtracts else slope - root
        distance = above / below
        reach += distance * drift
        height += distance * climb
        squared = weight * reach * reach
        met = (distance > nearest) & (bend * height <= 1.0) & (squared >= least) & (squared <= most)
        normal_across, normal_along = curvature * reach, bend * height - 1.0
        share = 2.0 * (weight * normal_across * drift + normal_along * climb)
        share /= weight * normal_across * normal_across + normal_along * normal_along
        gone = 0.0 if met else np.nan
        misses += 0 if met else 1
        after[0, ray] = reach + gone
        after[1, ray] = height + vertex + gone
        after[2, ray] = drift - share * normal_across + gone
        after[3, ray] = climb - share * normal_along + gone
    return misses


@_compile
def _spread(across: Array, reach: Array, along: Array, out: Array) -> None:
    """Write x, y, z of points or vectors to ``out`` (3, n)."""
    out_x, out_y, out_z = out[0], out[1], out[2]
    for ray in range(out_x.size):
        out_x[ray] = across[0, ray] * reach[ray]
    for ray in range(out_y.size):
        out_y[ray] = across[1, ray] * reach[ray]
    for ray in range(out_z.size):
        out_z[ray] = along[ray]
