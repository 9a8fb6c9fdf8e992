"""One configuration under one requirement: searched, recorded, traced. A pure function, fit for any process."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass

from designer.configurations import Configuration
from designer.design import Design
from designer.goals import in_columns
from designer.optimise.multistart import Candidate
from designer.optimise.pareto_fronts import ParetoPoint, trace_pareto_front
from designer.optimise.program import forget_programs
from designer.optimise.search import search
from designer.requirement import Requirement
from designer.study.columns import Found, FoundDesign
from designer.study.record import scored_design_of
from designer.study.row import Row, row_of
from designer.study.study import ParetoRow
from designer.verify.judge import judge
from designer.verify.verdict import Verdict

PARETO_POINTS = 9
PARETO_SIZES = ("height", "diameter")


@dataclass(frozen=True, slots=True)
class ConfigurationResult:
    """What a study knows of one configuration.

    ``design`` and ``first``, where Pareto fronts start from, are None unless the row's status is feasible.
    """

    configuration: Configuration
    row: Row
    design: Design | None = None
    first: Candidate | None = None

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
        result = search(requirement, configuration)
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
    except Exception as error:
        return failed(configuration, why_broken_down(error))
    return ConfigurationResult(configuration, row, found.record if found else None, result.first if found else None)


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


def pareto_front_of(first: Candidate) -> list[ParetoRow]:
    """Pareto fronts of depth error against height and diameter of one design, whatever the first objective."""
    name = first.problem.variant.configuration.name
    return [_pareto_row(name, point) for point in trace_pareto_front(first, PARETO_SIZES, PARETO_POINTS)]


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
