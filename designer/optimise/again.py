"""A configuration searched again with what neighbouring requirements have found since, and with fresh starts.

What is feasible under a stricter requirement is feasible under a looser one: the designs of both stages of every
neighbour are evaluated under the requirement at hand, and what is better is improved. A neighbour's design that is not
feasible here is followed if it does better there, by the size of the objective, and lies elsewhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from designer.configurations import Configuration
from designer.optimise.branch import (
    Branch,
    WarmStart,
    moved,
    recalled_second,
    search_afresh,
    search_with_few_starts,
    task_for,
)
from designer.optimise.impossibility import why_impossible
from designer.optimise.multistart import (
    Candidate,
    distinct_designs,
    examine,
    examine_all,
    follow,
    improve,
    make_feasible,
)
from designer.optimise.problem import Array
from designer.optimise.required_numbers import specification_of
from designer.optimise.search import MOST_DESIGNS_IN_SECOND_STAGE, SearchResult
from designer.optimise.separating_directions import SeparatingDirections
from designer.optimise.solver import StageTarget
from designer.optimise.variables import free_ranges
from designer.optimise.variants import enumerate_variants
from designer.requirement import SAME_OBJECTIVE, Requirement

# An objective better by less than this, as a share, is no reason to compute anything again.
WORTH_A_CHANGE = 1e-4
# A neighbour's design farther than this from the own one in the unit box is taken for another optimum.
ELSEWHERE = 0.1
# Only so many of the neighbours' best designs go on.
MOST_FROM_NEIGHBOURS = 3


@dataclass(frozen=True, slots=True)
class Fresh:
    """Fresh starts of a search: as many as the requirement's and with its seed, or few with a seed of their own."""

    few: int = 0
    seed: int = 0


@dataclass(slots=True)
class _Branch:
    """One lens and variant: its own result and those of its neighbours, ``found`` the designs better than the own."""

    branch: Branch
    neighbours: list[WarmStart]
    found: list[Candidate] = field(default_factory=list)

    @property
    def own(self) -> WarmStart | None:
        """Where the search ended, if with a design."""
        known = self.branch.known
        return known if known is not None and known.is_feasible else None

    @property
    def value(self) -> float:
        """The first objective so far; infinite without a design."""
        return self.own.first_value if self.own is not None and self.own.first_value is not None else np.inf

    def own_first(self) -> list[Candidate]:
        """The own design of the first stage, evaluated anew; none if there is none."""
        task = self.branch.task
        return [examine(task, moved(task, self.own.first), self.own.directions)] if self.own is not None else []


def search_again(
    requirement: Requirement,
    configuration: Configuration,
    own: Sequence[WarmStart],
    neighbours: Sequence[Sequence[WarmStart]],
    fresh: Fresh | None = None,
) -> SearchResult | None:
    """A better result than the own one, from neighbours' designs and fresh starts; None if nothing is better.

    Better is: feasible for the first time; or less of the first objective in any variant; or less of the second at no
    more of the first. The first objective is never worse than it was.
    """
    return _conclude(requirement, configuration, _branches(requirement, configuration, own, neighbours, fresh))


def least_again(
    requirement: Requirement,
    configuration: Configuration,
    own: Sequence[WarmStart],
    neighbours: Sequence[Sequence[WarmStart]],
    fresh: Fresh | None = None,
    hopeless: Collection[tuple[int, int]] = (),
) -> tuple[Candidate, tuple[WarmStart, ...]] | None:
    """The same for the first objective alone: its best new design, and where every lens and variant ends now.

    ``hopeless`` are pairs of a lens and a variant, by their numbers, that are not looked at.
    """
    goal = requirement.objective.minimise
    branches = _branches(requirement, configuration, own, neighbours, fresh, hopeless)
    found = [design for again in branches for design in again.found]
    if not found:
        return None
    ends = {(start.lens, start.variant): start for start in own}
    for again in branches:
        branch = again.branch
        if again.found:
            branch.designs = again.found
            ends[branch.lens, branch.variant] = branch.warm_start(goal, goal)
    return min(found, key=lambda design: design.goals[goal]), tuple(ends.values())


