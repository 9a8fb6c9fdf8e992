"""Processes that work for a study: how many, and how one begins, deaf to Ctrl-C and bound to who started it."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import multiprocessing.forkserver
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

_FORKSERVER = multiprocessing.get_context("forkserver")


def build_pool(jobs: int, preload: str) -> ProcessPoolExecutor:
    """A pool whose processes come from a server that has imported the module ``preload`` once."""
    start_server(preload)
    return ProcessPoolExecutor(jobs, mp_context=_FORKSERVER, initializer=begin_as_child)


def start_server(preload: str) -> None:
    """Start the server that processes come from, unless it runs: it imports ``preload`` while this process goes on."""
    _FORKSERVER.set_forkserver_preload([preload])
    if _is_main_thread():
        # Ctrl-C reaches every process of a terminal: while it imports, the server would die of it, loudly.
        previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            multiprocessing.forkserver.ensure_running()
        finally:
            signal.signal(signal.SIGINT, previous)


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait until the end, even one by an error: around handing out work, which starts processes.

    A process whose start is interrupted halfway would be ended by no one, and would find what it needs gone.
    """
    if not _is_main_thread():
        yield
        return
    waiting: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    previous = [signal.signal(number, lambda number, frame: waiting.append(number)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)
        for held_back in waiting:
            signal.raise_signal(held_back)


def stop_pool(pool: ProcessPoolExecutor) -> None:
    """End every process of a pool at once, whatever it is doing."""
    # None once the pool has broken.
    for process in list((pool._processes or {}).values()):
        process.terminate()
    pool.shutdown(wait=False, cancel_futures=True)


def begin_as_child() -> None:
    """Leave interrupts to the parent, and end with it, however it ends and whatever is being solved."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)


def _is_main_thread() -> bool:
    """Whether this is the thread that may handle signals, and that they interrupt."""
    return threading.current_thread() is threading.main_thread()


def cores() -> int:
    """How many processes this one may keep busy."""
    # Containers and schedulers often allow fewer cores than the machine has.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
