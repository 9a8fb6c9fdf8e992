"""The search for the best design of a configuration: starts, two stages, and a check of every claim.

For each lens and each variant, designs are screened, the most promising are solved for the first objective, and from
the best of them the second is minimised with the first kept within its tolerance. A solver's word counts for nothing:
a design is feasible when NumPy, evaluating every constraint and every clearance anew, finds them kept.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from designer.configurations import Configuration
from designer.goals import GOALS, TypicalSizes
from designer.optimise.impossibility import why_fixed_conflicts, why_impossible
from designer.optimise.limit import limit_of
from designer.optimise.multistart import (
    WORTH_ANOTHER_RESTART,
    Candidate,
    Task,
    distinct_designs,
    examine,
    follow,
    improve,
    make_feasible,
    restart_around,
    start_around,
    start_at,
)
from designer.optimise.problem import Array, Problem
from designer.optimise.screening import LARGE_GAIN_SHARE, screen
from designer.optimise.separating_directions import SeparatingDirections
from designer.optimise.shortfall import Shortfall, shortfalls_of
from designer.optimise.solver import SOLVED, STALLED, Target
from designer.optimise.specification import specification_of
from designer.optimise.variables import (
    SMALLEST_GAIN_SHARE,
    bounds_of,
    fixed_parameters,
    free_ranges,
    with_principal_distance,
)
from designer.optimise.variants import Variant, enumerate_variants
from designer.requirement import Lens, Requirement

# From so many of the best different designs the second objective is minimised.
MOST_DESIGNS_IN_SECOND_STAGE = 6
# Before a configuration is called infeasible, so many times more starts are tried, with small gains too, which waste
# the image but let the light pass where large ones do not.
MORE_STARTS_IF_INFEASIBLE = 2
# So many of the nearest misses that a range holds are then followed beyond it.
MOST_DESIGNS_BEYOND_RANGES = 8
HOPELESS_MISS = 2.0  # scaled violation (mm) of the first starts, beyond which a variant seldom feasible is given up


@dataclass(frozen=True, slots=True)
class WarmStart:
    """Where the search of one lens and variant ended: enough for a neighbouring requirement to start from.

    ``first`` holds the physical variables of the best first-stage design, or of the nearest miss; ``second`` those of
    the best second-stage design, None if there is none. Each has the separating directions it was found with.
    """

    lens: int
    variant: int
    is_feasible: bool
    first: dict[str, float]
    second: dict[str, float] | None
    directions: SeparatingDirections
    second_directions: SeparatingDirections | None = None


@dataclass(frozen=True, slots=True)
class SearchResult:
    """What the search found for one configuration.

    ``first`` is the best design by the first objective, ``best`` the one after the second stage; both None unless
    the status is feasible. ``statuses`` counts what the solver said; ``warm_starts`` has one entry for each lens and
    variant that is not impossible by rule. ``by_lens`` has what each lens of a catalogue gives as the only one, in the
    requirement's order, the chosen lens what is found here; empty unless it was asked for.
    """

    configuration: Configuration
    status: str
    reason: str
    first: Candidate | None = None
    best: Candidate | None = None
    shortfall: Shortfall | None = None
    statuses: dict[str, int] = field(default_factory=dict)
    warm_starts: tuple[WarmStart, ...] = ()
    by_lens: tuple[SearchResult, ...] = ()

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


def search(
    requirement: Requirement,
    configuration: Configuration,
    known: Sequence[WarmStart] = (),
    *,
    each_lens: bool = False,
) -> SearchResult:
    """Find the best design of one configuration, or say why there is none.

    With the warm starts of a neighbouring requirement, each variant starts from where it ended there, and from
    screened designs only where that fails though it succeeded there. With ``each_lens`` the result also tells what
    every lens of a catalogue gives.
    """
    lenses = requirement.camera.lenses
    fixed = fixed_parameters(requirement)
    conflict = why_fixed_conflicts(configuration, fixed)
    if conflict is not None:
        nothing = SearchResult(configuration, "impossible", conflict)
        return replace(nothing, by_lens=(nothing,) * len(lenses)) if each_lens and len(lenses) > 1 else nothing
    by_branch = {(start.lens, start.variant): start for start in known}
    reasons: dict[int, list[str]] = {index: [] for index in range(len(lenses))}
    branches: list[_Branch] = []
    for (lens_index, lens), (variant_index, variant) in product(
        enumerate(lenses), enumerate(enumerate_variants(configuration))
    ):
        reason = why_impossible(variant, specification_of(requirement, lens), free_ranges(requirement, lens))
        if reason is not None:
            reasons[lens_index].append(reason)
            continue
        task, warm_start = _task(requirement, lens, variant), by_branch.get((lens_index, variant_index))
        branch = _Branch(lens_index, variant_index, task, known=warm_start)
        _first_stage(requirement, branch)
        branches.append(branch)
    every_reason = [reason for of_lens in reasons.values() for reason in of_lens]
    result = _conclude(requirement, configuration, branches, every_reason)
    if not each_lens or len(lenses) == 1:
        return result
    chosen = lenses.index(result.best.lens) if result.best is not None else None
    by_lens = tuple(
        result
        if index == chosen
        else _conclude(requirement, configuration, [each for each in branches if each.lens == index], reasons[index])
        for index in reasons
    )
    return replace(result, by_lens=by_lens)


def _conclude(
    requirement: Requirement, configuration: Configuration, branches: list[_Branch], reasons: Sequence[str]
) -> SearchResult:
    """What the first stage's branches come to, after the second stage if any has a design."""
    if not branches:
        return SearchResult(configuration, "impossible", "; ".join(dict.fromkeys(reasons)))
    if not any(branch.designs for branch in branches):
        return _infeasible(configuration, branches)
    return _second_stage(requirement, configuration, branches)


