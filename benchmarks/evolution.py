"""The opponent: SciPy's differential evolution over the same box, with nothing of our solver in it.

Constraints are handled by feasibility rules: of two designs that both fail, the one that fails by less in total is
better; one that keeps every constraint beats one that does not; of two that do, the one with the lesser objective is
better. One number says all that, because depth errors stay far below ``PENALTY_FLOOR``.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, differential_evolution

from designer.goals import GOALS
from designer.optimise.problem import ConstraintEvaluation, Problem
from designer.optimise.problem import evaluate as evaluate_constraints
from designer.optimise.screening import draw
from designer.optimise.variables import VARIABLES

Array = NDArray[np.float64]

# Scaled violations up to this count as none, as in our own search.
TOLERANCE = 1e-6
PENALTY_FLOOR = 1e3
PENALTY_CEILING = 1e9
POPULATION = 64
DRAWN = 2048
# Restart once the best has not improved by this share for so many generations.
STALL_SHARE = 1e-6
STALL_GENERATIONS = 80
STRATEGIES = ("best1bin", "rand1bin", "currenttobest1bin", "best2bin")


@dataclass(slots=True)
class Best:
    """The best design seen in any generation of any restart; ``merit`` is the number that is minimised."""

    merit: float = np.inf
    scaled: Array = field(default_factory=lambda: np.empty(0))
    restarts: int = 0
    evaluations: int = 0

    @property
    def is_feasible(self) -> bool:
        """Whether it keeps every constraint."""
        return self.merit < PENALTY_FLOOR


def evolve(problem: Problem, goal: str, seconds: float, seed: int) -> Best:
    """Run differential evolution, restarted when it stalls, until the processor time is used up."""
    random = np.random.default_rng(seed)
    best = Best()
    # What encloses the mirrors is set by them, never chosen.
    chosen = [
        index
        for index, variable in enumerate(VARIABLES)
        if not problem.bounds[variable.name].is_fixed and variable.role == "shape"
    ]
    end = time.process_time() + seconds
    while time.process_time() < end:
        _run(problem, goal, chosen, STRATEGIES[best.restarts % len(STRATEGIES)], random, end, best)
        best.restarts += 1
    return best


def evaluate(problem: Problem, scaled: Array) -> tuple[dict[str, Array], ConstraintEvaluation]:
    """Goals and every constraint of designs in the unit box, (variables, n), in NumPy; enclosed as the mirrors are."""
    with np.errstate(all="ignore"):
        _, system = problem.enclosed(problem.physical(scaled))
        evaluation = evaluate_constraints(problem, system)
        goals = {name: goal.expression(system) for name, goal in GOALS.items()}
    shape = evaluation.largest_violations.shape
    return {name: np.broadcast_to(value, shape) for name, value in goals.items()}, evaluation


def merits(problem: Problem, goal: str, scaled: Array) -> Array:
    """What is minimised, (n,): the goal where all is kept, else the floor plus the sum of the scaled violations."""
    goals, evaluation = evaluate(problem, scaled)
    total = np.clip(evaluation.violations.sum(axis=0), 0.0, PENALTY_CEILING)
    kept = evaluation.largest_violations <= TOLERANCE
    return np.where(kept, goals[goal], PENALTY_FLOOR + total)


def _run(
    problem: Problem, goal: str, chosen: list[int], strategy: str, random: np.random.Generator, end: float, best: Best
) -> None:
    def merit(points: Array) -> Array:
        columns = np.zeros((len(VARIABLES), points.shape[1]))
        columns[chosen] = points
        found = merits(problem, goal, columns)
        best.evaluations += found.size
        index = int(found.argmin())
        if found[index] < best.merit:
            best.merit, best.scaled = float(found[index]), columns[:, index].copy()
        return found

    stalled, last = 0, np.inf

    def is_enough(intermediate_result: OptimizeResult) -> bool:
        nonlocal stalled, last
        reached = float(intermediate_result.fun)
        floor = PENALTY_FLOOR if reached >= PENALTY_FLOOR else 0.0
        improved = reached - floor < (last - floor) * (1.0 - STALL_SHARE)
        stalled, last = (0, reached) if improved else (stalled + 1, last)
        return stalled >= STALL_GENERATIONS or time.process_time() > end

    differential_evolution(
        merit,
        bounds=[(0.0, 1.0)] * len(chosen),
        init=_population(problem, goal, chosen, random),
        strategy=strategy,
        mutation=(0.4, 1.0),
        recombination=0.9,
        maxiter=100_000,
        tol=0.0,
        atol=0.0,
        rng=random,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=is_enough,
    )


def _population(problem: Problem, goal: str, chosen: list[int], random: np.random.Generator) -> Array:
    """A quarter the best of many random designs drawn as ours are, the rest drawn alike and taken as they come."""
    values = draw(problem, DRAWN, random)
    columns = np.clip(problem.scaled(values), 0.0, 1.0)
    order = np.argsort(merits(problem, goal, columns), kind="stable")[: POPULATION // 4]
    others = np.setdiff1d(np.arange(DRAWN), order)[: POPULATION - order.size]
    return np.nan_to_num(columns[:, np.concatenate([order, others])][chosen].T, nan=0.5)
