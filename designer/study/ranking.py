"""The order of a study's results."""

from __future__ import annotations

from collections.abc import Sequence

from designer.requirement import Requirement
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
        best = min(_first_stage(result, objective.minimise) for result in feasible)
        bound = best * (1.0 + objective.within_percent / 100.0)
        near = [result for result in feasible if _first_stage(result, objective.minimise) <= bound]
        rest = [result for result in feasible if _first_stage(result, objective.minimise) > bound]
        ordered += sorted(near, key=lambda result: _second_stage(result, objective.then))
        ordered += sorted(rest, key=lambda result: _first_stage(result, objective.minimise))
    for status in _STATUS_ORDER[1:]:
        ordered += [result for result in results if result.status == status]
    return ordered


def _first_stage(result: ConfigurationResult, goal: str) -> float:
    assert result.first is not None
    return result.first.goals[goal]


def _second_stage(result: ConfigurationResult, goal: str) -> float:
    assert result.design is not None
    key = {"depth_error": "depth_error_rms", "volume": "volume_cm3"}.get(goal, f"{goal}_mm")
    return float(result.design.score["second_stage"][key])
