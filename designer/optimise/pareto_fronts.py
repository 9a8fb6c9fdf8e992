"""The front of depth error against size, traced by tightening the envelope around a finished design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.optimise.multistart import LARGEST_VIOLATION, Candidate, improve, task_of
from designer.optimise.solver import Target


@dataclass(frozen=True, slots=True)
class ParetoPoint:
    """The least depth error found with one size (``height`` or ``diameter``) at most ``limit`` mm: all goals there."""

    swept: str
    limit: float
    goals: dict[str, float]


def trace_pareto_front(first: Candidate, sizes: Sequence[str], points: int) -> list[ParetoPoint]:
    """Bound each size in equal steps, from that of the least depth error down to the least the variant allows.

    Steps go down from the one end, each from its neighbour, and then up from the other, so that none is worse than a
    tighter one; the tightest lies a hair above the least size, where nothing is left to choose.

    Parameters
    ----------
    first
        A feasible design, whatever was minimised to find it.
    """
    loosest = improve(task_of(first), [first], Target("depth_error"))[0]
    front = []
    for size in sizes:
        ends = improve(task_of(first), [loosest, first], Target(size))
        smallest = min(ends, key=lambda design: design.goals[size])
        least = smallest.goals[size]
        limits = [float(limit) for limit in np.linspace(loosest.goals[size], least, points)]
        bounds = [max(limit, least * (1.0 + 1e-6)) for limit in limits]
        found = _loosened(smallest, size, bounds, _tightened(loosest, size, bounds))
        front += [ParetoPoint(size, limit, design.goals) for limit, design in zip(limits, found, strict=True)]
    return front


def _tightened(design: Candidate, size: str, bounds: Sequence[float]) -> list[Candidate | None]:
    """The least depth error within each bound, loosest first, each from its neighbour; None where it is stuck."""
    found: list[Candidate | None] = []
    for bound in bounds:
        start = design
        if start.goals[size] > bound:
            start = improve(task_of(design), [design], Target(size))[0]
        if start.goals[size] > bound * (1.0 + LARGEST_VIOLATION):
            found.append(None)
            continue
        design = _least_depth_error(start, size, bound)
        found.append(design)
    return found


def _loosened(
    design: Candidate, size: str, bounds: Sequence[float], known: Sequence[Candidate | None]
) -> list[Candidate]:
    """The same from a design within the tightest bound on; where better is known, from there."""
    found = []
    for bound, other in zip(reversed(bounds), reversed(known), strict=True):
        design = _least_depth_error(design, size, bound)
        if other is not None and other.goals["depth_error"] < design.goals["depth_error"]:
            design = other
        found.append(design)
    return found[::-1]


def _least_depth_error(start: Candidate, size: str, bound: float) -> Candidate:
    return improve(task_of(start), [start], Target("depth_error", ((size, bound),)))[0]
