"""The front of the first objective against size, traced by tightening the envelope around a finished design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.optimise.descent import LARGEST_VIOLATION, Candidate, improve, task_of
from designer.optimise.program import Goal


@dataclass(frozen=True, slots=True)
class FrontPoint:
    """The least first objective with one size (``height`` or ``diameter``) at most ``limit`` mm; None if not found."""

    swept: str
    limit: float
    goals: dict[str, float] | None


def trace_front(first: Candidate, goal: str, sizes: Sequence[str], points: int) -> list[FrontPoint]:
    """Tighten each size in equal steps, from that of the first-stage optimum down to the least the variant allows.

    Each point starts from its neighbour; the last one lies a hair above the least size, where nothing is left to
    choose.
    """
    front = []
    for size in sizes:
        least = improve(task_of(first), [first], Goal(size))[0].goals[size]
        limits = np.linspace(first.goals[size], least, points)
        current = first
        for limit in limits:
            tightened = _shrunk(current, goal, size, max(float(limit), least * (1.0 + 1e-6)))
            front.append(FrontPoint(size, float(limit), tightened.goals if tightened else None))
            current = tightened or current
    return front


def _shrunk(candidate: Candidate, goal: str, size: str, limit: float) -> Candidate | None:
    """Minimise a goal from a feasible design with one size bounded; None if nothing feasible comes of it."""
    task = task_of(candidate)
    start = candidate
    if start.goals[size] > limit:
        start = improve(task, [start], Goal(size))[0]
        if start.goals[size] > limit * (1.0 + LARGEST_VIOLATION):
            return None
    return improve(task, [start], Goal(goal, ((size, limit),)))[0]
