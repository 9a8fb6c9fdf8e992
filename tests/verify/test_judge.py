"""Good designs pass; spoiled ones do not, and the verdict says why."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import Design, read_design
from designer.verify.description import describe
from designer.verify.judge import judge
from designer.verify.verdict import Verdict
from support import DATA
from support.closed_forms import (
    convex_ellipsoid_pair,
    direct_ellipsoid_pair,
    folded_hypl_hy,
    half_tangent,
    paraboloid_pair,
)


def changed(design: Design, mirror: str | None = None, camera: dict[str, Any] | None = None, **values: Any) -> Design:
    """A copy of a design with values of one mirror, of the camera, or of the record itself replaced."""
    record = design.model_dump(by_alias=True)
    record["camera"] |= camera or {}
    if mirror is None:
        record |= values
    else:
        record["mirrors"] = [entry | values if entry["name"] == mirror else entry for entry in record["mirrors"]]
    return Design.model_validate(record)


def with_view(design: Design, name: str, **values: Any) -> Design:
    record = design.model_dump(by_alias=True)
    record["views"][name] |= values
    return Design.model_validate(record)


def rejected(design: Design, *words: str) -> Verdict:
    """The verdict on a design that must be refused with one problem that holds all the words."""
    verdict = judge(design)
    assert not verdict.passed
    assert any(all(word in problem for word in words) for problem in verdict.problems), verdict.problems
    return verdict


@pytest.mark.parametrize(
    "design", [folded_hypl_hy, convex_ellipsoid_pair, paraboloid_pair, direct_ellipsoid_pair], ids=lambda f: f.__name__
)
def test_designs_from_the_closed_forms_pass(design):
    design = design()
    verdict = judge(design)
    assert verdict.passed, verdict.problems
    for name, view in verdict.views.items():
        low, high = view.asked_elevation_deg
        assert view.gaps_deg == ()
        ((seen_low, seen_high),) = view.seen_elevation_deg
        assert seen_low < low < high < seen_high
        assert view.svp_residual_mm < 1e-11
        assert view.gain_residual < 1e-14
        record = getattr(design.views, name)
        ends = [2 * np.degrees(np.arctan(abs(record.gain) * half_tangent(phi, record.sense))) for phi in (low, high)]
        assert view.zone_psi_deg == pytest.approx(sorted(ends), abs=1e-6)
    assert "passed" in describe(verdict)


def test_the_sample_file_is_the_closed_form():
    assert read_design(DATA / "folded_hypl_hy.json") == folded_hypl_hy()


def test_apertures_are_measured_to_many_digits():
    verdict = judge(convex_ellipsoid_pair())
    assert verdict.lower.aperture_elevation_deg == pytest.approx((-17.0, 17.0), abs=1e-9)
    assert verdict.upper.aperture_elevation_deg == pytest.approx((-10.0, 10.0), abs=1e-9)


def test_the_convex_ellipsoids_that_share_a_focus_below():
    design = convex_ellipsoid_pair()
    secondary, primary = design.mirror("secondary"), design.mirror("primary")
    assert secondary.radius_mm == pytest.approx(-163.11, abs=0.005)
    assert (primary.vertex_mm, primary.radius_mm) == pytest.approx((15.071, -7.4264), abs=5e-4)
    assert design.views.lower.gain == pytest.approx(0.046355, abs=5e-7)


@pytest.mark.parametrize("mirror", ["secondary", "primary", "direct"])
@pytest.mark.parametrize("shift", [1e-6, 0.01])
def test_a_shifted_vertex_is_rejected(mirror, shift):
    design = folded_hypl_hy()
    moved = changed(design, mirror, vertex_mm=design.mirror(mirror).vertex_mm + shift)
    rejected(moved, "upper view" if mirror == "direct" else "lower view", "viewpoint")


@pytest.mark.parametrize("mirror", ["primary", "direct"])
def test_a_wrong_conic_is_rejected(mirror):
    design = folded_hypl_hy()
    view = "upper view" if mirror == "direct" else "lower view"
    rejected(changed(design, mirror, conic=design.mirror(mirror).conic - 1e-6), view, "viewpoint")
    rejected(changed(design, mirror, radius_mm=design.mirror(mirror).radius_mm * 1.001), view, "gain")


def test_a_wrong_gain_is_rejected():
    design = folded_hypl_hy()
    rejected(with_view(design, "upper", gain=design.views.upper.gain + 1e-8), "upper view", "gain")
    rejected(with_view(direct_ellipsoid_pair(), "upper", gain=+0.06), "upper view", "gain")


@pytest.mark.parametrize(
    ("mirror", "view"), [("secondary", "lower view"), ("primary", "lower view"), ("direct", "upper view")]
)
def test_a_cut_rim_is_rejected(mirror, view):
    design = folded_hypl_hy(margin=0.0)
    assert judge(design).passed
    cut = design.mirror(mirror)
    verdict = rejected(changed(design, mirror, outer_radius_mm=cut.outer_radius_mm - 1e-6), view, mirror, "ends at")
    assert verdict.views[view.split()[0]].gaps_deg
    if cut.inner_radius_mm > 0.0:
        rejected(changed(design, mirror, inner_radius_mm=cut.inner_radius_mm + 1e-6), view, mirror, "begins at")


def test_a_swollen_secondary_stands_in_the_upper_view():
    design = changed(folded_hypl_hy(), "secondary", outer_radius_mm=9.6)
    verdict = rejected(design, "upper view", "pinhole to direct", "secondary")
    low = [blockage.elevation_deg[0] for blockage in verdict.upper.blockages if blockage.is_asked]
    assert low[0] < design.views.upper.elevation_deg[0] + 1e-3


def test_a_swollen_lens_is_rejected():
    design = folded_hypl_hy()
    rejected(changed(design, camera={"lens_radius_mm": 9.0}), "primary", "lens barrel", "penetrate")
    tall = changed(design, camera={"lens_radius_mm": 8.5, "lens_front_mm": 30.0})
    rejected(tall, "lower view", "secondary to primary", "lens barrel")
    rejected(changed(design, camera={"lens_radius_mm": 0.5}), "the lens barrel cuts off the required rays")


def test_a_swollen_body_stands_in_the_lower_view():
    design = folded_hypl_hy()
    seat = 3.0 - 40.0
    reach = seat / np.tan(np.radians(design.views.lower.elevation_deg[0]))
    assert judge(changed(design, camera={"body_radius_mm": reach - 0.01})).passed
    rejected(changed(design, camera={"body_radius_mm": reach + 0.01}), "primary to world", "camera body")


def test_a_thick_substrate_is_rejected():
    rejected(changed(folded_hypl_hy(), "primary", thickness_mm=40.0), "primary and camera body penetrate")


def test_zero_thickness_still_blocks_from_behind():
    design = folded_hypl_hy(thickness=0.0)
    assert judge(design).passed
    rejected(changed(design, "secondary", outer_radius_mm=9.6), "pinhole to direct: secondary blocks")
    # An opaque sheet facing up: light from the camera meets its back.
    rejected(changed(design, "secondary", faces="up"), "lower view", "not seen")
    assert any(b.element == "back of secondary" for b in judge(sheet_in_the_way(design)).upper.blockages)


def sheet_in_the_way(design: Design) -> Design:
    record = design.model_dump(by_alias=True)
    sheet = dict(record["mirrors"][0], faces="up", vertex_mm=60.0, inner_radius_mm=6.9, outer_radius_mm=30.0)
    record["views"]["lower"]["path"] = ["direct", "primary"]
    return Design.model_validate(record | {"mirrors": [sheet, *record["mirrors"][1:]]})


def test_overlapping_zones_and_zones_beyond_the_image_are_rejected():
    design = folded_hypl_hy()
    low, high = design.views.lower.elevation_deg
    record = with_view(design, "lower", elevation_deg=(low - 12.0, high))
    wider = changed(record, "secondary", outer_radius_mm=12.0)
    wider = changed(wider, "primary", outer_radius_mm=24.0)
    verdict = rejected(wider, "zones of the two views overlap")
    assert any("secondary" in problem and "blocks" in problem for problem in verdict.problems)
    rejected(changed(design, camera={"image_circle_radius_px": 580.0}), "upper view", "beyond the image circle")
    rejected(with_view(design, "upper", zone="inner"), "upper view", "zone")


def test_solids_that_meet_are_named():
    design = folded_hypl_hy()
    rejected(changed(design, "secondary", vertex_mm=95.0, outer_radius_mm=12.0), "secondary and direct penetrate")
    rejected(changed(design, baseline_mm=99.0), "baseline_mm")
    thin = folded_hypl_hy(thickness=0.0)
    direct = thin.mirror("direct")
    crossing = changed(thin, "secondary", vertex_mm=98.0, outer_radius_mm=direct.outer_radius_mm)
    rejected(crossing, "secondary and direct penetrate")


def test_the_clearance_is_the_distance_of_the_steepest_leg_from_the_rim():
    design = folded_hypl_hy()
    verdict = judge(design)
    # Upper view's lowest ray past the top of the secondary's rim, by hand.
    psi = 2 * np.arctan(design.views.upper.gain * half_tangent(design.views.upper.elevation_deg[0], "direct"))
    radius, height = design.mirror("secondary").outer_radius_mm, 80.0
    by_hand = min(abs(z * np.sin(psi) - radius * np.cos(psi)) for z in (height, height + 2.0))
    assert verdict.upper.clearance_mm == pytest.approx(by_hand, abs=1e-6)
    assert "secondary" in verdict.upper.clearance_at


def test_a_rim_thinner_than_the_sampling_is_found():
    design = folded_hypl_hy()
    record = design.model_dump(by_alias=True)
    record["mirrors"] = (
        *record["mirrors"],
        dict(
            record["mirrors"][0],
            name="wire",
            vertex_mm=50.0,
            inner_radius_mm=7.123456,
            outer_radius_mm=7.123457,
            thickness_mm=0.0,
        ),
    )
    rejected(Design.model_validate(record), "upper view", "pinhole to direct", "wire", "lies between the rays")


# --- the published design of Jaramillo (2016), typed in by hand ---


def test_jaramillos_apertures_and_baseline():
    design = read_design(DATA / "jaramillo_2016.json")
    verdict = judge(design)
    assert verdict.baseline_mm == pytest.approx(131.607, abs=1e-9)
    assert verdict.upper.aperture_elevation_deg is not None
    assert verdict.lower.aperture_elevation_deg is not None
    assert [f"{value:.2f}" for value in verdict.upper.aperture_elevation_deg] == ["-21.10", "14.00"]
    assert [f"{value:.2f}" for value in verdict.lower.aperture_elevation_deg] == ["-13.92", "75.28"]
    for view in verdict.views.values():
        assert view.gaps_deg == ()
        # The published figures are rounded to a thousandth of a millimetre and better.
        assert view.svp_residual_mm < 1e-4
        assert view.gain_residual < 1e-6
    assert "secondary and direct touch at radius 17.23 mm" in verdict.problems


def test_what_blocks_what_in_jaramillos_design():
    """By hand: a ray over the hole's edge of the primary, at 75.2817 degrees, runs into the rim of the direct mirror.

    Seen from the lower viewpoint that rim stands at atan((132.71300 + 8.119) / 37) = 75.27967 degrees. And the fold
    plane, 0.14 micrometres below the cut of the direct mirror, hides the last 6e-5 degrees of the upper view.
    """
    verdict = judge(read_design(DATA / "jaramillo_2016.json"))
    (lower,) = verdict.lower.blockages
    assert (lower.leg, lower.element, lower.is_asked) == ("primary to world", "direct", False)
    height = 111.5648 + 37.0**2 / 26.69995 / (1.0 + np.sqrt(1.0 + 0.535920 * (37.0 / 26.69995) ** 2))
    assert lower.elevation_deg[0] == pytest.approx(np.degrees(np.arctan((height + 8.119) / 37.0)), abs=1e-6)
    assert lower.elevation_deg[1] == verdict.lower.aperture_elevation_deg[1]
    (upper,) = verdict.upper.blockages
    assert (upper.leg, upper.element, upper.is_asked) == ("pinhole to direct", "secondary", False)
    assert upper.elevation_deg[1] - upper.elevation_deg[0] < 1e-4
    assert "by direct, primary to world" in describe(verdict)


def test_the_image_from_its_centre_outwards():
    """The prototype's camera sees itself in the middle, then the lower view, then the upper one."""
    design = folded_hypl_hy()
    verdict = judge(design)
    zones = verdict.image
    assert zones[0].psi_deg[0] == 0.0
    assert zones[-1].psi_deg[1] == pytest.approx(np.degrees(np.arctan(1000 * 0.0044 / 12.0)))
    for zone, following in pairwise(zones):
        assert following.psi_deg[0] - zone.psi_deg[1] == pytest.approx(0.0, abs=1e-5)
    assert (zones[0].stations, zones[0].is_blocked) == (("secondary", "lens barrel"), True)
    # By hand: the fold plane mirrors the lens front to 157 mm, where it is 7 mm wide.
    assert zones[0].psi_deg[1] == pytest.approx(np.degrees(np.arctan(7.0 / 157.0)), abs=1e-5)
    seen = [zone for zone in zones if not zone.is_blocked and len(zone.stations) > 1]
    assert [zone.stations for zone in seen if "primary" in zone.stations] == [("secondary", "primary", "world")]
    assert [zone.stations for zone in seen if "direct" in zone.stations] == [("direct", "world")]


