"""Millions of rays from the pinhole along a path of mirrors, in compiled loops; needs Numba (the extra ``compiled``).

As in :func:`designer.trace.sequential.trace_sequential`, whose results a test holds these to. A ray that leaves the
pinhole in the direction (dx, dy, dz) stays in its meridional plane. Coordinates across the axis are counted in units of
(dx, dy): a point at ``across`` such units lies at x = across dx, y = across dy, and a ray along the axis is like any
other. Loops have no branches and run over blocks that stay in the processor's cache, so that the compiler takes several
rays at a time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import ArrayLike

from designer.trace.arrays import Array, Indices
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
        raise ValueError("compiled loops trace only mirrors that are on the axis")
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
def _follow(mirrors: Array, nearest: float, directions: Array, results: Array, missed: Indices) -> None:
    """Fill ``results`` (mirrors + 1, 3, n) with points and exit directions, ``missed`` (n,) with places in the path."""
    units = np.empty((3, BLOCK))
    before, after = np.empty((4, BLOCK)), np.empty((4, BLOCK))
    for low in range(0, len(directions), BLOCK):
        count = min(BLOCK, len(directions) - low)
        block = slice(low, low + count)
        for ray in range(count):
            dx, dy, dz = directions[low + ray, 0], directions[low + ray, 1], directions[low + ray, 2]
            units[0, ray], units[1, ray], units[2, ray] = dx, dy, dx * dx + dy * dy
            before[0, ray], before[1, ray], before[2, ray], before[3, ray] = 0.0, 0.0, 1.0, dz
        for place in range(len(mirrors)):
            misses = _meet(mirrors[place], nearest, units[2, :count], before[0], before[1], before[2], before[3], after)
            before, after = after, before
            _write_rows(units, before[0], before[1], results[place, :, block])
            if misses:
                for ray in range(count):
                    if np.isnan(before[0, ray]) and missed[low + ray] < 0:
                        missed[low + ray] = place
        _write_rows(units, before[2], before[3], results[len(mirrors), :, block])


@_compile
def _meet(
    mirror: Array,
    nearest: float,
    squared_units: Array,
    starts_across: Array,
    heights: Array,
    directions_across: Array,
    directions_along: Array,
    after: Array,
) -> int:
    """Rays from points (across, height) in directions (across, along) meet a mirror; returns how many miss it.

    The same four numbers after the mirror go to ``after`` (4, n), NaN for a ray that misses. ``squared_units``, dx^2 +
    dy^2, turn products of two coordinates across the axis into mm^2. With c the curvature, k = 1 + conic constant and
    the vertex as origin, the ray meets c (r^2 + k z^2) = 2 z where a s^2 - 2 b s + v = 0, and a s - b has the sign of
    the mirror's side (see :mod:`designer.trace.conics`).
    """
    curvature, one_plus_conic, side, vertex, least, most = mirror
    vertical_curvature = curvature * one_plus_conic
    misses = 0
    for ray in range(squared_units.size):
        unit, across, height = squared_units[ray], starts_across[ray], heights[ray] - vertex
        d_across, d_along = directions_across[ray], directions_along[ray]
        slope = (1.0 - vertical_curvature * height) * d_along - curvature * unit * across * d_across
        value = (vertical_curvature * height - 2.0) * height + curvature * unit * across * across
        # b^2 - a v by the moment about the vertex, which loses no digits far away or where the conic is nearly flat.
        moment = height * d_across - d_along * across
        root = side * np.sqrt(
            d_along * d_along + curvature * unit * moment * (2.0 * d_across - vertical_curvature * moment)
        )
        # Neither form subtracts like quantities.
        subtracts = side * slope > 0.0
        above = slope + root if subtracts else value
        below = curvature + (vertical_curvature - curvature) * d_along * d_along if subtracts else slope - root
        distance = above / below
        across += distance * d_across
        height += distance * d_along
        squared = unit * across * across
        met = (distance > nearest) & (vertical_curvature * height <= 1.0) & (squared >= least) & (squared <= most)
        normal_across, normal_along = curvature * across, vertical_curvature * height - 1.0
        share = 2.0 * (unit * normal_across * d_across + normal_along * d_along)
        share /= unit * normal_across * normal_across + normal_along * normal_along
        gone = 0.0 if met else np.nan
        misses += 0 if met else 1
        after[0, ray] = across + gone
        after[1, ray] = height + vertex + gone
        after[2, ray] = d_across - share * normal_across + gone
        after[3, ray] = d_along - share * normal_along + gone
    return misses


@_compile
def _write_rows(units: Array, across: Array, along: Array, out: Array) -> None:
    """Write x, y, z of points or vectors to ``out`` (3, n)."""
    out_x, out_y, out_z = out[0], out[1], out[2]
    for ray in range(out_x.size):
        out_x[ray] = units[0, ray] * across[ray]
    for ray in range(out_y.size):
        out_y[ray] = units[1, ray] * across[ray]
    for ray in range(out_z.size):
        out_z[ray] = along[ray]
