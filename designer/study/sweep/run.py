"""Running a sweep: what is finished stays, what is not runs, and every result goes to the store as it comes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from designer import __version__
from designer.requirement import Requirement, requirement_to_json
from designer.study.processes import Processes
from designer.study.sweep.definition import SweepDefinition
from designer.study.sweep.plan import check_points, plan_points
from designer.study.sweep.point import TaskResult, chunks_of, solve_task
from designer.study.sweep.schedule import Schedule, TaskKey
from designer.study.sweep.store import Store, open_store
from designer.study.sweep.tables import write_tables
from designer.study.sweep.workers import Workers, local_workers

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
    tell: Callable[[str], None] | None = None,
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
    tell
        Called with a sentence if the store was emptied, or if finished tasks in it are damaged and computed again.

    Raises
    ------
    InputError
        A point may not be asked, the folder holds another sweep, or its store is damaged beyond single tasks.
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
        if store.was_emptied and tell is not None:
            tell(f"{store.path}: is empty; the sweep starts from the beginning")
        store.create(about, points)
        if (damaged := store.remove_damaged()) and tell is not None:
            tell(f"{store.path}: {damaged} finished task{'s' * (damaged > 1)} damaged; computing again")
        schedule = Schedule(points, len(chunks_of(base)), store.finished())
        if schedule:
            with workers or local_workers(jobs) as crew:
                _Sweep(base, {point.number: point.coordinates for point in points}, schedule, store, crew).run(progress)
    write_tables(folder)


@dataclass(slots=True)
class _Sweep:
    """A sweep under way: what to solve, what is running, and where results go."""

    base: Requirement
    coordinates: dict[int, dict[str, float]]
    schedule: Schedule
    store: Store
    workers: Workers
    running: dict[Future[TaskResult], TaskKey] = field(default_factory=dict)
    lost: int = 0

    def run(self, progress: ProgressCallback | None) -> None:
        """Run every task that is left."""
        clock = _Clock()
        feasible = self.store.feasible_count()
        while self.schedule or self.running:
            try:
                self._hand_out()
                for result in self._collect():
                    feasible += sum(row.status == "feasible" for row in result.rows)
                    clock.tick()
                    if progress is not None:
                        progress(self._progress(feasible, clock))
            except BrokenProcessPool:
                self._go_on_without_the_dead()

    def _hand_out(self) -> None:
        """Keep every worker busy."""
        while self.schedule and len(self.running) < self.workers.capacity:
            task = self.schedule.take()
            try:
                self.running[self._submit(task)] = task
            except BrokenProcessPool:
                self.schedule.give_back(task)
                raise

    def _submit(self, task: TaskKey) -> Future[TaskResult]:
        number, chunk = task
        parent = self.schedule.parents[number]
        known = self.store.warm_starts(parent, chunk) if parent is not None else None
        return self.workers.submit(solve_task, self.base, self.coordinates[number], chunk, known)

    def _collect(self) -> Iterator[TaskResult]:
        """Wait until a task ends; store and yield all that have ended, in order."""
        finished, _ = wait(self.running, return_when=FIRST_COMPLETED)
        for future in sorted(finished, key=lambda future: self.running[future]):
            result = future.result()
            self._keep(self.running.pop(future), result)
            yield result

    def _keep(self, task: TaskKey, result: TaskResult) -> None:
        self.store.add(*task, result)
        self.schedule.finish(task)

    def _progress(self, feasible: int, clock: _Clock) -> SweepProgress:
        done, total = len(self.schedule.finished), self.schedule.total
        chunks = total / len(self.coordinates)
        return SweepProgress(done, total, 1.0 / chunks, feasible, clock.seconds_for(total - done))

    def _go_on_without_the_dead(self) -> None:
        """Keep what had come before a process died, and give back what was lost with it."""
        self.lost += 1
        for future in list(self.running):
            if future.done() and not future.cancelled() and future.exception() is None:
                self._keep(self.running.pop(future), future.result())
        if self.lost > MOST_LOST_WORKERS or not isinstance(self.workers, Processes):
            numbers = ", ".join(str(number) for number in sorted({number for number, _ in self.running.values()}))
            raise LostProcessesError(
                f"worker processes died {self.lost} times, the last time at points {numbers}; perhaps they ran out "
                f"of memory. Finished tasks are kept: to resume, run the same command with fewer jobs"
            ) from None
        for task in self.running.values():
            self.schedule.give_back(task)
        self.running.clear()
        self.workers.rebuild()


class _Clock:
    """Time left, judged by the latest tasks: the first start cold and take many times as long."""

    def __init__(self) -> None:
        self._ends = deque([time.perf_counter()], maxlen=LATEST_TASKS)

    def tick(self) -> None:
        """Note the end of a task."""
        self._ends.append(time.perf_counter())

    def seconds_for(self, tasks: int) -> float:
        """How long so many tasks will take."""
        return (self._ends[-1] - self._ends[0]) / (len(self._ends) - 1) * tasks
