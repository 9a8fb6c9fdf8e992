"""What is impossible by rule: each rule, its sentence, and the converse by random search with the rule switched off."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from designer.configurations import MirrorKind
from designer.design import Design
from designer.optics.clearance import pair_up, separations
from designer.optics.view import elevation_tangents_of_views
from designer.optimise.impossibility import why_fixed_conflicts, why_impossible
from designer.optimise.required_numbers import specification_of
from designer.optimise.variables import free_ranges
from designer.optimise.variants import Variant, enumerate_variants
from designer.requirement import Requirement, set_key
from designer.requirement.coherence import check_fixed_numbers
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.shipped_problems import (
    CHIEF_RAYS_ALONE,
    CONFIGURATIONS,
    SHIPPED,
    VARIANTS,
    at,
    design_record,
    is_coherent,
    problem_of,
    put_together,
    random_designs,
    shipped_requirement,
    variant_name,
    zones_fit,
)


def reason(requirement: Requirement, variant: Variant) -> str | None:
    lens = requirement.camera.lenses[0]
    ranges = free_ranges(requirement, lens)
    return why_impossible(variant, specification_of(requirement, lens), ranges)


def variant_called(configuration: str, label: str = "") -> Variant:
    return next(variant for variant in enumerate_variants(CONFIGURATIONS[configuration]) if variant.label == label)


@pytest.mark.parametrize("name", ["direct-HyHy-upper_outer", "folded-HyPl-Hy-upper_outer"])
def test_the_envelope_limits_the_baseline(name):
    variant = variant_called(name)
    said = reason(set_key(shipped_requirement("indoor_robot"), "baseline_mm", 100_000), variant)
    assert said == (
        "mirrors 60 mm wide in an envelope 140 mm high have viewpoints at most 722.8 mm apart, but the baseline must "
        "be 100000 mm"
    )
    # A sensor of long baseline can see far below and above the horizon, from mirrors as wide as high.
    assert reason(set_key(shipped_requirement("indoor_robot"), "baseline_mm", [139, 100_000]), variant) is None


@pytest.mark.parametrize(
    ("configuration", "label", "view"),
    [
        ("direct-HyEl-upper_outer", "", "upper"),
        ("direct-ElHy-upper_inner", "", "lower"),
        ("folded-HyPl-El-upper_outer", "", "upper"),
        ("folded-ElPl-Hy-upper_outer", "", "lower"),
        ("folded-ElEl-Hy-upper_outer", "concave primary, shared focus above", "lower"),
    ],
)
def test_an_ellipsoid_cannot_see_its_own_horizon(configuration, label, view):
    variant = variant_called(configuration, label)
    said = reason(shipped_requirement("indoor_robot"), variant)
    assert said is not None
    assert "an ellipsoid cannot see a range that contains its own horizon" in said
    assert f"the {view} view must cover" in said
    # In the near field the upper view looks down and the lower one up: neither range holds its horizon.
    assert reason(shipped_requirement("pipe_inspection"), variant) is None


def test_a_concave_paraboloid_cannot_see_its_own_horizon_and_a_convex_one_can():
    requirement = shipped_requirement("indoor_robot")
    said = reason(requirement, variant_called("folded-PaPa-Hy-upper_outer", "concave primary"))
    assert said is not None
    assert "a concave paraboloid cannot see" in said
    assert reason(requirement, variant_called("folded-PaPa-Hy-upper_outer", "convex primary")) is None


def test_a_convex_ellipsoidal_primary_sees_the_horizon():
    label = "convex primary, shared focus below"
    variant = variant_called("folded-ElEl-Hy-upper_outer", label)
    assert reason(shipped_requirement("indoor_robot"), variant) is None


@pytest.mark.parametrize("name", ["indoor_robot", "ceiling_watch"])
def test_a_plane_primary_sees_only_above_its_horizon(name):
    said = reason(shipped_requirement(name), variant_called("folded-PlHy-Hy-upper_outer"))
    assert said is not None
    assert "a plane primary sees only above its horizon" in said
    assert reason(shipped_requirement("sky_watch"), variant_called("folded-PlHy-Hy-upper_outer")) is None


def test_a_free_baseline_is_given_the_benefit_of_the_doubt():
    """-16 to 16 degrees at 1 to 5 m hold the horizon for any small baseline; a very long one leaves it."""
    variant = variant_called("folded-HyPl-El-upper_outer")
    requirement = set_key(shipped_requirement("pipe_inspection"), "working_volume.elevation_deg", [-16, 16])
    near, middle = (set_key(requirement, "baseline_mm", baseline) for baseline in (40, 130))
    assert reason(near, variant) is not None
    assert reason(middle, variant) is not None
    assert reason(set_key(requirement, "baseline_mm", 150), variant) is None
    assert reason(set_key(requirement, "baseline_mm", [40, 150]), variant) is None


def test_a_gap_as_wide_as_the_image_leaves_no_room():
    requirement = set_key(shipped_requirement("indoor_robot"), "manufacture.zone_gap_px", 590)
    said = reason(requirement, variant_called("folded-HyPl-Hy-upper_outer"))
    assert said == "the outer zone and the gap leave no space for the inner zone"


def forbidden(by_plane: bool) -> list[tuple[str, Variant]]:
    """What is impossible under the shipped requirements: because of a plane primary, or of a mirror's own wall."""
    said = {(name, variant): reason(shipped_requirement(name), variant) for name in SHIPPED for variant in VARIANTS}
    return [case for case, words in said.items() if words is not None and ("plane primary" in words) == by_plane]


