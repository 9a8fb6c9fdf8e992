"""The search of one lens and one variant of a configuration: its first stage, and where it can go on from.

Designs are screened and the most promising solved for the first objective, or the design of a neighbouring requirement
is followed.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from designer.goals import GOALS, TypicalSizes
from designer.optimise.limit import limit_of
from designer.optimise.multistart import (
    WORTH_ANOTHER_RESTART,
    Candidate,
    Task,
    examine,
    follow,
    improve,
    make_feasible,
    restart_around,
    start_around,
    start_at,
)
from designer.optimise.problem import Array, Problem
from designer.optimise.required_numbers import specification_of
from designer.optimise.screening import LARGE_GAIN_SHARE, screen
from designer.optimise.separating_directions import SeparatingDirections
from designer.optimise.solver import StageTarget
from designer.optimise.variables import (
    SMALLEST_GAIN_SHARE,
    bounds_of,
    fixed_parameters,
    free_ranges,
    with_principal_distance,
)
from designer.optimise.variants import Variant
from designer.requirement import Lens, Requirement

# Before a configuration is called infeasible, so many times more starts are tried, with small gains too, which waste
# the image but let the light pass where large ones do not.
MORE_STARTS_IF_INFEASIBLE = 2
# So many of the nearest misses that a range holds are then followed beyond it.
MOST_DESIGNS_BEYOND_RANGES = 8
# Scaled violation (mm) of the first starts beyond which a variant that is seldom feasible is given up.
HOPELESS_MISS = 2.0


@dataclass(frozen=True, slots=True)
class WarmStart:
    """Where the search of one lens and variant ended: enough for a neighbouring requirement to start from.

    ``first`` holds the physical variables of the best first-stage design, or of the nearest miss; ``second`` those of
    the best second-stage design, None if there is none. Each has the separating directions it was found with.
    ``first_value`` and ``second_value`` are what they reach in the objective of their stage, None without a design;
    ``scale`` is a size of the first objective, with which it grows from requirement to requirement.
    """

    lens: int
    variant: int
    is_feasible: bool
    first: dict[str, float]
    second: dict[str, float] | None
    directions: SeparatingDirections
    second_directions: SeparatingDirections | None = None
    first_value: float | None = None
    second_value: float | None = None
    scale: float = 1.0


def problem_of(requirement: Requirement, lens: Lens, variant: Variant) -> Problem:
    """A variant under a requirement with one of its lenses."""
    specification = specification_of(requirement, lens)
    free = free_ranges(requirement, lens)
    fixed = tuple(sorted(fixed_parameters(requirement).items()))
    return Problem(variant, specification, bounds_of(variant, specification, free), fixed)


def task_for(requirement: Requirement, lens: Lens, variant: Variant) -> Task:
    """A variant under a requirement with one of its lenses, ready for descents."""
    problem = problem_of(requirement, lens, variant)
    return Task(problem, lens, goal_scales(problem), Counter())


def goal_scales(problem: Problem) -> tuple[float, ...]:
    """A typical size of each goal, so that the solver sees numbers near one."""
    specification = problem.specification
    middle = with_principal_distance(
        {name: (bounds.low + bounds.high) / 2.0 for name, bounds in problem.bounds.items()}
    )
    limit = float(limit_of(problem.variant, specification, middle["baseline"], middle["principal_distance"]))
    envelope = specification.asked.envelope
    sizes = TypicalSizes(limit, envelope.height_mm, envelope.diameter_mm)
    return tuple(goal.typical_size(sizes) for goal in GOALS.values())


@dataclass(slots=True)
class Branch:
    """The search of one lens and variant: its feasible designs, or else its nearest miss.

    ``known`` is where a neighbouring requirement ended, ``smallest`` the best design of the second stage.
    """

    lens: int
    variant: int
    task: Task
    known: WarmStart | None = None
    designs: list[Candidate] = field(default_factory=list)
    miss: Candidate | None = None
    smallest: Candidate | None = None

    def warm_start(self, goal: str, second_goal: str) -> WarmStart:
        """What a neighbour needs to go on from here."""
        first = min(self.designs, key=lambda design: design.goals[goal]) if self.designs else self.miss
        assert first is not None
        smallest = self.smallest
        return WarmStart(
            self.lens,
            self.variant,
            bool(self.designs),
            first.values,
            smallest.values if smallest else None,
            first.directions,
            smallest.directions if smallest else None,
            first.goals[goal] if self.designs else None,
            smallest.goals[second_goal] if smallest else None,
            limit_at(first) if goal == "depth_error" else 1.0,
        )


def recalled_second(task: Task, known: WarmStart) -> Candidate | None:
    """The second-stage design of a warm start, evaluated anew; None if it has none."""
    if known.second is None or known.second_directions is None:
        return None
    return examine(task, moved(task, known.second), known.second_directions)


def first_stage(requirement: Requirement, branch: Branch) -> None:
    """Find designs of least first objective, or the nearest miss: from the warm start if there is one, or afresh."""
    target = StageTarget(requirement.objective.minimise)
    neighbours = []
    if branch.known is not None:
        followed = _follow_first(branch, branch.known, target)
        if followed is None:
            neighbours = _reached_from_neighbour(branch.task, branch.known)
            followed = _improved(branch.task, neighbours, target)
        if followed:
            branch.designs = followed
            return
        if not branch.known.is_feasible:
            branch.miss = neighbours[0]
            return
    search_afresh(requirement, branch, target, neighbours)


def _follow_first(branch: Branch, known: WarmStart, target: StageTarget) -> list[Candidate] | None:
    """The design that follows the neighbour's; None if the neighbour had none or it leads nowhere."""
    if not known.is_feasible:
        return None
    followed = follow(branch.task, moved(branch.task, known.first), known.directions, target)
    return None if followed is None else [followed]


