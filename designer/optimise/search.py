"""The search for the best design of a configuration: starts, two stages, and a check of every claim.

For each lens and each variant, designs are screened, the most promising are solved for the first objective, and from
the best of them the second is minimised with the first kept within its tolerance. A solver's word counts for nothing:
a design is feasible when NumPy, evaluating every constraint and every clearance anew, finds them kept.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from designer.configurations import Configuration
from designer.optimise.bounds import SMALLEST_GAIN_SHARE, Ranges, bounds_of, limit_of
from designer.optimise.impossibility import why_fixed_conflicts, why_impossible
from designer.optimise.multistart import (
    WORTH_ANOTHER_HOP,
    Candidate,
    Task,
    distinct_designs,
    examine,
    follow,
    hop,
    improve,
    make_feasible,
    start_around,
    start_at,
)
from designer.optimise.program import SOLVED, STALLED, Target
from designer.optimise.screening import (
    LARGE_GAIN_SHARE,
    Problem,
    scaled_values,
    screen,
)
from designer.optimise.separating_directions import Separators
from designer.optimise.specification import specification_of
from designer.optimise.variants import Variant, enumerate_variants
from designer.requirement import Lens, Requirement

# From so many of the best different designs the second objective is minimised.
MOST_DESIGNS_IN_SECOND_STAGE = 6
# Nobody should hear "infeasible" for want of starts: so many times more are tried before it is said, with small gains
# too, which waste the image but let the light pass where large ones do not.
MORE_STARTS_IF_INFEASIBLE = 2

# Violations within this share of the largest are as large.
TIED = 1e-3


@dataclass(frozen=True, slots=True)
class Shortfall:
    """A constraint that fails most at the point of least largest violation, the first by name, in its own unit."""

    constraint: str
    amount: float
    unit: str
    scaled: float
    variant: str


@dataclass(frozen=True, slots=True)
class WarmStart:
    """Where the search of one lens and variant ended: enough for a neighbouring requirement to start from.

    ``first`` holds the physical variables of the best first-stage design, or of the nearest miss; ``second`` those of
    the best second-stage design, None if there is none. Each has the separators it was found with.
    """

    lens: int
    variant: int
    is_feasible: bool
    first: dict[str, float]
    second: dict[str, float] | None
    separators: Separators
    second_separators: Separators | None = None


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What the search found for one configuration.

    ``first`` is the best design by the first objective, ``best`` the one after the second stage; both None unless
    the status is feasible. ``statuses`` counts what the solver said; ``trails`` has one entry for each lens and
    variant that is not impossible by rule.
    """

    configuration: Configuration
    status: str
    reason: str
    first: Candidate | None = None
    best: Candidate | None = None
    shortfall: Shortfall | None = None
    statuses: dict[str, int] = field(default_factory=dict)
    trails: tuple[WarmStart, ...] = ()

    @property
    def solves(self) -> int:
        """How often the solver ran."""
        return sum(self.statuses.values())

    @property
    def limit_of_first(self) -> float:
        """The closed-form least depth error at the first-stage design's own baseline and principal distance."""
        assert self.first is not None
        problem, values = self.first.problem, self.first.values
        return float(limit_of(problem.variant, problem.specification, values["baseline"], values["principal_distance"]))


def fixed_parameters(requirement: Requirement) -> dict[str, float]:
    """The parameters the requirement fixes, by names such as ``primary.radius_mm`` and ``upper.gain``."""
    given: dict[str, float] = {}
    for owners in (requirement.fixed.mirror, requirement.fixed.view):
        for owner, part in owners.items():
            given |= {f"{owner}.{name}": value for name, value in part.model_dump(exclude_none=True).items()}
    return given


def search(requirement: Requirement, configuration: Configuration, parent: Sequence[WarmStart] = ()) -> SearchResult:
    """Find the best design of one configuration, or say why there is none.

    With the trails of a neighbouring requirement, each variant starts from where it ended there, and from screened
    designs only where that fails though it succeeded there.
    """
    fixed = fixed_parameters(requirement)
    conflict = why_fixed_conflicts(configuration, fixed)
    if conflict is not None:
        return SearchResult(configuration, "impossible", conflict)
    from_parent = {(trail.lens, trail.variant): trail for trail in parent}
    reasons: list[str] = []
    branches: list[_Branch] = []
    for (lens_index, lens), (variant_index, variant) in product(
        enumerate(requirement.camera.lenses), enumerate(enumerate_variants(configuration))
    ):
        ranges = Ranges(requirement.baseline_range_mm, lens.principal_distances_mm)
        reason = why_impossible(variant, specification_of(requirement, lens), ranges)
        if reason is not None:
            reasons.append(reason)
            continue
        branch = _Branch(lens_index, variant_index, _task(requirement, lens, variant))
        _first_stage(requirement, branch, from_parent.get((lens_index, variant_index)))
        branches.append(branch)
    if not branches:
        return SearchResult(configuration, "impossible", "; ".join(dict.fromkeys(reasons)))
    if not any(branch.designs for branch in branches):
        return _infeasible(configuration, branches)
    return _second_stage(requirement, configuration, branches)


