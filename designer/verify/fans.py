"""Fans of asked rays against rims, in the meridional plane: the smallest clearance, and rims between two rays.

Rays are sampled, rims are not: a rim that neighbouring rays pass on different sides stands in the fan, however thin
the element and however fine the sampling. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.trace.arrays import Array
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import Instrument
from designer.trace.sequential import trace_sequential
from designer.verify.solids import Rims

FAR_MM = 1e5
# A rim this near to the edge of a fan lies on it.
GRAZING_MM = 1e-9


@dataclass(frozen=True, slots=True)
class FanClearance:
    """``distance_mm`` is the least distance of a leg from a rim, ``leg`` and ``rim`` say which.

    ``obstructions`` lists the (leg, rim) that stand inside a fan.
    """

    distance_mm: float
    leg: int
    rim: str
    obstructions: tuple[tuple[int, str], ...]


def fan_clearance(instrument: Instrument, path: Sequence[int], psi: Array, rims: Rims) -> FanClearance:
    """Clearance of the rays at rising pinhole angles psi (n,), on every leg, from every rim.

    Left out: barrel and body on the first leg, which starts inside the lens, and the near rims of the mirror on
    which a leg starts or ends (the edge margin, not a clearance). The far side of the same mirror counts.
    """
    trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
    far = trace.point + FAR_MM * trace.direction
    corners = np.stack([np.zeros_like(far), *trace.hits, far], axis=1)[:, :, [0, 2]]
    corners = corners[np.isfinite(corners).all(axis=(1, 2))]
    nearest = FanClearance(np.inf, -1, "", ())
    obstructions: list[tuple[int, str]] = []
    if len(corners) < 2 or not len(rims.labels):
        return nearest
    points = np.concatenate([rims.points, rims.points * [-1.0, 1.0]])
    owner = np.concatenate([rims.owner, rims.owner])
    side = np.repeat([1.0, -1.0], len(rims.owner))
    for leg in range(len(path) + 1):
        counts = np.ones(len(points), dtype=bool)
        if leg == 0:
            counts &= owner >= 0
        for corner, place in ((leg, leg - 1), (leg + 1, leg)):
            if 0 <= place < len(path):
                here = np.sign(np.median(corners[:, corner, 0]))
                counts &= ~((owner == path[place]) & (side == here))
        chosen = np.flatnonzero(counts)
        if not chosen.size:
            continue
        distance, across, beside = _legs_against_points(corners[:, leg], corners[:, leg + 1], points[chosen])
        ray, rim = np.unravel_index(int(np.argmin(distance)), distance.shape)
        if distance[ray, rim] < nearest.distance_mm:
            label = rims.labels[chosen[rim] % len(rims.labels)]
            nearest = FanClearance(float(distance[ray, rim]), leg, label, ())
        crossed = (across[:-1] > GRAZING_MM) & (across[1:] < -GRAZING_MM)
        crossed |= (across[:-1] < -GRAZING_MM) & (across[1:] > GRAZING_MM)
        crossed &= beside[:-1] & beside[1:]
        for rim in np.flatnonzero(crossed.any(axis=0)):
            found = (leg, rims.labels[chosen[rim] % len(rims.labels)])
            if found not in obstructions:
                obstructions.append(found)
    return FanClearance(nearest.distance_mm, nearest.leg, nearest.rim, tuple(obstructions))


def _legs_against_points(start: Array, end: Array, points: Array) -> tuple[Array, Array, np.typing.NDArray[np.bool_]]:
    """Distances (rays, points) of points from segments, signed distances from their lines, and who is alongside."""
    span = end - start
    length = np.hypot(span[:, 0], span[:, 1])[:, None]
    ahead_x, ahead_z = span[:, :1] / length, span[:, 1:] / length
    offset_x = points[None, :, 0] - start[:, :1]
    offset_z = points[None, :, 1] - start[:, 1:]
    along = ahead_x * offset_x + ahead_z * offset_z
    across = ahead_x * offset_z - ahead_z * offset_x
    beyond = np.maximum(np.maximum(-along, along - length), 0.0)
    return np.hypot(across, beyond), across, (along > 0.0) & (along < length)
