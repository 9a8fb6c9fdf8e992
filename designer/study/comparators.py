"""What else could be built for a study's requirement: designed beside the 44, and kept in the study's folder."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from designer.comparators.row import ComparatorRow, ComparatorStatus
from designer.files import InputError, read_text, write_atomically
from designer.requirement import Requirement
from designer.study.manifest import announce, settle
from designer.study.names import COMPARATORS_TABLE
from designer.study.processes import local_processes, run_each, why_it_failed

if TYPE_CHECKING:  # imported when a table is written
    import pandas as pd

_TEXTS = ("comparator", "title", "status", "reason", "prescription")


@dataclass(frozen=True, slots=True)
class ComparatorProgress:
    """One idea done, of how many."""

    done: int
    total: int
    row: ComparatorRow


def design_comparators(
    requirement: Requirement, *, jobs: int = 1, progress: Callable[[ComparatorProgress], None] | None = None
) -> tuple[ComparatorRow, ...]:
    """Design every comparator for a requirement, in the order of their table; the rows do not depend on ``jobs``."""
    from designer.comparators.table import COMPARATORS, design_comparator

    names = list(COMPARATORS)
    found: dict[int, ComparatorRow] = {}
    with local_processes(min(jobs, len(names)), "designer.comparators.table") as processes:
        for index, future in run_each(processes, design_comparator, [(requirement, name) for name in names]):
            name, idea = names[index], COMPARATORS[names[index]]
            try:
                found[index] = future.result()
            except Exception as error:
                found[index] = ComparatorRow(name, idea.title, "failed", why_it_failed(error), idea.cameras)
            if progress is not None:
                progress(ComparatorProgress(len(found), len(names), found[index]))
    return tuple(found[index] for index in range(len(names)))


def comparator_frame(rows: Sequence[ComparatorRow]) -> pd.DataFrame:
    """One row for each comparator."""
    import pandas as pd

    return pd.DataFrame([astuple(row) for row in rows], columns=[field.name for field in fields(ComparatorRow)])


def write_comparators(rows: Sequence[ComparatorRow], folder: Path) -> None:
    """Write ``comparators.csv`` into a study's folder.

    Raises
    ------
    InputError
        A file is in the way that no study wrote, or that has been changed since.
    """
    announce(folder, [COMPARATORS_TABLE])
    write_atomically(folder / COMPARATORS_TABLE, comparator_frame(rows).to_csv(index=False))
    settle(folder, [COMPARATORS_TABLE])


def read_comparators(path: Path) -> tuple[ComparatorRow, ...]:
    """The rows of a study's ``comparators.csv``.

    Raises
    ------
    InputError
        The file cannot be understood.
    """
    reader = csv.DictReader(io.StringIO(read_text(path)), restval="")
    missing = [name for name in ("comparator", "status", "cameras") if name not in (reader.fieldnames or ())]
    if missing:
        raise InputError(f"{path}: column {missing[0]} is missing")
    return tuple(_read_row(path, record) for record in reader)


def _read_row(path: Path, record: dict[str, str]) -> ComparatorRow:
    if record["status"] not in get_args(ComparatorStatus):
        allowed = ", ".join(get_args(ComparatorStatus))
        raise InputError(f"{path}: status = {record['status']!r}: must be one of {allowed}")
    if not record["cameras"].isdecimal():
        raise InputError(f"{path}: cameras = {record['cameras']!r}: must be a whole number")
    values: dict[str, Any] = {name: record.get(name, "") for name in _TEXTS}
    for field in fields(ComparatorRow):
        if field.name not in (*_TEXTS, "cameras"):
            values[field.name] = _number(record.get(field.name, ""))
    return ComparatorRow(cameras=int(record["cameras"]), **values)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
