"""What is said before mirrors are ordered: against finite differences, traced light, and designs of the studies."""

from __future__ import annotations

import json

import numpy as np
import pytest

from designer.design import Design, Mirror, read_design
from designer.evaluate.fabrication import surface_of
from designer.evaluate.fabrication_notes import fabrication_notes_on, tightest_curvature_mm
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import build_instrument
from support import DATA

PROTOTYPE = read_design(DATA / "folded_hypl_hy.json")


def indoor_winner(**changes: object) -> Design:
    """The best design of the indoor robot's study."""
    records = json.loads((DATA / "studied_designs.json").read_text(encoding="utf-8"))
    return Design.model_validate(next(each for each in records if each["requirement"] == "indoor_robot") | changes)


def with_mirror(design: Design, name: str, **changes: object) -> Design:
    mirrors = [mirror.model_copy(update=changes if mirror.name == name else {}) for mirror in design.mirrors]
    return design.model_copy(update={"mirrors": tuple(mirrors)})


@pytest.mark.parametrize("radius", [-0.6, 3.0])
@pytest.mark.parametrize("conic", [-4.0, -1.4, -1.0, -0.5])
@pytest.mark.parametrize("inner", [0.0, 0.3])
def test_tightest_curvature_by_finite_differences(radius: float, conic: float, inner: float) -> None:
    mirror = Mirror(
        name="primary",
        kind="hyperboloid",
        vertex_mm=0.0,
        radius_mm=radius,
        conic=conic,
        inner_radius_mm=inner,
        outer_radius_mm=0.6,
        thickness_mm=1.0,
        faces="up",
    )
    edges, step = np.linspace(max(inner, 1e-3), 0.6, 400), 1e-4
    below, here, above = (surface_of(mirror).height(edges + shift) for shift in (-step, 0.0, step))
    slope, bend = (above - below) / (2 * step), (above - 2 * here + below) / step**2
    along = (1 + slope**2) ** 1.5 / np.abs(bend)
    across = edges * np.sqrt(1 + slope**2) / np.abs(slope)
    assert tightest_curvature_mm(mirror) == pytest.approx(min(along.min(), across.min()), rel=1e-4)


def test_a_needle_with_a_pinhole_is_hard_to_make() -> None:
    needle = with_mirror(
        PROTOTYPE, "primary", radius_mm=-0.606, conic=-1.43, inner_radius_mm=0.225, outer_radius_mm=5.0
    )
    (remark,) = fabrication_notes_on(needle)
    assert remark == (
        "the primary mirror has a hole 0.45 mm in diameter (below 2 mm) and a radius of curvature of 0.66 mm "
        "(below 1 mm), which is hard to turn and to measure; to enlarge the mirror, increase "
        "manufacture.smallest_mirror_radius_mm (its outer radius is 5.00 mm)"
    )
    assert fabrication_notes_on(with_mirror(needle, "primary", radius_mm=-6.06, inner_radius_mm=1.0)) == []
    # Without a hole there is none to drill.
    (whole,) = fabrication_notes_on(with_mirror(needle, "primary", inner_radius_mm=0.0))
    assert "hole" not in whole
    assert "radius of curvature of 0.61 mm" in whole


def share_lost(design: Design) -> float:
    """The largest share of the pupil's light that edges cut off, at the ends of both views."""
    scene, camera = build_instrument(design), design.camera
    random = np.random.default_rng(0)
    radius, turn = camera.pupil_radius_mm * np.sqrt(random.random(4000)), 2 * np.pi * random.random(4000)
    starts = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(4000)], axis=1)
    shares = []
    for view in (design.views.upper, design.views.lower):
        path = scene.path(view.path)
        for psi in pinhole_angles(scene, path, np.radians(view.elevation_deg), widest_pinhole_angle(design)):
            in_focus = camera.focus_distance_mm * np.array([np.tan(psi), 0.0, 1.0])
            ahead = (in_focus - starts) / np.linalg.norm(in_focus - starts, axis=1, keepdims=True)
            report = compare_with_path(trace_first_hits(scene, ahead, starts), path)
            shares.append(float(np.mean(report.status != Status.OK)))
    return max(shares)


