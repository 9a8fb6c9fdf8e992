"""Designs of a finished study checked end to end: the ``checks/`` folder beside the study's tables.

``checks/<configuration>/`` holds what :mod:`designer.imaging.endtoend.check_files` writes; where the check itself broke
down, only ``unchecked.json``: the configuration and the reason.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from designer.design import Design
from designer.files import UnwritableError, write_atomically
from designer.study.folder import remove_checks
from designer.study.manifest import announce, settle
from designer.study.names import UNCHECKED, check_folder, names_of_check
from designer.study.processes import local_processes, run_each, why_it_failed


@dataclass(frozen=True, slots=True)
class CheckProgress:
    """One design checked: its verdict, how many are done of how many, and the seconds it took.

    ``problem`` says why the design could not be checked; it is empty if it was, and then ``passed`` is the verdict.
    """

    done: int
    total: int
    configuration: str
    passed: bool
    seconds: float
    problem: str = ""


CheckCallback = Callable[[CheckProgress], None]


def check_designs(
    designs: Sequence[Design], folder: Path, *, jobs: int = 1, seed: int = 0, progress: CheckCallback | None = None
) -> dict[str, bool]:
    """Check designs of a study, and write ``checks/<configuration>/`` for each into the study's folder.

    Checks of an earlier study in the folder are removed first. The results do not depend on ``jobs``. A check that
    breaks down concerns its own design alone: the reason is written, and the others go on.

    Returns
    -------
    Whether each passed, by configuration, in the order given; one that could not be checked did not.

    Raises
    ------
    InputError
        A file is in the way that no study wrote, or that has been changed since.
    OSError
        A check cannot be written.
    """
    remove_checks(folder)
    if not designs:
        return {}
    announce(folder, [name for design in designs for name in names_of_check(design.configuration)])
    passed: dict[str, bool] = {}
    started = time.perf_counter()
    tasks = [(design, check_folder(folder, design.configuration), seed) for design in designs]
    with local_processes(min(jobs, len(designs))) as processes:
        for index, future in run_each(processes, _check_and_write, tasks):
            design, problem = designs[index], ""
            try:
                verdict, seconds = future.result()
            except (OSError, UnwritableError):
                raise  # a full disk is no property of a design
            except Exception as error:
                verdict, seconds = False, time.perf_counter() - started
                problem = why_it_failed(error)
                _write_unchecked(design, problem, check_folder(folder, design.configuration))
            settle(folder, names_of_check(design.configuration))
            passed[design.configuration] = verdict
            if progress is not None:
                step = CheckProgress(len(passed), len(designs), design.configuration, verdict, seconds, problem)
                progress(step)
    return {design.configuration: passed[design.configuration] for design in designs}


def _check_and_write(design: Design, folder: Path, seed: int) -> tuple[bool, float]:
    # Imported where it runs, so that a study without checks needs no imaging.
    from designer.imaging.endtoend.check import CheckOptions, check_with_control
    from designer.imaging.endtoend.check_files import write_check

    started = time.perf_counter()
    checks = check_with_control(design, CheckOptions(seed=seed))
    write_check(checks, folder)
    return checks.lens.passed, time.perf_counter() - started


def _write_unchecked(design: Design, problem: str, folder: Path) -> None:
    from designer.imaging.endtoend.check_files import fingerprint

    content = {"configuration": design.configuration, "reason": problem, "design_sha256": fingerprint(design)}
    write_atomically(folder / UNCHECKED, json.dumps(content, indent=2) + "\n")
