"""From the optimiser's numbers to the design record that everyone else reads."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np

from designer.configurations import Configuration, MirrorKind
from designer.design import Camera, Design, Mirror, View, ViewName, Views, WorkingVolume
from designer.evaluate.depth import Volume, depth_error_rms, noise_mm_of
from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.limit import ImageBounds, LeastLimit, NoiseOfPair, arrangement_of, least_limit_over
from designer.evaluate.predicted_noise import sharp_noise_model
from designer.evaluate.score import evaluate_design
from designer.goals import in_columns
from designer.optics.layout import Layout, PlacedMirror
from designer.optics.view import elevation_tangents_of_views
from designer.optimise.limit import conditions_of
from designer.optimise.margin_limit import LensSetting, margin_limit_of
from designer.optimise.multistart import Candidate
from designer.optimise.required_numbers import specification_of
from designer.optimise.search import SearchResult
from designer.optimise.system import put_together
from designer.requirement import Lens, Requirement
from designer.study.score import StudyScore

# Focused farther than any requirement can say, a lens is focused at infinity; so is one that rounding takes beyond.
AT_INFINITY_PER_MM = 1e-9


def design_of(requirement: Requirement, result: SearchResult) -> Design:
    """The design record of a feasible search result, scored."""
    design, _ = scored_design_of(requirement, result)
    return design


def scored_design_of(requirement: Requirement, result: SearchResult) -> tuple[Design, StudyScore]:
    """The same, and beside it the score that stands in it."""
    assert result.best is not None
    record = record_of(requirement, result.best)
    score = _score(requirement, result, record)
    return record.model_copy(update={"score": score.as_json()}), score


def record_of(requirement: Requirement, best: Candidate) -> Design:
    """The record of a design without its score: all that the tracer needs."""
    variant, values = best.problem.variant, best.values
    kinds = variant.configuration.mirror_kinds
    layout = best.layout
    mirrors = {mirror.name: mirror for mirror in layout.mirrors}
    return Design.model_validate(
        {
            "configuration": variant.configuration.name,
            "variant": describe_variant(best, layout),
            "camera": _camera(requirement, best.lens, values),
            "mirrors": [_mirror(mirrors[name], kinds[name], requirement) for name in kinds],
            "views": _views(best),
            "baseline_mm": values["baseline"],
            "height_mm": best.goals["height"],
            "diameter_mm": best.goals["diameter"],
            "working_volume": WorkingVolume(
                elevation_deg=requirement.working_volume.elevation_deg,
                distance_mm=requirement.working_volume.distance_mm,
            ),
            "noise_px": equivalent_noise_px(best),
            "scale_uncertainty": best.problem.specification.scale_uncertainty,
            "zone_gap_px": requirement.manufacture.zone_gap_px,
            "clearance_mm": requirement.manufacture.clearance_mm,
            "edge_margin_mm": requirement.manufacture.edge_margin_mm,
            "sharpness": _finite(requirement.sharpness.model_dump()),
            "housing": _housing(requirement, values),
        }
    )


def equivalent_noise_px(best: Candidate) -> float:
    """The noise that, the same in both views and everywhere, gives the noise's part of the depth error, in pixels."""
    specification = best.problem.specification
    if not specification.predicted_share:
        return float(specification.noise / specification.pixel_pitch)
    system = put_together(best.problem.variant, best.values, specification)
    per_pixel = float(depth_error_rms(system.pair, system.volume, specification.pixel_pitch))
    return float(depth_error_rms(system.pair, system.volume, system.noise)) / per_pixel


