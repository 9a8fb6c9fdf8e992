"""Running a sweep: what is finished stays, what is not runs, and every result goes to the store as it comes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer import __version__
from designer.requirement import Requirement, requirement_to_json
from designer.study.sweep.definition import SweepDefinition
from designer.study.sweep.export import export_tables
from designer.study.sweep.plan import check_points, plan_points
from designer.study.sweep.point import TaskResult, chunks_of, solve_task
from designer.study.sweep.schedule import Schedule, TaskKey
from designer.study.sweep.store import Store, open_store
from designer.study.sweep.workers import Workers, local_workers
from designer.study.workers import Processes

# A task that takes its process down with it each time is not tried for ever.
MOST_LOST_WORKERS = 20
LATEST_TASKS = 100


class LostProcessesError(OSError):
    """Processes died again and again. What is in the store stays, and the sweep can be run again."""


@dataclass(frozen=True, slots=True)
class SweepProgress:
    """How far a sweep has come; ``done`` and ``total`` count tasks, ``feasible`` designs."""

    done: int
    total: int
    points_per_task: float
    feasible: int
    remaining_seconds: float


ProgressCallback = Callable[[SweepProgress], None]


def run_sweep(
    definition: SweepDefinition,
    base: Requirement,
    folder: Path,
    *,
    jobs: int = 1,
    workers: AbstractContextManager[Any] | None = None,
    progress: ProgressCallback | None = None,
) -> None:
    """Solve what is not yet in the folder's store, then write the tables.

    Parameters
    ----------
    definition, base
        As :func:`designer.study.sweep.definition.read_sweep` gives them.
    folder
        Where the store and the tables go.
    jobs
        How many processes. Results do not depend on it.
    workers
        Where to run instead, such as a cluster.
    progress
        Called after each task.

    Raises
    ------
    InputError
        A point may not be asked, or the folder holds another sweep.
    StoreError
        The disk is full or the folder read-only; what is finished stays.
    LostProcessesError
        Processes died again and again, for want of memory for example; what is finished stays.
    """
    points = plan_points(definition)
    check_points(definition, base, points)
    about = {
        "definition": definition.model_dump_json(),
        "requirement": requirement_to_json(base),
        "version of designer": __version__,
    }
    with open_store(folder) as store:
        store.create(about, points)
        schedule = Schedule(points, len(chunks_of(base)), store.finished())
        if schedule:
            with workers or local_workers(jobs) as crew:
                _work(schedule, store, crew, base, {point.number: point.coordinates for point in points}, progress)
    export_tables(folder)


def _work(
    schedule: Schedule,
    store: Store,
    workers: Workers,
    base: Requirement,
    coordinates: dict[int, dict[str, float]],
    progress: ProgressCallback | None,
) -> None:
    lost = 0
    feasible = store.feasible_count()
    # The first tasks start cold and take many times as long: time left is told by the latest.
    latest = deque([time.perf_counter()], maxlen=LATEST_TASKS)
    running: dict[Future[TaskResult], TaskKey] = {}
    while schedule or running:
        try:
            while schedule and len(running) < workers.capacity:
                task = schedule.take()
                try:
                    running[_submit(workers, store, schedule, base, coordinates, task)] = task
                except BrokenProcessPool:
                    schedule.give_back(task)
                    raise
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=lambda future: running[future]):
                result = future.result()
                task = running.pop(future)
                store.add(*task, result)
                schedule.finish(task)
                feasible += sum(row["status"] == "feasible" for row in result.rows)
                latest.append(time.perf_counter())
                if progress is not None:
                    done = len(schedule.finished)
                    remaining = (latest[-1] - latest[0]) / (len(latest) - 1) * (schedule.total - done)
                    chunks = schedule.total / len(coordinates)
                    progress(SweepProgress(done, schedule.total, 1.0 / chunks, feasible, remaining))
        except BrokenProcessPool:
            lost += 1
            _take_what_is_whole(running, store, schedule)
            if lost > MOST_LOST_WORKERS or not isinstance(workers, Processes):
                numbers = ", ".join(str(number) for number in sorted({number for number, _ in running.values()}))
                raise LostProcessesError(
                    f"processes died {lost} times, at last with these points under way: {numbers}; perhaps out of "
                    "memory. What is finished is kept: run it again, with fewer jobs, to go on"
                ) from None
            for task in running.values():
                schedule.give_back(task)
            running.clear()
            workers.rebuild()


def _take_what_is_whole(running: dict[Future[TaskResult], TaskKey], store: Store, schedule: Schedule) -> None:
    """Keep results that had come before a process died."""
    for future in list(running):
        if future.done() and not future.cancelled() and future.exception() is None:
            task = running.pop(future)
            store.add(*task, future.result())
            schedule.finish(task)


def _submit(
    workers: Workers,
    store: Store,
    schedule: Schedule,
    base: Requirement,
    coordinates: dict[int, dict[str, float]],
    task: TaskKey,
) -> Future[TaskResult]:
    number, chunk = task
    parent = schedule.parents[number]
    known = store.trails(parent, chunk) if parent is not None else None
    return workers.submit(solve_task, base, coordinates[number], chunk, known)
