"""A small search of its own for each comparator: random starts, then sequential quadratic programming.

Values are scaled to 0..1 within their bounds. A start counts by what it violates; the least violating ones are
improved. The first search minimises depth error, a second one height within a tolerance of it; or other goals than
these two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from designer.trace.arrays import Array

SCREENED, IMPROVED = 128, 3
ITERATIONS = 60
# Constraints, in mm or pixels or shares, count as kept to this.
KEPT = 1e-6
# Depth errors that a search must not flee into where rays find no way.
NOWHERE = 1e3
STEP = 1e-6

Trial = TypeVar("Trial")


@dataclass(frozen=True, slots=True)
class Measured(Generic[Trial]):
    """One trial: what was put together, its depth error, its size in mm, and what must not be negative (m,)."""

    built: Trial
    error: float
    height: float
    diameter: float
    spare: Array

    @property
    def is_finite(self) -> bool:
        """Whether every number is one."""
        return bool(np.isfinite([self.error, self.height, self.diameter, *self.spare]).all())

    @property
    def violation(self) -> float:
        """The largest violation."""
        return float(max(0.0, -np.min(self.spare)))


@dataclass(frozen=True, slots=True)
class Space(Generic[Trial]):
    """Variables by their bounds, and what measures a trial; None where nothing can be put together."""

    bounds: Sequence[tuple[float, float]]
    measure: Callable[[Array], Measured[Trial] | None]


Goal = Callable[[Measured[Any]], float]


def error_of_trial(trial: Measured[Any]) -> float:
    """The depth error."""
    return trial.error


def height_of_trial(trial: Measured[Any]) -> float:
    """The height."""
    return trial.height


def search(
    space: Space[Trial],
    seed: int,
    tolerance: float,
    first: Goal = error_of_trial,
    then: Goal = height_of_trial,
) -> list[Measured[Trial]]:
    """The trials that the starts have led to, best first: those that keep every constraint before the others.

    Best is what has the least ``then`` with ``first`` within the tolerance, a share, of its least value.
    """
    low, high = np.array(space.bounds, dtype=float).T
    free = high > low
    cache: dict[bytes, Measured[Trial] | None] = {}

    def measured(point: Array) -> Measured[Trial] | None:
        key = np.asarray(point).tobytes()
        if key not in cache:
            values = low.copy()
            values[free] += np.clip(point, 0.0, 1.0) * (high - low)[free]
            with np.errstate(all="ignore"):
                found = space.measure(values)
            cache[key] = found if found is not None and found.is_finite else None
        return cache[key]

    points = qmc.Sobol(int(free.sum()), seed=seed).random(SCREENED)
    starts = [(found.violation, place) for place, point in enumerate(points) if (found := measured(point)) is not None]
    ends = [_best_from(measured, points[place], first) for _, place in sorted(starts)[:IMPROVED]]
    ranked = sorted((end for end in ends if end is not None), key=lambda end: _order(end[1], first))
    if not ranked:
        return []
    best_point, best = ranked[0]
    trials = [trial for _, trial in ranked]
    if best.violation <= KEPT:
        second = _improved(measured, best_point, then, (first, (1.0 + tolerance) * first(best)))
        if second is not None and second[1].violation <= KEPT and then(second[1]) < then(best):
            trials.insert(0, second[1])
    return trials


def _best_from(
    measured: Callable[[Array], Measured[Trial] | None], start: Array, goal: Goal
) -> tuple[Array, Measured[Trial]] | None:
    """The least goal from one start; where that ends outside the constraints, from the nearest point inside."""
    found = _improved(measured, start, goal)
    if found is None or found[1].violation <= KEPT:
        return found
    first = measured(start)
    nearer = start if first is not None and first.violation < found[1].violation else found[0]
    inside = _feasible(measured, nearer)
    if inside[1].violation > KEPT:
        return inside
    again = _improved(measured, inside[0], goal)
    return inside if again is None or again[1].violation > KEPT else again


def _feasible(measured: Callable[[Array], Measured[Trial] | None], start: Array) -> tuple[Array, Measured[Trial]]:
    """The point of the least violation that the solver reaches: one more variable, what every constraint lacks."""
    first = measured(start)
    assert first is not None
    lack = first.violation

    def spare(extended: Array) -> Array:
        trial = measured(extended[:-1])
        return np.full(len(first.spare), -NOWHERE) if trial is None else trial.spare + lack * extended[-1]

    bounds = [(0.0, 1.0)] * len(start) + [(-0.01, 1.0)]
    reached = _solved(lambda extended: float(extended[-1]), spare, np.append(start, 1.0), bounds)[:-1]
    end = measured(reached)
    return (start, first) if end is None or end.violation > first.violation else (reached, end)


def _order(trial: Measured[Trial], goal: Goal) -> tuple[bool, float]:
    is_kept = trial.violation <= KEPT
    return (False, goal(trial)) if is_kept else (True, trial.violation)


def _improved(
    measured: Callable[[Array], Measured[Trial] | None],
    start: Array,
    goal: Goal,
    bound: tuple[Goal, float] | None = None,
) -> tuple[Array, Measured[Trial]] | None:
    """Where the solver goes from a start, with another goal at most at its bound; None if that leads nowhere."""
    first = measured(start)
    if first is None:
        return None
    count = len(first.spare) + (bound is not None)

    def value(point: Array) -> float:
        trial = measured(point)
        return NOWHERE if trial is None else float(np.log(goal(trial)))

    def spare(point: Array) -> Array:
        trial = measured(point)
        if trial is None:
            return np.full(count, -NOWHERE)
        return trial.spare if bound is None else np.append(trial.spare, 1.0 - bound[0](trial) / bound[1])

    reached = _solved(value, spare, start, [(0.0, 1.0)] * len(start))
    end = measured(reached)
    return None if end is None else (reached, end)


def _solved(
    value: Callable[[Array], float],
    spare: Callable[[Array], Array],
    start: Array,
    bounds: Sequence[tuple[float, float]],
) -> Array:
    """Where sequential quadratic programming, with derivatives by differences, ends."""
    options: Any = {"maxiter": ITERATIONS, "ftol": 1e-7, "eps": STEP}
    kept: Any = [{"type": "ineq", "fun": spare}]
    solved = minimize(value, start, method="SLSQP", bounds=bounds, constraints=kept, options=options)
    return np.asarray(solved.x, dtype=float)
