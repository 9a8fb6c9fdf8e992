"""The search for the best design of a configuration: starts, two stages, and a check of every claim.

For each lens and each variant, designs are screened, the most promising are solved for the first objective, and from
the best of them the second is minimised with the first kept within its tolerance. A solver's word counts for nothing:
a design is feasible when NumPy, evaluating every constraint and every clearance anew, finds them kept.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from designer.configurations import Configuration
from designer.optimise.box import Ranges, box_of, limit_of
from designer.optimise.feasibility import why_fixed_conflicts, why_impossible
from designer.optimise.program import GOALS, Goal, Menu, Outcome, Separators, reduce_violation, solve
from designer.optimise.rules import rules_of
from designer.optimise.screening import Check, Problem, assemble_enclosed, check, physical_values, scaled_values, screen
from designer.optimise.separators import choose_separators, rechoose
from designer.optimise.variants import enumerate_variants
from designer.requirement import Lens, Requirement

Array = NDArray[np.float64]

# A design is feasible when no constraint fails by more than this, as a share of its scale (a nanometre for lengths).
LARGEST_VIOLATION = 1e-6
# Objectives nearer than this, as a ratio, are the same optimum.
SAME_OBJECTIVE = 1e-7
# How often the directions that keep light and solids apart are chosen anew at a result.
SEPARATOR_ROUNDS = 4
# Once the first objective has reached its proven least value, this many different designs are enough for the second.
ENOUGH_OPTIMA = 4


@dataclass(frozen=True, slots=True)
class Candidate:
    """A design in the unit box, checked; it carries what is needed to go on from it."""

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    scaled: Array
    values: dict[str, float]
    goals: dict[str, float]
    separators: Separators
    violation: float
    report: Check

    @property
    def is_feasible(self) -> bool:
        """Whether every constraint is kept, by independent evaluation."""
        return self.violation <= LARGEST_VIOLATION


@dataclass(frozen=True, slots=True)
class Shortfall:
    """The constraint that fails most at the point of least largest violation, in its own unit."""

    constraint: str
    amount: float
    unit: str
    scaled: float
    variant: str


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What the search found for one configuration.

    ``first`` is the best design by the first objective, ``best`` the one after the second stage; both None unless
    the status is feasible. ``statuses`` counts what the solver said.
    """

    configuration: Configuration
    status: str
    reason: str
    first: Candidate | None = None
    best: Candidate | None = None
    shortfall: Shortfall | None = None
    solves: int = 0
    statuses: dict[str, int] = field(default_factory=dict)

    @property
    def limit_of_first(self) -> float:
        """The closed-form least depth error at the first-stage design's own baseline and principal distance."""
        assert self.first is not None
        problem, values = self.first.problem, self.first.values
        return float(limit_of(problem.variant, problem.rules, values["baseline"], values["principal_distance"]))


def fixed_parameters(requirement: Requirement, configuration: Configuration) -> dict[str, float]:
    """The parameters the requirement fixes, by names such as ``primary.radius_mm`` and ``upper.gain``."""
    given: dict[str, float] = {}
    for owners in (requirement.fixed.mirror, requirement.fixed.view):
        for owner, part in owners.items():
            given |= {f"{owner}.{name}": value for name, value in part.model_dump(exclude_none=True).items()}
    return given


def search(requirement: Requirement, configuration: Configuration) -> SearchResult:
    """Find the best design of one configuration, or say why there is none."""
    fixed = fixed_parameters(requirement, configuration)
    conflict = why_fixed_conflicts(configuration, fixed)
    if conflict is not None:
        return SearchResult(configuration, "impossible", conflict)
    log = _Log()
    reasons: list[str] = []
    found: list[tuple[_Task, Candidate]] = []
    misses: list[Candidate] = []
    for lens, variant in product(requirement.camera.lenses, enumerate_variants(configuration)):
        ranges = Ranges(requirement.baseline_range_mm, lens.principal_distances_mm)
        rules = rules_of(requirement, lens)
        reason = why_impossible(variant, rules, ranges)
        if reason is not None:
            reasons.append(reason)
            continue
        problem = Problem(variant, rules, box_of(variant, rules, ranges), tuple(sorted(fixed.items())))
        task = _Task(problem, lens, _goal_scales(problem), log)
        feasible, miss = _first_stage(requirement, task)
        found += [(task, candidate) for candidate in feasible]
        if miss is not None:
            misses.append(miss)
    if not found and not misses:
        return SearchResult(configuration, "impossible", "; ".join(dict.fromkeys(reasons)))
    if not found:
        return _infeasible(configuration, misses, log)
    return _second_stage(requirement, configuration, found, log)


