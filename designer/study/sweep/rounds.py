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
# So many starts it then gets for each variant; neighbours tell each other what they find. If more than so many could
# win somewhere, as many are chosen evenly over the sweep.
FEW_STARTS = 2
MOST_WITH_FEW_STARTS = 600
# A configuration stands out at a point if its first objective is this share above what both sides of it suggest, ...
ABOVE_BOTH_SIDES = 0.02
# ... or if it is so much farther above the closed-form limit than at one neighbour; or if it has no design there.
ABOVE_ONE_NEIGHBOUR = 0.05
# Of those that stand out, so many in all are searched from scratch, the worst first: their number does not grow with
# the sweep's, and fine sweeps need them less.
MOST_SEARCHES = 300


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
        {(point.number, chunk): point.neighbours for point in points for chunk in chunks},
        _grouped(
            {
                (number, name): Fresh(FEW_STARTS, number + 1)
                for number, name in _could_win(store, base, 1)
                if (number, name) not in searched
            },
            of_chunk,
        ),
    )
    number, most = 2, MOST_SEARCHES
    while True:
        neighbours = defaultdict(list)
        for changed, chunk in sorted(store.better(number - 1)):
            for other in points[changed].neighbours:
                neighbours[other, chunk].append(changed)
        fresh = {}
        if not neighbours:
            worst_first = [each for each in _standing_out(store, base, points, number) if each not in searched]
            fresh = {each: Fresh() for each in worst_first[:most]}
            if not fresh:
                return
            searched |= fresh.keys()
            most -= len(fresh)
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


def _could_win(store: Store, base: Requirement, number: int) -> list[tuple[int, str]]:
    """The points and configurations whose first objective is near the best of the point, before a round."""
    values = store.feasible_before(number, ranking_columns(base.objective)[0])
    best: dict[int, float] = {}
    for (point, _), value in values.items():
        best[point] = min(value, best.get(point, math.inf))
    found = [(point, name) for (point, name), value in values.items() if value <= best[point] * (1.0 + COULD_WIN)]
    count = min(len(found), MOST_WITH_FEW_STARTS)
    return [found[place * len(found) // count] for place in range(count)]


def _standing_out(store: Store, base: Requirement, points: tuple[Point, ...], number: int) -> list[tuple[int, str]]:
    """The points and configurations that are worse than their neighbours suggest, before a round; the worst first."""
    column = ranking_columns(base.objective)[0]
    values = store.feasible_before(number, column)
    # Another objective has no limit to be compared with.
    ratios = (
        store.feasible_before(number, "first_stage_limit_ratio") if base.objective.minimise == "depth_error" else values
    )
    impossible = store.impossible_before(number)
    found = []
    for point in points:
        for name in (configuration.name for configuration in base.configurations):
            this = point.number, name
            beside = [ratios[other, name] for other in point.neighbours if (other, name) in ratios]
            if this in impossible or not beside:
                continue
            if this not in values:
                found.append((1.0, *this))
                continue
            above = [math.log(ratios[this] / min(beside)) / ABOVE_ONE_NEIGHBOUR]
            for sides in point.lines:
                expected = _expected(values, points, point, sides, name)
                above.append(math.log(values[this] / expected) / ABOVE_BOTH_SIDES if expected else 0.0)
            if max(above) >= 1.0:
                found.append((max(above), *this))
    return [(point, name) for _, point, name in sorted(found, key=lambda each: (-each[0], *each[1:]))]


def _expected(
    values: dict[tuple[int, str], float], points: tuple[Point, ...], point: Point, sides: tuple[int, int], name: str
) -> float | None:
    """The first objective between two neighbours, as if its logarithm were linear; None unless both have one."""
    low, high = (values.get((side, name)) for side in sides)
    if low is None or high is None:
        return None
    start, end = (points[side].coordinates for side in sides)
    (key,) = [key for key, value in start.items() if value != end[key]]
    share = (point.coordinates[key] - start[key]) / (end[key] - start[key])
    return math.exp((1.0 - share) * math.log(low) + share * math.log(high))