def case_name(part: object) -> str:
    return variant_name(part) if isinstance(part, Variant) else str(part)


@pytest.mark.parametrize(("name", "variant"), forbidden(by_plane=False), ids=case_name)
def test_random_search_never_finds_what_the_rule_forbids(name, variant):
    """With the rule switched off, nothing has all its light unhindered, whatever the envelope."""
    tried = unhindered(problem_of(shipped_requirement(name), variant), seed=3, count=6000)
    assert tried.size >= 50
    assert not tried.any()


@pytest.mark.parametrize(("name", "variant"), forbidden(by_plane=True), ids=case_name)
def test_no_traced_ray_leaves_a_plane_primary_at_or_below_its_horizon(name, variant):
    """Here the formulas lay out no mirrors at all, so the tracer tries those that look upwards, opened wide."""
    low, _ = lower_elevations_deg(shipped_requirement(name))
    assert low <= 0.0
    upwards = shipped_requirement("sky_watch")
    problem = problem_of(upwards, variant)
    values = random_designs(problem, 1000, seed=3, f_number=CHIEF_RAYS_ALONE)
    kept = np.flatnonzero(is_coherent(put_together(problem, values)))[:20]
    assert kept.size == 20
    for index in kept:
        design = opened_wide(design_record(upwards, problem, at(values, index)))
        scene = build_instrument(design)
        rays = pinhole_directions(np.linspace(0.0, widest_pinhole_angle(design), 500))
        trace = trace_sequential(scene, scene.path(design.views.lower.path), rays)
        left = elevation_angles(trace.direction[trace.missed < 0])
        assert left.size > 10
        assert left.min() > 0.0


def lower_elevations_deg(requirement: Requirement) -> tuple[float, float]:
    volume = requirement.working_volume
    slopes = (np.tan(np.radians(volume.elevation_deg[0])), np.tan(np.radians(volume.elevation_deg[1])))
    lower = elevation_tangents_of_views(slopes, volume.distance_mm, requirement.baseline_mm).lower
    return float(np.degrees(np.arctan(lower[0]))), float(np.degrees(np.arctan(lower[1])))


def opened_wide(design: Design) -> Design:
    """The same mirrors without holes, and as wide as they go: an ellipsoid to its equator, others to 1 m."""
    mirrors = []
    for mirror in design.mirrors:
        equator = np.inf if mirror.conic <= -1.0 else abs(mirror.radius_mm or np.inf) / np.sqrt(1.0 + mirror.conic)
        widest = float(min(1000.0, 0.999 * equator))
        mirrors.append(mirror.model_copy(update={"inner_radius_mm": 0.0, "outer_radius_mm": widest}))
    return design.model_copy(update={"mirrors": tuple(mirrors)})


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(VARIANTS),
    st.floats(-60.0, 55.0),
    st.floats(2.0, 60.0),
    st.floats(20.0, 300.0),
    st.floats(110.0, 3000.0),
)
def test_no_rule_forbids_what_random_search_finds(variant, low, span, baseline, near):
    requirement = shipped_requirement("pipe_inspection")
    assume(low + span < 75.0)
    for key, value in (
        ("working_volume.distance_mm", [near, 2.0 * near]),
        ("working_volume.elevation_deg", [low, low + span]),
        ("baseline_mm", baseline),
    ):
        requirement = set_key(requirement, key, value)
    # A ray a hundredth of a degree off the horizon meets its wall so near the rim that clearances cannot tell.
    slopes = (np.tan(np.radians(low)), np.tan(np.radians(low + span)))
    ranges = elevation_tangents_of_views(slopes, (near, 2.0 * near), baseline)
    ends_deg = np.degrees(np.arctan([ranges.lower, ranges.upper]))
    assume(np.abs(ends_deg).min() > 0.05)
    if unhindered(problem_of(requirement, variant), seed=5).any():
        assert reason(requirement, variant) is None