def problem_of(requirement: Requirement, lens: Lens, variant: Variant) -> Problem:
    """A variant under a requirement with one of its lenses."""
    specification = specification_of(requirement, lens)
    ranges = Ranges(requirement.baseline_range_mm, lens.principal_distances_mm)
    fixed = tuple(sorted(fixed_parameters(requirement).items()))
    return Problem(variant, specification, bounds_of(variant, specification, ranges), fixed)


def recall(
    requirement: Requirement, configuration: Configuration, trail: WarmStart
) -> tuple[Candidate, Candidate | None]:
    """The first-stage and the second-stage design of a trail, checked anew under the requirement it belongs to."""
    lens = requirement.camera.lenses[trail.lens]
    task = _task(requirement, lens, enumerate_variants(configuration)[trail.variant])
    first = examine(task, _moved(task, trail.first), trail.separators)
    if trail.second is None or trail.second_separators is None:
        return first, None
    return first, examine(task, _moved(task, trail.second), trail.second_separators)


def _task(requirement: Requirement, lens: Lens, variant: Variant) -> Task:
    problem = problem_of(requirement, lens, variant)
    return Task(problem, lens, _goal_scales(problem), Counter())


@dataclass(slots=True)
class _Branch:
    """The search of one lens and variant: its feasible designs, or else its nearest miss."""

    lens: int
    variant: int
    task: Task
    designs: list[Candidate] = field(default_factory=list)
    miss: Candidate | None = None
    smallest: Candidate | None = None
    known: WarmStart | None = None

    def trail(self, goal: str) -> WarmStart:
        """What a neighbour needs to go on from here."""
        first = min(self.designs, key=lambda design: design.goals[goal]) if self.designs else self.miss
        assert first is not None
        return WarmStart(
            self.lens,
            self.variant,
            bool(self.designs),
            first.values,
            self.smallest.values if self.smallest else None,
            first.separators,
            self.smallest.separators if self.smallest else None,
        )


def _goal_scales(problem: Problem) -> tuple[float, ...]:
    """A typical size of each goal, so that the solver sees numbers near one."""
    specification = problem.specification
    middle = {name: (interval.low + interval.high) / 2.0 for name, interval in problem.bounds.items()}
    depth_error = float(limit_of(problem.variant, specification, middle["baseline"], middle["principal_distance"]))
    height, diameter = specification.envelope_height, specification.envelope_diameter
    return (depth_error if depth_error > 0.0 else 0.01, height, diameter, math.pi / 4.0 * diameter**2 * height)


def _first_stage(requirement: Requirement, branch: _Branch, trail: WarmStart | None) -> None:
    """Solve for the first objective from every start."""
    task, goal = branch.task, Target(requirement.objective.minimise)
    reached: list[Candidate] = []
    few, many = requirement.solve.starts, MORE_STARTS_IF_INFEASIBLE * requirement.solve.starts
    rounds = [(few, LARGE_GAIN_SHARE), (many, SMALLEST_GAIN_SHARE)]
    if trail is not None:
        branch.known = trail
        followed = follow(task, _moved(task, trail.first), trail.separators, goal) if trail.is_feasible else None
        if followed is not None:
            branch.designs = [followed]
            return
        neighbours = [examine(task, _moved(task, trail.first), trail.separators)]
        if trail.second is not None and trail.second_separators is not None:
            neighbours.append(examine(task, _moved(task, trail.second), trail.second_separators))
        reached = make_feasible(task, neighbours)
        feasible = [candidate for candidate in reached if candidate.is_feasible]
        if feasible:
            branch.designs = improve(task, feasible, goal)
            return
        if not trail.is_feasible:
            branch.miss = reached[0]
            return
    variant = task.problem.variant
    key = zlib.crc32(f"{variant.configuration.name}/{variant.label}".encode())
    random = np.random.default_rng([requirement.solve.seed, key])
    for starts, least_gain_share in rounds:
        reached += make_feasible(task, _starts(task, starts, random, least_gain_share))
        if any(candidate.is_feasible for candidate in reached):
            break
    else:
        nearest = min(reached, key=lambda candidate: candidate.violation)
        reached += make_feasible(task, start_around(task, nearest, random))
    feasible = [candidate for candidate in reached if candidate.is_feasible]
    if feasible:
        branch.designs = improve(task, feasible, goal)
        best = min(branch.designs, key=lambda design: design.goals[goal.minimise])
        if not _is_proven_least(best, goal):
            branch.designs.append(hop(task, best, goal, random))
    else:
        branch.miss = min(reached, key=lambda candidate: candidate.violation)


