"""Where the tasks of a sweep run: here, in processes of this machine, or on a cluster (see ``cluster``)."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol

from designer.study.child import begin_as_child


class Workers(Protocol):
    """Runs tasks; a future fails with BrokenProcessPool if a process died."""

    @property
    def capacity(self) -> int:
        """How many tasks to have under way, so that nobody waits."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task."""


class Here:
    """Runs each task in this process, at once."""

    capacity = 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run a task."""
        future: Future[Any] = Future()
        future.set_result(function(*arguments))
        return future


class Processes:
    """A pool of processes that is built anew when one of them dies."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs
        self.capacity = 2 * jobs
        self._pool = self._build()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task; raises BrokenProcessPool if a process has died."""
        return self._pool.submit(function, *arguments)

    def rebuild(self) -> None:
        """Replace a broken pool."""
        self.stop()
        self._pool = self._build()

    def stop(self) -> None:
        """End every process at once."""
        for process in list(getattr(self._pool, "_processes", None) or {}.values()) if self._pool else []:
            process.terminate()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def finish(self) -> None:
        """Let the processes end."""
        self._pool.shutdown()

    def _build(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["designer.study.sweep.point"])
        return ProcessPoolExecutor(self.jobs, mp_context=context, initializer=begin_as_child)


@contextmanager
def local_workers(jobs: int) -> Iterator[Here | Processes]:
    """Workers on this machine; interruption stops them all."""
    if jobs == 1:
        yield Here()
        return
    processes = Processes(jobs)
    try:
        yield processes
    except BaseException:
        processes.stop()
        raise
    processes.finish()
