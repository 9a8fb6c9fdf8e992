"""Running a sweep: what is finished stays, what is not runs, and every result goes to the store as it comes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from designer import __version__
from designer.requirement import Requirement, requirement_to_json
from designer.study.processes import Processes
from designer.study.sweep.definition import SweepDefinition
from designer.study.sweep.plan import Point, check_points, plan_points
from designer.study.sweep.point import TaskResult, chunks_of, solve_task, solve_task_again
from designer.study.sweep.rounds import Round, again_task, rounds_after_tree
from designer.study.sweep.schedule import RoundSchedule, Schedule, TaskKey
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
    """How far a round of a sweep has come; ``done`` and ``total`` count its tasks, ``feasible`` all designs.

    Round 0 solves every point; the others improve points by what their neighbours have found.
    """

    round: int
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
        with ExitStack() as stack:
            sweep = _Sweep(base, points, store, lambda: stack.enter_context(workers or local_workers(jobs)))
            sweep.run(progress)
    write_tables(folder)


@dataclass(slots=True)
class _Sweep:
    """A sweep under way: what to solve, what is running, and where results go."""

    base: Requirement
    points: tuple[Point, ...]
    store: Store
    get_workers: Callable[[], Workers]
    workers: Workers | None = None
    running: dict[Future[TaskResult], TaskKey] = field(default_factory=dict)
    lost: int = 0

    def run(self, progress: ProgressCallback | None) -> None:
        """Run every task that is left: the tree, then rounds until nothing is better."""
        self._run_round(Schedule(self.points, len(chunks_of(self.base)), self.store.finished(0)), None, progress)
        for this in rounds_after_tree(self.points, self.base, self.store):
            self._run_round(RoundSchedule(this.tasks, self.store.finished(this.number)), this, progress)

    def _run_round(
        self, schedule: Schedule | RoundSchedule, this: Round | None, progress: ProgressCallback | None
    ) -> None:
        """Run what is left of a round; None is the tree."""
        if not schedule:
            return
        # Only now, so that a finished sweep starts no process.
        self.workers = self.workers or self.get_workers()
        clock = _Clock()
        feasible = self.store.feasible_count()
        while schedule or self.running:
            try:
                self._hand_out(schedule, this)
                for result in self._collect(schedule, this):
                    feasible += 0 if this else sum(row.status == "feasible" for row in result.rows)
                    clock.tick()
                    if progress is not None:
                        progress(self._progress(schedule, this, feasible, clock))
            except BrokenProcessPool:
                self._go_on_without_the_dead(schedule, this)

    def _hand_out(self, schedule: Schedule | RoundSchedule, this: Round | None) -> None:
        """Keep every worker busy."""
        assert self.workers is not None
        while schedule and len(self.running) < self.workers.capacity:
            task = schedule.take()
            try:
                self.running[self._submit(task, this)] = task
            except BrokenProcessPool:
                schedule.give_back(task)
                raise

    def _submit(self, task: TaskKey, this: Round | None) -> Future[TaskResult]:
        assert self.workers is not None
        number, chunk = task
        point = self.points[number]
        if this is not None:
            again = again_task(self.store, this, task)
            return self.workers.submit(solve_task_again, self.base, point.coordinates, again)
        known = self.store.warm_starts(point.parent, chunk) if point.parent is not None else None
        return self.workers.submit(solve_task, self.base, point.coordinates, chunk, known, point.is_afresh)

    def _collect(self, schedule: Schedule | RoundSchedule, this: Round | None) -> Iterator[TaskResult]:
        """Wait until a task ends; store and yield all that have ended, in order."""
        finished, _ = wait(self.running, return_when=FIRST_COMPLETED)
        for future in sorted(finished, key=lambda future: self.running[future]):
            result = future.result()
            self._keep(schedule, this, self.running.pop(future), result)
            yield result

    def _keep(self, schedule: Schedule | RoundSchedule, this: Round | None, task: TaskKey, result: TaskResult) -> None:
        self.store.add(*task, this.number if this else 0, result)
        schedule.finish(task)

    def _progress(
        self, schedule: Schedule | RoundSchedule, this: Round | None, feasible: int, clock: _Clock
    ) -> SweepProgress:
        done, total = len(schedule.finished), schedule.total
        chunks = len(chunks_of(self.base))
        return SweepProgress(
            this.number if this else 0, done, total, 1.0 / chunks, feasible, clock.seconds_for(total - done)
        )

    def _go_on_without_the_dead(self, schedule: Schedule | RoundSchedule, this: Round | None) -> None:
        """Keep what had come before a process died, and give back what was lost with it."""
        self.lost += 1
        for future in list(self.running):
            if future.done() and not future.cancelled() and future.exception() is None:
                self._keep(schedule, this, self.running.pop(future), future.result())
        if self.lost > MOST_LOST_WORKERS or not isinstance(self.workers, Processes):
            numbers = ", ".join(str(number) for number in sorted({number for number, _ in self.running.values()}))
            raise LostProcessesError(
                f"worker processes died {self.lost} times, the last time at points {numbers}; perhaps they ran out "
                f"of memory. Finished tasks are kept: to resume, run the same command with fewer jobs"
            ) from None
        for task in self.running.values():
            schedule.give_back(task)
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
