"""What a page says about a design beside its drawing: names and values in groups."""

from __future__ import annotations

from designer.design import VIEW_NAMES, Design
from designer.evaluate.focus import focus_score
from designer.evaluate.resolution import smallest_object
from designer.evaluate.through_focus import blur_limit_deg
from designer.report.content.housing import housing_groups, housing_in_short
from designer.report.content.lens import depth_of_field_words
from designer.report.content.requirement import projection_facts
from designer.report.content.tables import in_percent, percent_decimals
from designer.study.row import Row
from designer.typesetting.markup import DASH, number, plain_number, typographic

Groups = list[tuple[str, list[tuple[str, str]]]]


def design_groups(row: Row, design: Design) -> Groups:
    """What the first page of a design says beside its drawing; the lens has the second."""
    performance = [*_performance_facts(row), *_smallest_object_facts(design)]
    groups = [("Performance", performance), ("Size and manufacture", _size_facts(row)), ("Views", _view_facts(design))]
    return groups + housing_groups(design)


def winner_groups(row: Row, design: Design) -> Groups:
    """How well a design does and what it sees; its size stands in the verdict."""
    return [
        ("Performance", [*_performance_facts(row), *_focus_facts(design), *_smallest_object_facts(design)]),
        ("Views", _view_facts(design)),
        *housing_in_short(design),
    ]


def _focus_facts(design: Design) -> list[tuple[str, str]]:
    """Focus, stop, blur of each view and depth of field; nothing of designs whose focus no closed form tells."""
    score = focus_score(design)
    if score is None:
        return []
    at = "infinity" if score.focus_distance_mm is None else f"{number(score.focus_distance_mm, 1)} mm"
    blurs = ", ".join(f"{number(score.largest_blur_deg_of_views[name], 2)}° {name}" for name in VIEW_NAMES)
    return [
        ("focus, f-number", f"{at}, f/{plain_number(round(score.f_number, 2))}"),
        ("largest blur", blurs),
        (f"both within {plain_number(blur_limit_deg(design))}°", depth_of_field_words(design).removeprefix("from ")),
    ]


def _smallest_object_facts(design: Design) -> list[tuple[str, str]]:
    """Height and width of the smallest object that both views resolve, at the nearest and the farthest distance."""
    distances = design.working_volume.distance_mm
    smallest = smallest_object(design, distances)
    return [
        (
            f"resolved at {plain_number(distance)} mm",
            f"{number(float(height), 1)} × {number(float(width), 1)} mm (2 px)",
        )
        for distance, height, width in zip(distances, smallest.height_mm, smallest.width_mm, strict=True)
    ]


def _performance_facts(row: Row) -> list[tuple[str, str]]:
    """Depth error, limit, and what the second stage gave up."""
    columns = ("depth_error_rms", "depth_error_worst", "first_stage_depth_error_rms")
    decimals = percent_decimals(row.number(column) for column in columns)
    rms, worst, first_stage = (in_percent(row.number(column), decimals) for column in columns)
    height, diameter = (number(row.number(f"first_stage_{size}_mm"), 1) for size in ("height", "diameter"))
    facts = [
        ("rms depth error", f"{rms} %"),
        ("worst depth error", f"{worst} %"),
        ("to second order", _second_order_words(row)),
        ("0.1 % of image scale", _scale_words(row)),
        ("limit ratio", number(row.number("limit_ratio"), 4)),
        ("with margins", number(row.number("margin_limit_ratio"), 4)),
        ("lowest limit", _least_limit_words(row)),
        ("first stage only", f"{first_stage} %, {height} mm tall, {diameter} mm wide"),
    ]
    return [fact for fact in facts if not fact[1].startswith(DASH)]


def _least_limit_words(row: Row) -> str:
    """The least limit and where it lies; a dash, which is left out, where it is the design's own."""
    if row.least_limit is None:
        return DASH
    baseline, principal_distance = (
        row.number(f"least_limit_{key}") for key in ("baseline_mm", "principal_distance_mm")
    )
    return f"{in_percent(row.least_limit)} %, at b = {number(baseline, 1)} and f = {number(principal_distance, 2)} mm"


def _scale_words(row: Row) -> str:
    """How far 0.1 percent of the image's scale shifts the depth; a dash, which is left out, of older tables."""
    rms, worst = (row.number(f"depth_shift_per_scale{ending}") for ending in ("", "_worst"))
    if rms is None or worst is None:
        return DASH
    return f"shifts the depth by {in_percent(0.001 * rms)} % rms, up to {in_percent(0.001 * worst)} %"


def _second_order_words(row: Row) -> str:
    """Depth errors to second order where first order is off; a dash, which is left out, where it is not."""
    if not row.is_beyond_first_order:
        return DASH
    if row.is_beyond_second_order:
        return "also invalid: use the traced points"
    rms, worst = (in_percent(row.number(f"depth_error_{kind}_second_order")) for kind in ("rms", "worst"))
    return f"{rms} %, at worst {worst} %"


def _size_facts(row: Row) -> list[tuple[str, str]]:
    """Dimensions, lens, and the tightest clearance."""
    place = typographic(row.text("smallest_clearance_where"))
    where = f": {place}" if place else ""
    facts = [
        ("baseline", f"{number(row.number('baseline_mm'), 2)} mm"),
        ("height × diameter", f"{number(row.number('height_mm'), 2)} × {number(row.number('diameter_mm'), 2)} mm"),
        ("volume", f"{number(row.number('volume_cm3'), 0)} cm³"),
        ("principal distance", f"{number(row.number('principal_distance_mm'), 3)} mm"),
        ("variant", typographic(row.text("variant"))),
        ("least clearance", f"{number(row.number('smallest_clearance_mm'), 3)} mm{where}"),
    ]
    return [fact for fact in facts if fact[1] and not fact[1].startswith(DASH)]


def _view_facts(design: Design) -> list[tuple[str, str]]:
    """Elevation range, gain and viewpoint of both views."""
    upper, lower = design.views.upper, design.views.lower
    elevations = [
        (f"{name} view", f"{number(low, 2)}° to {number(high, 2)}°, {view.zone} zone")
        for name, view in design.views.by_name.items()
        for low, high in [view.elevation_deg]
    ]
    return [
        *elevations,
        ("gains, upper, lower", f"{number(upper.gain, 6)}, {number(lower.gain, 6)}"),
        ("viewpoints", f"{number(upper.viewpoint_mm, 3)}, {number(lower.viewpoint_mm, 3)} mm"),
        *projection_facts(design.camera.projection, design.camera.distortion),
    ]
