"""Where a sweep goes: its points, and the tree along which each starts from a neighbour's optimum.

The tree depends on the definition alone, so that every point is a pure function of its requirement and of its parent's
stored result: neither order nor interruption changes a number.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from designer.files import InputError
from designer.requirement import Requirement
from designer.study.sweep.definition import SweepDefinition, requirement_at


@dataclass(frozen=True, slots=True)
class Point:
    """One requirement of a sweep: its number, the values of the axes' keys, and the point it starts from."""

    number: int
    coordinates: dict[str, float]
    parent: int | None


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
    points = []
    for number, place in enumerate(product(*(range(length) for length in shape))):
        coordinates = {key: level[index] for key, level, index in zip(keys, levels, place, strict=True)}
        points.append(Point(number, coordinates, _towards(place, root, shape)))
    return tuple(points)


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
    return tuple(
        Point(number, {axis.key: axis.at(float(share)) for axis, share in zip(definition.axis, row, strict=True)}, up)
        for number, (row, up) in enumerate(zip(shares, spanning_tree(shares), strict=True))
    )


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
