"""Processes of this machine that do a study's work, and what becomes of the work when one of them dies."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from designer.files import InputError
from designer.study.process_pool import build_pool, interrupts_held_back, stop_pool

Tasks = Sequence[tuple[Any, ...]]


class Processes:
    """A pool of processes that can be built anew when one of them dies.

    One job is a process of its own too: CasADi swallows a signal that comes while it solves in the main thread, and a
    thread beside it could not be stopped.
    """

    def __init__(self, jobs: int, preload: str) -> None:
        self.jobs = jobs
        self.capacity = 2 * jobs
        self._preload = preload
        self._pool = self._build()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task; raises BrokenProcessPool if a process has died."""
        with interrupts_held_back():
            try:
                return self._pool.submit(function, *arguments)
            except (EOFError, ConnectionError) as error:
                raise BrokenProcessPool("the server that starts processes has died") from error

    def rebuild(self) -> None:
        """Replace a broken pool."""
        self.stop()
        self._pool = self._build()

    def stop(self) -> None:
        """End every process at once."""
        stop_pool(self._pool)

    def finish(self) -> None:
        """Let the processes end."""
        self._pool.shutdown()

    def _build(self) -> ProcessPoolExecutor:
        return build_pool(self.jobs, self._preload)


@contextmanager
def local_processes(jobs: int, preload: str = "designer.study.task") -> Iterator[Processes]:
    """So many processes that have imported the module ``preload``; interruption ends them at once."""
    processes = Processes(jobs, preload)
    try:
        yield processes
    except BaseException:
        processes.stop()
        raise
    processes.finish()


def run_each(processes: Processes, function: Callable[..., Any], tasks: Tasks) -> Iterator[tuple[int, Future[Any]]]:
    """Run a function on each tuple of arguments; yields the tuple's index and its finished future as they come.

    A process that dies takes all that is under way with it. What was lost runs again in the end, one task at a time,
    twice at most, so that only those fail whose own process dies twice: their future holds a BrokenProcessPool.
    """
    left: Sequence[int] = range(len(tasks))
    for most, is_last in ((processes.jobs, False), (1, False), (1, True)):
        lost = []
        for index, future in _run_once(processes, function, tasks, left, most):
            if _process_died(future) and not is_last:
                lost.append(index)
            else:
                yield index, future
        left = sorted(lost)


def why_it_failed(error: Exception) -> str:
    """Why a task of :func:`run_each` has no result, in one line."""
    if isinstance(error, BrokenProcessPool):
        return "its process died twice, perhaps out of memory"
    said = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    return " ".join(said.split())


def _run_once(
    processes: Processes, function: Callable[..., Any], tasks: Tasks, indices: Iterable[int], most: int
) -> Iterator[tuple[int, Future[Any]]]:
    """Run each of some tasks once, so many at a time: those alone are lost with a process that dies."""
    waiting = deque(indices)
    running: dict[Future[Any], int] = {}
    while waiting or running:
        is_broken = False
        try:
            while waiting and len(running) < most:
                running[processes.submit(function, *tasks[waiting[0]])] = waiting[0]
                waiting.popleft()
        except BrokenProcessPool:
            is_broken = True
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        if is_broken or any(_process_died(future) for future in finished):
            finished, _ = wait(running)
            processes.rebuild()
        for future in sorted(finished, key=lambda future: running[future]):
            yield running.pop(future), future


def _process_died(future: Future[Any]) -> bool:
    return isinstance(future.exception(), BrokenProcessPool)
