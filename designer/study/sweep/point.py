"""One point of a sweep for some of its configurations: a pure function of requirement and parent, fit for any process.

What goes in and comes out are strings and plain rows, so that a result is the same whether its parent was computed a
moment ago or read from the store of an interrupted run: Python writes floats so that they read back exactly.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from typing import Any

from designer.configurations import Configuration
from designer.design import Design
from designer.evaluate.depth import FIRST_ORDER_BOUND, noise_mm_of, stereo_pair_of, volume_of, worst_depth_error
from designer.optimise.limit import limit_of
from designer.optimise.search import SearchResult, WarmStart, search
from designer.optimise.separating_directions import SeparatingDirections
from designer.requirement import Requirement
from designer.study.record import record_of
from designer.study.sweep.definition import requirement_at
from designer.study.task import columns_of_shortfall, why_broken_down, why_rejected
from designer.verify.judge import judge

# Configurations of one task: enough of them that a task outweighs what it costs to hand it out.
CONFIGURATIONS_PER_TASK = 11


@dataclass(frozen=True, slots=True)
class TaskResult:
    """What a task found: a row for each configuration, and the trails that its children start from, as JSON."""

    rows: list[dict[str, Any]]
    trails: str
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
        Trails of the parent's task of the same chunk; None at the root, which starts from screened designs.
    """
    started = time.perf_counter()
    requirement = requirement_at(base, coordinates)
    known = read_warm_starts(parent) if parent is not None else {}
    rows, trails = [], {}
    for configuration in chunks_of(base)[chunk]:
        row, found = _solve(requirement, configuration, known.get(configuration.name, []))
        rows.append(row)
        trails[configuration.name] = [asdict(trail) for trail in found]
    return TaskResult(rows, json.dumps(trails, separators=(",", ":")), time.perf_counter() - started)


def read_warm_starts(text: str) -> dict[str, list[WarmStart]]:
    """Trails by configuration, from the JSON of a task."""
    return {name: [_trail(item) for item in items] for name, items in json.loads(text).items()}


def _solve(
    requirement: Requirement, configuration: Configuration, parent: list[WarmStart]
) -> tuple[dict[str, Any], tuple[WarmStart, ...]]:
    """One configuration as a row of the table, and its trails; never raises."""
    row: dict[str, Any] = {"configuration": configuration.name}
    try:
        result = search(requirement, configuration, parent)
        row |= {"status": result.status, "reason": result.reason, "solves": result.solves}
        row |= columns_of_shortfall(result)
        if result.status == "feasible":
            assert result.best is not None
            record = record_of(requirement, result.best)
            verdict = judge(record, whole_image=False)
            if verdict.passed:
                row |= _scores(result, record)
            else:
                row |= {"status": "failed", "reason": why_rejected(verdict)}
    except Exception as error:
        # Without trails the children start anew.
        return {"configuration": configuration.name, "status": "failed", "reason": why_broken_down(error)}, ()
    return row, result.warm_starts


def _scores(result: SearchResult, record: Design) -> dict[str, Any]:
    assert result.best is not None
    assert result.first is not None
    best, first = result.best, result.first
    values, problem = best.values, best.problem
    worst = worst_depth_error(stereo_pair_of(record), volume_of(record), noise_mm_of(record))
    limit = float(limit_of(problem.variant, problem.specification, values["baseline"], values["principal_distance"]))
    return {
        "depth_error_rms": best.goals["depth_error"],
        "depth_error_worst": worst,
        "first_order_valid": int(worst <= FIRST_ORDER_BOUND),
        "limit_ratio": best.goals["depth_error"] / limit,
        "baseline_mm": values["baseline"],
        "height_mm": best.goals["height"],
        "diameter_mm": best.goals["diameter"],
        "volume_cm3": best.goals["volume"] * 1e-3,
        "first_stage_depth_error_rms": first.goals["depth_error"],
        "first_stage_limit_ratio": first.goals["depth_error"] / result.limit_of_first,
        "first_stage_height_mm": first.goals["height"],
        "first_stage_diameter_mm": first.goals["diameter"],
        "first_stage_volume_cm3": first.goals["volume"] * 1e-3,
        "principal_distance_mm": values["principal_distance"],
        "lens": best.lens.name,
        "variant": record.variant,
    }


def _trail(item: dict[str, Any]) -> WarmStart:
    known = {name: _directions(item[name]) for name in ("directions", "second_directions")}
    return WarmStart(**(item | known))


def _directions(chosen: dict[str, list[int]] | None) -> SeparatingDirections | None:
    return None if chosen is None else SeparatingDirections(tuple(chosen["legs"]), tuple(chosen["solids"]))
