"""The best designs of a finished study checked end to end: the ``checks/`` folder beside the study's tables."""

from __future__ import annotations

import csv
import io
import shutil
import time
from collections.abc import Callable
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

from designer.design import Design, read_design
from designer.files import read_text
from designer.study.run import workers

CHECKS = "checks"
DEFAULT_CHECKS = 3


@dataclass(frozen=True, slots=True)
class CheckProgress:
    """One design checked: its verdict, how many are done of how many, and the seconds it took."""

    done: int
    total: int
    configuration: str
    passed: bool
    seconds: float


CheckCallback = Callable[[CheckProgress], None]


def check_best(
    folder: Path, count: int = DEFAULT_CHECKS, *, jobs: int = 1, seed: int = 0, progress: CheckCallback | None = None
) -> dict[str, bool]:
    """Check the best designs of a finished study, and write ``checks/<configuration>/`` for each into its folder.

    Checks of an earlier study in the folder are removed first. The results do not depend on ``jobs``.

    Returns
    -------
    Whether each passed, by configuration, best first.

    Raises
    ------
    InputError
        The folder is not that of a finished study.
    """
    for earlier in (folder / CHECKS).glob("*/check.json"):
        shutil.rmtree(earlier.parent)
    designs = best_designs(folder, count)
    if not designs:
        return {}
    passed: dict[str, bool] = {}
    with workers(min(jobs, len(designs))) as submit:
        futures = [submit(_check_and_write, design, folder / CHECKS / design.configuration, seed) for design in designs]
        for future in as_completed(futures):
            configuration, verdict, seconds = future.result()
            passed[configuration] = verdict
            if progress is not None:
                progress(CheckProgress(len(passed), len(designs), configuration, verdict, seconds))
    return {design.configuration: passed[design.configuration] for design in designs}


def best_designs(folder: Path, count: int) -> list[Design]:
    """The best feasible designs of a study's folder, in its order."""
    rows = csv.DictReader(io.StringIO(read_text(folder / "designs.csv")))
    feasible = [row["configuration"] for row in rows if row["status"] == "feasible"]
    return [read_design(folder / "designs" / f"{configuration}.json") for configuration in feasible[:count]]


def _check_and_write(design: Design, folder: Path, seed: int) -> tuple[str, bool, float]:
    # Imported where it runs, so that a study without checks needs no imaging.
    from designer.imaging.check import check_design
    from designer.imaging.check_files import write_check

    started = time.perf_counter()
    check = check_design(design, seed=seed)
    write_check(check, folder)
    return design.configuration, check.passed, time.perf_counter() - started
