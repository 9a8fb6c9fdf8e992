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


def tied_with_best(objective: Objective, rows: Sequence[Row]) -> int:
    """How many feasible rows are tied in the first objective: within the tolerance of the best, as a ranking has it.

    They have the first ranks. 1 if no other is tied with the best; 0 if nothing is feasible. Tables of earlier versions
    have no first stage: there the finished designs are compared.
    """
    staged, _ = ranking_columns(objective)
    columns = (staged, GOALS[objective.minimise].column)
    values = [
        next((value for column in columns if (value := row.number(column)) is not None), None)
        for row in rows
        if row.status == "feasible"
    ]
    known = [value for value in values if value is not None]
    return sum(value <= min(known) * (1.0 + objective.tolerance) for value in known)


def ties_in_words(objective: Objective, rows: Sequence[Row]) -> str:
    """Which ranks are tied in the first objective and what decides among them; empty if no other ties with the best."""
    tied = tied_with_best(objective, rows)
    if tied < 2:
        return ""
    first, then = GOALS[objective.minimise].label, GOALS[objective.then].label
    ranks = f"ranks 1 {'and' if tied == 2 else 'to'} {tied}"
    return f"{ranks} are tied{tolerance_in_words(objective)} in {first}; {then} decides their order"


def tolerance_in_words(objective: Objective) -> str:
    """The share within which designs are tied, after a blank; empty where they must be equal."""
    return f" within {objective.within_percent:g} %" if objective.within_percent else ""


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