def unhindered(problem, seed: int, count: int = 3000) -> np.ndarray:
    """Which random designs send all their light out past everything; of those tried, whose image zones are apart."""
    values = random_designs(problem, count, seed, f_number=CHIEF_RAYS_ALONE)
    system = put_together(problem, values)
    coherent = is_coherent(system)
    with np.errstate(all="ignore"):
        fits = zones_fit(system)
    kept = np.flatnonzero(coherent & fits)
    if not kept.size:
        return np.zeros(0, dtype=bool)
    layout = put_together(problem, {name: value[kept] for name, value in values.items()}).layout
    light, _ = separations(layout, pair_up(layout))
    # Light is followed only so far out; a mirror beyond that fits no envelope, and would not be seen in its way.
    in_reach = np.max([mirror.outer_radius for mirror in layout.mirrors], axis=0) < problem.specification.reach_radius
    return np.asarray((light.max(axis=0).min(axis=0) > 0.0) & in_reach)


def test_random_search_does_find_what_is_possible():
    """The converse would be hollow if the random search found nothing anywhere."""
    requirement = shipped_requirement("pipe_inspection")
    found = [unhindered(problem_of(requirement, variant), seed=3).any() for variant in VARIANTS]
    assert sum(found) > 0.5 * len(VARIANTS)


@pytest.mark.parametrize(
    ("configuration", "fixed", "words"),
    [
        (
            "direct-HyHy-upper_outer",
            {"primary.radius_mm": -30.0},
            "a primary mirror is fixed, but this configuration has none",
        ),
        ("folded-HyPl-Hy-upper_outer", {"secondary.radius_mm": 30.0}, "the fixed secondary mirror is curved"),
        ("folded-HyPl-Hy-upper_outer", {"secondary.conic": -2.0}, "the fixed secondary mirror is curved"),
        (
            "folded-HyPl-Hy-upper_outer",
            {"direct.conic": -0.5},
            "is an? ellipsoid, but in this configuration it is a hyperboloid",
        ),
        (
            "folded-ElPl-El-upper_outer",
            {"primary.conic": -1.5},
            "is a hyperboloid, but in this configuration it is a.? ellipsoid",
        ),
        (
            "folded-PaPa-Hy-upper_outer",
            {"primary.conic": -1.2},
            "is a hyperboloid, but in this configuration it is a paraboloid",
        ),
        (
            "folded-HyPl-Hy-upper_outer",
            {"direct.conic": -1.0},
            "is a paraboloid, but in this configuration it is a hyperboloid",
        ),
    ],
)
def test_a_mirror_that_does_not_belong_is_refused_by_name(configuration, fixed, words):
    said = why_fixed_conflicts(CONFIGURATIONS[configuration], fixed)
    assert said is not None
    assert re.search(words, said), said


@pytest.mark.parametrize(
    ("configuration", "fixed"),
    [
        ("folded-HyPl-Hy-upper_outer", {"secondary.vertex_mm": 100.0}),
        ("folded-HyPl-Hy-upper_outer", {"direct.conic": -2.0, "direct.radius_mm": 20.0}),
        ("folded-PaPa-Hy-upper_outer", {"primary.conic": -1.0}),
        ("direct-ElHy-upper_outer", {"lower.conic": -0.4, "upper.gain": 0.1, "lower.viewpoint_mm": 30.0}),
    ],
)
def test_what_may_belong_is_not_refused(configuration, fixed):
    assert why_fixed_conflicts(CONFIGURATIONS[configuration], fixed) is None


