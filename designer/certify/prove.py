"""Proofs about one configuration under a requirement: a bound of its depth error, or that it has no design."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from designer.certify.branch_and_bound import Outcome, bound_score
from designer.certify.certificate import KNOWN_RULES, SMALL_GAP, Certificate
from designer.certify.keys import KEYS, Key, kinds_of, loosened
from designer.configurations import Configuration
from designer.optimise.branch import problem_of
from designer.optimise.impossibility import why_fixed_conflicts, why_impossible
from designer.optimise.operations import state
from designer.optimise.problem import Problem
from designer.optimise.required_numbers import specification_of
from designer.optimise.variables import fixed_parameters, free_ranges
from designer.optimise.variants import enumerate_variants
from designer.requirement import Lens, Requirement

# A conflict is proved again without a key in at most so many times what the whole proof took, and some seconds.
TIMES_LONGER, SOME_SECONDS = 4.0, 2.0


@dataclass(frozen=True, slots=True)
class Branch:
    """One lens and one variant that no rule forbids."""

    lens: Lens
    problem: Problem


def branches_of(requirement: Requirement, configuration: Configuration) -> list[Branch]:
    """Every lens and variant of a configuration that no rule forbids."""
    if why_fixed_conflicts(configuration, fixed_parameters(requirement)) is not None:
        return []
    return [
        Branch(lens, problem_of(requirement, lens, variant))
        for lens in requirement.camera.lenses
        for variant in enumerate_variants(configuration)
        if why_impossible(variant, specification_of(requirement, lens), free_ranges(requirement, lens)) is None
    ]


def bound_of(
    requirement: Requirement, configuration: Configuration, found: float, design: float | None, seconds: float
) -> Certificate:
    """Bound the depth error of a configuration of which the study has a design.

    Parameters
    ----------
    found
        The least depth error that the study found, as a share.
    design
        That of the study's design.
    seconds
        Processor time.
    """
    if requirement.objective.minimise != "depth_error":
        goal = requirement.objective.minimise.replace("_", " ")
        why = f"the study looked for the least {goal}; a bound is known for the depth error alone"
        return Certificate(configuration.name, "not proven", why_not_proven=why)
    target = found / (1.0 + SMALL_GAP)
    outcomes, spent = [], 0.0
    branches = branches_of(requirement, configuration)
    for place, branch in enumerate(branches):
        # What one variant does not need is left to the others.
        outcome = bound_score(state(branch.problem), target, (seconds - spent) / (len(branches) - place))
        outcomes.append(outcome)
        spent += outcome.seconds
    bound = min(outcome.bound for outcome in outcomes)
    is_close = all(outcome.is_complete for outcome in outcomes)
    why = "" if is_close else f"{_left(outcomes)} boxes of designs are open after {spent:.0f} s"
    return Certificate(
        configuration.name,
        "optimal" if is_close else "gap",
        bound,
        found,
        100.0 * (found / bound - 1.0) if bound > 0.0 else None,
        100.0 * (design / bound - 1.0) if design is not None and bound > 0.0 else None,
        KNOWN_RULES,
        seconds=spent,
        why_not_proven=why,
    )


def prove_infeasible(requirement: Requirement, configuration: Configuration, seconds: float) -> Certificate:
    """Prove that a configuration has no design, and find keys that conflict, in a processor time."""
    branches = branches_of(requirement, configuration)
    start = time.process_time()
    outcomes = list(_without(requirement, branches, (), seconds))
    spent = time.process_time() - start
    if not all(outcome.is_complete for outcome in outcomes):
        why = f"{_left(outcomes)} boxes of designs are open after {spent:.0f} s"
        return Certificate(configuration.name, "not proven", seconds=spent, why_not_proven=why)
    keys, is_smallest = _conflict(requirement, branches, TIMES_LONGER * spent + SOME_SECONDS, start + seconds)
    return Certificate(
        configuration.name,
        "infeasible",
        knows=KNOWN_RULES,
        conflicting_keys=tuple(key.name for key in keys),
        is_smallest=is_smallest,
        seconds=time.process_time() - start,
    )


def _conflict(
    requirement: Requirement, branches: list[Branch], seconds: float, end: float
) -> tuple[tuple[Key, ...], bool]:
    """Keys that conflict, and whether none of them could be spared: each is left out in turn (deletion filter)."""
    present = set(_kinds(branches))
    kept = [key for key in KEYS if present & set(key.kinds)]
    dropped: list[Key] = [key for key in KEYS if key not in kept]
    for key in tuple(kept):
        left = min(seconds, end - time.process_time())
        if left <= 0.0:
            return tuple(kept), False
        outcomes = list(_without(requirement, branches, (*dropped, key), left))
        if all(outcome.is_complete for outcome in outcomes) and len(outcomes) == len(branches):
            kept.remove(key)
            dropped.append(key)
    return tuple(kept), True


def _kinds(branches: list[Branch]) -> Iterator[str]:
    """The kinds of rule that branches have."""
    for branch in branches:
        yield from state(branch.problem, is_conflict=True).kinds


def _without(
    requirement: Requirement, branches: list[Branch], keys: Collection[Key], seconds: float
) -> Iterator[Outcome]:
    """The outcome for each branch without some keys, up to the first of which boxes are left."""
    start = time.process_time()
    for branch in branches:
        problem = loosened(branch.problem, requirement, branch.lens, keys)
        left = seconds - (time.process_time() - start)
        outcome = bound_score(state(problem, kinds_of(keys), is_conflict=True), float("inf"), left)
        yield outcome
        if not outcome.is_complete:
            return


def _left(outcomes: list[Outcome]) -> int:
    return sum(outcome.open_boxes for outcome in outcomes)
