"""Sweeps on Dask distributed: a cluster that exists already, or one started on this machine for the occasion."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from designer.extras import require_extra
from designer.files import InputError

# A task whose worker dies runs again, so many times.
RETRIES = 20
# Dask waits 30 s by default before it believes that a worker is gone.
_SETTINGS = {
    "distributed.comm.timeouts.connect": "3s",
    "distributed.scheduler.allowed-failures": RETRIES,
    "distributed.worker.daemon": False,
}
CONNECT_SECONDS = 20


class Cluster:
    """Workers of a Dask cluster."""

    def __init__(self, client: Any) -> None:
        self.client = client

    @property
    def capacity(self) -> int:
        """Enough tasks for every thread to have one and one waiting."""
        return max(2, 2 * sum(int(count) for count in self.client.nthreads().values()))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task; the future is a plain one, fulfilled when the task ends."""
        remote = self.client.submit(function, *arguments, pure=False, retries=RETRIES)
        future: Future[Any] = Future()

        def pass_on(done: Any) -> None:
            error = done.exception() if done.status == "error" else None
            if done.status == "finished":
                future.set_result(done.result())
            else:
                future.set_exception(error or OSError(f"the cluster abandoned a task: {done.status}"))

        remote.add_done_callback(pass_on)
        return future


@contextmanager
def cluster_workers(scheduler: str | None = None, workers: int | None = None) -> Iterator[Cluster]:
    """Workers of the cluster at a scheduler's address, or of a local one with so many processes.

    Raises
    ------
    InputError
        Dask is not installed, or nothing answers at the address.
    """
    require_extra("cluster", "a cluster")
    import dask
    from distributed import Client, LocalCluster

    with dask.config.set(_SETTINGS):
        if scheduler is not None:
            try:
                # A client that finds no scheduler is left half started, and can wait for ever when it is cleared away.
                asyncio.run(_connect_and_leave(scheduler))
                client = Client(scheduler, timeout=CONNECT_SECONDS)
            except (OSError, ValueError, OverflowError) as error:
                raise InputError(f"--scheduler {scheduler}: no response from this address: {error}") from None
            with client:
                yield Cluster(client)
            return
        # The solver holds the interpreter: one thread for each process.
        with (
            LocalCluster(
                n_workers=workers or 1,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address=None,
                silence_logs=50,
            ) as local,
            Client(local) as client,
        ):
            yield Cluster(client)


async def _connect_and_leave(address: str) -> None:
    """Raise OSError, ValueError or OverflowError if nothing answers at an address."""
    from distributed.comm.core import connect

    connection = await connect(address, timeout=CONNECT_SECONDS)
    await connection.close()
