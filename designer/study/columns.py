"""The columns of results, in one table: studies, sweeps, report, terminal and comparison read these names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from designer.goals import GOALS, in_columns

if TYPE_CHECKING:  # tables are read without the solver, and processes that solve need no tables
    import pandas as pd

    from designer.configurations import Configuration
    from designer.design import Design
    from designer.evaluate.focus import FocusScore
    from designer.evaluate.score import DepthScore
    from designer.optimise.search import SearchResult
    from designer.study.score import StudyScore

Value = str | float | int | bool | None
STATUSES = ("feasible", "infeasible", "failed", "impossible")
"""What can become of a configuration, in the order of a ranking."""


@dataclass(frozen=True, slots=True)
class FoundDesign:
    """A design that the tracer has passed. ``score`` is what only a study works out; None in a sweep."""

    record: Design
    depth: DepthScore
    focus: FocusScore | None
    score: StudyScore | None = None


@dataclass(frozen=True, slots=True)
class Found:
    """What is known of one configuration when its row is written; what was not found is None."""

    configuration: Configuration
    status: str
    reason: str
    result: SearchResult | None = None
    design: FoundDesign | None = None
    starts: int | None = None
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name in every file, its type, its label and unit for people, and its value.

    Shares (unit %) are stored as such and shown as percent. A sweep leaves out what costs more than its searches, what
    is not the same twice, and the rank, which is worked out when its table is read.
    """

    name: str
    kind: type[str] | type[float] | type[int] | type[bool]
    value: Callable[[Found], Value]
    label: str = ""
    unit: str = ""
    is_swept: bool = True

    @property
    def factor(self) -> float:
        """From the stored value to the one that people read."""
        return 100.0 if self.unit == "%" else 1.0

    @property
    def heading(self) -> str:
        """Label and unit; percent signs stand with the values."""
        return self.label if self.unit == "%" else f"{self.label} {self.unit}".rstrip()


def _of_result(value: Callable[[SearchResult], Value]) -> Callable[[Found], Value]:
    return lambda found: None if found.result is None else value(found.result)


def _of_design(value: Callable[[FoundDesign], Value]) -> Callable[[Found], Value]:
    return lambda found: None if found.design is None else value(found.design)


def _of_depth(value: Callable[[DepthScore], Value]) -> Callable[[Found], Value]:
    return _of_design(lambda design: value(design.depth))


def _of_focus(value: Callable[[FocusScore], Value]) -> Callable[[Found], Value]:
    return _of_design(lambda design: None if design.focus is None else value(design.focus))


def _of_score(value: Callable[[StudyScore], Value]) -> Callable[[Found], Value]:
    return _of_design(lambda design: None if design.score is None else value(design.score))


def _of_stage(stage: str, goal: str) -> Callable[[Found], Value]:
    """A goal at the design of the ``first`` or of the second stage (``best``), in the unit of its column."""

    def value(found: Found) -> Value:
        candidate = getattr(found.result, stage) if found.result is not None and found.design is not None else None
        return None if candidate is None else in_columns(candidate.goals)[GOALS[goal].column]

    return value


def _of_housing(design: FoundDesign, name: str) -> Value:
    """A number of the housing's score, if it has one of that name."""
    from designer.evaluate.housing import housing_score

    value: Value = getattr(housing_score(design.record), name, None)
    return value


def _of_shortfall(name: str) -> Callable[[Found], Value]:
    return _of_result(lambda result: None if result.shortfall is None else getattr(result.shortfall, name))


_CONTRACT = (
    Column("configuration", str, lambda found: found.configuration.name, "configuration"),
    Column("family", str, lambda found: found.configuration.family, "family"),
    Column("topology", str, lambda found: found.configuration.topology, "topology"),
    Column("status", str, lambda found: found.status, "status"),
    Column("reason", str, lambda found: found.reason, "reason"),
    Column("depth_error_rms", float, _of_depth(lambda depth: depth.depth_error_rms), "depth error", "%"),
    Column("limit_ratio", float, _of_depth(lambda depth: depth.limit_ratio), "limit ratio"),
    Column("baseline_mm", float, _of_design(lambda design: design.record.baseline_mm), "baseline", "mm"),
    Column("height_mm", float, _of_design(lambda design: design.record.height_mm), "height", "mm"),
    Column("diameter_mm", float, _of_design(lambda design: design.record.diameter_mm), "diameter", "mm"),
)
"""The first columns of designs.csv, which never change."""

