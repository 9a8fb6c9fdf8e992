"""A record that contradicts its mirrors is found out, with both values, and the mirrors are believed."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.configurations import enumerate_configurations
from designer.design import Design, read_design
from designer.verify.contradicted_record import needed_elevations, record_problems
from designer.verify.judge import judge
from designer.verify.traced_views import as_traced
from support import DATA
from support.closed_forms import (
    convex_ellipsoid_pair,
    direct_ellipsoid_pair,
    folded_hypl_hy,
    half_tangent,
    paraboloid_pair,
    view_ranges,
)
from support.studied_designs import NAMES, studied_design

BUILDERS = [folded_hypl_hy, convex_ellipsoid_pair, paraboloid_pair, direct_ellipsoid_pair]


def edited(design: Design, part: tuple[str | int, ...] = (), **values: Any) -> Design:
    """A copy with values of the record, or of one part of it, replaced."""
    record = design.model_dump(mode="json", by_alias=True)
    here = record
    for key in part:
        here = here[key]
    here |= values
    return Design.model_validate(record)


def swapped(design: Design) -> Design:
    views = design.views
    return design.model_copy(update={"views": views.model_copy(update={"upper": views.lower, "lower": views.upper})})


@pytest.mark.parametrize("build", BUILDERS, ids=lambda f: f.__name__)
def test_a_true_record_is_left_alone(build):
    design = build()
    assert record_problems(design) == []
    same, said = as_traced(design)
    assert same is design
    assert said == []


def test_a_published_record_is_left_alone():
    design = read_design(DATA / "jaramillo_2016.json")
    assert record_problems(design) == []
    assert as_traced(design) == (design, [])


def test_an_image_circle_may_reach_the_corner_of_the_sensor():
    assert record_problems(edited(folded_hypl_hy(), ("camera",), image_circle_radius_px=1000.0)) == []


@pytest.mark.parametrize(
    ("part", "values", "words"),
    [
        ((), {"baseline_mm": 90.0}, ("baseline_mm is 90", "100 mm apart")),
        ((), {"height_mm": 50.0}, ("height_mm is 50", "115.472")),
        ((), {"diameter_mm": 46.0}, ("diameter_mm is 46", "46.13298")),
        ((), {"configuration": "folded-HyEl-Hy-upper_outer"}, ("an ellipsoid as secondary", "it is a plane")),
        ((), {"configuration": "folded-HyPl-El-upper_outer"}, ("an ellipsoid as direct", "conic -1.38390804")),
        ((), {"configuration": "folded-HyPl-Hy-upper_inner"}, ("is upper_inner", "6.66 to 12.16", "3.28 to 6.00")),
        ((), {"configuration": "direct-HyHy-upper_outer"}, ("its lower view by lower", "secondary, primary")),
        ((), {"configuration": "folded-PlPl-Hy-upper_outer"}, ("not one of the 44",)),
        (("mirrors", 1), {"kind": "ellipsoid"}, ("primary: kind is ellipsoid", "-1.17301179", "hyperboloid")),
        (("mirrors", 2), {"kind": "paraboloid"}, ("direct: kind is paraboloid", "-1.38390804", "hyperboloid")),
        (("camera",), {"image_circle_radius_px": 1100.0}, ("image_circle_radius_px is 1100", "1000 px")),
        (("views", "upper"), {"elevation_deg": [-18.0, 16.0]}, ("elevation_deg is [-18, 16]", "[-18.6107, 15.4692]")),
        (("views", "upper"), {"viewpoint_mm": 110.0}, ("viewpoint (110 mm)", "10 mm", "at 100 mm")),
        (("views", "lower"), {"sense": "direct"}, ("0.0398725054, direct", "its mirrors give 0.0398725054, folded")),
        (("working_volume",), {"elevation_deg": [16.0, -16.0]}, ("working_volume.elevation_deg [16, -16]",)),
        (("working_volume",), {"elevation_deg": [-90.5, 16.0]}, ("working_volume.elevation_deg [-90.5, 16]",)),
        (("working_volume",), {"elevation_deg": [-16.0, 90.5]}, ("working_volume.elevation_deg [-16, 90.5]",)),
        (("working_volume",), {"distance_mm": [0.0, 5000.0]}, ("working_volume.distance_mm [0, 5000]",)),
        (("views", "upper"), {"elevation_deg": [-90.5, 16.0]}, ("upper view: elevation_deg [-90.5, 16] is not",)),
        (("views", "lower"), {"elevation_deg": [-18.0, 90.5]}, ("lower view: elevation_deg [-18, 90.5] is not",)),
    ],
)
def test_each_contradiction_is_named_with_both_values(part, values: dict[str, Any], words: tuple[str, ...]):
    verdict = judge(edited(folded_hypl_hy(), part, **values))
    assert not verdict.passed
    assert any(all(word in problem for word in words) for problem in verdict.problems), verdict.problems


@pytest.mark.parametrize("volume", [(-16.0, 20.0), (-25.0, 16.0)])
def test_a_wider_volume_is_traced_and_not_only_compared(volume):
    """The mirrors are what they were, so the tracer says which elevations they do not show."""
    verdict = judge(edited(folded_hypl_hy(), ("working_volume",), elevation_deg=list(volume)))
    upper, lower = view_ranges(volume, (1000.0, 5000.0), 100.0)
    for view, needed in ((verdict.upper, upper), (verdict.lower, lower)):
        assert view.asked_elevation_deg[0] <= needed[0] + 1e-9
        assert view.asked_elevation_deg[1] >= needed[1] - 1e-9
        assert view.gaps_deg
    assert any("but the working volume needs" in problem for problem in verdict.problems)
    assert any("is not seen" in problem for problem in verdict.problems)


@pytest.mark.parametrize(
    ("name", "wider"),
    [
        ("sky_watch:folded-ElHy-Hy-upper_inner", (-6.0, 0.0)),
        ("ceiling_watch:direct-HyHy-upper_outer", (0.0, 6.0)),
    ],
)
def test_a_volume_wider_towards_the_horizon_is_traced(name, wider):
    """Of views that look above it, or below it, alone."""
    design = studied_design(name)
    low, high = design.working_volume.elevation_deg
    assert low * high > 0.0
    volume = (low + wider[0], high + wider[1])
    verdict = judge(edited(design, ("working_volume",), elevation_deg=list(volume)), whole_image=False)
    needed = view_ranges(volume, design.working_volume.distance_mm, design.baseline_mm)
    for view, (least, greatest) in zip((verdict.upper, verdict.lower), needed, strict=True):
        assert view.asked_elevation_deg == pytest.approx((least, greatest), abs=1e-3)


def test_a_nearer_volume_needs_more_of_both_views():
    verdict = judge(edited(folded_hypl_hy(), ("working_volume",), distance_mm=[300.0, 5000.0]))
    assert {problem.split()[0] for problem in verdict.problems if "the working volume needs" in problem} == {
        "upper",
        "lower",
    }


@given(
    low=st.floats(-60, 40),
    width=st.floats(1, 30),
    near=st.floats(100, 2000),
    depth=st.floats(1.1, 8),
    inside=st.tuples(st.floats(0, 1), st.floats(0, 1)),
)
@settings(max_examples=50)
def test_the_needed_elevations_just_hold_the_volume(low, width, near, depth, inside):
    volume = {"elevation_deg": [low, low + width], "distance_mm": [near, near * depth]}
    design = edited(folded_hypl_hy(), ("working_volume",), **volume)
    needed = needed_elevations(design)
    assert needed is not None
    upper, lower = view_ranges((low, low + width), (near, near * depth), 100.0)
    assert needed["upper"] == pytest.approx(upper, abs=1e-9)
    assert needed["lower"] == pytest.approx(lower, abs=1e-9)
    distance = near * (1 + inside[0] * (depth - 1))
    height = 50.0 + distance * math.tan(math.radians(low + inside[1] * width))
    for name, viewpoint in (("upper", 100.0), ("lower", 0.0)):
        seen = math.degrees(math.atan2(height - viewpoint, distance))
        assert needed[name][0] - 1e-9 <= seen <= needed[name][1] + 1e-9


def test_only_the_44_names_are_names():
    kinds = ("Pl", "Hy", "El", "Pa")
    topologies = ("upper_outer", "upper_inner")
    possible = {f"folded-{a}{b}-{c}-{t}" for a, b, c, t in product(kinds, kinds, kinds, topologies)}
    possible |= {f"direct-{a}{b}-{t}" for a, b, t in product(kinds, kinds, topologies)}
    design = folded_hypl_hy()
    named = {
        name
        for name in possible
        if not any("not one of the 44" in problem for problem in record_problems(edited(design, configuration=name)))
    }
    assert named == {configuration.name for configuration in enumerate_configurations()}


# --- what is computed from views comes from the mirrors ---


@pytest.mark.parametrize("build", BUILDERS, ids=lambda f: f.__name__)
@pytest.mark.parametrize("name", ["upper", "lower"])
def test_wrong_views_are_measured_on_the_mirrors(build, name: str):
    design = build()
    view = getattr(design.views, name)
    wrong = edited(
        design,
        ("views", name),
        viewpoint_mm=view.viewpoint_mm + 7.0,
        gain=-2.0 * view.gain,
        sense="folded" if view.sense == "direct" else "direct",
    )
    wrong = wrong.model_copy(update={"baseline_mm": 3.0})
    right, said = as_traced(wrong)
    measured = getattr(right.views, name)
    assert measured.viewpoint_mm == pytest.approx(view.viewpoint_mm, abs=1e-9)
    assert measured.gain == pytest.approx(view.gain, rel=1e-9)
    assert measured.sense == view.sense
    assert right.baseline_mm == pytest.approx(design.baseline_mm, abs=1e-9)
    for key in (f"views.{name}.viewpoint_mm", f"views.{name}.gain", f"views.{name}.sense", "baseline_mm"):
        assert any(line.startswith(key) for line in said), said


@pytest.mark.parametrize("build", BUILDERS, ids=lambda f: f.__name__)
def test_swapped_views_are_put_right(build):
    design = build()
    right, said = as_traced(swapped(design))
    assert right == design
    (line,) = said
    assert "the two views are interchanged" in line


def test_swapped_zones_are_put_right():
    design = folded_hypl_hy()
    wrong = edited(edited(design, ("views", "upper"), zone="inner"), ("views", "lower"), zone="outer")
    right, said = as_traced(wrong)
    assert right == design
    assert "zone is recorded as inner" in said[0]


@pytest.mark.parametrize("name", NAMES)
def test_zones_of_studied_designs_are_believed_if_true_and_put_right_if_not(name):
    design = studied_design(name)
    assert as_traced(design) == (design, [])
    zones = {view: record.zone for view, record in design.views.by_name.items()}
    wrong = edited(edited(design, ("views", "upper"), zone=zones["lower"]), ("views", "lower"), zone=zones["upper"])
    right, (said,) = as_traced(wrong)
    assert right == design
    assert f"zone is recorded as {zones['lower']} for the upper" in said


@pytest.mark.parametrize("name", ["upper", "lower"])
@pytest.mark.parametrize("ratio", [0.97, 1.03])
def test_the_outer_zone_is_that_whose_middle_elevation_lies_farther_out(name, ratio):
    design = folded_hypl_hy()
    view, other = (design.views.by_name[one] for one in (name, "lower" if name == "upper" else "upper"))
    # Half the pinhole angle of the other view's middle elevation, by the gain law; and ours a little off it.
    reached = abs(other.gain) * half_tangent(sum(other.elevation_deg) / 2.0, other.sense)
    from_axis = 2.0 * math.degrees(math.atan(ratio * reached / abs(view.gain)))
    middle = from_axis - 90.0 if view.sense == "direct" else 90.0 - from_axis
    right, _ = as_traced(edited(design, ("views", name), elevation_deg=[middle - 1.0, middle + 1.0]))
    assert right.views.by_name[name].zone == ("outer" if ratio > 1.0 else "inner")


def test_mirrors_without_a_single_viewpoint_say_so():
    design = folded_hypl_hy()
    _, said = as_traced(edited(design, ("mirrors", 2), conic=design.mirror("direct").conic * 1.02))
    assert any("there is no single viewpoint" in line for line in said)


def test_mirrors_that_let_nothing_through_say_so():
    design = folded_hypl_hy()
    same, said = as_traced(edited(design, ("mirrors", 2), faces="up"))
    assert "views.upper: its mirrors transmit no ray" in said[0]
    assert same.views.upper == design.views.upper
