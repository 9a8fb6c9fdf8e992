"""The drone's requirement of the benchmarks: a small envelope in which optima lie apart from one another."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import cache
from pathlib import Path
from typing import Any

from designer.configurations import Configuration
from designer.requirement import Requirement, read_requirement, set_key
from designer.study.sweep.definition import Axis, SweepDefinition

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks" / "sweeps"


@cache
def drone(baseline_mm: float, height_mm: float) -> Requirement:
    """The requirement with a baseline and a height."""
    requirement = read_requirement(FOLDER / "drone.toml")
    return set_key(set_key(requirement, "baseline_mm", baseline_mm), "envelope.height_mm", height_mm)


def configuration(name: str) -> Configuration:
    """One of the 44."""
    (found,) = [each for each in drone(60.0, 75.0).configurations if each.name == name]
    return found


def drone_sweep(start: int) -> SweepDefinition:
    """Two baselines by three heights, from the first (0) or the last (-1) of each."""
    axes = tuple(
        Axis(key=key, values=values, start=values[start])
        for key, values in (("baseline_mm", (48.0, 54.0)), ("envelope.height_mm", (75.0, 85.0, 100.0)))
    )
    return SweepDefinition(name="drone", requirement="drone.toml", axis=axes)


class InThisProcess:
    """Workers that work at once, in the test's own process."""

    capacity = 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Do a task."""
        future: Future[Any] = Future()
        future.set_result(function(*arguments))
        return future