def test_a_pupil_wider_than_margins_loses_light_and_one_stopped_down_as_told_does_not() -> None:
    design = indoor_winner(clearance_mm=0.5, edge_margin_mm=0.5)
    assert design.camera.pupil_radius_mm == pytest.approx(12.0 / 5.6 / 2.0)
    assert share_lost(design) > 0.15
    remark = next(remark for remark in fabrication_notes_on(design) if "pupil" in remark)
    assert "2.14 mm in diameter (f/5.6)" in remark
    assert "manufacture.clearance_mm = 0.5 and manufacture.edge_margin_mm = 0.5" in remark
    assert "1.08 mm for each" in remark
    assert "f/12, avoids" in remark
    stopped = design.model_copy(update={"camera": design.camera.model_copy(update={"f_number": 12.0})})
    assert not [remark for remark in fabrication_notes_on(stopped) if "pupil" in remark]
    assert share_lost(stopped) < 0.02


@pytest.mark.parametrize(("clearance", "margin", "named"), [(0.5, 1.08, "clearance"), (1.08, 0.5, "edge_margin")])
def test_only_the_margin_that_falls_short_is_named(clearance: float, margin: float, named: str) -> None:
    remarks = fabrication_notes_on(indoor_winner(clearance_mm=clearance, edge_margin_mm=margin))
    (remark,) = (remark for remark in remarks if "pupil" in remark)
    assert f"with manufacture.{named}_mm = 0.5, edges" in remark
    assert "1.08 mm for it" in remark
    assert not [remark for remark in fabrication_notes_on(indoor_winner()) if "pupil" in remark]


@pytest.mark.parametrize(
    ("pair", "mirror", "kind", "conic", "told", "sibling"),
    [
        (
            "HyPl",
            "primary",
            "hyperboloid",
            -1.0413,
            "-1.041, which separates a hyperboloid from a paraboloid",
            "PaPa",
        ),
        (
            "ElPl",
            "primary",
            "ellipsoid",
            -0.9604,
            "-0.9604, which separates an ellipsoid from a paraboloid",
            "PaPa",
        ),
        ("HyHy", "secondary", "hyperboloid", -400.0, "-400, which separates a hyperboloid from a plane", "HyPl"),
        ("HyPl", "primary", "hyperboloid", -400.0, "-400, which separates a hyperboloid from a plane", ""),
        ("ElPl", "primary", "ellipsoid", -0.0025, "-0.0025, which separates an ellipsoid from a sphere", ""),
    ],
)
def test_a_mirror_held_at_the_edge_of_its_kind_names_its_sibling(
    pair: str, mirror: str, kind: str, conic: float, told: str, sibling: str
) -> None:
    design = PROTOTYPE.model_copy(update={"configuration": f"folded-{pair}-Hy-upper_outer"})
    radius = -100.0
    (remark,) = fabrication_notes_on(with_mirror(design, mirror, kind=kind, conic=conic, radius_mm=radius))
    towards = f", towards folded-{sibling}-Hy-upper_outer" if sibling else ""
    assert remark == (
        f"the {mirror} mirror is at the limit of its conic constant, {told}: the optimum lies beyond this limit"
        f"{towards}"
    )
    assert (
        fabrication_notes_on(
            with_mirror(design, mirror, kind=kind, conic=-1.3 if conic < -1 else -0.7, radius_mm=radius)
        )
        == []
    )


def test_a_direct_mirror_has_no_neighbouring_kind() -> None:
    assert fabrication_notes_on(with_mirror(PROTOTYPE, "direct", conic=-1.0413)) == []


def test_the_published_design_draws_no_remark(published: Design) -> None:
    assert fabrication_notes_on(published) == []
