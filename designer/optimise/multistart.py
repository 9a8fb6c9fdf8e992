"""Descents from several starts at once, every result evaluated in NumPy.

The solver is not taken at its word: a design is feasible when every constraint and every clearance, evaluated anew, is
kept. Starts go in rounds: after each, separating directions that hold a design and need not are chosen anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.goals import GOALS
from designer.optics.layout import Layout
from designer.optimise.problem import ConstraintEvaluation, Problem, evaluate
from designer.optimise.separating_directions import (
    SeparatingDirections,
    choose_directions,
    rechoose_directions,
)
from designer.optimise.solver import Run, SolverResult, StageTarget, minimise, reduce_violation
from designer.optimise.system import put_together
from designer.optimise.variables import VARIABLE_NAMES
from designer.requirement import SAME_OBJECTIVE, Lens

Array = NDArray[np.float64]

# A design is feasible when no constraint fails by more than this, as a share of its scale (a nanometre for lengths).
LARGEST_VIOLATION = 1e-6
# Nobody asks how good a design is that fails by more than this, and to predict its noise takes as long as all else.
FAR_FROM_FEASIBLE = 1e-3
# Designs nearer than this in the unit box are the same.
SAME_POINT = 1e-3
# How often separating directions are chosen anew.
ROUNDS = 4
# Only so many of the best designs go into another round.
MOST_DESIGNS_IN_LATER_ROUNDS = 4
# Places tried around an optimum, and how far from it in the unit box they spread.
PERTURBED_STARTS = 8
PERTURBATIONS = (0.01, 0.05)
WORTH_ANOTHER_RESTART = 1e-4


@dataclass(frozen=True, slots=True)
class Candidate:
    """A design in the unit box, checked; it carries what is needed to go on from it.

    ``goals`` holds every goal in its own unit, but nothing if the design is far from feasible (``FAR_FROM_FEASIBLE``);
    ``violation`` is the largest scaled violation.
    """

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    scaled: Array
    values: dict[str, float]
    goals: dict[str, float]
    directions: SeparatingDirections
    violation: float
    evaluation: ConstraintEvaluation

    @property
    def layout(self) -> Layout:
        """The design put together: arrays of one."""
        values = {name: np.array([value]) for name, value in self.values.items()}
        return self.problem.enclosed(values)[1].layout

    @property
    def is_feasible(self) -> bool:
        """Whether every constraint is kept, by independent evaluation."""
        return self.violation <= LARGEST_VIOLATION

    @property
    def is_held_by_a_range(self) -> bool:
        """Whether a variable lies at an end of its range, beyond which the solver may go."""
        least, greatest = self.problem.reach
        is_low = (self.scaled <= SAME_POINT) & (least < 0.0)
        is_high = (self.scaled >= 1.0 - SAME_POINT) & (greatest > 1.0)
        return bool(np.any(is_low | is_high))

    def keeps(self, target: StageTarget) -> bool:
        """Whether the bounds that a target sets for other goals are kept."""
        return all(self.goals[name] <= bound * (1.0 + LARGEST_VIOLATION) for name, bound in target.at_most)


@dataclass(slots=True)
class Task:
    """A problem with what a descent needs beside it.

    ``scales`` are typical sizes of the goals; ``statuses`` counts what the solver said.
    """

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    statuses: Counter[str]

    def note(self, result: SolverResult) -> SolverResult:
        """Count one result and pass it on."""
        self.statuses[result.status] += 1
        return result

    def run_from(self, start: Array, directions: SeparatingDirections) -> Run:
        """A run of the solver that starts at a point of the unit box."""
        return Run(self.problem, directions, start, self.scales)


def examine(task: Task, scaled: Array, directions: SeparatingDirections) -> Candidate:
    """Evaluate a point of the unit box in NumPy; what encloses the mirrors is taken from the mirrors themselves."""
    return examine_all(task, scaled[:, None], [directions])[0]


def examine_all(task: Task, scaled: Array, directions: Sequence[SeparatingDirections]) -> list[Candidate]:
    """Evaluate points of the unit box at once, shape (variables, points), each with its separating directions."""
    problem, shape = task.problem, scaled.shape[1:]
    with np.errstate(all="ignore"):
        values, system = problem.enclosed(problem.physical(scaled))
        evaluation = evaluate(problem, system)
    enclosed = problem.scaled(values)
    by_name = {name: np.broadcast_to(value, shape) for name, value in values.items()}
    violations = evaluation.largest_violations
    goals = _goals_of(problem, by_name, violations <= FAR_FROM_FEASIBLE)
    return [
        Candidate(
            problem,
            task.lens,
            task.scales,
            enclosed[:, index],
            {name: float(value[index]) for name, value in by_name.items()},
            goals[index],
            choice,
            float(violations[index]),
            evaluation.of_design(index),
        )
        for index, choice in enumerate(directions)
    ]


def _goals_of(problem: Problem, values: dict[str, Array], is_asked: NDArray[np.bool_]) -> list[dict[str, float]]:
    """Every goal of those designs (n,) that are asked for, by name; nothing of the others."""
    goals: list[dict[str, float]] = [{} for _ in is_asked]
    chosen = np.flatnonzero(is_asked)
    if chosen.size:
        asked = {name: value[chosen] for name, value in values.items()}
        with np.errstate(all="ignore"):
            system = put_together(problem.variant, asked, problem.specification)
            columns = {name: np.broadcast_to(goal.expression(system), chosen.shape) for name, goal in GOALS.items()}
        for place, index in enumerate(chosen):
            goals[index] = {name: float(column[place]) for name, column in columns.items()}
    return goals


def make_feasible(task: Task, starts: Sequence[Candidate]) -> list[Candidate]:
    """Reduce the largest violation of every start, until it is feasible or nothing helps."""
    best = list(starts)
    choices = [start.directions for start in starts]
    active = [index for index, start in enumerate(starts) if not start.is_feasible]
    if not active:
        return best
    for _ in range(ROUNDS):
        results = [
            task.note(reduce_violation(task.run_from(best[index].scaled, choices[index]), best[index].violation))
            for index in active
        ]
        again = []
        for index, reached in zip(active, _examine_results(task, results, [choices[i] for i in active]), strict=True):
            choice = choices[index]
            if not reached.violation < best[index].violation:
                continue
            best[index] = reached
            chosen = _rechosen(task, choice, reached)
            if not reached.is_feasible and chosen != choice:
                choices[index] = chosen
                again.append(index)
        active = sorted(again, key=lambda index: best[index].violation)[:MOST_DESIGNS_IN_LATER_ROUNDS]
        if not active:
            break
    return best


def improve(task: Task, starts: Sequence[Candidate], target: StageTarget) -> list[Candidate]:
    """Minimise a goal from every start, each feasible: never worse than it was."""
    best = list(starts)
    choices = [start.directions for start in starts]
    active = list(range(len(starts)))
    for _ in range(ROUNDS):
        results = [task.note(minimise(task.run_from(best[index].scaled, choices[index]), target)) for index in active]
        again = []
        for index, reached in zip(active, _examine_results(task, results, [choices[i] for i in active]), strict=True):
            choice = choices[index]
            least = best[index].goals[target.minimise] * (1.0 - SAME_OBJECTIVE)
            if reached.is_feasible and reached.keeps(target) and reached.goals[target.minimise] < least:
                best[index] = reached
            # A feasible result may be held by a direction that need not be; one that is not feasible met a pair that
            # had been left out as far.
            chosen = _rechosen(task, choice, best[index] if reached.is_feasible else reached)
            if chosen != choice:
                choices[index] = chosen
                again.append(index)
        place = {id(best[index]): index for index in again}
        distinct = distinct_designs([best[index] for index in again], target.minimise)
        active = [place[id(design)] for design in distinct[:MOST_DESIGNS_IN_LATER_ROUNDS]]
        if not active:
            break
    return best


def start_at(task: Task, scaled: Array) -> list[Candidate]:
    """Points of the unit box, shape (variables, points), as starts: each with the directions chosen there."""
    problem, specification = task.problem, task.problem.specification
    with np.errstate(all="ignore"):
        values, system = problem.enclosed(problem.physical(scaled))
        evaluation = evaluate(problem, system)
    asked = specification.asked
    choices = choose_directions(evaluation, asked.manufacture.clearance_mm, asked.envelope.height_mm)
    return examine_all(task, problem.scaled(values), choices)


def start_around(task: Task, design: Candidate, random: np.random.Generator) -> list[Candidate]:
    """Starts at random places around a design.

    An optimum is one for the directions it was found with; a little aside others serve, and may lead on.
    """
    free = np.array([not task.problem.bounds[name].is_fixed for name in VARIABLE_NAMES])
    moves = np.geomspace(*PERTURBATIONS, PERTURBED_STARTS) * random.standard_normal(
        (len(VARIABLE_NAMES), PERTURBED_STARTS)
    )
    least, greatest = task.problem.reach
    around = design.scaled[:, None] + moves * free[:, None]
    return start_at(task, np.clip(around, least[:, None], greatest[:, None]))


def restart_around(task: Task, design: Candidate, target: StageTarget, random: np.random.Generator) -> Candidate:
    """Minimise a goal from around its minimum, again and again until nothing better comes of it."""
    while True:
        starts = start_around(task, design, random)
        feasible = [candidate for candidate in make_feasible(task, starts) if candidate.is_feasible]
        reached = [found for found in improve(task, feasible, target) if found.keeps(target)] if feasible else []
        best = min(reached, key=lambda found: found.goals[target.minimise], default=design)
        if not best.goals[target.minimise] < design.goals[target.minimise] * (1.0 - WORTH_ANOTHER_RESTART):
            return min(best, design, key=lambda found: found.goals[target.minimise])
        design = best


def follow(task: Task, start: Array, directions: SeparatingDirections, target: StageTarget) -> Candidate | None:
    """Minimise a goal from near its minimum, feasible or not; None if nothing feasible comes of it."""
    best: Candidate | None = None
    for _ in range(ROUNDS):
        result = task.note(minimise(task.run_from(start, directions), target))
        reached = examine(task, result.scaled, directions)
        if reached.is_feasible and reached.keeps(target):
            aim = target.minimise
            gains = best is None or reached.goals[aim] < best.goals[aim] * (1.0 - SAME_OBJECTIVE)
            if not gains:
                break
            best, start = reached, reached.scaled
        chosen = _rechosen(task, directions, reached)
        if chosen == directions:
            break
        directions = chosen
    return best


def distinct_designs(designs: Sequence[Candidate], goal: str) -> list[Candidate]:
    """Designs that differ, best first."""
    kept: list[Candidate] = []
    for design in sorted(designs, key=lambda design: design.goals[goal]):
        if all(np.abs(design.scaled - other.scaled).max() > SAME_POINT for other in kept):
            kept.append(design)
    return kept


def task_of(candidate: Candidate) -> Task:
    """A task that goes on from a candidate."""
    return Task(candidate.problem, candidate.lens, candidate.scales, Counter())


def _examine_results(
    task: Task, results: Sequence[SolverResult], directions: Sequence[SeparatingDirections]
) -> list[Candidate]:
    return examine_all(task, np.stack([result.scaled for result in results], axis=1), directions)


def _rechosen(task: Task, directions: SeparatingDirections, candidate: Candidate) -> SeparatingDirections:
    clearance = task.problem.specification.asked.manufacture.clearance_mm
    return rechoose_directions(directions, candidate.evaluation, clearance, candidate.violation)
