"""Which task may run next: those whose parent is in the store, nearest the root first."""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterable

from designer.study.sweep.plan import Point

TaskKey = tuple[int, int]
"""(point, chunk)"""


class Schedule:
    """Tasks that are ready, in order; a task becomes ready when that of its parent is finished."""

    def __init__(self, points: tuple[Point, ...], chunks: int, finished: Iterable[TaskKey]) -> None:
        self._children: dict[int, list[int]] = defaultdict(list)
        self._depth: dict[int, int] = {}
        parents = {point.number: point.parent for point in points}
        for number, parent in parents.items():
            if parent is not None:
                self._children[parent].append(number)
            else:
                self._depth[number] = 0
        order = list(self._depth)
        for number in order:  # grows while it is walked: parents come before their children
            for child in self._children[number]:
                self._depth[child] = self._depth[number] + 1
                order.append(child)
        self.parents = parents
        self.finished = set(finished)
        self.total = len(points) * chunks
        self._ready: list[tuple[int, int, int]] = []
        for number in order:
            for chunk in range(chunks):
                parent = parents[number]
                is_open = parent is None or (parent, chunk) in self.finished
                if is_open and (number, chunk) not in self.finished:
                    self._push(number, chunk)

    def __bool__(self) -> bool:
        """Whether any task is ready."""
        return bool(self._ready)

    def take(self) -> TaskKey:
        """The next task to run."""
        _, number, chunk = heapq.heappop(self._ready)
        return number, chunk

    def give_back(self, task: TaskKey) -> None:
        """Let a task that was taken run again: whoever ran it has died."""
        self._push(*task)

    def finish(self, task: TaskKey) -> None:
        """Note that a task is in the store, so that its children may run."""
        number, chunk = task
        self.finished.add(task)
        for child in self._children[number]:
            if (child, chunk) not in self.finished:
                self._push(child, chunk)

    def _push(self, number: int, chunk: int) -> None:
        heapq.heappush(self._ready, (self._depth[number], number, chunk))


class RoundSchedule:
    """Tasks that do not wait for one another, in order."""

    def __init__(self, tasks: Iterable[TaskKey], finished: Iterable[TaskKey]) -> None:
        asked = set(tasks)
        self.finished = asked.intersection(finished)
        self.total = len(asked)
        self._ready = sorted(asked - self.finished)
        heapq.heapify(self._ready)

    def __bool__(self) -> bool:
        """Whether any task is left to take."""
        return bool(self._ready)

    def take(self) -> TaskKey:
        """The next task to run."""
        return heapq.heappop(self._ready)

    def give_back(self, task: TaskKey) -> None:
        """Let a task that was taken run again: whoever ran it has died."""
        heapq.heappush(self._ready, task)

    def finish(self, task: TaskKey) -> None:
        """Note that a task is in the store."""
        self.finished.add(task)
