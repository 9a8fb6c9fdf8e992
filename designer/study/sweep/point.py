"""One point of a sweep for some of its configurations: a pure function of requirement and parent, fit for any process.

What goes in and comes out are strings and plain rows, so that a result is the same whether its parent was computed a
moment ago or read from the store of an interrupted run: Python writes floats so that they read back exactly.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, replace
from typing import Any

from designer.configurations import Configuration
from designer.evaluate.focus import focus_score
from designer.evaluate.score import depth_score
from designer.optimise.search import WarmStart, search
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
    """What a task found: a row for each configuration, and the warm starts of its children, as JSON."""

    rows: list[Row]
    warm_starts: str
    seconds: float


def chunks_of(base: Requirement) -> tuple[tuple[Configuration, ...], ...]:
    """The configurations of each task at a point, dealt out so that tasks take about as long as one another."""
    chosen = base.configurations
    count = -(-len(chosen) // CONFIGURATIONS_PER_TASK)
    return tuple(chosen[first::count] for first in range(count))


def solve_task(base: Requirement, coordinates: dict[str, float], chunk: int, parent: str | None) -> TaskResult:
    """Solve some configurations of one point.

    Parameters
    ----------
    base, coordinates
        The requirement before and what the point changes in it.
    chunk
        Which of :func:`chunks_of`.
    parent
        Warm starts from the parent's task of the same chunk; None at the root, which starts from screened designs.
    """
    started = time.perf_counter()
    requirement = requirement_at(base, coordinates)
    known = read_warm_starts(parent) if parent is not None else {}
    rows, warm_starts = [], {}
    for configuration in chunks_of(base)[chunk]:
        found, reached = _solve(requirement, configuration, known.get(configuration.name, []))
        rows.append(row_of(found, SWEPT_COLUMNS))
        warm_starts[configuration.name] = [asdict(warm_start) for warm_start in reached]
    return TaskResult(rows, json.dumps(warm_starts, separators=(",", ":")), time.perf_counter() - started)


def read_warm_starts(text: str) -> dict[str, list[WarmStart]]:
    """Warm starts by configuration, from the JSON of a task."""
    return {name: [_warm_start(item) for item in items] for name, items in json.loads(text).items()}


def _solve(
    requirement: Requirement, configuration: Configuration, parent: list[WarmStart]
) -> tuple[Found, tuple[WarmStart, ...]]:
    """What is found of one configuration, and the warm starts for its children; never raises."""
    try:
        result = search(requirement, configuration, parent)
        found = Found(configuration, result.status, result.reason, result)
        if result.best is not None:
            record = record_of(requirement, result.best)
            verdict = judge(record, whole_image=False)
            found = (
                replace(found, design=FoundDesign(record, depth_score(record), focus_score(record)))
                if verdict.passed
                else replace(found, status="failed", reason=why_rejected(verdict))
            )
    except Exception as error:
        # Without warm starts the children start anew.
        return Found(configuration, "failed", why_broken_down(error)), ()
    return found, result.warm_starts


def _warm_start(item: dict[str, Any]) -> WarmStart:
    known = {name: _directions(item[name]) for name in ("directions", "second_directions")}
    return WarmStart(**(item | known))


def _directions(chosen: dict[str, list[int]] | None) -> SeparatingDirections | None:
    return None if chosen is None else SeparatingDirections(tuple(chosen["legs"]), tuple(chosen["solids"]))
