"""A study's folder, written file by file, each whole or not at all, and read back.

``designs.csv`` (a row for each configuration), ``designs/`` (a file for each feasible design), ``fronts.csv`` (Pareto
fronts), ``lenses.csv`` (what each lens of a catalogue gives), ``comparators.csv`` (what else could be built),
``requirement.toml``, ``provenance.json`` (written last of the study), ``checks/``, ``study.html``, ``study.pdf``,
``figures/`` and ``manifest.json`` (which of the folder's files are the study's own).
"""

from __future__ import annotations

import csv
import io
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import astuple, fields, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import JsonValue

from designer.design import design_to_json, read_design
from designer.files import InputError, as_json, read_text, write_atomically
from designer.own_files import described_run
from designer.requirement import Requirement, read_requirement, requirement_to_toml, set_key
from designer.study.columns import STATUSES
from designer.study.comparators import read_comparators
from designer.study.manifest import announce, read_manifest, remove, settle
from designer.study.names import (
    CHECKS,
    COMPARATORS_TABLE,
    DESIGNS,
    FIGURE_LIST,
    FIGURES,
    LENSES,
    PAGE,
    PARETO,
    PDF,
    PROVENANCE,
    REQUIREMENT,
    RESULTS,
    TOLERANCES,
    UNCHECKED,
    design_name,
    design_path,
    figure_name,
    folder_of_check,
)
from designer.study.row import Row, frame_of, number_in, read_row
from designer.study.study import LensRow, ParetoRow, Study

if TYPE_CHECKING:  # imported when a table is written
    import pandas as pd

_PACKAGES = ("numpy", "scipy", "casadi", "pydantic", "pandas", "matplotlib", "typst")


def write_study(study: Study, folder: Path) -> None:
    """Write everything but checks and report; an older report goes. A folder without provenance.json is not finished.

    Only files that a study wrote, and that are as it wrote them, are replaced or removed.

    Raises
    ------
    InputError
        A file is in the way that no study wrote, or that has been changed since; nothing is written.
    OSError
        A file cannot be written.
    """
    files = {
        **{design_name(name): design_to_json(design) for name, design in study.designs.items()},
        REQUIREMENT: requirement_to_toml(study.requirement),
        RESULTS: frame_of(study.rows).to_csv(index=False),
        PARETO: pareto_frame(study.pareto).to_csv(index=False),
        **({LENSES: lens_frame(study.lenses).to_csv(index=False)} if study.lenses else {}),
        PROVENANCE: json.dumps(study.provenance, indent=2) + "\n",
    }
    earlier = read_manifest(folder) or {}
    announce(folder, files)
    stale = [name for name in earlier if name not in files and not name.startswith(f"{CHECKS}/")]
    (folder / PROVENANCE).unlink(missing_ok=True)
    remove(folder, stale)
    (folder / DESIGNS).mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        write_atomically(folder / name, content)
    settle(folder, files)


def write_report(folder: Path, pdf: bytes, figures: Mapping[str, bytes]) -> Path:
    """Write a typeset report and its figures (SVG by name), remove those of an earlier one; the path of the PDF.

    Raises
    ------
    InputError
        A file is in the way that no report wrote, or that has been changed since; nothing is written.
    """
    files: dict[str, str | bytes] = {figure_name(name): svg for name, svg in figures.items()}
    files |= {figure_name(FIGURE_LIST): json.dumps(sorted(figures), indent=2) + "\n", PDF: pdf}
    earlier = read_manifest(folder) or {}
    announce(folder, files)
    remove(folder, [name for name in earlier if name.startswith(f"{FIGURES}/") and name not in files])
    for name, content in files.items():
        write_atomically(folder / name, content)
    settle(folder, files)
    return folder / PDF


def write_page(folder: Path, page: str) -> Path:
    """Write ``study.html`` and return its path.

    Raises
    ------
    InputError
        A file is in the way that no study wrote, or that has been changed since; nothing is written.
    """
    announce(folder, [PAGE])
    write_atomically(folder / PAGE, page)
    settle(folder, [PAGE])
    return folder / PAGE


def pareto_frame(pareto: Sequence[ParetoRow]) -> pd.DataFrame:
    """One row for each point of the Pareto fronts."""
    import pandas as pd

    return pd.DataFrame([astuple(row) for row in pareto], columns=[field.name for field in fields(ParetoRow)])


def lens_frame(lenses: Sequence[LensRow]) -> pd.DataFrame:
    """One row for each configuration and lens of a catalogue."""
    import pandas as pd

    return pd.DataFrame([astuple(row) for row in lenses], columns=[field.name for field in fields(LensRow)])


def provenance_of(requirement: Requirement, elapsed_seconds: float) -> dict[str, JsonValue]:
    """Where results come from: versions, seed, solver options, machine, times."""
    from designer.optimise.program import SOLVERS  # folders are read without the solver

    return {
        **described_run({name: _version(name) for name in _PACKAGES}),
        "seed": requirement.solve.seed,
        "starts": requirement.solve.starts,
        "solvers": as_json(SOLVERS),
        "machine": {"system": platform.system(), "processor": platform.machine()},
        "elapsed_seconds": elapsed_seconds,
    }