def _goal_scales(problem: Problem) -> tuple[float, ...]:
    """A typical size of each goal, so that the solver sees numbers near one."""
    rules = problem.rules
    middle = {name: (interval.low + interval.high) / 2.0 for name, interval in problem.box.items()}
    depth_error = float(limit_of(problem.variant, rules, middle["baseline"], middle["principal_distance"]))
    height, diameter = rules.envelope_height, rules.envelope_diameter
    return (depth_error if depth_error > 0.0 else 0.01, height, diameter, math.pi / 4.0 * diameter**2 * height)


class _Log:
    """Counts what the solver said."""

    def __init__(self) -> None:
        self.statuses: Counter[str] = Counter()

    def note(self, outcome: Outcome) -> Outcome:
        """Count one outcome and pass it on."""
        self.statuses[outcome.status] += 1
        return outcome


@dataclass(slots=True)
class _Task:
    """A problem with what a search needs beside it; the menu grows with the separators that turn out to be needed."""

    problem: Problem
    lens: Lens
    scales: tuple[float, ...]
    log: _Log
    menu: Menu | None = None

    def menu_for(self, separators: Separators) -> Menu:
        """A menu that offers the separators and all those asked for before."""
        if self.menu is None:
            self.menu = Menu.of([separators])
        elif not self.menu.offers(separators):
            self.menu = self.menu.with_choice(separators)
        return self.menu


def _first_stage(requirement: Requirement, task: _Task) -> tuple[list[Candidate], Candidate | None]:
    """Solve for the first objective from every start: feasible designs, and the nearest miss if there are none."""
    problem = task.problem
    name = problem.variant.configuration.name
    random = np.random.default_rng([requirement.solve.seed, zlib.crc32(f"{name}/{problem.variant.label}".encode())])
    starts = screen(problem, requirement.solve.starts, random)
    values, assembly = assemble_enclosed(problem, physical_values(problem, starts))
    report = check(problem, assembly)
    scaled = scaled_values(problem, values)
    separators = choose_separators(report, problem.rules.clearance, problem.rules.envelope_height)
    task.menu = Menu.of(separators)
    goal = Goal(requirement.objective.minimise)
    limit = _proven_least(requirement, task)
    feasible: list[Candidate] = []
    misses: list[Candidate] = []
    for index, choice in enumerate(separators):
        start = _examine(task, scaled[:, index], choice)
        if not start.is_feasible:
            start = _make_feasible(task, start)
        if not start.is_feasible:
            misses.append(start)
            continue
        feasible.append(_improve(task, start, goal))
        if feasible[-1].goals[goal.minimise] <= limit * (1.0 + SAME_OBJECTIVE) and len(feasible) >= ENOUGH_OPTIMA:
            break
    nearest = min(misses, key=lambda miss: miss.violation) if misses and not feasible else None
    return feasible, nearest


def _proven_least(requirement: Requirement, task: _Task) -> float:
    """The least value of the first objective that any mirrors could reach, where a closed form knows it."""
    baseline, distance = task.problem.box["baseline"], task.problem.box["principal_distance"]
    if requirement.objective.minimise != "depth_error" or not (baseline.is_fixed and distance.is_fixed):
        return 0.0
    return float(limit_of(task.problem.variant, task.problem.rules, baseline.low, distance.low))


def _make_feasible(task: _Task, start: Candidate) -> Candidate:
    """Reduce the largest violation, choosing separators anew where they stand in the way."""
    best = start
    separators = start.separators
    for _ in range(SEPARATOR_ROUNDS):
        menu = task.menu_for(separators)
        outcome = task.log.note(
            reduce_violation(task.problem, menu, separators, best.scaled, task.scales, max(best.violation, 0.0))
        )
        reached = _examine(task, outcome.scaled, separators)
        if not reached.violation < best.violation:
            break
        best = reached
        if best.is_feasible:
            break
        chosen = _rechosen(task, separators, best)
        if chosen == separators:
            break
        separators = chosen
    return best