def _reached_from_neighbour(task: Task, known: WarmStart) -> list[Candidate]:
    """Both designs of a neighbour, as near to feasible as they can be brought."""
    first = examine(task, moved(task, known.first), known.directions)
    second = recalled_second(task, known)
    return make_feasible(task, [first] if second is None else [first, second])


def _improved(task: Task, reached: Sequence[Candidate], target: StageTarget) -> list[Candidate]:
    """The feasible ones of some designs, each taken to its minimum; none if none is feasible."""
    feasible = [candidate for candidate in reached if candidate.is_feasible]
    return improve(task, feasible, target) if feasible else []


def search_afresh(
    requirement: Requirement, branch: Branch, target: StageTarget, known: Sequence[Candidate] = ()
) -> None:
    """Search from screened designs, with all that a neighbour's have led to so far."""
    random = random_of(requirement, branch.task.problem.variant)
    reached = [*known, *_reached_from_screened(branch.task, requirement.solve.starts, random, known)]
    branch.designs = _improved(branch.task, reached, target)
    if not branch.designs:
        branch.miss = min(reached, key=lambda candidate: candidate.violation)
        return
    best = min(branch.designs, key=lambda design: design.goals[target.minimise])
    if not _is_proven_least(best, target):
        branch.designs.append(restart_around(branch.task, best, target, random))


def search_with_few_starts(
    requirement: Requirement, branch: Branch, target: StageTarget, starts: int, seed: int
) -> None:
    """Search from a few screened designs, and no further: for many neighbours that tell each other what they find."""
    random = random_of(requirement, branch.task.problem.variant, seed)
    screened = screen(branch.task.problem, starts, random)
    branch.designs = _improved(branch.task, make_feasible(branch.task, start_at(branch.task, screened)), target)


def random_of(requirement: Requirement, variant: Variant, *further: int) -> np.random.Generator:
    """The random numbers of a variant under the requirement's seed; further numbers give others."""
    key = zlib.crc32(f"{variant.configuration.name}/{variant.label}".encode())
    return np.random.default_rng([requirement.solve.seed, key, *further])


def limit_at(design: Candidate) -> float:
    """The closed-form least depth error at a design's own baseline and principal distance, as a share."""
    problem, values = design.problem, design.values
    return float(limit_of(problem.variant, problem.specification, values["baseline"], values["principal_distance"]))


def _reached_from_screened(
    task: Task, count: int, random: np.random.Generator, known: Sequence[Candidate]
) -> list[Candidate]:
    """Screened designs brought as near to feasible as they can be; more of them while none is feasible.

    At first the solver keeps to the ranges of starts: farther off it may lose its way.
    """
    variant, ranges = task.problem.variant, replace(task, problem=task.problem.within_ranges)
    reached: list[Candidate] = []
    for starts, least_gain_share in (
        (count, LARGE_GAIN_SHARE),
        (MORE_STARTS_IF_INFEASIBLE * count, SMALLEST_GAIN_SHARE),
    ):
        screened = screen(task.problem, starts, random, least_gain_share)
        found = make_feasible(ranges, start_at(ranges, screened))
        reached += [replace(candidate, problem=task.problem) for candidate in found]
        is_hopeless = variant.is_seldom_feasible and min(each.violation for each in reached) > HOPELESS_MISS
        if is_hopeless or any(candidate.is_feasible for candidate in (*known, *reached)):
            return reached
    nearest = min((*known, *reached), key=lambda candidate: candidate.violation)
    found = make_feasible(ranges, start_around(ranges, nearest, random))
    reached += [replace(candidate, problem=task.problem) for candidate in found]
    if any(candidate.is_feasible for candidate in found):
        return reached
    held = sorted((each for each in reached if each.is_held_by_a_range), key=lambda candidate: candidate.violation)
    return [*reached, *make_feasible(task, held[:MOST_DESIGNS_BEYOND_RANGES])]


def _is_proven_least(design: Candidate, target: StageTarget) -> bool:
    """Whether a design reaches the closed-form limit, and nothing that it depends on could be chosen otherwise."""
    problem = design.problem
    is_given = all(problem.bounds[name].is_fixed for name in ("baseline", "focal_length", "reciprocal_focus"))
    # With a predicted noise the largest gains are not always the best, and the limit proves nothing.
    if target.minimise != "depth_error" or not is_given or problem.specification.predicted_share:
        return False
    return design.goals["depth_error"] <= limit_at(design) * (1.0 + WORTH_ANOTHER_RESTART)


def moved(task: Task, values: dict[str, float]) -> Array:
    """A neighbour's design, moved into this problem's bounds."""
    scaled = task.problem.scaled({name: np.array([value]) for name, value in values.items()})
    return np.clip(scaled[:, 0], *task.problem.reach)
