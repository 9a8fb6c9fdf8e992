"""The rounds of a sweep after its tree: who is searched again, with which neighbours and which fresh starts.

Round 0 walks the tree. In round 1 every point sees its neighbours' designs, and the configurations that could win there
get a few fresh starts. In each further round those see their neighbours again whose neighbours have found something
better. When nothing is better any more, configurations that still stand out at a point are searched from scratch, and
the rounds go on; until nothing stands out that has not been searched so.

A round is a function of what the rounds before it have left in the store. Each task sees the neighbours as the round
before left them, so that the order within a round changes nothing.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

from designer.optimise.again import Fresh
from designer.requirement import Requirement
from designer.study.ranking import ranking_columns
from designer.study.sweep.plan import Point
from designer.study.sweep.point import AgainTask, chunks_of
from designer.study.sweep.schedule import TaskKey
from designer.study.sweep.store import Store

# A configuration could win a point if its first objective is within this share of the best one's there.
COULD_WIN = 0.05
# So many starts it then gets for each variant; neighbours tell each other what they find.
FEW_STARTS = 2
# A configuration stands out at a point if its first objective is this share above what both sides of it suggest.
STANDS_OUT = 0.02


@dataclass(frozen=True, slots=True)
class Round:
    """The tasks of a round, each with what it takes from whom.

    ``neighbours`` are the points whose latest warm starts a task sees, ``fresh`` the fresh starts by configuration.
    """

    number: int
    neighbours: dict[TaskKey, tuple[int, ...]]
    fresh: dict[TaskKey, dict[str, Fresh]]

    @property
    def tasks(self) -> list[TaskKey]:
        """(point, chunk) of each task, in order."""
        return sorted(self.neighbours.keys() | self.fresh.keys())


def rounds_after_tree(points: tuple[Point, ...], base: Requirement, store: Store) -> Iterator[Round]:
    """The rounds, each to be finished before the next is asked for."""
    of_chunk = {each.name: number for number, chunk in enumerate(chunks_of(base)) for each in chunk}
    chunks = range(len(chunks_of(base)))
    searched = {(point.number, name) for point in points if point.is_afresh for name in of_chunk}
    yield Round(
        1,
        {(point.number, chunk): tuple(set(point.neighbours) - {point.parent}) for point in points for chunk in chunks},
        _grouped(
            {
                (number, name): Fresh(FEW_STARTS, number + 1)
                for number, name in _could_win(store, base, 1)
                if (number, name) not in searched
            },
            of_chunk,
        ),
    )
    number = 2
    while True:
        neighbours = defaultdict(list)
        for changed, chunk in sorted(store.better(number - 1)):
            for other in points[changed].neighbours:
                neighbours[other, chunk].append(changed)
        fresh = {}
        if not neighbours:
            fresh = {each: Fresh() for each in _standing_out(store, base, points, number) if each not in searched}
            if not fresh:
                return
            searched |= fresh.keys()
        yield Round(number, {task: tuple(others) for task, others in neighbours.items()}, _grouped(fresh, of_chunk))
        number += 1


def again_task(store: Store, this: Round, task: TaskKey) -> AgainTask:
    """What a task of a round needs to know."""
    point, chunk = task
    fresh = this.fresh.get(task, {})
    reached = store.statuses_before(point, chunk, this.number)
    return AgainTask(
        chunk,
        store.warm_starts_before(point, chunk, this.number),
        tuple(store.warm_starts(other, chunk, this.number - 1) for other in this.neighbours.get(task, ())),
        fresh,
        frozenset(name for name, status in reached.items() if status == "failed"),
    )


def _grouped(fresh: dict[tuple[int, str], Fresh], of_chunk: dict[str, int]) -> dict[TaskKey, dict[str, Fresh]]:
    tasks: dict[TaskKey, dict[str, Fresh]] = defaultdict(dict)
    for (number, name), starts in fresh.items():
        tasks[number, of_chunk[name]][name] = starts
    return dict(tasks)


def _first_objectives(store: Store, base: Requirement, number: int) -> dict[tuple[int, str], float]:
    """The first objective of everything feasible before a round."""
    reached = store.reached_before(number, ranking_columns(base.objective)[0])
    return {each: value for each, (status, value) in reached.items() if status == "feasible" and value is not None}


def _could_win(store: Store, base: Requirement, number: int) -> list[tuple[int, str]]:
    """The points and configurations whose first objective is near the best of the point."""
    values = _first_objectives(store, base, number)
    best: dict[int, float] = {}
    for (point, _), value in values.items():
        best[point] = min(value, best.get(point, math.inf))
    return [(point, name) for (point, name), value in values.items() if value <= best[point] * (1.0 + COULD_WIN)]


def _standing_out(store: Store, base: Requirement, points: tuple[Point, ...], number: int) -> list[tuple[int, str]]:
    """The points and configurations that are worse than both neighbours along an axis suggest."""
    values = _first_objectives(store, base, number)
    names = [configuration.name for configuration in base.configurations]
    found = []
    for point in points:
        for name in names:
            value = values.get((point.number, name), math.inf)
            if any(value > _expected(values, points, point, sides, name) * (1.0 + STANDS_OUT) for sides in point.lines):
                found.append((point.number, name))
    return found


def _expected(
    values: dict[tuple[int, str], float], points: tuple[Point, ...], point: Point, sides: tuple[int, int], name: str
) -> float:
    """The first objective between two neighbours, as if its logarithm were linear; infinite unless both have one."""
    ends = [values.get((side, name)) for side in sides]
    low, high = ends
    if low is None or high is None:
        return math.inf
    (key,) = [key for key, value in points[sides[0]].coordinates.items() if value != points[sides[1]].coordinates[key]]
    start, end = (points[side].coordinates[key] for side in sides)
    share = (point.coordinates[key] - start) / (end - start)
    return math.exp((1.0 - share) * math.log(low) + share * math.log(high))
