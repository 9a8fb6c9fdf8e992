"""Going down from several starts at once, and checking every result in NumPy.

A solver's word counts for nothing: a design is feasible when every constraint and every clearance, evaluated anew, is
kept. Starts go in rounds: after each, the separators that hold a design and need not are chosen anew, and the program
is built again once for all of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.optics.layout import Layout
from designer.optimise.direction_choice import choose_separators, rechoose
from designer.optimise.program import GOALS, SolverResult, Target, reduce_violation, solve
from designer.optimise.screening import Evaluation, Problem, assemble_enclosed, check, physical_values, scaled_values
from designer.optimise.separating_directions import Menu, Separators
from designer.optimise.system import VARIABLES
from designer.requirement import SAME_OBJECTIVE, Lens

Array = NDArray[np.float64]

# A design is feasible when no constraint fails by more than this, as a share of its scale (a nanometre for lengths).
LARGEST_VIOLATION = 1e-6
# Designs nearer than this in the unit box are the same.
SAME_POINT = 1e-3
# How often separators are chosen anew.
ROUNDS = 4
# Only so many of the best designs go into another round.
MOST_DESIGNS_IN_LATER_ROUNDS = 4
# Places tried around an optimum, and how far from it in the unit box they spread.
HOPS = 8
HOP_SPREADS = (0.01, 0.05)
WORTH_ANOTHER_HOP = 1e-4


@dataclass(frozen=True, slots=True)
class Candidate:
    """A design in the unit box, checked; it carries what is needed to go on from it.

    ``goals`` holds every goal in its own unit, ``violation`` the largest scaled violation.
    """

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    scaled: Array
    values: dict[str, float]
    goals: dict[str, float]
    separators: Separators
    violation: float
    evaluation: Evaluation

    @property
    def layout(self) -> Layout:
        """The design put together: arrays of one."""
        values = {name: np.array([value]) for name, value in self.values.items()}
        return assemble_enclosed(self.problem, values)[1].layout

    @property
    def is_feasible(self) -> bool:
        """Whether every constraint is kept, by independent evaluation."""
        return self.violation <= LARGEST_VIOLATION

    def keeps(self, goal: Target) -> bool:
        """Whether the bounds of a goal are kept."""
        return all(self.goals[name] <= bound * (1.0 + LARGEST_VIOLATION) for name, bound in goal.at_most)


@dataclass(slots=True)
class Task:
    """A problem with what a descent needs beside it.

    ``scales`` are typical sizes of the goals. The menu grows with the separators that turn out to be needed;
    ``statuses`` counts what the solver said.
    """

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    statuses: Counter[str]
    menu: Menu | None = None

    def offer(self, choices: Iterable[Separators]) -> Menu:
        """A menu with the given choices and all those offered before."""
        menu = self.menu
        for choice in choices:
            if menu is None:
                menu = Menu.of([choice])
            elif not menu.offers(choice):
                menu = menu.with_choice(choice)
        assert menu is not None
        self.menu = menu
        return menu

    def note(self, outcome: SolverResult) -> SolverResult:
        """Count one outcome and pass it on."""
        self.statuses[outcome.status] += 1
        return outcome


def examine(task: Task, scaled: Array, separators: Separators) -> Candidate:
    """Check a point of the unit box in NumPy; what encloses the mirrors is taken from the mirrors themselves."""
    return examine_all(task, scaled[:, None], [separators])[0]


def examine_all(task: Task, scaled: Array, separators: Sequence[Separators]) -> list[Candidate]:
    """Check points of the unit box at once, shape (variables, points), each with its separators."""
    problem, shape = task.problem, scaled.shape[1:]
    with np.errstate(all="ignore"):
        values, system = assemble_enclosed(problem, physical_values(problem, scaled))
        evaluation = check(problem, system)
        goals = {name: np.broadcast_to(getattr(system, name), shape) for name in GOALS}
    enclosed = scaled_values(problem, values)
    by_name = {name: np.broadcast_to(value, shape) for name, value in values.items()}
    violations = evaluation.largest_violations
    return [
        Candidate(
            problem,
            task.lens,
            task.scales,
            enclosed[:, index],
            {name: float(value[index]) for name, value in by_name.items()},
            {name: float(value[index]) for name, value in goals.items()},
            choice,
            float(violations[index]),
            evaluation.of_design(index),
        )
        for index, choice in enumerate(separators)
    ]


def make_feasible(task: Task, starts: Sequence[Candidate]) -> list[Candidate]:
    """Reduce the largest violation of every start, until it is feasible or nothing helps."""
    best = list(starts)
    choices = [start.separators for start in starts]
    active = [index for index, start in enumerate(starts) if not start.is_feasible]
    if not active:
        return best
    for _ in range(ROUNDS):
        menu = task.offer(choices[index] for index in active)
        outcomes = [
            task.note(
                reduce_violation(
                    task.problem, menu, choices[index], best[index].scaled, task.scales, best[index].violation
                )
            )
            for index in active
        ]
        again = []
        for index, reached in zip(active, _examine_outcomes(task, outcomes, [choices[i] for i in active]), strict=True):
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


def improve(task: Task, starts: Sequence[Candidate], goal: Target) -> list[Candidate]:
    """Minimise a goal from every start, each feasible: never worse than it was."""
    best = list(starts)
    choices = [start.separators for start in starts]
    active = list(range(len(starts)))
    for _ in range(ROUNDS):
        menu = task.offer(choices[index] for index in active)
        outcomes = [
            task.note(solve(task.problem, menu, choices[index], best[index].scaled, goal, task.scales))
            for index in active
        ]
        again = []
        for index, reached in zip(active, _examine_outcomes(task, outcomes, [choices[i] for i in active]), strict=True):
            choice = choices[index]
            better = reached.goals[goal.minimise] < best[index].goals[goal.minimise] * (1.0 - SAME_OBJECTIVE)
            if reached.is_feasible and reached.keeps(goal) and better:
                best[index] = reached
            # A feasible result may be held by a separator that need not be; one that is not feasible met a pair that
            # had been left out as far.
            chosen = _rechosen(task, choice, best[index] if reached.is_feasible else reached)
            if chosen != choice:
                choices[index] = chosen
                again.append(index)
        place = {id(best[index]): index for index in again}
        distinct = distinct_designs([best[index] for index in again], goal.minimise)
        active = [place[id(design)] for design in distinct[:MOST_DESIGNS_IN_LATER_ROUNDS]]
        if not active:
            break
    return best


def start_at(task: Task, scaled: Array) -> list[Candidate]:
    """Points of the unit box, shape (variables, points), as starts: each with the separators chosen there."""
    problem = task.problem
    with np.errstate(all="ignore"):
        values, system = assemble_enclosed(problem, physical_values(problem, scaled))
        evaluation = check(problem, system)
    choices = choose_separators(evaluation, problem.specification.clearance, problem.specification.envelope_height)
    task.offer(choices)
    return examine_all(task, scaled_values(problem, values), choices)


def start_around(task: Task, design: Candidate, random: np.random.Generator) -> list[Candidate]:
    """Starts at random places around a design.

    An optimum is one for the separators it was found with; a little aside others serve, and may lead on.
    """
    free = np.array([not task.problem.bounds[name].is_fixed for name in VARIABLES])
    moves = np.geomspace(*HOP_SPREADS, HOPS) * random.standard_normal((len(VARIABLES), HOPS))
    return start_at(task, np.clip(design.scaled[:, None] + moves * free[:, None], 0.0, 1.0))


def hop(task: Task, design: Candidate, goal: Target, random: np.random.Generator) -> Candidate:
    """Minimise a goal from around its minimum, again and again until nothing better comes of it."""
    while True:
        starts = start_around(task, design, random)
        feasible = [candidate for candidate in make_feasible(task, starts) if candidate.is_feasible]
        reached = [found for found in improve(task, feasible, goal) if found.keeps(goal)] if feasible else []
        best = min(reached, key=lambda found: found.goals[goal.minimise], default=design)
        if not best.goals[goal.minimise] < design.goals[goal.minimise] * (1.0 - WORTH_ANOTHER_HOP):
            return min(best, design, key=lambda found: found.goals[goal.minimise])
        design = best


def follow(task: Task, start: Array, separators: Separators, goal: Target) -> Candidate | None:
    """Minimise a goal from near its minimum, feasible or not; None if nothing feasible comes of it.

    The program offers the one choice of separators only, which a neighbour has probably asked for already.
    """
    best: Candidate | None = None
    for _ in range(ROUNDS):
        menu = Menu.of([separators])
        outcome = task.note(solve(task.problem, menu, separators, start, goal, task.scales))
        reached = examine(task, outcome.scaled, separators)
        if reached.is_feasible and reached.keeps(goal):
            aim = goal.minimise
            gains = best is None or reached.goals[aim] < best.goals[aim] * (1.0 - SAME_OBJECTIVE)
            if not gains:
                break
            best, start = reached, reached.scaled
        chosen = _rechosen(task, separators, reached)
        if chosen == separators:
            break
        separators = chosen
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


def _examine_outcomes(
    task: Task, outcomes: Sequence[SolverResult], separators: Sequence[Separators]
) -> list[Candidate]:
    return examine_all(task, np.stack([outcome.scaled for outcome in outcomes], axis=1), separators)


def _rechosen(task: Task, separators: Separators, candidate: Candidate) -> Separators:
    return rechoose(separators, candidate.evaluation, task.problem.specification.clearance, candidate.violation)
