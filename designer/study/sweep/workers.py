"""Where the tasks of a sweep run: in processes of this machine, or on a cluster (see ``cluster``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol

from designer.study.child import build_pool, interrupts_held_back, stop_pool


class Workers(Protocol):
    """Runs tasks; a future fails with BrokenProcessPool if a process died."""

    @property
    def capacity(self) -> int:
        """How many tasks to have under way, so that nobody waits."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task."""


class Processes:
    """A pool of processes that is built anew when one of them dies.

    One job is a process of its own too: CasADi swallows a signal that comes while it solves in the main thread.
    """

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs
        self.capacity = 2 * jobs
        self._pool = self._build()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task; raises BrokenProcessPool if a process has died."""
        with interrupts_held_back():
            return self._pool.submit(function, *arguments)

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
        return build_pool(self.jobs, "designer.study.sweep.point")


@contextmanager
def local_workers(jobs: int) -> Iterator[Processes]:
    """Workers on this machine; interruption stops them all."""
    processes = Processes(jobs)
    try:
        yield processes
    except BaseException:
        processes.stop()
        raise
    processes.finish()