def problem_of(requirement: Requirement, lens: Lens, variant: Variant) -> Problem:
    """A variant under a requirement with one of its lenses."""
    specification = specification_of(requirement, lens)
    free = free_ranges(requirement, lens)
    fixed = tuple(sorted(fixed_parameters(requirement).items()))
    return Problem(variant, specification, bounds_of(variant, specification, free), fixed)


def recall(
    requirement: Requirement, configuration: Configuration, known: WarmStart
) -> tuple[Candidate, Candidate | None]:
    """The first-stage and the second-stage design of a warm start, evaluated anew under its own requirement."""
    lens = requirement.camera.lenses[known.lens]
    task = _task(requirement, lens, enumerate_variants(configuration)[known.variant])
    first = examine(task, _moved(task, known.first), known.directions)
    return first, _recalled_second(task, known)


def _recalled_second(task: Task, known: WarmStart) -> Candidate | None:
    if known.second is None or known.second_directions is None:
        return None
    return examine(task, _moved(task, known.second), known.second_directions)


def _task(requirement: Requirement, lens: Lens, variant: Variant) -> Task:
    problem = problem_of(requirement, lens, variant)
    return Task(problem, lens, goal_scales(problem), Counter())


@dataclass(slots=True)
class _Branch:
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

    def warm_start(self, goal: str) -> WarmStart:
        """What a neighbour needs to go on from here."""
        first = min(self.designs, key=lambda design: design.goals[goal]) if self.designs else self.miss
        assert first is not None
        return WarmStart(
            self.lens,
            self.variant,
            bool(self.designs),
            first.values,
            self.smallest.values if self.smallest else None,
            first.directions,
            self.smallest.directions if self.smallest else None,
        )


def goal_scales(problem: Problem) -> tuple[float, ...]:
    """A typical size of each goal, so that the solver sees numbers near one."""
    specification = problem.specification
    middle = with_principal_distance(
        {name: (bounds.low + bounds.high) / 2.0 for name, bounds in problem.bounds.items()}
    )
    limit = float(limit_of(problem.variant, specification, middle["baseline"], middle["principal_distance"]))
    sizes = TypicalSizes(limit, specification.envelope_height, specification.envelope_diameter)
    return tuple(goal.typical_size(sizes) for goal in GOALS.values())


def _first_stage(requirement: Requirement, branch: _Branch) -> None:
    """Find designs of least first objective, or the nearest miss: from the warm start if there is one, or afresh."""
    target = Target(requirement.objective.minimise)
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
    _search_afresh(requirement, branch, target, neighbours)


def _follow_first(branch: _Branch, known: WarmStart, target: Target) -> list[Candidate] | None:
    """The design that follows the neighbour's; None if the neighbour had none or it leads nowhere."""
    if not known.is_feasible:
        return None
    followed = follow(branch.task, _moved(branch.task, known.first), known.directions, target)
    return None if followed is None else [followed]


def _reached_from_neighbour(task: Task, known: WarmStart) -> list[Candidate]:
    """Both designs of a neighbour, as near to feasible as they can be brought."""
    first = examine(task, _moved(task, known.first), known.directions)
    second = _recalled_second(task, known)
    return make_feasible(task, [first] if second is None else [first, second])


def _improved(task: Task, reached: Sequence[Candidate], target: Target) -> list[Candidate]:
    """The feasible ones of some designs, each taken to its minimum; none if none is feasible."""
    feasible = [candidate for candidate in reached if candidate.is_feasible]
    return improve(task, feasible, target) if feasible else []


