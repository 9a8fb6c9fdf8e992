"""A study: every configuration of a requirement, in parallel, ranked and written to its folder."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from designer.optimise.front import FrontPoint
from designer.requirement import Requirement
from designer.study.child import build_pool, interrupts_held_back, stop_pool
from designer.study.folder import write_folder
from designer.study.progress import Progress
from designer.study.ranking import rank
from designer.study.task import ConfigurationResult, front_of, solve_configuration

ProgressCallback = Callable[[Progress], None]
DESIGNS_WITH_FRONTS = 5


@dataclass(frozen=True, slots=True)
class Study:
    """The outcome of a study, best designs first."""

    requirement: Requirement
    results: tuple[ConfigurationResult, ...]
    fronts: tuple[tuple[str, FrontPoint], ...]
    elapsed_seconds: float

    @property
    def feasible(self) -> tuple[ConfigurationResult, ...]:
        """Results of feasible configurations, best first."""
        return tuple(result for result in self.results if result.status == "feasible")


def run_study(
    requirement: Requirement,
    folder: Path,
    *,
    jobs: int = 1,
    only: tuple[str, ...] = (),
    progress: ProgressCallback | None = None,
) -> Study:
    """Solve, rank and write a study.

    Parameters
    ----------
    requirement
        What is asked.
    folder
        Where results go; each file is written whole or not at all, provenance.json last.
    jobs
        Processes to work with. The results do not depend on it.
    only
        Names or patterns of configurations; all that the requirement selects if empty.
    progress
        Called after each configuration.
    """
    study = solve_study(requirement, jobs=jobs, only=only, progress=progress)
    write_folder(study.requirement, study.results, study.fronts, study.elapsed_seconds, folder)
    return study


def solve_study(
    requirement: Requirement, *, jobs: int = 1, only: tuple[str, ...] = (), progress: ProgressCallback | None = None
) -> Study:
    """Solve and rank a study without writing anything; see :func:`run_study`."""
    started = time.perf_counter()
    configurations = [
        configuration
        for configuration in requirement.configurations
        if not only or any(fnmatchcase(configuration.name, pattern) for pattern in only)
    ]
    with workers(jobs) as submit:
        futures = [submit(solve_configuration, requirement, configuration) for configuration in configurations]
        results = _gather(futures, progress, started)
        ranked = rank(requirement, results)
        best = [result for result in ranked if result.first is not None][:DESIGNS_WITH_FRONTS]
        traced = [submit(front_of, requirement, result.first) for result in best]
        fronts = tuple(
            (result.configuration.name, point)
            for result, future in zip(best, traced, strict=True)
            for point in future.result()
        )
    return Study(requirement, tuple(ranked), fronts, time.perf_counter() - started)


def _gather(
    futures: list[Future[ConfigurationResult]], progress: ProgressCallback | None, started: float
) -> list[ConfigurationResult]:
    """Results in the order of their futures; progress in the order in which they come."""
    waiting, done, feasible = set(futures), 0, 0
    while waiting:
        finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
        for future in sorted(finished, key=futures.index):
            result = future.result()
            feasible += result.status == "feasible"
            done += 1
            elapsed = time.perf_counter() - started
            if progress is not None:
                name = result.configuration.name
                remaining = elapsed / done * (len(futures) - done)
                progress(Progress(done, len(futures), name, result.status, feasible, elapsed, remaining))
    return [future.result() for future in futures]


@contextmanager
def workers(jobs: int) -> Iterator[Callable[..., Future[Any]]]:
    """A ``submit`` that runs tasks in so many other processes; interruption ends them at once.

    One job is a process of its own too: CasADi swallows a signal that comes while it solves in the main thread, and a
    thread beside it could not be stopped.
    """

    def submit(function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with interrupts_held_back():
            return pool.submit(function, *arguments)

    with build_pool(jobs, "designer.study.task") as pool:
        try:
            yield submit
        except BaseException:
            stop_pool(pool)
            raise
