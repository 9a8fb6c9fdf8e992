"""Where a sweep goes: its points, and the tree along which each starts from a neighbour's optimum.

The tree and the neighbours depend on the definition alone, so that every task is a pure function of its requirement and
of stored results: neither order nor interruption changes a number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from designer.files import InputError
from designer.requirement import Requirement
from designer.study.sweep.definition import SweepDefinition, requirement_at

# So many points, spread over the sweep with its ends among them, are searched from scratch.
MOST_AFRESH = 16


@dataclass(frozen=True, slots=True)
class Point:
    """One requirement of a sweep: its number, the values of the axes' keys, and the point it starts from.

    ``neighbours`` are the points that it shares designs with, ``lines`` the pairs of them on either side along an axis
    of a grid. A point ``is_afresh`` if it is searched from scratch, as a study does.
    """

    number: int
    coordinates: dict[str, float]
    parent: int | None
    neighbours: tuple[int, ...] = ()
    lines: tuple[tuple[int, int], ...] = ()
    is_afresh: bool = False


def plan_points(definition: SweepDefinition) -> tuple[Point, ...]:
    """All points of a sweep in a fixed order; exactly one, the root, has no parent."""
    if definition.plan == "grid":
        return _grid(definition)
    return _latin_hypercube(definition)


def check_points(definition: SweepDefinition, base: Requirement, points: tuple[Point, ...]) -> None:
    """Make sure before any work that every point is a requirement that may be asked.

    Raises
    ------
    InputError
        Names the first point that may not.
    """
    for point in points:
        try:
            requirement_at(base, point.coordinates)
        except InputError as error:
            where = ", ".join(f"{key} = {value:g}" for key, value in point.coordinates.items())
            raise InputError(f"sweep {definition.name}, point {point.number} ({where}): {error}") from None


def _grid(definition: SweepDefinition) -> tuple[Point, ...]:
    """A grid, rooted where its axes start; every other point goes one step along its last axis that is off the root."""
    levels = [axis.levels for axis in definition.axis]
    keys = [axis.key for axis in definition.axis]
    shape = tuple(len(level) for level in levels)
    root = tuple(axis.start_index for axis in definition.axis)
    afresh = _spread(shape, root)
    points = []
    for number, place in enumerate(product(*(range(length) for length in shape))):
        coordinates = {key: level[index] for key, level, index in zip(keys, levels, place, strict=True)}
        sides = [_beside(place, axis, shape) for axis in range(len(shape))]
        points.append(
            Point(
                number,
                coordinates,
                _towards(place, root, shape),
                tuple(sorted(other for side in sides for other in side)),
                tuple((side[0], side[1]) for side in sides if len(side) == 2),
                place == root or all(index in chosen for index, chosen in zip(place, afresh, strict=True)),
            )
        )
    return tuple(points)


def _beside(place: tuple[int, ...], axis: int, shape: tuple[int, ...]) -> list[int]:
    """The points one step along an axis, on either side."""
    return [
        int(np.ravel_multi_index((*place[:axis], index, *place[axis + 1 :]), shape))
        for index in (place[axis] - 1, place[axis] + 1)
        if 0 <= index < shape[axis]
    ]


def _spread(shape: tuple[int, ...], root: tuple[int, ...]) -> list[set[int]]:
    """Indices along each axis whose combinations are at most MOST_AFRESH points: both ends first, then the widest gap.

    An axis for which not even its ends fit has the root's index alone.
    """
    counts = [1] * len(shape)

    def gap(axis: int) -> float:
        return (shape[axis] - 1) / (counts[axis] - 1) if counts[axis] > 1 else math.inf

    while True:
        others = math.prod(counts)
        fit = [
            axis
            for axis, length in enumerate(shape)
            if counts[axis] < length and others // counts[axis] * (counts[axis] + 1) <= MOST_AFRESH
        ]
        if not fit:
            break
        counts[max(fit, key=lambda axis: (gap(axis), shape[axis]))] += 1
    return [
        {start} if count == 1 else {int(index) for index in np.linspace(0, length - 1, count).round()}
        for length, count, start in zip(shape, counts, root, strict=True)
    ]


def _towards(place: tuple[int, ...], root: tuple[int, ...], shape: tuple[int, ...]) -> int | None:
    for axis in reversed(range(len(place))):
        if place[axis] != root[axis]:
            step = 1 if root[axis] > place[axis] else -1
            nearer = (*place[:axis], place[axis] + step, *place[axis + 1 :])
            return int(np.ravel_multi_index(nearer, shape))
    return None


def _latin_hypercube(definition: SweepDefinition) -> tuple[Point, ...]:
    """Points spread evenly, joined by their shortest spanning tree, rooted at the one nearest the middle."""
    from scipy.stats import qmc  # half a second that other sweeps need not wait

    assert definition.points is not None
    sampler = qmc.LatinHypercube(len(definition.axis), rng=np.random.default_rng(definition.seed))
    shares = sampler.random(definition.points)
    parents = spanning_tree(shares)
    neighbours = _nearest(shares, parents)
    afresh = _farthest_apart(shares, parents.index(None))
    return tuple(
        Point(
            number,
            {axis.key: axis.at(float(share)) for axis, share in zip(definition.axis, row, strict=True)},
            parents[number],
            neighbours[number],
            is_afresh=number in afresh,
        )
        for number, row in enumerate(shares)
    )


def _nearest(places: NDArray[np.float64], parents: list[int | None]) -> list[tuple[int, ...]]:
    """As many nearest points as a grid's has beside it, and whoever has the point among its own; the tree's edges."""
    count = min(2 * places.shape[1], len(places) - 1)
    found: list[set[int]] = [set() if parent is None else {parent} for parent in parents]
    for number, place in enumerate(places):
        distance = np.linalg.norm(places - place, axis=1)
        distance[number] = np.inf
        found[number].update(int(other) for other in np.argsort(distance, kind="stable")[:count])
    for number, others in enumerate([set(each) for each in found]):
        for other in others:
            found[other].add(number)
    return [tuple(sorted(others)) for others in found]


def _farthest_apart(places: NDArray[np.float64], root: int) -> set[int]:
    """The root, then again and again the point farthest from all chosen."""
    chosen = {root}
    distance = np.linalg.norm(places - places[root], axis=1)
    while len(chosen) < min(MOST_AFRESH, len(places)):
        added = int(np.argmax(distance))
        chosen.add(added)
        distance = np.minimum(distance, np.linalg.norm(places - places[added], axis=1))
    return chosen


def spanning_tree(places: NDArray[np.float64]) -> list[int | None]:
    """Parent of each point in the shortest spanning tree (Prim), rooted at the point nearest the middle of the box.

    ``places`` has shape (points, axes), each axis in 0..1. Ties go to the smallest number.
    """
    root = int(np.argmin(np.linalg.norm(places - 0.5, axis=1)))
    parents: list[int | None] = [None] * len(places)
    distance = np.linalg.norm(places - places[root], axis=1)
    nearest = np.full(len(places), root)
    distance[root] = np.inf
    inside = np.zeros(len(places), dtype=bool)
    inside[root] = True
    for _ in range(len(places) - 1):
        added = int(np.argmin(distance))
        parents[added] = int(nearest[added])
        inside[added] = True
        distance[added] = np.inf
        to_added = np.linalg.norm(places - places[added], axis=1)
        closer = ~inside & (to_added < distance)
        distance[closer] = to_added[closer]
        nearest[closer] = added
    return parents
