"""A study: every configuration of a requirement, in parallel, ranked and written to its folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from designer.requirement import Requirement
from designer.study.folder import provenance_of, write_study
from designer.study.processes import Processes, local_processes, run_each, why_it_failed
from designer.study.progress import Progress
from designer.study.ranking import ranking
from designer.study.selection import restrict
from designer.study.study import ParetoRow, Study
from designer.study.task import ConfigurationResult, failed, pareto_front_of, solve_configuration

ProgressCallback = Callable[[Progress], None]
DESIGNS_WITH_PARETO_FRONTS = 5


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
        A pattern matches none of the requirement's configurations; or a file is in the way that no study wrote, or that
        has been changed since.
    """
    study = solve_study(requirement, jobs=jobs, only=only, progress=progress)
    write_study(study, folder)
    return study


def solve_study(
    requirement: Requirement, *, jobs: int = 1, only: tuple[str, ...] = (), progress: ProgressCallback | None = None
) -> Study:
    """Solve and rank a study without writing anything; see :func:`run_study`."""
    started = time.perf_counter()
    requirement = restrict(requirement, only)
    with local_processes(jobs) as processes:
        results = _ranked(requirement, _solve_each(processes, requirement, progress, started))
        results, pareto = _trace_pareto_fronts(processes, requirement, results)
    return Study(
        requirement,
        tuple(result.row for result in results),
        {result.row.configuration: result.design for result in results if result.design is not None},
        tuple(pareto),
        provenance_of(requirement, time.perf_counter() - started),
        lenses=tuple(row for result in results for row in result.lenses),
    )


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
            result = failed(configurations[index], why_it_failed(error))
        results[index] = result
        feasible += result.status == "feasible"
        if progress is not None:
            done, total = len(results), len(configurations)
            elapsed = time.perf_counter() - started
            remaining = elapsed / done * (total - done)
            progress(Progress(done, total, result.configuration.name, result.status, feasible, elapsed, remaining))
    return [results[index] for index in range(len(configurations))]


def _ranked(requirement: Requirement, results: list[ConfigurationResult]) -> list[ConfigurationResult]:
    """The results, best first, the feasible ones with their ranks."""
    ordered = [results[place] for place in ranking(requirement, [result.row for result in results])]
    return [
        replace(result, row=result.row.with_values(rank=rank)) if result.status == "feasible" else result
        for rank, result in enumerate(ordered, start=1)
    ]


def _trace_pareto_fronts(
    processes: Processes, requirement: Requirement, ranked: list[ConfigurationResult]
) -> tuple[list[ConfigurationResult], list[ParetoRow]]:
    """The Pareto fronts of the best designs, in their order, and the results; one without its front says why."""
    ranked = list(ranked)
    best = [place for place, result in enumerate(ranked) if result.first is not None][:DESIGNS_WITH_PARETO_FRONTS]
    found: dict[int, list[ParetoRow]] = {}
    tasks = [(requirement, ranked[place].first, ranked[place].warm_starts) for place in best]
    for index, future in run_each(processes, pareto_front_of, tasks):
        place = best[index]
        try:
            found[place] = future.result()
        except Exception as error:
            row = ranked[place].row.with_values(pareto_front_problem=why_it_failed(error))
            ranked[place] = replace(ranked[place], row=row)
    return ranked, [point for place in sorted(found) for point in found[place]]
