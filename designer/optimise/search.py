"""The search for the best design of a configuration: starts, two stages, and a check of every claim.

For each lens and each variant, designs are screened, the most promising are solved for the first objective, and from
the best of them the second is minimised with the first kept within its tolerance. A solver's word counts for nothing:
a design is feasible when NumPy, evaluating every constraint and every clearance anew, finds them kept.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from designer.configurations import Configuration
from designer.optimise.box import Ranges, box_of, limit_of
from designer.optimise.descent import (
    SAME_OBJECTIVE,
    Candidate,
    Task,
    distinct_designs,
    examine,
    improve,
    make_feasible,
)
from designer.optimise.feasibility import why_fixed_conflicts, why_impossible
from designer.optimise.program import Goal
from designer.optimise.rules import rules_of
from designer.optimise.screening import Problem, assemble_enclosed, check, physical_values, scaled_values, screen
from designer.optimise.separators import choose_separators
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement

# From so many of the best different designs the second objective is minimised.
MOST_DESIGNS_IN_SECOND_STAGE = 6
# Nobody should hear "infeasible" for want of starts: so many times more are tried before it is said.
MORE_STARTS_IF_INFEASIBLE = 3
_SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


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
    statuses: dict[str, int] = field(default_factory=dict)

    @property
    def solves(self) -> int:
        """How often the solver ran."""
        return sum(self.statuses.values())

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
    reasons: list[str] = []
    tasks: list[Task] = []
    found: list[tuple[Task, list[Candidate]]] = []
    misses: list[Candidate] = []
    for lens, variant in product(requirement.camera.lenses, enumerate_variants(configuration)):
        ranges = Ranges(requirement.baseline_range_mm, lens.principal_distances_mm)
        rules = rules_of(requirement, lens)
        reason = why_impossible(variant, rules, ranges)
        if reason is not None:
            reasons.append(reason)
            continue
        problem = Problem(variant, rules, box_of(variant, rules, ranges), tuple(sorted(fixed.items())))
        task = Task(problem, lens, _goal_scales(problem), Counter())
        tasks.append(task)
        feasible, miss = _first_stage(requirement, task)
        if feasible:
            found.append((task, feasible))
        if miss is not None:
            misses.append(miss)
    if not found and not misses:
        return SearchResult(configuration, "impossible", "; ".join(dict.fromkeys(reasons)))
    if not found:
        return _infeasible(configuration, tasks, misses)
    return _second_stage(requirement, configuration, tasks, found)


def _goal_scales(problem: Problem) -> tuple[float, ...]:
    """A typical size of each goal, so that the solver sees numbers near one."""
    rules = problem.rules
    middle = {name: (interval.low + interval.high) / 2.0 for name, interval in problem.box.items()}
    depth_error = float(limit_of(problem.variant, rules, middle["baseline"], middle["principal_distance"]))
    height, diameter = rules.envelope_height, rules.envelope_diameter
    return (depth_error if depth_error > 0.0 else 0.01, height, diameter, math.pi / 4.0 * diameter**2 * height)


def _first_stage(requirement: Requirement, task: Task) -> tuple[list[Candidate], Candidate | None]:
    """Solve for the first objective from every start: feasible designs, and the nearest miss if there are none."""
    variant = task.problem.variant
    key = zlib.crc32(f"{variant.configuration.name}/{variant.label}".encode())
    random = np.random.default_rng([requirement.solve.seed, key])
    misses: list[Candidate] = []
    for starts in (requirement.solve.starts, MORE_STARTS_IF_INFEASIBLE * requirement.solve.starts):
        reached = make_feasible(task, _starts(task, starts, random))
        feasible = [candidate for candidate in reached if candidate.is_feasible]
        if feasible:
            return improve(task, feasible, Goal(requirement.objective.minimise)), None
        misses += reached
    return [], min(misses, key=lambda miss: miss.violation)


def _starts(task: Task, count: int, random: np.random.Generator) -> list[Candidate]:
    """Screened designs, each with the separators to start with."""
    problem = task.problem
    screened = screen(problem, count, random)
    values, assembly = assemble_enclosed(problem, physical_values(problem, screened))
    scaled = scaled_values(problem, values)
    choices = choose_separators(check(problem, assembly), problem.rules.clearance, problem.rules.envelope_height)
    task.offer(choices)
    return [examine(task, scaled[:, index], choice) for index, choice in enumerate(choices)]


def _second_stage(
    requirement: Requirement,
    configuration: Configuration,
    tasks: list[Task],
    found: list[tuple[Task, list[Candidate]]],
) -> SearchResult:
    """Minimise the second objective, with the first within its tolerance of the configuration's best."""
    first_goal, second_goal = requirement.objective.minimise, requirement.objective.then
    first = min((design for _, designs in found for design in designs), key=lambda design: design.goals[first_goal])
    bound = first.goals[first_goal] * (1.0 + max(requirement.objective.within_percent / 100.0, SAME_OBJECTIVE))
    goal = Goal(second_goal, ((first_goal, bound),))
    improved: list[Candidate] = []
    for task, designs in found:
        near = [design for design in designs if design.goals[first_goal] <= bound]
        improved += improve(task, distinct_designs(near, second_goal)[:MOST_DESIGNS_IN_SECOND_STAGE], goal)
    best = min(improved, key=lambda design: design.goals[second_goal])
    return SearchResult(configuration, "feasible", "", first=first, best=best, statuses=_all_statuses(tasks))


def _all_statuses(tasks: Iterable[Task]) -> dict[str, int]:
    return dict(sum((task.statuses for task in tasks), Counter()))


def _infeasible(configuration: Configuration, tasks: list[Task], misses: list[Candidate]) -> SearchResult:
    statuses = _all_statuses(tasks)
    if not any(status in statuses for status in _SOLVED):
        said = ", ".join(f"{status} ({count})" for status, count in statuses.items())
        return SearchResult(configuration, "failed", f"the solver never came to an end: {said}", statuses=statuses)
    nearest = min(misses, key=lambda miss: miss.violation)
    worst = int(nearest.report.violations[:, 0].argmax())
    short = abs(float(nearest.report.amounts[worst, 0]))
    unit, name = nearest.report.units[worst], nearest.report.names[worst]
    shortfall = Shortfall(name, short, unit, nearest.violation, nearest.problem.variant.label)
    variant = f" ({shortfall.variant})" if shortfall.variant else ""
    return SearchResult(
        configuration,
        "infeasible",
        f"no feasible point found; the nearest{variant} misses by {shortfall.amount:.3g} {unit}: {name}",
        shortfall=shortfall,
        statuses=statuses,
    )