def read_study(folder: Path) -> Study:
    """Read a study's folder.

    Raises
    ------
    InputError
        A file is absent or cannot be understood, or a feasible design has no file: one line says which.
    """
    requirement = read_stored_requirement(folder)
    rows = read_rows(folder)
    designs = {
        row.configuration: read_design(design_path(folder, row.configuration))
        for row in rows
        if row.status == "feasible"
    }
    pareto = _read_pareto(folder / PARETO) if (folder / PARETO).exists() else ()
    provenance = _read_json(folder / PROVENANCE) if (folder / PROVENANCE).exists() else {}
    lenses = _read_lenses(folder / LENSES) if (folder / LENSES).exists() else ()
    others = read_comparators(folder / COMPARATORS_TABLE) if (folder / COMPARATORS_TABLE).exists() else ()
    study = Study(requirement, rows, designs, pareto, provenance, lenses=lenses, comparators=others)
    return with_checks(with_tolerances(study, folder), folder)


def read_stored_requirement(folder: Path) -> Requirement:
    """The requirement of a study's folder, with what an older version did not count set so.

    Raises
    ------
    InputError
        The file is absent or cannot be understood: one line says why.
    """
    requirement = read_requirement(folder / REQUIREMENT)
    if "scale_uncertainty_percent" in requirement.model_fields_set:
        return requirement
    # A folder holds every key, so without this one the scale was not counted.
    return set_key(requirement, "scale_uncertainty_percent", 0.0)


def with_checks(study: Study, folder: Path) -> Study:
    """The study with the end-to-end checks of its designs that stand in its folder.

    Raises
    ------
    InputError
        A file of a check is absent or cannot be understood.
    """
    if not (folder / CHECKS).exists():
        return study
    from designer.study.checked import read_check, read_unchecked

    checks = {name: read_check(folder_of_check(folder, name), design) for name, design in study.designs.items()}
    reasons = {
        name: read_unchecked(folder_of_check(folder, name) / UNCHECKED, design)
        for name, design in study.designs.items()
    }
    return replace(
        study,
        checked={name: check for name, check in checks.items() if check is not None},
        unchecked={name: reason for name, reason in reasons.items() if reason is not None},
    )


def with_tolerances(study: Study, folder: Path) -> Study:
    """The study with what its best designs forgive, if that stands in its folder.

    Raises
    ------
    InputError
        The file cannot be understood.
    """
    if not (folder / TOLERANCES).exists():
        return study
    from designer.study.tolerances import read_tolerances_of_study

    return replace(study, tolerances=read_tolerances_of_study(folder, tuple(study.designs.values())))


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


def remove_checks(folder: Path) -> None:
    """Remove the checks of an earlier study; what someone else put among them stays."""
    remove(folder, [name for name in read_manifest(folder) or {} if name.startswith(f"{CHECKS}/")])


def _read_pareto(path: Path) -> tuple[ParetoRow, ...]:
    points = []
    for record in _read_records(path, ("configuration", "swept", "limit_mm", "status")):
        limit = number_in(record["limit_mm"])
        if limit is None:
            raise InputError(f"{path}: limit_mm = {record['limit_mm']!r}: must be a number")
        points.append(
            ParetoRow(
                configuration=record["configuration"],
                swept=record["swept"],
                limit_mm=limit,
                status=record["status"],
                depth_error_rms=number_in(record.get("depth_error_rms", "")),
                height_mm=number_in(record.get("height_mm", "")),
                diameter_mm=number_in(record.get("diameter_mm", "")),
            )
        )
    return tuple(points)


def _read_lenses(path: Path) -> tuple[LensRow, ...]:
    texts = ("configuration", "number", "lens", "is_chosen", "status", "reason")
    numbers = [field.name for field in fields(LensRow) if field.name not in texts]
    rows = []
    for record in _read_records(path, texts):
        number = record["number"]
        if not number.isdecimal():
            raise InputError(f"{path}: number = {number!r}: must be the number of a lens")
        rows.append(
            LensRow(
                configuration=record["configuration"],
                number=int(number),
                lens=record["lens"],
                is_chosen=record["is_chosen"] == "True",
                status=record["status"],
                reason=record["reason"],
                **{name: number_in(record.get(name, "")) for name in numbers},
            )
        )
    return tuple(rows)


def _read_records(path: Path, needed: tuple[str, ...]) -> list[dict[str, str]]:
    reader = csv.DictReader(io.StringIO(read_text(path)), restval="")
    try:
        for column in needed:
            if column not in (reader.fieldnames or ()):
                raise InputError(f"{path}: column {column} is missing")
        return [{key: value for key, value in record.items() if key is not None} for record in reader]
    except csv.Error as error:
        raise InputError(f"{path}: not a table that a study wrote: {error} (line {reader.line_num})") from None


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
