"""Blocks of pixels on all cores: NumPy leaves the interpreter free while it works on arrays."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Block = TypeVar("Block")


def for_each(work: Callable[[int, Block], None], blocks: Iterable[Block]) -> None:
    """Call ``work`` with the number of each block and the block, in any order; blocks must not touch one another.

    A process that another one has started works in one thread: its siblings have the other cores.
    """
    cores = len(os.sched_getaffinity(0)) if multiprocessing.parent_process() is None else 1
    with ThreadPoolExecutor(cores) as pool:
        for _ in pool.map(work, *zip(*enumerate(blocks), strict=True)):
            pass
