"""A study's folder, read into memory: the report is a function of these files and of nothing else."""

from __future__ import annotations

import csv
import io
import json
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from designer.design import Design, read_design
from designer.files import InputError, read_text
from designer.study.checked import CheckedDesign, read_check, read_unchecked

_SCORE_AND_RATIO = ("depth_error_rms", "limit_ratio")
STATUSES = ("feasible", "infeasible", "failed", "impossible")


@dataclass(frozen=True, slots=True)
class Row:
    """One configuration's line in ``designs.csv``; what the line leaves out is empty or None."""

    configuration: str
    family: str
    topology: str
    status: str
    reason: str
    numbers: dict[str, float]
    texts: dict[str, str]

    def number(self, column: str) -> float | None:
        """A column's finite number, or None."""
        return self.numbers.get(column)

    def text(self, column: str) -> str:
        """A column's text, or an empty string."""
        return self.texts.get(column, "")

    @property
    def is_beyond_first_order(self) -> bool:
        """Whether first order is off at the worst point of the volume; False where the table does not tell."""
        return self.text("first_order_valid") == "False"

    @property
    def is_beyond_second_order(self) -> bool:
        """Whether second order is off too, so that only a Monte Carlo is honest."""
        return self.text("second_order_valid") == "False"

    @property
    def least_limit(self) -> float | None:
        """The least limit over all allowed baselines and focal lengths; None unless it is below the design's own."""
        least, error, ratio = (self.number(key) for key in ("least_limit_depth_error_rms", *_SCORE_AND_RATIO))
        if least is None or error is None or ratio is None:
            return None
        return least if least * ratio < 0.9999 * error else None

    @property
    def rank(self) -> int | None:
        """Place in the ranking, from 1; None unless feasible."""
        value = self.number("rank")
        return None if value is None else int(value)


@dataclass(frozen=True, slots=True)
class FrontPoint:
    """One point of the front traced by tightening the envelope: the best design within ``limit_mm``."""

    configuration: str
    swept: str
    limit_mm: float
    status: str
    depth_error_rms: float | None
    height_mm: float | None
    diameter_mm: float | None


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """Everything a study wrote: requirement, 44 rows in order of rank, feasible designs, fronts, provenance, checks.

    ``unchecked`` holds the reason for each design whose check broke down.
    """

    path: Path
    requirement: dict[str, Any]
    rows: tuple[Row, ...]
    designs: dict[str, Design]
    fronts: tuple[FrontPoint, ...]
    provenance: dict[str, Any]
    checked: dict[str, CheckedDesign] = field(default_factory=dict)
    unchecked: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The study's name: the requirement's, or else the folder's."""
        return str(self.requirement.get("name") or self.path.resolve().name)

    @property
    def title(self) -> str:
        """The study's title, or its name if it has none."""
        return str(self.requirement.get("title") or self.name)

    @property
    def feasible(self) -> tuple[Row, ...]:
        """Feasible rows, best first."""
        return self.with_status("feasible")

    def with_status(self, status: str) -> tuple[Row, ...]:
        """Rows of one status, in order."""
        return tuple(row for row in self.rows if row.status == status)

    def best(self, count: int = 5) -> tuple[tuple[Row, Design], ...]:
        """The best feasible rows with their designs."""
        return tuple((row, self.designs[row.configuration]) for row in self.feasible[:count])

    def checks(self) -> tuple[tuple[Row, CheckedDesign], ...]:
        """The rows of designs that were checked end to end, best first, with their checks."""
        return tuple(
            (row, self.checked[row.configuration]) for row in self.feasible if row.configuration in self.checked
        )

    def not_checked(self) -> tuple[tuple[Row, str], ...]:
        """The rows of designs that could not be checked, best first, with the reason."""
        return tuple(
            (row, self.unchecked[row.configuration]) for row in self.feasible if row.configuration in self.unchecked
        )

    def row(self, configuration: str) -> Row | None:
        """The row of one configuration, or None."""
        return next((row for row in self.rows if row.configuration == configuration), None)


def read_folder(path: Path) -> StudyFolder:
    """Read a study's folder.

    Raises
    ------
    InputError
        A file is absent or cannot be understood, or a feasible design has no file: one line says which.
    """
    requirement = _read_toml(path / "requirement.toml")
    rows = _read_rows(path / "designs.csv")
    designs = {
        row.configuration: read_design(path / "designs" / f"{row.configuration}.json")
        for row in rows
        if row.status == "feasible"
    }
    fronts_path, provenance_path = path / "fronts.csv", path / "provenance.json"
    fronts = _read_fronts(fronts_path) if fronts_path.exists() else ()
    provenance = _read_json(provenance_path) if provenance_path.exists() else {}
    checks = {name: read_check(path / "checks" / name, design) for name, design in designs.items()}
    checked = {name: check for name, check in checks.items() if check is not None}
    reasons = {name: read_unchecked(path / "checks" / name, design) for name, design in designs.items()}
    unchecked = {name: reason for name, reason in reasons.items() if reason is not None}
    return StudyFolder(path, requirement, rows, designs, fronts, provenance, checked, unchecked)


def _read_rows(path: Path) -> tuple[Row, ...]:
    rows = [_row(record) for record in _read_records(path, ("configuration", "status"))]
    order = {status: place for place, status in enumerate(STATUSES)}
    unranked = len(rows) + 1
    return tuple(sorted(rows, key=lambda row: (order.get(row.status, len(order)), row.rank or unranked)))


def _row(record: dict[str, str]) -> Row:
    numbers = {column: number for column, text in record.items() if (number := _number(text)) is not None}
    return Row(
        configuration=record["configuration"],
        family=record.get("family", ""),
        topology=record.get("topology", ""),
        status=record["status"],
        reason=record.get("reason", ""),
        numbers=numbers,
        texts={column: text for column, text in record.items() if text},
    )


def _read_fronts(path: Path) -> tuple[FrontPoint, ...]:
    points = []
    for record in _read_records(path, ("configuration", "swept", "limit_mm", "status")):
        limit = _number(record["limit_mm"])
        if limit is None:
            raise InputError(f"{path}: limit_mm = {record['limit_mm']!r}: must be a number")
        points.append(
            FrontPoint(
                configuration=record["configuration"],
                swept=record["swept"],
                limit_mm=limit,
                status=record["status"],
                depth_error_rms=_number(record.get("depth_error_rms", "")),
                height_mm=_number(record.get("height_mm", "")),
                diameter_mm=_number(record.get("diameter_mm", "")),
            )
        )
    return tuple(points)


def _read_records(path: Path, needed: tuple[str, ...]) -> list[dict[str, str]]:
    reader = csv.DictReader(io.StringIO(read_text(path)), restval="")
    for column in needed:
        if column not in (reader.fieldnames or ()):
            raise InputError(f"{path}: column {column} is missing")
    return [{key: value for key, value in record.items() if key is not None} for record in reader]


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML: {error}") from None


def _read_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: must hold a JSON object")
    return content
