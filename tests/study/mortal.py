"""Tasks in processes that die or raise; a module of its own, so that the processes import little."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from designer.study.checks import Half

ALWAYS = 99


def mortal(folder: Path, deaths: Mapping[str, int], name_of: Callable[..., str], function: Any, *arguments: Any) -> Any:
    """Do a task in a process that first dies, so many times over a name; the folder remembers."""
    place = folder / name_of(*arguments)
    place.mkdir(parents=True, exist_ok=True)
    died = len(list(place.iterdir()))
    if died < deaths.get(place.name, 0):
        (place / str(died)).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return function(*arguments)


def slow_then_mortal(folder: Path, number: int) -> int:
    """Number 0 dies always; another is still at work when 0 dies first, dies of itself next, and succeeds at last."""
    if number == 0:
        while not list(folder.iterdir()):
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGKILL)
    marks = len(list(folder.iterdir()))
    (folder / str(marks)).touch()
    if marks == 0:
        time.sleep(60.0)
    if marks == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def raising(
    folder: Path, deaths: Mapping[str, int], name_of: Callable[..., str], function: Any, *arguments: Any
) -> Any:
    """Raise wherever :func:`mortal` dies."""
    if name_of(*arguments) in deaths:
        raise RuntimeError("broken")
    return function(*arguments)


def name_of_configuration(requirement: Any, configuration: Any) -> str:
    return str(configuration.name)


def name_of_first(requirement: Any, first: Any, warm_starts: Any) -> str:
    return str(first.problem.variant.configuration.name)


def name_of_design(design: Any, folder: Path, seed: int, through_lens: bool) -> str:
    return str(design.configuration)


def name_of_point(*arguments: Any) -> str:
    return "point"


def square(number: int) -> int:
    if number < 0:
        raise ValueError("below\nzero")
    return number**2


def pass_check(design: Any, folder: Path, seed: int, through_lens: bool) -> Half:
    return Half(1, 1.0, {"passed": True} if through_lens else None)


def break_at_the_pinhole(design: Any, folder: Path, seed: int, through_lens: bool) -> Half:
    if not through_lens:
        raise RuntimeError("broken")
    folder.mkdir(parents=True)
    (folder / "raw.png").touch()
    return pass_check(design, folder, seed, through_lens)