def _branches(
    requirement: Requirement,
    configuration: Configuration,
    own: Sequence[WarmStart],
    neighbours: Sequence[Sequence[WarmStart]],
    fresh: Fresh | None,
    hopeless: Collection[tuple[int, int]] = (),
) -> list[_Branch]:
    """Every lens and variant after its first stage, but those of which nothing is known and nothing sought."""
    first = StageTarget(requirement.objective.minimise)
    branches = []
    by_branch = {(start.lens, start.variant): start for start in own}
    for (lens_index, lens), (variant_index, variant) in product(
        enumerate(requirement.camera.lenses), enumerate(enumerate_variants(configuration))
    ):
        if (lens_index, variant_index) in hopeless:
            continue
        if why_impossible(variant, specification_of(requirement, lens), free_ranges(requirement, lens)) is not None:
            continue
        known = by_branch.get((lens_index, variant_index))
        around = [
            start
            for of_neighbour in neighbours
            for start in of_neighbour
            if (start.lens, start.variant) == (lens_index, variant_index) and start.is_feasible
        ]
        if known is None and not around and fresh is None:
            continue
        branch = Branch(lens_index, variant_index, task_for(requirement, lens, variant), known=known)
        again = _Branch(branch, around)
        _first_stage(requirement, again, first, fresh)
        branches.append(again)
    return branches


def _first_stage(requirement: Requirement, again: _Branch, target: StageTarget, fresh: Fresh | None) -> None:
    goal, task = target.minimise, again.branch.task
    feasible, others = _from_neighbours(again, goal)
    found = improve(task, feasible, target) if feasible else []
    if again.own is not None:
        followed = [follow(task, other.scaled, other.directions, target) for other in others]
        found += [design for design in followed if design is not None]
        others = [other for other, design in zip(others, followed, strict=True) if design is None]
    if others and not found:
        reached = [design for design in make_feasible(task, others) if design.is_feasible]
        found += improve(task, reached, target) if reached else []
    if fresh is not None:
        found += _afresh(requirement, again.branch, target, fresh)
    again.found = [design for design in found if design.goals[goal] < again.value * (1.0 - WORTH_A_CHANGE)]


def _from_neighbours(again: _Branch, goal: str) -> tuple[list[Candidate], list[Candidate]]:
    """The neighbours' designs that are better here than the own, and those elsewhere that may lead to something better.

    Under a requirement that asks as much, a design may do better as it is; under any, if it does by the objective's
    size.
    """
    task, own, value = again.branch.task, again.own, again.value
    scale = own.scale if own is not None else 0.0
    here = [moved(task, own.first)] if own is not None else []
    designs: list[tuple[Array, SeparatingDirections]] = []
    for start in again.neighbours:
        if start.first_value is None:
            continue
        is_better = start.first_value < value and start.scale >= scale * (1.0 - SAME_OBJECTIVE)
        may_be = own is None or start.first_value / start.scale < value / scale * (1.0 - WORTH_A_CHANGE)
        for values, choice in ((start.first, start.directions), (start.second, start.second_directions)):
            if values is None or choice is None:
                continue
            scaled = moved(task, values)
            if is_better or (may_be and _is_elsewhere(scaled, here)):
                designs.append((scaled, choice))
    if not designs:
        return [], []
    examined = examine_all(task, np.stack([scaled for scaled, _ in designs], axis=1), [choice for _, choice in designs])
    better = [one for one in examined if one.is_feasible and one.goals[goal] < value * (1.0 - WORTH_A_CHANGE)]
    feasible = distinct_designs(better, goal)[:MOST_FROM_NEIGHBOURS]
    others: list[Candidate] = []
    for one in examined:
        known = [*here, *(other.scaled for other in (*others, *feasible))]
        if not one.is_feasible and _is_elsewhere(one.scaled, known):
            others.append(one)
    return feasible, others[:MOST_FROM_NEIGHBOURS]


def _is_elsewhere(scaled: Array, known: Sequence[Array]) -> bool:
    """Whether a point of the unit box is far from all those known."""
    return all(np.abs(scaled - other).max() > ELSEWHERE for other in known)