_FURTHER = (
    Column("rank", int, lambda found: None, "rank", is_swept=False),
    Column("starts", int, lambda found: found.starts, "starts", is_swept=False),
    Column("solves", int, _of_result(lambda result: result.solves), "runs of the solver"),
    Column("variant", str, _of_design(lambda design: design.record.variant), "variant"),
    Column(
        "first_stage_limit_ratio",
        float,
        lambda found: (
            found.result.first.goals["depth_error"] / found.result.limit_of_first
            if found.design is not None and found.result is not None and found.result.first is not None
            else None
        ),
        "first stage's limit ratio",
    ),
    *(
        Column(f"first_stage_{goal.column}", float, _of_stage("first", name), f"first stage's {goal.label}", goal.unit)
        for name, goal in GOALS.items()
    ),
    *(
        Column(goal.column, float, _of_stage("best", name), goal.label, goal.unit)
        for name, goal in GOALS.items()
        if goal.column not in {each.name for each in _CONTRACT}
    ),
    Column(
        "largest_mirror_diameter_mm",
        float,
        _of_design(lambda design: 2.0 * max(mirror.outer_radius_mm for mirror in design.record.mirrors)),
        "widest mirror",
        "mm",
    ),
    Column(
        "principal_distance_mm",
        float,
        _of_design(lambda design: design.record.camera.focal_length_mm),
        "principal distance",
        "mm",
    ),
    Column(
        "lens",
        str,
        lambda found: found.result.best.lens.name if found.design and found.result and found.result.best else None,
        "lens",
    ),
    Column("lens_projection", str, _of_design(lambda design: design.record.camera.projection), "projection"),
    Column("f_number", float, _of_design(lambda design: design.record.camera.f_number), "f-number"),
    Column(
        "focus_distance_mm",
        float,
        _of_design(lambda design: design.record.camera.focus_distance_mm),
        "focused at",
        "mm",
    ),
    Column("largest_blur_px", float, _of_focus(lambda focus: focus.largest_blur_px), "largest blur", "px"),
    Column(
        "largest_blur_deg",
        float,
        _of_focus(lambda focus: focus.largest_blur_deg),
        "largest blur in the scene",
        "°",
    ),
    Column("depth_error_worst", float, _of_depth(lambda depth: depth.depth_error_worst), "worst depth error", "%"),
    Column("first_order_valid", bool, _of_depth(lambda depth: depth.first_order_valid), "first order valid"),
    Column(
        "depth_error_rms_second_order",
        float,
        _of_depth(lambda depth: depth.depth_error_rms_second_order),
        "depth error, second order",
        "%",
    ),
    Column(
        "depth_error_worst_second_order",
        float,
        _of_depth(lambda depth: depth.depth_error_worst_second_order),
        "worst depth error, second order",
        "%",
    ),
    Column("second_order_valid", bool, _of_depth(lambda depth: depth.second_order_valid), "second order valid"),
    Column(
        "depth_shift_per_scale",
        float,
        _of_depth(lambda depth: depth.depth_shift_per_scale),
        "depth shift per scale error",
    ),
    Column(
        "depth_shift_per_scale_worst",
        float,
        _of_depth(lambda depth: depth.depth_shift_per_scale_worst),
        "worst depth shift per scale error",
    ),
    Column(
        "least_limit_depth_error_rms",
        float,
        _of_score(lambda score: score.least_limit.depth_error_rms),
        "least limit",
        "%",
        is_swept=False,
    ),
    Column(
        "least_limit_baseline_mm",
        float,
        _of_score(lambda score: score.least_limit.baseline_mm),
        "baseline of the least limit",
        "mm",
        is_swept=False,
    ),
    Column(
        "least_limit_principal_distance_mm",
        float,
        _of_score(lambda score: score.least_limit.principal_distance_mm),
        "principal distance of the least limit",
        "mm",
        is_swept=False,
    ),
    Column(
        "smallest_clearance_mm",
        float,
        _of_score(lambda score: score.smallest_clearance_mm),
        "least clearance",
        "mm",
        is_swept=False,
    ),
    Column(
        "smallest_clearance_where",
        str,
        _of_score(lambda score: score.smallest_clearance_where),
        "place of the least clearance",
        is_swept=False,
    ),
    Column(
        "largest_slope_deg",
        float,
        _of_score(lambda score: score.largest_slope_deg),
        "steepest slope",
        "°",
        is_swept=False,
    ),
    Column("seconds", float, lambda found: found.seconds, "time", "s", is_swept=False),
    Column("closest_constraint", str, _of_shortfall("constraint"), "limiting constraint"),
    Column("closest_violation", float, _of_shortfall("amount"), "violated by"),
    Column("closest_unit", str, _of_shortfall("unit"), "unit"),
    Column(
        "pareto_front_problem",
        str,
        lambda found: None,
        "why there is no Pareto front",
        is_swept=False,
    ),
    Column(
        "margin_limit_ratio",
        float,
        _of_score(lambda score: score.margin_limit_ratio),
        "ratio to the limit with margins",
        is_swept=False,
    ),
    Column(
        "blocked_azimuths",
        float,
        _of_design(lambda design: _of_housing(design, "blocked_share")),
        "azimuths behind struts",
        "%",
        is_swept=False,
    ),
    Column(
        "uncorrected_tube_bias_mm",
        float,
        _of_design(lambda design: _of_housing(design, "nearest_bias_mm")),
        "depth bias of the tube, if not corrected, nearest",
        "mm",
        is_swept=False,
    ),
)

COLUMNS: dict[str, Column] = {column.name: column for column in (*_CONTRACT, *_FURTHER)}
"""Every column of designs.csv by its name, in order."""
SWEPT_COLUMNS: dict[str, Column] = {name: column for name, column in COLUMNS.items() if column.is_swept}
"""Those that a sweep keeps for each point and configuration."""
SCORE_COLUMNS = ("depth_error_rms", "limit_ratio", "baseline_mm", "height_mm", "diameter_mm", "largest_blur_px")
"""What people compare designs by."""

NAMES_OF_VERSION_0_1 = {
    "focal_length_mm": "principal_distance_mm",
    "least_limit_focal_length_mm": "least_limit_principal_distance_mm",
}
"""Columns that were called otherwise; :func:`designer.study.row.read_row` understands both."""

_DTYPES = {str: "object", float: "float64", int: "Int64", bool: "boolean"}


def typed(frame: pd.DataFrame) -> pd.DataFrame:
    """The table with each known column in its own type; missing text is empty."""
    known = {name: COLUMNS[name].kind for name in frame.columns if name in COLUMNS}
    texts = {name: frame[name].astype("object").where(frame[name].notna(), "") for name in known if known[name] is str}
    return frame.astype({name: _DTYPES[kind] for name, kind in known.items() if kind is not str}).assign(**texts)
