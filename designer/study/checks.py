"""Designs of a finished study checked end to end: the ``checks/`` folder beside the study's tables.

``checks/<configuration>/`` holds what :mod:`designer.imaging.endtoend.check_files` writes; where the check itself broke
down, only ``unchecked.json``: the configuration and the reason.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from designer.design import Design
from designer.files import UnwritableError, write_atomically
from designer.study.folder import remove_checks
from designer.study.manifest import announce, settle
from designer.study.names import FILES_OF_A_CHECK, UNCHECKED, folder_of_check, names_of_check
from designer.study.processes import local_processes, run_each, why_it_failed

if TYPE_CHECKING:  # OpenCV, which a study without checks does not need
    from designer.imaging.endtoend.check_files import CheckFile


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


@dataclass(frozen=True, slots=True)
class Half:
    """A design checked through its lens or through a pinhole: the points found, and the seconds it took.

    ``verdict`` is that of the check through the lens, None for a pinhole.
    """

    points: int
    seconds: float
    verdict: CheckFile | None = None


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
    halves: list[list[Half]] = [[] for _ in designs]
    problems: dict[int, str] = {}
    is_other_under_way = [False] * len(designs)
    # Apart, and the long ones first, so that all processes are busy to the end.
    parts = [(index, through_lens) for through_lens in (True, False) for index in range(len(designs))]
    places = [folder_of_check(folder, design.configuration) for design in designs]
    tasks = [(designs[index], places[index], seed, through_lens) for index, through_lens in parts]
    with local_processes(min(jobs, len(tasks))) as processes:
        for number, future in run_each(processes, _check_half, tasks):
            index, _ = parts[number]
            try:
                halves[index].append(future.result())
            except (OSError, UnwritableError):
                raise  # a full disk is no property of a design
            except Exception as error:
                problems.setdefault(index, why_it_failed(error))
            is_other_under_way[index] = not is_other_under_way[index]
            if is_other_under_way[index]:
                continue
            name, problem = designs[index].configuration, problems.get(index, "")
            if problem:
                _write_unchecked(designs[index], problem, places[index])
            passed[name] = not problem and _write_verdict(halves[index], places[index])
            settle(folder, names_of_check(name))
            if progress is not None:
                seconds = sum(half.seconds for half in halves[index])
                progress(CheckProgress(len(passed), len(designs), name, passed[name], seconds, problem))
    return {design.configuration: passed[design.configuration] for design in designs}


def _check_half(design: Design, folder: Path, seed: int, through_lens: bool) -> Half:
    # Imported where it runs, so that a study without checks needs no imaging.
    from designer.imaging.endtoend.check import CheckOptions, check_design
    from designer.imaging.endtoend.check_files import write_check

    started = time.perf_counter()
    options = CheckOptions(seed=seed)
    check = check_design(design, options if through_lens else replace(options, lens=None))
    verdict = write_check(check, folder) if through_lens else None
    return Half(check.points, time.perf_counter() - started, verdict)


def _write_verdict(halves: Sequence[Half], folder: Path) -> bool:
    from designer.imaging.endtoend.check import share_of_points
    from designer.imaging.endtoend.check_files import write_verdict

    pinhole, lens = sorted(halves, key=lambda half: half.verdict is not None)
    assert lens.verdict is not None
    write_verdict(lens.verdict, share_of_points(lens.points, pinhole.points), folder)
    return lens.verdict["passed"]


def _write_unchecked(design: Design, problem: str, folder: Path) -> None:
    from designer.imaging.endtoend.check_files import fingerprint

    for name in FILES_OF_A_CHECK:
        (folder / name).unlink(missing_ok=True)
    content = {"configuration": design.configuration, "reason": problem, "design_sha256": fingerprint(design)}
    write_atomically(folder / UNCHECKED, json.dumps(content, indent=2) + "\n")