def _afresh(requirement: Requirement, branch: Branch, target: StageTarget, fresh: Fresh) -> list[Candidate]:
    alone = Branch(branch.lens, branch.variant, branch.task)
    if fresh.few:
        search_with_few_starts(requirement, alone, target, fresh.few, fresh.seed)
    else:
        search_afresh(requirement, alone, target)
    return alone.designs


def _conclude(
    requirement: Requirement, configuration: Configuration, branches: Sequence[_Branch]
) -> SearchResult | None:
    goals = requirement.objective
    is_changed = any(again.found for again in branches)
    values = [again.value for again in branches] + [
        one.goals[goals.minimise] for again in branches for one in again.found
    ]
    if not min(values, default=np.inf) < np.inf:
        return None
    target = StageTarget(goals.then, ((goals.minimise, min(values) * (1.0 + goals.tolerance)),))
    least = min((own.second_value for again in branches if (own := again.own) and own.second_value), default=np.inf)
    smaller = [_smaller_of_neighbours(again, target, np.inf if is_changed else least) for again in branches]
    if not is_changed and not any(smaller):
        return None
    for again, starts in zip(branches, smaller, strict=True):
        again.branch.designs = again.own_first() + again.found
        again.branch.smallest = _smallest(again, target, starts)
    first = min(
        (design for again in branches for design in again.branch.designs),
        key=lambda design: design.goals[goals.minimise],
    )
    second = [again.branch.smallest for again in branches if again.branch.smallest is not None]
    if not second:
        return None
    best = min(second, key=lambda design: design.goals[goals.then])
    if not is_changed and not best.goals[goals.then] < least * (1.0 - WORTH_A_CHANGE):
        return None
    warm_starts = [
        again.branch.warm_start(goals.minimise, goals.then) if again.branch.designs else again.branch.known
        for again in branches
    ]
    statuses = sum((again.branch.task.statuses for again in branches), Counter[str]())
    return SearchResult(
        configuration,
        "feasible",
        "",
        first=first,
        best=best,
        statuses=dict(statuses),
        warm_starts=tuple(start for start in warm_starts if start is not None),
    )


def _smallest(again: _Branch, target: StageTarget, smaller: Sequence[Candidate]) -> Candidate | None:
    """The best second-stage design of a branch: its own, a neighbour's, or one that starts from what was found."""
    task, known = again.branch.task, again.own
    own = recalled_second(task, known) if known is not None else None
    found = []
    if own is not None:
        if own.is_feasible and own.keeps(target):
            found = [own]
        elif (moved_on := follow(task, own.scaled, own.directions, target)) is not None:
            found = [moved_on]
    value = min((one.goals[target.minimise] for one in found), default=np.inf)
    near = [design for design in (again.found if own is not None else again.branch.designs) if design.keeps(target)]
    starts = distinct_designs(near, target.minimise)[:MOST_DESIGNS_IN_SECOND_STAGE]
    starts += [one for one in smaller if one.goals[target.minimise] < value * (1.0 - WORTH_A_CHANGE)]
    if starts:
        found += improve(task, starts, target)
    return min(found, key=lambda design: design.goals[target.minimise], default=None)


def _smaller_of_neighbours(again: _Branch, target: StageTarget, value: float) -> list[Candidate]:
    """Neighbours' second-stage designs that keep the first objective's bound here and are smaller than a value."""
    smaller = [
        start
        for start in again.neighbours
        if start.second is not None
        and start.second_value is not None
        and start.second_value < value * (1.0 - WORTH_A_CHANGE)
    ]
    if not smaller:
        return []
    task = again.branch.task
    scaled = np.stack([moved(task, start.second) for start in smaller if start.second is not None], axis=1)
    examined = examine_all(task, scaled, [start.second_directions for start in smaller if start.second_directions])
    kept = [
        one
        for one in examined
        if one.is_feasible and one.keeps(target) and one.goals[target.minimise] < value * (1.0 - WORTH_A_CHANGE)
    ]
    return distinct_designs(kept, target.minimise)[:MOST_FROM_NEIGHBOURS]