def describe_variant(candidate: Candidate, layout: Layout) -> str:
    """What distinguishes a design, put together as ``layout``, among those of its configuration, in words."""
    mirrors = {mirror.name: mirror for mirror in layout.mirrors}
    words = [candidate.problem.variant.label]
    if "primary" in mirrors:
        inner_height = float(np.ravel(mirrors["primary"].rim_heights[0])[0])
        around = inner_height <= candidate.lens.front_mm
        words.append("primary around the lens" if around else "primary ahead of the lens")
        direct, secondary = (max(map(_number, mirrors[name].rim_heights)) for name in ("direct", "secondary"))
        words.append("direct mirror above the secondary" if direct > secondary else "direct mirror below the secondary")
    for view in ("lower", "upper"):
        name = candidate.problem.variant.last_mirror(view)
        if candidate.problem.variant.crosses_at_viewpoint(view):
            viewpoint = candidate.values["lower_viewpoint"] + (candidate.values["baseline"] if view == "upper" else 0.0)
            side = "above" if min(map(_number, mirrors[name].rim_heights)) > viewpoint else "below"
            words.append(f"{name} mirror used {side} its focus")
    return "; ".join(word for word in words if word)


def _number(value: Any) -> float:
    return float(np.ravel(value)[0])


def _camera(requirement: Requirement, lens: Lens, values: dict[str, float]) -> Camera:
    camera = requirement.camera
    reciprocal_focus = values["reciprocal_focus"]
    return Camera.model_validate(
        {
            "focal_length_mm": values["principal_distance"],
            "pixel_pitch_mm": camera.pixel_pitch_mm,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "f_number": values["f_number"],
            "lens_radius_mm": lens.radius_mm,
            "lens_front_mm": lens.front_mm,
            "lens_length_mm": lens.length_mm,
            "body_radius_mm": camera.body_radius_mm,
            "image_circle_radius_px": camera.image_circle_radius_px,
            "name": camera.name,
            "lens": lens.name,
            "nominal_focal_length_mm": values["focal_length"],
            "focus_distance_mm": 1.0 / reciprocal_focus if reciprocal_focus > AT_INFINITY_PER_MM else None,
            "projection": lens.projection,
            "distortion": lens.distortion,
        }
    )


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    """Numbers as JSON holds them: None where there is no limit."""
    return {name: value if math.isfinite(value) else None for name, value in values.items()}


def _mirror(mirror: PlacedMirror, kind: MirrorKind, requirement: Requirement) -> Mirror:
    curvature, conic_term = _number(mirror.surface.curvature), _number(mirror.surface.conic_term)
    conic = {MirrorKind.PLANE: 0.0, MirrorKind.PARABOLOID: -1.0}.get(kind)
    return Mirror.model_validate(
        {
            "name": mirror.name,
            "kind": kind.word,
            "vertex_mm": _number(mirror.surface.vertex_height),
            "radius_mm": None if kind is MirrorKind.PLANE else 1.0 / curvature,
            "conic": conic_term / curvature**2 - 1.0 if conic is None else conic,
            "inner_radius_mm": _number(mirror.inner_radius),
            "outer_radius_mm": _number(mirror.outer_radius),
            "thickness_mm": requirement.manufacture.substrate_thickness_mm,
            "faces": "down" if mirror.direction > 0 else "up",
        }
    )


def _housing(requirement: Requirement, values: dict[str, float]) -> dict[str, Any] | None:
    """The housing from the variables that enclose mirrors and light, as the record holds it."""
    asked = requirement.housing
    if asked.kind == "none":
        return None
    ends = {"kind": asked.kind, "low_mm": values["bottom"], "high_mm": values["top"]}
    if asked.kind == "struts":
        width = asked.width_mm
        return {**ends, "number": asked.number, "width_mm": width, "radius_mm": values["radius"] - width / 2.0}
    return {
        **ends,
        "inner_radius_mm": values["radius"] - asked.wall_mm,
        "wall_mm": asked.wall_mm,
        "refractive_index": asked.refractive_index,
        "material": asked.material,
    }


