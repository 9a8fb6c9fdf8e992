"""One configuration under one requirement: searched, recorded, traced. A pure function, fit for any process."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass, field
from typing import Any

from designer.configurations import Configuration
from designer.design import Design
from designer.optimise.multistart import Candidate
from designer.optimise.pareto_fronts import ParetoPoint, trace_pareto_front
from designer.optimise.program import forget_programs
from designer.optimise.search import SearchResult, search
from designer.requirement import Requirement
from designer.study.record import design_of
from designer.verify.judge import judge
from designer.verify.verdict import Verdict

FRONT_POINTS = 9
FRONT_SIZES = ("height", "diameter")


@dataclass(frozen=True, slots=True)
class ConfigurationResult:
    """What a study knows of one configuration.

    ``status`` is one of feasible, impossible, infeasible, failed; ``design`` is None unless feasible. ``details`` are
    further columns of the table. ``first`` is where fronts start from.
    """

    configuration: Configuration
    status: str
    reason: str
    design: Design | None = None
    details: dict[str, Any] = field(default_factory=dict)
    first: Candidate | None = None


def solve_configuration(requirement: Requirement, configuration: Configuration) -> ConfigurationResult:
    """Search a configuration, and believe the result only after the tracer has seen it.

    Never raises: an error in here concerns one configuration, and its message becomes the reason.
    """
    started = time.perf_counter()
    # No other configuration can use the last one's programs.
    forget_programs()
    try:
        result = search(requirement, configuration)
        details: dict[str, Any] = {"starts": requirement.solve.starts, "solves": result.solves}
        details |= columns_of_shortfall(result)
        design = None
        status, reason = result.status, result.reason
        if result.status == "feasible":
            design = design_of(requirement, result)
            details |= _details(result, design)
            verdict = judge(design)
            if not verdict.passed:
                status, reason = "failed", why_rejected(verdict)
    except Exception as error:
        return ConfigurationResult(configuration, "failed", why_broken_down(error))
    details["seconds"] = time.perf_counter() - started
    first = result.first if status == "feasible" else None
    return ConfigurationResult(configuration, status, reason, design if first else None, details, first)


def columns_of_shortfall(result: SearchResult) -> dict[str, Any]:
    """What the nearest miss of an infeasible configuration misses, and by how much; nothing for any other."""
    if result.shortfall is None:
        return {}
    return {
        "closest_constraint": result.shortfall.constraint,
        "closest_violation": result.shortfall.amount,
        "closest_unit": result.shortfall.unit,
    }


def why_rejected(verdict: Verdict) -> str:
    """The reason of a configuration whose design the tracer does not pass."""
    return f"the tracer rejects the design: {verdict.problems[0]}"


def why_broken_down(error: Exception) -> str:
    """The reason of a configuration whose solution raised an error, in one line."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return " ".join(f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})".split())


def front_of(first: Candidate) -> list[ParetoPoint]:
    """The front of depth error against height and diameter for one design, whatever the first objective."""
    return trace_pareto_front(first, FRONT_SIZES, FRONT_POINTS)


def _details(result: SearchResult, design: Design) -> dict[str, Any]:
    """Columns of designs.csv beyond the contract's first ten."""
    score = design.score
    first, second = score["first_stage"], score["second_stage"]
    return {
        "variant": design.variant,
        "first_stage_depth_error_rms": first["depth_error_rms"],
        "first_stage_limit_ratio": score["first_stage_limit_ratio"],
        "first_stage_height_mm": first["height_mm"],
        "first_stage_diameter_mm": first["diameter_mm"],
        "first_stage_volume_cm3": first["volume_cm3"],
        "volume_cm3": second["volume_cm3"],
        "largest_mirror_diameter_mm": 2.0 * max(mirror.outer_radius_mm for mirror in design.mirrors),
        "focal_length_mm": design.camera.focal_length_mm,
        "lens": result.best.lens.name if result.best else "",
        "depth_error_worst": score["depth_error_worst"],
        "first_order_valid": score["first_order_valid"],
        "depth_error_rms_second_order": score["depth_error_rms_second_order"],
        "depth_error_worst_second_order": score["depth_error_worst_second_order"],
        "second_order_valid": score["second_order_valid"],
        "least_limit_depth_error_rms": score["least_limit"]["depth_error_rms"],
        "least_limit_baseline_mm": score["least_limit"]["baseline_mm"],
        "least_limit_focal_length_mm": score["least_limit"]["focal_length_mm"],
        "smallest_clearance_mm": score["smallest_clearance_mm"],
        "smallest_clearance_where": score["smallest_clearance_where"],
        "largest_slope_deg": score["largest_slope_deg"],
    }
