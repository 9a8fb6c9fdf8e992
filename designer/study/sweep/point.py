"""One point of a sweep for some configurations: a pure function of requirement and neighbours, fit for any process.

What goes in and comes out are strings and plain rows, so that a result is the same whether a neighbour was computed a
moment ago or read from the store of an interrupted run: Python writes floats so that they read back exactly.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from designer.configurations import Configuration
from designer.evaluate.focus import focus_score
from designer.evaluate.score import depth_score
from designer.optimise.again import Fresh, search_again
from designer.optimise.branch import WarmStart
from designer.optimise.search import SearchResult, search
from designer.optimise.separating_directions import SeparatingDirections
from designer.requirement import Requirement
from designer.study.columns import SWEPT_COLUMNS, Found, FoundDesign
from designer.study.record import record_of
from designer.study.row import Row, row_of
from designer.study.sweep.definition import requirement_at
from designer.study.task import why_broken_down, why_rejected
from designer.verify.judge import judge

# Configurations of one task: enough of them that a task outweighs what it costs to hand it out.
CONFIGURATIONS_PER_TASK = 11


@dataclass(frozen=True, slots=True)
class TaskResult:
    """What a task found: rows and warm starts, as JSON, of each configuration, or of those that it found better."""

    rows: list[Row]
    warm_starts: str
    seconds: float


def chunks_of(base: Requirement) -> tuple[tuple[Configuration, ...], ...]:
    """The configurations of each task at a point, dealt out so that tasks take about as long as one another."""
    chosen = base.configurations
    count = -(-len(chosen) // CONFIGURATIONS_PER_TASK)
    return tuple(chosen[first::count] for first in range(count))


def solve_task(
    base: Requirement, coordinates: dict[str, float], chunk: int, parent: str | None, is_afresh: bool
) -> TaskResult:
    """Solve some configurations of one point.

    Parameters
    ----------
    base, coordinates
        The requirement before and what the point changes in it.
    chunk
        Which of :func:`chunks_of`.
    parent
        Warm starts from the parent's task of the same chunk; None at the root.
    is_afresh
        Whether to search from scratch, and then to take what is better from the parent.
    """
    started = time.perf_counter()
    requirement = requirement_at(base, coordinates)
    known = read_warm_starts(parent) if parent is not None else {}
    rows, warm_starts = [], {}
    for configuration in chunks_of(base)[chunk]:
        of_parent = known.get(configuration.name, [])
        found, reached = _solve(requirement, configuration, [] if is_afresh else of_parent)
        if is_afresh and of_parent:
            own = [] if found.status == "failed" else reached
            found, reached = _solve_again(requirement, configuration, own, [of_parent], None) or (found, reached)
        rows.append(row_of(found, SWEPT_COLUMNS))
        warm_starts[configuration.name] = reached
    return _result(rows, warm_starts, started)


@dataclass(frozen=True, slots=True)
class AgainTask:
    """Configurations of one point that are to be searched again.

    ``own`` holds the warm starts of the point's earlier tasks, oldest first, ``neighbours`` those of the neighbours'
    latest; ``fresh`` the fresh starts by configuration, ``failed`` the configurations without a design that the tracer
    passes, for which every design is better than the own.
    """

    chunk: int
    own: tuple[str, ...]
    neighbours: tuple[str, ...]
    fresh: dict[str, Fresh]
    failed: frozenset[str]


def solve_task_again(base: Requirement, coordinates: dict[str, float], task: AgainTask) -> TaskResult:
    """Search configurations of one point again; the result has those that have become better."""
    started = time.perf_counter()
    requirement = requirement_at(base, coordinates)
    own = {name: known for text in task.own for name, known in read_warm_starts(text).items()}
    around = [read_warm_starts(text) for text in task.neighbours]
    rows, warm_starts = [], {}
    for configuration in chunks_of(base)[task.chunk]:
        name = configuration.name
        neighbours = [known[name] for known in around if name in known]
        if not neighbours and name not in task.fresh:
            continue
        of_own = [] if name in task.failed else own.get(name, [])
        better = _solve_again(requirement, configuration, of_own, neighbours, task.fresh.get(name))
        if better is not None:
            rows.append(row_of(better[0], SWEPT_COLUMNS))
            warm_starts[name] = better[1]
    return _result(rows, warm_starts, started)


def read_warm_starts(text: str) -> dict[str, list[WarmStart]]:
    """Warm starts by configuration, from the JSON of a task."""
    return {name: [_warm_start(item) for item in items] for name, items in json.loads(text).items()}


def _result(rows: list[Row], warm_starts: dict[str, Sequence[WarmStart]], started: float) -> TaskResult:
    as_json = {name: [asdict(warm_start) for warm_start in reached] for name, reached in warm_starts.items()}
    return TaskResult(rows, json.dumps(as_json, separators=(",", ":")), time.perf_counter() - started)


def _solve(
    requirement: Requirement, configuration: Configuration, parent: Sequence[WarmStart]
) -> tuple[Found, Sequence[WarmStart]]:
    """What is found of one configuration, and the warm starts for its children; never raises."""
    try:
        result = search(requirement, configuration, parent)
        return _judged(requirement, result), result.warm_starts
    except Exception as error:
        # Without warm starts the children start anew.
        return Found(configuration, "failed", why_broken_down(error)), ()


def _solve_again(
    requirement: Requirement,
    configuration: Configuration,
    own: Sequence[WarmStart],
    neighbours: Sequence[Sequence[WarmStart]],
    fresh: Fresh | None,
) -> tuple[Found, Sequence[WarmStart]] | None:
    """What is better than the own result and passed by the tracer; None if nothing is; never raises."""
    try:
        result = search_again(requirement, configuration, own, neighbours, fresh)
        found = None if result is None else _judged(requirement, result)
    except Exception:
        return None  # what was found before stands
    return None if result is None or found is None or found.status != "feasible" else (found, result.warm_starts)


def _judged(requirement: Requirement, result: SearchResult) -> Found:
    """A search's result as the tracer sees it."""
    found = Found(result.configuration, result.status, result.reason, result)
    if result.best is None:
        return found
    record = record_of(requirement, result.best)
    verdict = judge(record, whole_image=False)
    if not verdict.passed:
        return replace(found, status="failed", reason=why_rejected(verdict))
    return replace(found, design=FoundDesign(record, depth_score(record), focus_score(record)))


def _warm_start(item: dict[str, Any]) -> WarmStart:
    known = {name: _directions(item[name]) for name in ("directions", "second_directions")}
    return WarmStart(**(item | known))


def _directions(chosen: dict[str, list[int]] | None) -> SeparatingDirections | None:
    return None if chosen is None else SeparatingDirections(tuple(chosen["legs"]), tuple(chosen["solids"]))