# --- nonsense ---

LENGTHS = st.floats(-300.0, 300.0) | st.sampled_from([0.0, 1e-300, 1e-9, 1e9, 1e308, -1e308])
POSITIVE = st.floats(1e-3, 300.0) | st.sampled_from([1e-300, 1e-9, 1e9, 1e308])


@given(
    data=st.data(),
    path=st.lists(st.sampled_from(["secondary", "primary", "direct"]), min_size=1, max_size=8),
)
@settings(max_examples=60, deadline=None)
def test_nonsense_gets_problems_and_never_an_exception(data, path):
    record = folded_hypl_hy().model_dump(by_alias=True)
    for mirror in record["mirrors"]:
        inner = data.draw(POSITIVE)
        mirror |= {
            "vertex_mm": data.draw(LENGTHS),
            "conic": data.draw(st.floats(-10.0, -1.0) | st.just(-1e308)),
            "inner_radius_mm": inner * data.draw(st.sampled_from([0.0, 0.5])),
            "outer_radius_mm": inner,
            "thickness_mm": data.draw(POSITIVE),
            "faces": data.draw(st.sampled_from(["up", "down"])),
        }
        if mirror["kind"] != "plane":
            mirror["radius_mm"] = data.draw(POSITIVE) * data.draw(st.sampled_from([1.0, -1.0]))
    record["camera"] |= {
        key: data.draw(POSITIVE) for key in ("focal_length_mm", "pixel_pitch_mm", "lens_radius_mm", "body_radius_mm")
    }
    record["camera"]["lens_front_mm"] = data.draw(LENGTHS)
    record["views"]["upper"] |= {"path": path, "viewpoint_mm": data.draw(LENGTHS), "gain": data.draw(LENGTHS)}
    record["views"]["lower"]["elevation_deg"] = [data.draw(LENGTHS), data.draw(LENGTHS)]
    verdict = judge(Design.model_validate(record))
    assert not verdict.passed
    assert all("\n" not in problem for problem in verdict.problems)
    assert describe(verdict)
