"""The order of a study's results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from designer.goals import GOALS
from designer.requirement import Requirement

if TYPE_CHECKING:  # a sweep's tables are read without the solver
    from designer.study.task import ConfigurationResult

_STATUS_ORDER = ("feasible", "infeasible", "failed", "impossible")


def rank(requirement: Requirement, results: Sequence[ConfigurationResult]) -> list[ConfigurationResult]:
    """Best first.

    Designs whose first-stage objective lies within the tolerance of the best of all are equal in it and rank by the
    second objective; the others follow by the first. Then what is not feasible: nearest misses, failures,
    impossibilities, each in the order given.
    """
    objective = requirement.objective
    feasible = [result for result in results if result.status == "feasible"]
    ordered: list[ConfigurationResult] = []
    if feasible:
        first = [_first_stage(result, objective.minimise) for result in feasible]
        second = [_second_stage(result, objective.then) for result in feasible]
        ordered += [feasible[index] for index in best_first(first, second, objective.tolerance)]
    for status in _STATUS_ORDER[1:]:
        ordered += [result for result in results if result.status == status]
    return ordered


def best_first(first: Sequence[float], second: Sequence[float], tolerance: float) -> list[int]:
    """Indices of designs, best first, from both objectives and the share of the first that counts as nothing."""
    bound = min(first) * (1.0 + tolerance)

    def key(index: int) -> tuple[bool, float]:
        is_far = first[index] > bound
        return is_far, first[index] if is_far else second[index]

    return sorted(range(len(first)), key=key)


def _first_stage(result: ConfigurationResult, goal: str) -> float:
    assert result.first is not None
    return result.first.goals[goal]


def _second_stage(result: ConfigurationResult, goal: str) -> float:
    assert result.design is not None
    return float(result.design.score["second_stage"][GOALS[goal].column])