@pytest.mark.parametrize(
    ("configuration", "fixed", "words"),
    [
        (
            "folded-HyPl-Hy-upper_outer",
            {"direct.radius_mm": -40.0},
            "radius of -40 mm, but the hyperboloid .* needs a positive radius",
        ),
        (
            "folded-HyPl-El-upper_outer",
            {"direct.radius_mm": 40.0},
            "radius of 40 mm, but the ellipsoid .* needs a negative radius",
        ),
        (
            "folded-HyPl-Hy-upper_outer",
            {"primary.radius_mm": 20.0},
            "radius of 20 mm, but the hyperboloid .* needs a negative radius",
        ),
        (
            "folded-ElHy-Hy-upper_outer",
            {"primary.radius_mm": -20.0},
            "radius of -20 mm, but the ellipsoid .* needs a positive radius",
        ),
        (
            "folded-PlEl-Hy-upper_outer",
            {"secondary.radius_mm": 20.0},
            "radius of 20 mm, but the ellipsoid .* needs a negative radius",
        ),
        (
            "folded-PaPa-Hy-upper_outer",
            {"secondary.radius_mm": 20.0},
            "radius of 20 mm, but the paraboloid .* needs a negative radius",
        ),
        ("folded-HyPl-El-upper_outer", {"upper.gain": 0.1}, "gain of the upper view is 0.1, .* is negative"),
        ("folded-HyPl-El-upper_outer", {"lower.gain": -0.1}, "gain of the lower view is -0.1, .* is positive"),
        (
            "direct-HyHy-upper_outer",
            {"lower.viewpoint_mm": -5.0},
            "lower viewpoint lies below the pinhole, but the mirror .* lies above it",
        ),
        ("direct-HyHy-upper_outer", {"lower.gain": 1.5}, "a single mirror gives less than 1"),
        (
            "direct-HyEl-upper_outer",
            {"upper.vertex_mm": 100.0, "upper.viewpoint_mm": 110.0},
            "upper mirror is a hyperboloid according to vertex_mm with the view's viewpoint_mm, .* is an ellipsoid",
        ),
        (
            "folded-HyPl-Hy-upper_outer",
            {"direct.vertex_mm": 100.0, "upper.viewpoint_mm": 90.0},
            "direct mirror is an ellipsoid according to vertex_mm with the view's viewpoint_mm, .* is a hyperboloid",
        ),
    ],
)
def test_a_fixed_number_on_the_wrong_side_is_impossible_at_once(configuration, fixed, words):
    said = why_fixed_conflicts(CONFIGURATIONS[configuration], fixed)
    assert said is not None
    assert re.search(words, said), said


@pytest.mark.parametrize("variant", VARIANTS, ids=variant_name)
def test_numbers_of_a_design_never_conflict_with_its_own_configuration(variant):
    """Whatever is fixed of a coherent design, alone or together, some design of the configuration has it."""
    problem = problem_of(shipped_requirement("pipe_inspection"), variant)
    values = random_designs(problem, 400, seed=11, f_number=CHIEF_RAYS_ALONE)
    system = put_together(problem, values)
    kept = np.flatnonzero(is_coherent(system))[:20]
    assert kept.size
    for index in kept:
        mirrors, views = numbers_of(variant, put_together(problem, at(values, index)), at(values, index))
        together = {
            f"{owner}.{key}": value
            for table in (mirrors, views)
            for owner in table
            for key, value in table[owner].items()
        }
        check_fixed_numbers(mirrors, views)
        for fixed in (together, *({key: value} for key, value in together.items())):
            assert why_fixed_conflicts(variant.configuration, fixed) is None, fixed


def numbers_of(variant, system, values):
    """Radius, conic constant and vertex of each curved mirror, viewpoint and gain of each view, of one design."""
    mirrors, views = {}, {}
    for mirror in system.layout.mirrors:
        vertex, curvature, conic_term = (
            float(np.ravel(number)[0])
            for number in (mirror.surface.vertex_height, mirror.surface.curvature, mirror.surface.conic_term)
        )
        mirrors[mirror.name] = {"vertex_mm": vertex}
        kind = variant.configuration.mirror_kinds[mirror.name]
        if kind is not MirrorKind.PLANE:
            conic = -1.0 if kind is MirrorKind.PARABOLOID else conic_term / curvature**2 - 1.0
            mirrors[mirror.name] |= {"radius_mm": 1.0 / curvature, "conic": conic}
    for view in ("lower", "upper"):
        viewpoint = values["lower_viewpoint"][0] + (values["baseline"][0] if view == "upper" else 0.0)
        views[view] = {"viewpoint_mm": float(viewpoint), "gain": float(values[f"{view}_gain"][0])}
    return mirrors, views
