"""From a sweep's store back to designs: the record of any of them, and what each requirement is worth to it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from designer.configurations import Configuration
from designer.design import Design
from designer.evaluate.score import evaluate_design
from designer.files import InputError
from designer.optimise.multipliers import KEYS, first_stage_multipliers
from designer.optimise.multistart import Candidate
from designer.optimise.search import recall
from designer.requirement import Requirement
from designer.study.record import record_of
from designer.study.sweep.definition import requirement_at
from designer.study.sweep.point import read_warm_starts
from designer.study.sweep.store import read_store
from designer.study.sweep.tables import requirement_of


def design_at(folder: Path, point: int, configuration: str) -> Design:
    """The second-stage design of one configuration at one point of a sweep, scored.

    Raises
    ------
    InputError
        The sweep has no feasible design there.
    """
    requirement, _, best = _recalled(folder, point, configuration)
    record = record_of(requirement, best)
    return record.model_copy(update={"score": evaluate_design(record).as_json()})


def multipliers_of_designs(
    folder: Path, designs: Iterable[tuple[int, str]], keys: Sequence[str] = KEYS
) -> pd.DataFrame:
    """Derivatives of the least first objective by requirement keys: one row for each (point, configuration) given.

    They belong to the first stage. Rows whose optimum the solver does not confirm are left out.
    """
    rows = []
    for point, configuration in designs:
        requirement, first, _ = _recalled(folder, point, configuration)
        slopes = first_stage_multipliers(requirement, first, keys)
        if slopes is not None:
            rows.append({"point": point, "configuration": configuration, **slopes})
    return pd.DataFrame(rows, columns=["point", "configuration", *keys])


def _recalled(folder: Path, point: int, name: str) -> tuple[Requirement, Candidate, Candidate]:
    """The requirement of a point, and the best first-stage and second-stage design of a configuration there."""
    base = requirement_of(folder)
    configuration = _configuration(base, name)
    with read_store(folder) as connection:
        asked = connection.execute("SELECT coordinates FROM points WHERE point = ?", (point,)).fetchone()
        if asked is None:
            raise InputError(f"{folder}: the sweep has no point {point}")
        status = connection.execute(
            "SELECT status FROM results WHERE point = ? AND configuration = ? ORDER BY round DESC", (point, name)
        ).fetchone()
        if status != ("feasible",):
            raise InputError(f"{folder}: {name} has no feasible design at point {point}")
        tasks = connection.execute("SELECT warm_starts FROM tasks WHERE point = ? ORDER BY round", (point,)).fetchall()
        if not tasks:
            raise InputError(
                f"{folder}: was written by another version of designer: its tables can be read, its designs cannot be "
                "put together again"
            )
    requirement = requirement_at(base, json.loads(asked[0]))
    known = {found: warm_starts for (text,) in tasks for found, warm_starts in read_warm_starts(text).items()}
    goals = requirement.objective
    pairs = [
        recall(requirement, configuration, warm_start) for warm_start in known.get(name, []) if warm_start.is_feasible
    ]
    smallest = [second for _, second in pairs if second is not None]
    first = min((first for first, _ in pairs), key=lambda design: design.goals[goals.minimise])
    return requirement, first, min(smallest, key=lambda design: design.goals[goals.then])


def _configuration(base: Requirement, name: str) -> Configuration:
    for configuration in base.configurations:
        if configuration.name == name:
            return configuration
    raise InputError(f"{name!r} is not a configuration of this sweep")
