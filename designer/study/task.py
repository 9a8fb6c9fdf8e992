"""One configuration under one requirement: searched, recorded, traced. A pure function, fit for any process."""

from __future__ import annotations

import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace

from designer.configurations import Configuration
from designer.design import Design
from designer.evaluate.focus import focus_score
from designer.evaluate.score import depth_score
from designer.goals import in_columns
from designer.optimise.branch import WarmStart
from designer.optimise.multistart import Candidate
from designer.optimise.pareto_fronts import ParetoPoint, trace_pareto_front
from designer.optimise.program import forget_programs
from designer.optimise.search import SearchResult, search
from designer.requirement import Requirement
from designer.study.columns import Found, FoundDesign
from designer.study.record import record_of, scored_design_of
from designer.study.row import Row, row_of
from designer.study.study import LensRow, ParetoRow
from designer.verify.judge import judge
from designer.verify.verdict import Verdict

PARETO_POINTS = 9
PARETO_SIZES = ("height", "diameter")


@dataclass(frozen=True, slots=True)
class ConfigurationResult:
    """What a study knows of one configuration.

    ``design`` and ``first``, where Pareto fronts start from with ``warm_starts``, are None unless the row's status is
    feasible. ``lenses`` has a row for each lens of a catalogue.
    """

    configuration: Configuration
    row: Row
    design: Design | None = None
    first: Candidate | None = None
    lenses: tuple[LensRow, ...] = ()
    warm_starts: tuple[WarmStart, ...] = ()

    @property
    def status(self) -> str:
        """One of feasible, impossible, infeasible, failed."""
        return self.row.status


def solve_configuration(requirement: Requirement, configuration: Configuration) -> ConfigurationResult:
    """Search a configuration, and believe the result only after the tracer has seen it.

    Never raises: an error in here concerns one configuration, and its message becomes the reason.
    """
    started = time.perf_counter()
    # No other configuration can use the last one's programs.
    forget_programs()
    try:
        result = search(requirement, configuration, each_lens=True)
        status, reason, found = result.status, result.reason, None
        if result.status == "feasible":
            design, score = scored_design_of(requirement, result)
            verdict = judge(design)
            if verdict.passed:
                found = FoundDesign(design, score.score.depth, score.score.focus, score)
            else:
                status, reason = "failed", why_rejected(verdict)
        seconds = time.perf_counter() - started
        row = row_of(Found(configuration, status, reason, result, found, requirement.solve.starts, seconds))
        lenses = _lens_rows(requirement, result, _LensOutcome(status, reason, found))
    except Exception as error:
        return failed(configuration, why_broken_down(error))
    if found is None:
        return ConfigurationResult(configuration, row, lenses=lenses)
    return ConfigurationResult(configuration, row, found.record, result.first, lenses, result.warm_starts)


def failed(configuration: Configuration, reason: str) -> ConfigurationResult:
    """The result of a configuration that could not be solved."""
    return ConfigurationResult(configuration, row_of(Found(configuration, "failed", reason)))


def why_rejected(verdict: Verdict) -> str:
    """The reason of a configuration whose design the tracer does not pass."""
    return f"the tracer rejects the design: {verdict.problems[0]}"


def why_broken_down(error: Exception) -> str:
    """The reason of a configuration whose solution raised an error, in one line."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return " ".join(f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})".split())


@dataclass(frozen=True, slots=True)
class _LensOutcome:
    """What became of one lens; ``found`` is None unless the status is feasible."""

    status: str
    reason: str
    found: FoundDesign | None = None


def _lens_rows(requirement: Requirement, result: SearchResult, chosen: _LensOutcome) -> tuple[LensRow, ...]:
    """A row for each lens of a catalogue, of which the chosen one has come to what the configuration has."""
    rows = []
    for number, of_lens in enumerate(result.by_lens, start=1):
        is_chosen = result.best is not None and of_lens.best is result.best
        outcome = chosen if is_chosen else _judged(requirement, of_lens)
        name = requirement.camera.lenses[number - 1].name or f"lens {number}"
        rows.append(_lens_row(result.configuration.name, number, name, is_chosen, outcome))
    return tuple(rows)


def _lens_row(configuration: str, number: int, name: str, is_chosen: bool, outcome: _LensOutcome) -> LensRow:
    row = LensRow(configuration, number, name, is_chosen, outcome.status, reason=outcome.reason)
    if outcome.found is None:
        return row
    record, depth, focus = outcome.found.record, outcome.found.depth, outcome.found.focus
    return replace(
        row,
        depth_error_rms=depth.depth_error_rms,
        height_mm=record.height_mm,
        diameter_mm=record.diameter_mm,
        f_number=record.camera.f_number,
        focus_distance_mm=record.camera.focus_distance_mm,
        largest_blur_px=focus.largest_blur_px if focus else None,
        largest_blur_deg=focus.largest_blur_deg if focus else None,
    )


def _judged(requirement: Requirement, result: SearchResult) -> _LensOutcome:
    """The best design with one lens as the tracer sees it; an error in here concerns that lens alone."""
    if result.best is None:
        return _LensOutcome(result.status, result.reason)
    try:
        record = record_of(requirement, result.best)
        verdict = judge(record)
        if not verdict.passed:
            return _LensOutcome("failed", why_rejected(verdict))
        return _LensOutcome("feasible", "", FoundDesign(record, depth_score(record), focus_score(record)))
    except Exception as error:
        return _LensOutcome("failed", why_broken_down(error))


def pareto_front_of(
    requirement: Requirement, first: Candidate, warm_starts: Sequence[WarmStart] = ()
) -> list[ParetoRow]:
    """Pareto fronts of depth error against height and diameter of one design, whatever the first objective.

    ``warm_starts`` are those of the search that found it.
    """
    name = first.problem.variant.configuration.name
    unbounded = warm_starts if requirement.objective.minimise == "depth_error" else ()
    front = trace_pareto_front(requirement, first, PARETO_SIZES, PARETO_POINTS, unbounded)
    return [_pareto_row(name, point) for point in front]


def _pareto_row(configuration: str, point: ParetoPoint) -> ParetoRow:
    goals = in_columns(point.goals)
    return ParetoRow(
        configuration=configuration,
        swept=f"{point.swept}_mm",
        limit_mm=point.limit,
        status="feasible",
        depth_error_rms=goals["depth_error_rms"],
        height_mm=goals["height_mm"],
        diameter_mm=goals["diameter_mm"],
    )