def _search_afresh(requirement: Requirement, branch: _Branch, target: Target, reached: list[Candidate]) -> None:
    """Search from screened designs, with all that a neighbour's have led to so far."""
    task, variant = branch.task, branch.task.problem.variant
    key = zlib.crc32(f"{variant.configuration.name}/{variant.label}".encode())
    random = np.random.default_rng([requirement.solve.seed, key])
    reached = [*reached, *_reached_from_screened(task, requirement.solve.starts, random, reached)]
    branch.designs = _improved(task, reached, target)
    if not branch.designs:
        branch.miss = min(reached, key=lambda candidate: candidate.violation)
        return
    best = min(branch.designs, key=lambda design: design.goals[target.minimise])
    if not _is_proven_least(best, target):
        branch.designs.append(restart_around(task, best, target, random))


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


def _is_proven_least(design: Candidate, target: Target) -> bool:
    """Whether a design reaches the closed-form limit, and nothing that it depends on could be chosen otherwise."""
    problem, values = design.problem, design.values
    is_given = all(problem.bounds[name].is_fixed for name in ("baseline", "focal_length", "reciprocal_focus"))
    # With a predicted noise the largest gains are not always the best, and the limit proves nothing.
    if target.minimise != "depth_error" or not is_given or problem.specification.predicted_share:
        return False
    limit = float(limit_of(problem.variant, problem.specification, values["baseline"], values["principal_distance"]))
    return design.goals["depth_error"] <= limit * (1.0 + WORTH_ANOTHER_RESTART)


def _moved(task: Task, values: dict[str, float]) -> Array:
    """A neighbour's design, moved into this problem's bounds."""
    scaled = task.problem.scaled({name: np.array([value]) for name, value in values.items()})
    return np.clip(scaled[:, 0], *task.problem.reach)


def _second_stage(requirement: Requirement, configuration: Configuration, branches: list[_Branch]) -> SearchResult:
    """Minimise the second objective, with the first within its tolerance of the configuration's best."""
    first_goal, second_goal = requirement.objective.minimise, requirement.objective.then
    every = [design for branch in branches for design in branch.designs]
    first = min(every, key=lambda design: design.goals[first_goal])
    bound = first.goals[first_goal] * (1.0 + requirement.objective.tolerance)
    target = Target(second_goal, ((first_goal, bound),))
    improved: list[Candidate] = []
    for branch in branches:
        branch.smallest = _follow_second(branch, target) or _improve_second(branch, target)
        if branch.smallest is not None:
            improved.append(branch.smallest)
    best = min(improved, key=lambda design: design.goals[second_goal])
    return SearchResult(
        configuration,
        "feasible",
        "",
        first=first,
        best=best,
        statuses=_all_statuses(branches),
        warm_starts=tuple(branch.warm_start(first_goal) for branch in branches),
    )


def _follow_second(branch: _Branch, target: Target) -> Candidate | None:
    """The second-stage design from that of the neighbour; None if there was none or it leads nowhere."""
    known = branch.known
    if known is None or known.second is None or known.second_directions is None:
        return None
    return follow(branch.task, _moved(branch.task, known.second), known.second_directions, target)


def _improve_second(branch: _Branch, target: Target) -> Candidate | None:
    """The second-stage design from those of the first that keep the target's bounds; None if none does."""
    near = [design for design in branch.designs if design.keeps(target)]
    if not near:
        return None
    starts = distinct_designs(near, target.minimise)[:MOST_DESIGNS_IN_SECOND_STAGE]
    return min(improve(branch.task, starts, target), key=lambda design: design.goals[target.minimise])


def _all_statuses(branches: list[_Branch]) -> dict[str, int]:
    return dict(sum((branch.task.statuses for branch in branches), Counter()))


def _infeasible(configuration: Configuration, branches: list[_Branch]) -> SearchResult:
    statuses = _all_statuses(branches)
    if not {SOLVED, STALLED} & statuses.keys():
        said = ", ".join(f"{status} ({count})" for status, count in statuses.items())
        return SearchResult(configuration, "failed", f"the solver never converged: {said}", statuses=statuses)
    misses = [branch.miss for branch in branches if branch.miss is not None]
    tied = shortfalls_of(min(misses, key=lambda miss: miss.violation))
    variant = f" ({tied[0].variant})" if tied[0].variant else ""
    missed = "; equally, ".join(f"{short.constraint} by {short.amount:.3g} {short.unit}" for short in tied)
    return SearchResult(
        configuration,
        "infeasible",
        f"no feasible point found; smallest violation{variant}: {missed}",
        shortfall=tied[0],
        statuses=statuses,
        warm_starts=tuple(branch.warm_start("depth_error") for branch in branches),
    )
