"""The order of a study's results."""

from __future__ import annotations

from collections.abc import Sequence

from designer.goals import GOALS
from designer.requirement import Objective, Requirement
from designer.study.columns import STATUSES
from designer.study.row import Row


def ranking(requirement: Requirement, rows: Sequence[Row]) -> list[int]:
    """Indices of rows, best first.

    Designs whose first-stage objective lies within the tolerance of the best of all are equal in it and rank by the
    second objective; the others follow by the first. Then what is not feasible: nearest misses, failures,
    impossibilities, each in the order given.
    """
    places = {status: [place for place, row in enumerate(rows) if row.status == status] for status in STATUSES}
    feasible = places.pop("feasible")
    ordered: list[int] = []
    if feasible:
        first, second = (
            [_value(rows[place], column) for place in feasible] for column in ranking_columns(requirement.objective)
        )
        ordered += [feasible[index] for index in best_first(first, second, requirement.objective.tolerance)]
    return ordered + [place for others in places.values() for place in others]


def ranking_columns(objective: Objective) -> tuple[str, str]:
    """The columns that hold the first objective, at the design of the first stage, and the second."""
    return f"first_stage_{GOALS[objective.minimise].column}", GOALS[objective.then].column


def best_first(first: Sequence[float], second: Sequence[float], tolerance: float) -> list[int]:
    """Indices of designs, best first, from both objectives and the share of the first that counts as nothing."""
    bound = min(first) * (1.0 + tolerance)

    def key(index: int) -> tuple[bool, float]:
        is_far = first[index] > bound
        return is_far, first[index] if is_far else second[index]

    return sorted(range(len(first)), key=key)


def _value(row: Row, column: str) -> float:
    value = row.number(column)
    assert value is not None
    return value