def _improve(task: _Task, start: Candidate, goal: Goal) -> Candidate:
    """Minimise a goal from a feasible design, choosing separators anew where they stand in the way."""
    best = start
    separators = start.separators
    for _ in range(SEPARATOR_ROUNDS):
        menu = task.menu_for(separators)
        outcome = task.log.note(solve(task.problem, menu, separators, best.scaled, goal, task.scales))
        reached = _examine(task, outcome.scaled, separators)
        kept = all(reached.goals[name] <= bound * (1.0 + LARGEST_VIOLATION) for name, bound in goal.bounds)
        better = reached.goals[goal.minimise] < best.goals[goal.minimise] * (1.0 - SAME_OBJECTIVE)
        if reached.is_feasible and kept and better:
            best = reached
        # A feasible result may be held by a separator that need not be; one that is not feasible met a pair that had
        # been left out as far.
        chosen = _rechosen(task, separators, best if reached.is_feasible else reached)
        if chosen == separators:
            break
        separators = chosen
    return best


def _examine(task: _Task, scaled: Array, separators: Separators) -> Candidate:
    """Check a point of the unit box in NumPy; what encloses the mirrors is taken from the mirrors themselves."""
    problem = task.problem
    with np.errstate(all="ignore"):
        values, assembly = assemble_enclosed(problem, physical_values(problem, scaled[:, None]))
        report = check(problem, assembly)
    enclosed = scaled_values(problem, values)[:, 0]
    goals = {name: float(np.ravel(getattr(assembly, name))[0]) for name in GOALS}
    return Candidate(
        problem,
        task.lens,
        task.scales,
        enclosed,
        {name: float(np.ravel(value)[0]) for name, value in values.items()},
        goals,
        separators,
        float(report.largest_violations[0]),
        report,
    )


def improve(candidate: Candidate, goal: str) -> Candidate:
    """Minimise one goal alone from a feasible design."""
    return _improve(_task_of(candidate), candidate, Goal(goal))


def shrink_to(candidate: Candidate, goal: str, size: str, limit: float) -> Candidate | None:
    """Minimise a goal from a feasible design with one size bounded; None if nothing feasible comes of it."""
    task = _task_of(candidate)
    start = candidate
    if start.goals[size] > limit:
        smaller = _improve(task, candidate, Goal(size, ((size, limit),)))
        if smaller.goals[size] > limit * (1.0 + LARGEST_VIOLATION):
            return None
        start = smaller
    return _improve(task, start, Goal(goal, ((size, limit),)))


def _task_of(candidate: Candidate) -> _Task:
    return _Task(candidate.problem, candidate.lens, candidate.scales, _Log())


def _rechosen(task: _Task, separators: Separators, candidate: Candidate) -> Separators:
    return rechoose(separators, candidate.report, task.problem.rules.clearance, candidate.violation)


def _second_stage(
    requirement: Requirement, configuration: Configuration, found: list[tuple[_Task, Candidate]], log: _Log
) -> SearchResult:
    """Minimise the second objective, with the first within its tolerance of the configuration's best."""
    first_goal, second_goal = requirement.objective.minimise, requirement.objective.then
    _, first = min(found, key=lambda item: item[1].goals[first_goal])
    bound = first.goals[first_goal] * (1.0 + max(requirement.objective.within_percent / 100.0, SAME_OBJECTIVE))
    near = sorted(
        (item for item in found if item[1].goals[first_goal] <= bound), key=lambda item: item[1].goals[second_goal]
    )
    goal = Goal(second_goal, ((first_goal, bound),))
    best = min(
        (_improve(task, candidate, goal) for task, candidate in near), key=lambda design: design.goals[second_goal]
    )
    return SearchResult(
        configuration,
        "feasible",
        "",
        first=first,
        best=best,
        solves=log.statuses.total(),
        statuses=dict(log.statuses),
    )


def _infeasible(configuration: Configuration, misses: list[Candidate], log: _Log) -> SearchResult:
    nearest = min(misses, key=lambda miss: miss.violation)
    worst = int(nearest.report.violations[:, 0].argmax())
    short = -float(nearest.report.amounts[worst, 0])
    unit, name = nearest.report.units[worst], nearest.report.names[worst]
    shortfall = Shortfall(name, abs(short), unit, nearest.violation, nearest.problem.variant.label)
    variant = f" ({shortfall.variant})" if shortfall.variant else ""
    return SearchResult(
        configuration,
        "infeasible",
        f"no feasible point found; the nearest{variant} misses by {shortfall.amount:.3g} {unit}: {name}",
        shortfall=shortfall,
        solves=log.statuses.total(),
        statuses=dict(log.statuses),
    )
