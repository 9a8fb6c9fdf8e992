"""Rims and contacts of solids against their sections, sampled point by point."""

from __future__ import annotations

import re
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import Design
from designer.trace.instrument import sag
from designer.verify.solids import contact_problems, find_rims
from support.closed_forms import convex_ellipsoid_pair, direct_ellipsoid_pair, folded_hypl_hy

Section = tuple[float, float, np.ndarray, np.ndarray]
SAMPLES = 3001


def moved(design: Design, name: str, **values: float | str) -> Design:
    mirrors = [one.model_copy(update=values) if one.name == name else one for one in design.mirrors]
    return design.model_copy(update={"mirrors": tuple(mirrors)})


def depth_in_common(design: Design, first: str, second: str) -> float:
    """By how much two solids overlap along z at the radius where they do so most; negative by the gap between them.

    Minus infinity for solids that have no radius in common.
    """
    camera = design.camera
    seat = camera.lens_front_mm - camera.lens_length_mm
    cylinders = {
        "lens barrel": (camera.lens_radius_mm, seat, camera.lens_front_mm),
        "camera body": (camera.body_radius_mm, -1e4, seat),
    }

    def reach(name: str) -> tuple[float, float]:
        if name in cylinders:
            return 0.0, cylinders[name][0]
        return design.mirror(name).inner_radius_mm, design.mirror(name).outer_radius_mm

    def walls(name: str, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if name in cylinders:
            return np.full(SAMPLES, cylinders[name][1]), np.full(SAMPLES, cylinders[name][2])
        mirror = design.mirror(name)
        face = mirror.vertex_mm + sag(mirror, radii)
        back = face + (mirror.thickness_mm if mirror.faces == "down" else -mirror.thickness_mm)
        return np.minimum(face, back), np.maximum(face, back)

    inner, outer = (
        pick(ends) for pick, ends in zip((max, min), zip(reach(first), reach(second), strict=True), strict=True)
    )
    if inner > outer:
        return -np.inf
    radii = np.linspace(inner, outer, SAMPLES)
    (low_1, high_1), (low_2, high_2) = walls(first, radii), walls(second, radii)
    return float((np.minimum(high_1, high_2) - np.maximum(low_1, low_2)).max())


@given(
    build=st.sampled_from([folded_hypl_hy, convex_ellipsoid_pair, direct_ellipsoid_pair]),
    which=st.integers(0, 1),
    shift=st.floats(-90.0, 60.0),
    wider=st.floats(-6.0, 6.0),
    thickness=st.floats(0.5, 12.0),
)
@settings(max_examples=60)
def test_solids_meet_where_their_sections_do(build, which, shift, wider, thickness):
    design = build()
    mirror = design.mirrors[which]
    design = moved(
        design,
        mirror.name,
        vertex_mm=mirror.vertex_mm + shift,
        outer_radius_mm=max(mirror.outer_radius_mm + wider, mirror.inner_radius_mm + 0.5),
        thickness_mm=thickness,
    )
    said = {}
    for problem in contact_problems(design):
        names = problem.split(" touch ")[0].split(" penetrate ")[0].split(" and ")
        said[tuple(names)] = problem
    mirrors = [one.name for one in design.mirrors]
    pairs = [
        *combinations(mirrors, 2),
        *((name, solid) for name in mirrors for solid in ("lens barrel", "camera body")),
    ]
    for pair in pairs:
        depth = depth_in_common(design, *pair)
        if depth > 1e-3:
            found = re.search(r"penetrate each other by (\S+) mm", said[pair])
            assert found is not None
            assert float(found[1]) == pytest.approx(depth, rel=6e-3, abs=0.1)
        elif depth < -1e-3:
            assert pair not in said


@pytest.mark.parametrize(
    ("offset", "touches"),
    [(0.0, True), (-1.9, True), (1.9, True), (-2.0, True), (2.0, True), (-2.1, False), (2.1, False)],
    ids=str,
)
def test_rings_side_by_side_touch_where_their_walls_have_a_height_in_common(offset, touches):
    """A flat ring that ends at the radius where the direct mirror begins; both are 2 mm thick, corners count."""
    design = folded_hypl_hy()
    direct = design.mirror("direct")
    wall = direct.vertex_mm + float(sag(direct, direct.inner_radius_mm))
    design = moved(design, "secondary", vertex_mm=wall + offset, outer_radius_mm=direct.inner_radius_mm)
    problems = [problem for problem in contact_problems(design) if problem.startswith("secondary and direct")]
    assert problems == ([f"secondary and direct touch at radius {direct.inner_radius_mm:.4g} mm"] if touches else [])


def test_sheets_without_thickness_that_cross_are_told_where():
    design = folded_hypl_hy(thickness=0.0)
    direct = design.mirror("direct")
    # A plane at the height of the direct mirror's face at a radius between both of its rims.
    radius = 0.4 * direct.inner_radius_mm + 0.6 * direct.outer_radius_mm
    height = direct.vertex_mm + float(sag(direct, radius))
    design = moved(design, "secondary", vertex_mm=height, outer_radius_mm=direct.outer_radius_mm)
    (said,) = (problem for problem in contact_problems(design) if problem.startswith("secondary and direct"))
    assert float(re.search(r"at radius (\S+) mm", said)[1]) == pytest.approx(radius, rel=0.01)


def test_a_face_that_ends_before_its_rim_still_meets_what_it_meets():
    """A ball of 5 mm, said to reach out to 7 mm, a millimetre deep in the lens barrel, whose front lies at 3 mm."""
    ball = {"vertex_mm": 2.0, "radius_mm": 5.0, "conic": 0.0, "kind": "ellipsoid", "outer_radius_mm": 7.0}
    problems = contact_problems(moved(folded_hypl_hy(), "secondary", **ball))
    assert "secondary and lens barrel penetrate each other by 1 mm at radius 0 mm" in problems


@pytest.mark.parametrize("rim", ["inner_radius_mm", "outer_radius_mm"])
def test_sheets_without_thickness_that_meet_in_a_rim_alone_touch(rim):
    design = folded_hypl_hy(thickness=0.0)
    direct = design.mirror("direct")
    radius = getattr(direct, rim)
    height = direct.vertex_mm + float(sag(direct, radius))
    design = moved(design, "secondary", vertex_mm=height, outer_radius_mm=direct.outer_radius_mm)
    (said,) = (problem for problem in contact_problems(design) if problem.startswith("secondary and direct"))
    assert said == f"secondary and direct touch at radius {radius:.4g} mm"


@pytest.mark.parametrize("thickness", [0.0, 2.0])
def test_rims_are_the_ends_of_every_face_and_back_and_of_the_camera(thickness):
    design = folded_hypl_hy(thickness=thickness)
    expected = set()
    for index, mirror in enumerate(design.mirrors):
        for radius in {mirror.inner_radius_mm, mirror.outer_radius_mm} - {0.0}:
            face = mirror.vertex_mm + float(sag(mirror, radius))
            for height in {face, face + thickness if mirror.faces == "down" else face - thickness}:
                edge = "outer edge" if radius == mirror.outer_radius_mm else "hole edge"
                expected.add((index, f"{edge} of {mirror.name}", round(radius, 9), round(height, 9)))
    expected |= {(-1, "lens barrel", 7.0, 3.0), (-1, "lens barrel", 7.0, -37.0), (-1, "camera body", 20.0, -37.0)}
    rims = find_rims(design)
    found = [
        (int(owner), label, round(float(radius), 9), round(float(height), 9))
        for owner, label, (radius, height) in zip(rims.owner, rims.labels, rims.points, strict=True)
    ]
    assert len(found) == len(set(found))
    assert set(found) == expected
