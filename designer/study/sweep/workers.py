"""Where the tasks of a sweep run: in processes of this machine, or on a cluster (see ``cluster``)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager
from typing import Any, Protocol

from designer.study.processes import Processes, local_processes


class Workers(Protocol):
    """Runs tasks; a future fails with BrokenProcessPool if a process died."""

    @property
    def capacity(self) -> int:
        """How many tasks to have under way, so that no worker waits."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task."""


def local_workers(jobs: int) -> AbstractContextManager[Processes]:
    """Workers on this machine; interruption stops them all."""
    return local_processes(jobs, "designer.study.sweep.point")
