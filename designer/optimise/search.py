"""The search for the best design of a configuration: starts, two stages, and a check of every claim.

For each lens and each variant, designs are screened, the most promising are solved for the first objective, and from
the best of them the second is minimised with the first kept within its tolerance. A solver's word counts for nothing:
a design is feasible when NumPy, evaluating every constraint and every clearance anew, finds them kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from designer.configurations import Configuration
from designer.optimise.branch import (
    Branch,
    WarmStart,
    first_stage,
    limit_at,
    moved,
    recalled_second,
    task_for,
)
from designer.optimise.impossibility import why_fixed_conflicts, why_impossible
from designer.optimise.multistart import Candidate, distinct_designs, examine, follow, improve
from designer.optimise.required_numbers import specification_of
from designer.optimise.shortfall import Shortfall, shortfalls_of
from designer.optimise.solver import SOLVED, STALLED, StageTarget
from designer.optimise.variables import fixed_parameters, free_ranges
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement

# From so many of the best different designs the second objective is minimised.
MOST_DESIGNS_IN_SECOND_STAGE = 6


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
        return limit_at(self.first)


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
    branches: list[Branch] = []
    for (lens_index, lens), (variant_index, variant) in product(
        enumerate(lenses), enumerate(enumerate_variants(configuration))
    ):
        reason = why_impossible(variant, specification_of(requirement, lens), free_ranges(requirement, lens))
        if reason is not None:
            reasons[lens_index].append(reason)
            continue
        task, warm_start = task_for(requirement, lens, variant), by_branch.get((lens_index, variant_index))
        branch = Branch(lens_index, variant_index, task, known=warm_start)
        first_stage(requirement, branch)
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
    requirement: Requirement, configuration: Configuration, branches: list[Branch], reasons: Sequence[str]
) -> SearchResult:
    """What the first stage's branches come to, after the second stage if any has a design."""
    if not branches:
        return SearchResult(configuration, "impossible", "; ".join(dict.fromkeys(reasons)))
    if not any(branch.designs for branch in branches):
        return _infeasible(configuration, branches)
    return _second_stage(requirement, configuration, branches)


def recall(
    requirement: Requirement, configuration: Configuration, known: WarmStart
) -> tuple[Candidate, Candidate | None]:
    """The first-stage and the second-stage design of a warm start, evaluated anew under its own requirement."""
    lens = requirement.camera.lenses[known.lens]
    task = task_for(requirement, lens, enumerate_variants(configuration)[known.variant])
    first = examine(task, moved(task, known.first), known.directions)
    return first, recalled_second(task, known)


def _second_stage(requirement: Requirement, configuration: Configuration, branches: list[Branch]) -> SearchResult:
    """Minimise the second objective, with the first within its tolerance of the configuration's best."""
    first_goal, second_goal = requirement.objective.minimise, requirement.objective.then
    every = [design for branch in branches for design in branch.designs]
    first = min(every, key=lambda design: design.goals[first_goal])
    bound = first.goals[first_goal] * (1.0 + requirement.objective.tolerance)
    target = StageTarget(second_goal, ((first_goal, bound),))
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
        warm_starts=tuple(branch.warm_start(first_goal, second_goal) for branch in branches),
    )


def _follow_second(branch: Branch, target: StageTarget) -> Candidate | None:
    """The second-stage design from that of the neighbour; None if there was none or it leads nowhere."""
    known = branch.known
    if known is None or known.second is None or known.second_directions is None:
        return None
    return follow(branch.task, moved(branch.task, known.second), known.second_directions, target)


def _improve_second(branch: Branch, target: StageTarget) -> Candidate | None:
    """The second-stage design from those of the first that keep the target's bounds; None if none does."""
    near = [design for design in branch.designs if design.keeps(target)]
    if not near:
        return None
    starts = distinct_designs(near, target.minimise)[:MOST_DESIGNS_IN_SECOND_STAGE]
    return min(improve(branch.task, starts, target), key=lambda design: design.goals[target.minimise])


def _all_statuses(branches: list[Branch]) -> dict[str, int]:
    return dict(sum((branch.task.statuses for branch in branches), Counter()))


def _infeasible(configuration: Configuration, branches: list[Branch]) -> SearchResult:
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
        warm_starts=tuple(branch.warm_start("depth_error", "depth_error") for branch in branches),
    )