def _views(candidate: Candidate) -> Views:
    variant, values, specification = candidate.problem.variant, candidate.values, candidate.problem.specification
    low, high = specification.elevations
    slopes = elevation_tangents_of_views((math.tan(low), math.tan(high)), specification.distances, values["baseline"])
    outer = variant.configuration.outer_view
    folded = variant.fold is not None

    def view(name: ViewName) -> View:
        last = variant.last_mirror(name)
        return View.model_validate(
            {
                "path": ("secondary", last) if folded and name == "lower" else (last,),
                "viewpoint_mm": values["lower_viewpoint"] + (values["baseline"] if name == "upper" else 0.0),
                "gain": values[f"{name}_gain"],
                "sense": variant.sense(name),
                "elevation_deg": tuple(math.degrees(math.atan(slope)) for slope in slopes[name]),
                "zone": "outer" if name == outer else "inner",
            }
        )

    return Views(upper=view("upper"), lower=view("lower"))


def _score(requirement: Requirement, result: SearchResult, record: Design) -> StudyScore:
    assert result.best is not None
    assert result.first is not None
    best, first = result.best, result.first
    clearances = best.evaluation.clearances[:, 0]
    tightest = int(clearances.argmin())
    names = best.evaluation.names[-len(clearances) :]
    shapes = [mirror_shape(record, mirror.name) for mirror in record.mirrors]
    score = evaluate_design(record)
    return StudyScore(
        score=score,
        smallest_clearance_mm=float(clearances[tightest]),
        smallest_clearance_where=names[tightest],
        largest_slope_deg=max(max(abs(slope) for slope in shape.slope_deg) for shape in shapes),
        first_stage=in_columns(first.goals),
        second_stage=in_columns(best.goals),
        least_limit=least_limit_of(requirement, best.problem.variant.configuration),
        first_stage_limit_ratio=first.goals["depth_error"] / result.limit_of_first,
        margin_limit_ratio=_margin_limit_ratio(best, record, score.depth.depth_error_rms),
        largest_scaled_violation=best.violation,
        solver_statuses=result.statuses,
    )


def _margin_limit_ratio(best: Candidate, record: Design, depth_error: float | None) -> float | None:
    """The score over the limit with margins for the design's own lens, as it is set, and mean noise."""
    camera = record.camera
    setting = LensSetting(camera.focal_length_mm, 2.0 * camera.pupil_radius_mm, best.values["reciprocal_focus"])
    limit = margin_limit_of(best.problem, record.baseline_mm, setting, noise_mm_of(record))
    return None if limit is None or depth_error is None else depth_error / limit


def _sharp_noise(requirement: Requirement, lens: Lens) -> NoiseOfPair:
    """The noise of a pair of views with every point in focus."""
    specification = specification_of(requirement, lens)
    conditions = conditions_of(specification)
    return lambda pair: sharp_noise_model(conditions, pair, specification.fastest)


def least_limit_of(requirement: Requirement, configuration: Configuration) -> LeastLimit:
    """The least limit over every baseline and principal distance that the requirement allows, and where it lies.

    Raises
    ------
    ValueError
        Nowhere, with no lens, is there room for the inner zone.
    """
    volume, camera = requirement.working_volume, requirement.camera
    pitch = camera.pixel_pitch_mm
    low_deg, high_deg = volume.elevation_deg
    limits = []
    for lens in camera.lenses:
        with suppress(ValueError):  # this lens leaves no room; another of the catalogue may
            limits.append(
                least_limit_over(
                    arrangement_of(configuration.family, configuration.topology),
                    Volume((math.radians(low_deg), math.radians(high_deg)), volume.distance_mm),
                    requirement.baseline_range_mm,
                    lens.principal_distances_mm,
                    ImageBounds(camera.image_radius_mm, requirement.manufacture.zone_gap_px * pitch, lens.image_law),
                    _sharp_noise(requirement, lens),
                    requirement.scale_uncertainty_percent / 100.0,
                )
            )
    if not limits:
        raise ValueError("with every lens the outer zone and the gap leave no space for the inner zone")
    return min(limits, key=lambda limit: limit.depth_error_rms)
