"""A study: every configuration of a requirement, in parallel, ranked and written to its folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from designer.optimise.pareto_fronts import ParetoPoint
from designer.requirement import Requirement
from designer.study.folder import write_folder
from designer.study.progress import Progress
from designer.study.ranking import rank
from designer.study.selection import restrict
from designer.study.task import ConfigurationResult, front_of, solve_configuration
from designer.study.workers import Processes, local_processes, run_each, why_it_failed

ProgressCallback = Callable[[Progress], None]
DESIGNS_WITH_FRONTS = 5


@dataclass(frozen=True, slots=True)
class Study:
    """The outcome of a study, best designs first."""

    requirement: Requirement
    results: tuple[ConfigurationResult, ...]
    fronts: tuple[tuple[str, ParetoPoint], ...]
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
        Names or patterns of configurations; all that the requirement selects if empty. The study's own requirement
        names them.
    progress
        Called after each configuration.

    Raises
    ------
    InputError
        A pattern matches none of the requirement's configurations.
    """
    study = solve_study(requirement, jobs=jobs, only=only, progress=progress)
    write_folder(study.requirement, study.results, study.fronts, study.elapsed_seconds, folder)
    return study


def solve_study(
    requirement: Requirement, *, jobs: int = 1, only: tuple[str, ...] = (), progress: ProgressCallback | None = None
) -> Study:
    """Solve and rank a study without writing anything; see :func:`run_study`."""
    started = time.perf_counter()
    requirement = restrict(requirement, only)
    with local_processes(jobs) as processes:
        results = _solve_each(processes, requirement, progress, started)
        ranked = rank(requirement, results)
        ranked, fronts = _trace_fronts(processes, ranked)
    return Study(requirement, tuple(ranked), tuple(fronts), time.perf_counter() - started)


def _solve_each(
    processes: Processes, requirement: Requirement, progress: ProgressCallback | None, started: float
) -> list[ConfigurationResult]:
    """Results in the order of the configurations; progress in the order in which they come."""
    configurations = requirement.configurations
    results: dict[int, ConfigurationResult] = {}
    feasible = 0
    tasks = [(requirement, configuration) for configuration in configurations]
    for index, future in run_each(processes, solve_configuration, tasks):
        try:
            result = future.result()
        except Exception as error:
            result = ConfigurationResult(configurations[index], "failed", why_it_failed(error))
        results[index] = result
        feasible += result.status == "feasible"
        if progress is not None:
            done, total = len(results), len(configurations)
            elapsed = time.perf_counter() - started
            remaining = elapsed / done * (total - done)
            progress(Progress(done, total, result.configuration.name, result.status, feasible, elapsed, remaining))
    return [results[index] for index in range(len(configurations))]


def _trace_fronts(
    processes: Processes, ranked: list[ConfigurationResult]
) -> tuple[list[ConfigurationResult], list[tuple[str, ParetoPoint]]]:
    """The fronts of the best designs, in their order, and the results; one without its front says why."""
    ranked = list(ranked)
    best = [place for place, result in enumerate(ranked) if result.first is not None][:DESIGNS_WITH_FRONTS]
    fronts: dict[int, list[ParetoPoint]] = {}
    for index, future in run_each(processes, front_of, [(ranked[place].first,) for place in best]):
        place = best[index]
        try:
            fronts[place] = future.result()
        except Exception as error:
            details = ranked[place].details | {"front_problem": why_it_failed(error)}
            ranked[place] = replace(ranked[place], details=details)
    return ranked, [(ranked[place].configuration.name, point) for place in sorted(fronts) for point in fronts[place]]