def _is_proven_least(design: Candidate, goal: Target) -> bool:
    """Whether a design reaches the closed-form limit, and nothing that it depends on could be chosen otherwise."""
    problem, values = design.problem, design.values
    if goal.minimise != "depth_error" or not all(
        problem.bounds[n].is_fixed for n in ("baseline", "principal_distance")
    ):
        return False
    limit = float(limit_of(problem.variant, problem.specification, values["baseline"], values["principal_distance"]))
    return design.goals["depth_error"] <= limit * (1.0 + WORTH_ANOTHER_HOP)


def _moved(task: Task, values: dict[str, float]) -> NDArray[np.float64]:
    """A neighbour's design, moved into this problem's box."""
    scaled = scaled_values(task.problem, {name: np.array([value]) for name, value in values.items()})
    return np.clip(scaled[:, 0], 0.0, 1.0)


def _starts(task: Task, count: int, random: np.random.Generator, least_gain_share: float) -> list[Candidate]:
    """Screened designs, each with the separators to start with."""
    return start_at(task, screen(task.problem, count, random, least_gain_share))


def _second_stage(requirement: Requirement, configuration: Configuration, branches: list[_Branch]) -> SearchResult:
    """Minimise the second objective, with the first within its tolerance of the configuration's best."""
    first_goal, second_goal = requirement.objective.minimise, requirement.objective.then
    every = [design for branch in branches for design in branch.designs]
    first = min(every, key=lambda design: design.goals[first_goal])
    bound = first.goals[first_goal] * (1.0 + requirement.objective.tolerance)
    goal = Target(second_goal, ((first_goal, bound),))
    improved: list[Candidate] = []
    for branch in branches:
        branch.smallest = _follow_second(branch, goal) or _improve_second(branch, goal)
        if branch.smallest is not None:
            improved.append(branch.smallest)
    best = min(improved, key=lambda design: design.goals[second_goal])
    trails = tuple(branch.trail(first_goal) for branch in branches)
    return SearchResult(
        configuration, "feasible", "", first=first, best=best, statuses=_all_statuses(branches), trails=trails
    )


def _follow_second(branch: _Branch, goal: Target) -> Candidate | None:
    """The second-stage design from that of the neighbour; None if there was none or it leads nowhere."""
    trail = branch.known
    if trail is None or trail.second is None or trail.second_separators is None:
        return None
    return follow(branch.task, _moved(branch.task, trail.second), trail.second_separators, goal)


def _improve_second(branch: _Branch, goal: Target) -> Candidate | None:
    """The second-stage design from those of the first that keep the goal's bounds; None if none does."""
    near = [design for design in branch.designs if design.keeps(goal)]
    if not near:
        return None
    starts = distinct_designs(near, goal.minimise)[:MOST_DESIGNS_IN_SECOND_STAGE]
    return min(improve(branch.task, starts, goal), key=lambda design: design.goals[goal.minimise])


def _all_statuses(branches: list[_Branch]) -> dict[str, int]:
    return dict(sum((branch.task.statuses for branch in branches), Counter()))


def _infeasible(configuration: Configuration, branches: list[_Branch]) -> SearchResult:
    statuses = _all_statuses(branches)
    if not {SOLVED, STALLED} & statuses.keys():
        said = ", ".join(f"{status} ({count})" for status, count in statuses.items())
        return SearchResult(configuration, "failed", f"the solver never came to an end: {said}", statuses=statuses)
    misses = [branch.miss for branch in branches if branch.miss is not None]
    tied = _shortfalls(min(misses, key=lambda miss: miss.violation))
    variant = f" ({tied[0].variant})" if tied[0].variant else ""
    told = "; and as much, ".join(f"{short.amount:.3g} {short.unit}: {short.constraint}" for short in tied)
    return SearchResult(
        configuration,
        "infeasible",
        f"no feasible point found; the nearest{variant} misses by {told}",
        shortfall=tied[0],
        statuses=statuses,
        trails=tuple(branch.trail("depth_error") for branch in branches),
    )


def _shortfalls(miss: Candidate) -> list[Shortfall]:
    """The constraints that fail most, by name: several tie where the largest violation is least, in no fixed order."""
    evaluation, variant = miss.evaluation, miss.problem.variant.label
    failing = np.flatnonzero(evaluation.violations[:, 0] >= (1.0 - TIED) * evaluation.violations[:, 0].max())
    # A constraint on both ends of a zone has one name for the two.
    amounts = {
        evaluation.names[index]: (abs(float(evaluation.amounts[index, 0])), evaluation.units[index])
        for index in failing
    }
    return [Shortfall(name, *amounts[name], miss.violation, variant) for name in sorted(amounts)]
