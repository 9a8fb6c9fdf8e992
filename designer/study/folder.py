"""A study's folder, written file by file, each whole or not at all, and read back: the only place that knows its files.

``designs.csv`` (a row for each configuration), ``designs/`` (a file for each feasible design), ``fronts.csv`` (Pareto
fronts), ``requirement.toml``, ``provenance.json`` (written last), ``checks/``, ``study.pdf`` and ``figures/``.
"""

from __future__ import annotations

import csv
import io
import json
import math
import platform
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, fields, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pandas as pd
from pydantic import JsonValue

from designer import __version__
from designer.design import read_design, write_design
from designer.files import InputError, as_json, read_text, write_atomically
from designer.requirement import Requirement, read_requirement, requirement_to_toml, set_key
from designer.study.columns import STATUSES
from designer.study.row import Row, frame_of, read_row
from designer.study.study import ParetoRow, Study

RESULTS = "designs.csv"
DESIGNS = "designs"
PARETO = "fronts.csv"
REQUIREMENT = "requirement.toml"
PROVENANCE = "provenance.json"
CHECKS = "checks"
UNCHECKED = "unchecked.json"
"""In a check's folder: why a design could not be checked."""
PDF = "study.pdf"
FIGURES = "figures"
FIGURE_LIST = "report.json"
"""In the folder of figures: the names of those that the report has drawn, since others may stand beside them."""

# The first file of a check and the last, so that one cut short is known too.
_FILES_OF_A_CHECK = ("raw.png", "check.json", UNCHECKED)
_FIGURES_OF_VERSION_0_1 = (
    "cross-section-",
    "trade-",
    "fronts-",
    "check-",
    "image-layout-",
    "resolution-",
    "depth-resolution-",
    "depth-error-",
)
"""How the figures begin in a folder that has no list of them."""
_PACKAGES = ("numpy", "scipy", "casadi", "pydantic", "pandas", "matplotlib", "typst")


def write_study(study: Study, folder: Path) -> None:
    """Write everything but checks and report; an older report goes. A folder without provenance.json is not finished.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    (folder / PROVENANCE).unlink(missing_ok=True)
    _remove_report(folder)
    files = {f"{name}.json": design for name, design in study.designs.items()}
    (folder / DESIGNS).mkdir(parents=True, exist_ok=True)
    for stale in (folder / DESIGNS).glob("*.json"):
        if stale.name not in files:
            stale.unlink()
    for name, design in files.items():
        write_design(design, folder / DESIGNS / name)
    write_atomically(folder / REQUIREMENT, requirement_to_toml(study.requirement))
    write_atomically(folder / RESULTS, frame_of(study.rows).to_csv(index=False))
    write_atomically(folder / PARETO, pareto_frame(study.pareto).to_csv(index=False))
    write_atomically(folder / PROVENANCE, json.dumps(study.provenance, indent=2) + "\n")


def write_report(folder: Path, pdf: bytes, figures: Mapping[str, bytes]) -> Path:
    """Write a typeset report and its figures (SVG by name), remove those of an earlier one; the path of the PDF."""
    stale = set(_report_figures(folder)) - set(figures)
    # Whatever interrupts this, no figure is there that the list does not name.
    _list_figures(folder, stale.union(figures))
    for name, svg in figures.items():
        write_atomically(folder / FIGURES / name, svg)
    for name in stale:
        (folder / FIGURES / name).unlink(missing_ok=True)
    _list_figures(folder, figures)
    path = folder / PDF
    write_atomically(path, pdf)
    return path


def pareto_frame(pareto: Sequence[ParetoRow]) -> pd.DataFrame:
    """One row for each point of the Pareto fronts."""
    return pd.DataFrame([astuple(row) for row in pareto], columns=[field.name for field in fields(ParetoRow)])


def provenance_of(requirement: Requirement, elapsed_seconds: float) -> dict[str, JsonValue]:
    """Where results come from: versions, seed, solver options, machine, times."""
    from designer.optimise.program import SOLVERS  # folders are read without the solver

    versions = {"python": platform.python_version()} | {name: _version(name) for name in _PACKAGES}
    return {
        "designer": __version__,
        "versions": as_json(versions),
        "seed": requirement.solve.seed,
        "starts": requirement.solve.starts,
        "solvers": as_json(SOLVERS),
        "machine": {"system": platform.system(), "processor": platform.machine()},
        "command": " ".join(["designer", *sys.argv[1:]]),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "elapsed_seconds": elapsed_seconds,
    }


def read_study(folder: Path) -> Study:
    """Read a study's folder.

    Raises
    ------
    InputError
        A file is absent or cannot be understood, or a feasible design has no file: one line says which.
    """
    requirement = read_requirement(folder / REQUIREMENT)
    if "scale_uncertainty_percent" not in requirement.model_fields_set:
        # A folder holds every key, so without this one the scale was not counted.
        requirement = set_key(requirement, "scale_uncertainty_percent", 0.0)
    rows = read_rows(folder)
    designs = {
        row.configuration: read_design(design_path(folder, row.configuration))
        for row in rows
        if row.status == "feasible"
    }
    pareto = _read_pareto(folder / PARETO) if (folder / PARETO).exists() else ()
    provenance = _read_json(folder / PROVENANCE) if (folder / PROVENANCE).exists() else {}
    return with_checks(Study(requirement, rows, designs, pareto, provenance), folder)


def with_checks(study: Study, folder: Path) -> Study:
    """The study with the end-to-end checks of its designs that stand in its folder.

    Raises
    ------
    InputError
        A file of a check is absent or cannot be understood.
    """
    from designer.study.checked import read_check, read_unchecked

    checks = {name: read_check(check_folder(folder, name), design) for name, design in study.designs.items()}
    reasons = {
        name: read_unchecked(check_folder(folder, name) / UNCHECKED, design) for name, design in study.designs.items()
    }
    return replace(
        study,
        checked={name: check for name, check in checks.items() if check is not None},
        unchecked={name: reason for name, reason in reasons.items() if reason is not None},
    )


def read_rows(folder: Path) -> tuple[Row, ...]:
    """The rows of a study's table, best first.

    Raises
    ------
    InputError
        There is none, or it lacks the columns that every study has.
    """
    rows = [read_row(record) for record in _read_records(folder / RESULTS, ("configuration", "status"))]
    order = {status: place for place, status in enumerate(STATUSES)}
    unranked = len(rows) + 1
    return tuple(sorted(rows, key=lambda row: (order.get(row.status, len(order)), row.rank or unranked)))


def design_path(folder: Path, configuration: str) -> Path:
    """Where a configuration's design stands."""
    return folder / DESIGNS / f"{configuration}.json"


