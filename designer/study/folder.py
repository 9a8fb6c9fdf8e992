"""A study's folder, written whole file by whole file: the contract in docs/results.md."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pandas as pd

from designer import __version__
from designer.design import write_design
from designer.files import write_atomically
from designer.optimise.pareto_fronts import ParetoPoint
from designer.optimise.program import SOLVERS
from designer.requirement import Requirement, requirement_to_toml
from designer.study.outputs import remove_report
from designer.study.task import ConfigurationResult

CONTRACT_COLUMNS = (
    "configuration",
    "family",
    "topology",
    "status",
    "reason",
    "depth_error_rms",
    "limit_ratio",
    "baseline_mm",
    "height_mm",
    "diameter_mm",
)
PROVENANCE = "provenance.json"
_PACKAGES = ("numpy", "scipy", "casadi", "pydantic", "pandas", "matplotlib", "typst")


def write_folder(
    requirement: Requirement,
    results: Sequence[ConfigurationResult],
    fronts: Sequence[tuple[str, ParetoPoint]],
    elapsed_seconds: float,
    folder: Path,
) -> None:
    """Write everything but the report. A folder without provenance.json is not finished."""
    (folder / PROVENANCE).unlink(missing_ok=True)
    remove_report(folder)
    designs = {f"{result.configuration.name}.json": result.design for result in results if result.design is not None}
    (folder / "designs").mkdir(parents=True, exist_ok=True)
    for stale in (folder / "designs").glob("*.json"):
        if stale.name not in designs:
            stale.unlink()
    for name, design in designs.items():
        write_design(design, folder / "designs" / name)
    write_atomically(folder / "requirement.toml", requirement_to_toml(requirement))
    write_atomically(folder / "designs.csv", table(results).to_csv(index=False))
    write_atomically(folder / "fronts.csv", front_table(fronts).to_csv(index=False))
    write_atomically(folder / PROVENANCE, json.dumps(provenance(requirement, elapsed_seconds), indent=2) + "\n")


def table(results: Sequence[ConfigurationResult]) -> pd.DataFrame:
    """One row for each configuration, in the order given: the contract's columns first."""
    rows = []
    ranks = iter(range(1, len(results) + 1))
    for result in results:
        design = result.design
        row: dict[str, Any] = {
            "configuration": result.configuration.name,
            "family": result.configuration.family,
            "topology": result.configuration.topology,
            "status": result.status,
            "reason": result.reason,
        }
        if design is not None:
            row |= {
                "depth_error_rms": design.score["depth_error_rms"],
                "limit_ratio": design.score["limit_ratio"],
                "baseline_mm": design.baseline_mm,
                "height_mm": design.height_mm,
                "diameter_mm": design.diameter_mm,
                "rank": next(ranks),
            }
        rows.append(row | result.details)
    frame = pd.DataFrame(rows)
    columns = [*CONTRACT_COLUMNS, *(name for name in frame.columns if name not in CONTRACT_COLUMNS)]
    frame = frame.reindex(columns=columns)
    # Whole numbers that some rows lack would be written as 2.0.
    return frame.astype({name: "Int64" for name in ("rank", "starts", "solves") if name in frame})


def front_table(fronts: Sequence[tuple[str, ParetoPoint]]) -> pd.DataFrame:
    """One row for each point of the fronts."""
    rows = [
        {
            "configuration": configuration,
            "swept": f"{point.swept}_mm",
            "limit_mm": point.limit,
            "status": "feasible",
            "depth_error_rms": point.goals["depth_error"],
            "height_mm": point.goals["height"],
            "diameter_mm": point.goals["diameter"],
        }
        for configuration, point in fronts
    ]
    columns = ["configuration", "swept", "limit_mm", "status", "depth_error_rms", "height_mm", "diameter_mm"]
    return pd.DataFrame(rows, columns=columns)


def provenance(requirement: Requirement, elapsed_seconds: float) -> dict[str, Any]:
    """Where results come from: versions, seed, solver options, machine, times."""
    return {
        "designer": __version__,
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in _PACKAGES},
        "seed": requirement.solve.seed,
        "starts": requirement.solve.starts,
        "solvers": SOLVERS,
        "machine": {"system": platform.system(), "processor": platform.machine()},
        "command": " ".join(["designer", *sys.argv[1:]]),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "elapsed_seconds": elapsed_seconds,
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