def check_folder(folder: Path, configuration: str) -> Path:
    """Where the check of a configuration's design stands."""
    return folder / CHECKS / configuration


def remove_checks(folder: Path) -> None:
    """Remove the checks of an earlier study; what someone else put among them stays."""
    for earlier in {path.parent for name in _FILES_OF_A_CHECK for path in (folder / CHECKS).glob(f"*/{name}")}:
        shutil.rmtree(earlier)


def _remove_report(folder: Path) -> None:
    """Remove a report and its figures, which describe other results than those about to be written."""
    (folder / PDF).unlink(missing_ok=True)
    for name in (*_report_figures(folder), FIGURE_LIST):
        (folder / FIGURES / name).unlink(missing_ok=True)


def _list_figures(folder: Path, names: Iterable[str]) -> None:
    write_atomically(folder / FIGURES / FIGURE_LIST, json.dumps(sorted(names), indent=2) + "\n")


def _report_figures(folder: Path) -> list[str]:
    """The names of the figures of a report in a study's folder; what someone else put beside them is not among them."""
    listed = folder / FIGURES / FIGURE_LIST
    if listed.exists():
        try:
            names = json.loads(read_text(listed))
        except json.JSONDecodeError as error:
            raise InputError(f"{listed}: not JSON: {error.msg} at line {error.lineno}") from None
        # Nothing outside the folder is ever removed.
        return [name for name in names if isinstance(name, str) and Path(name).name == name]
    return [path.name for path in (folder / FIGURES).glob("*.svg") if path.name.startswith(_FIGURES_OF_VERSION_0_1)]


def _read_pareto(path: Path) -> tuple[ParetoRow, ...]:
    points = []
    for record in _read_records(path, ("configuration", "swept", "limit_mm", "status")):
        limit = _number(record["limit_mm"])
        if limit is None:
            raise InputError(f"{path}: limit_mm = {record['limit_mm']!r}: must be a number")
        points.append(
            ParetoRow(
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


def _read_json(path: Path) -> dict[str, JsonValue]:
    try:
        content = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: must be a JSON object")
    return content


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
