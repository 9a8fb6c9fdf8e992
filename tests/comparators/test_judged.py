"""The judge's questions are put to comparators: what is made wrong is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.comparators.asked import Asked
from designer.comparators.coaxial import Coaxial
from designer.comparators.head import cylinder
from designer.comparators.judged import problems_of
from designer.comparators.planar import problems_of as problems_of_planar
from designer.comparators.planar import put_together as planar
from designer.comparators.stacked import put_together
from designer.design import Mirror
from support.shipped_problems import requirement_as_shipped

REQUIREMENT = requirement_as_shipped("pipe_inspection")
ASKED = Asked.of(REQUIREMENT, REQUIREMENT.camera.lenses[0])
UNIT = [0.13, 125.0, 12.0, 1.0 / 150.0, 6.5]


def stacked() -> Coaxial:
    built = put_together(ASKED, True, np.array([*UNIT, *UNIT, 100.0]))
    assert built is not None
    return built


def with_lower_mirrors(built: Coaxial, *mirrors: Mirror) -> Coaxial:
    lower, upper = built.heads
    return replace(built, heads=(replace(lower, mirrors=mirrors), upper))


def test_nothing_is_wrong_with_two_cameras_that_face_each_other():
    assert problems_of(ASKED, stacked()) == []


def test_a_mirror_that_ends_too_soon_loses_rays_and_light():
    built = stacked()
    own, *others = built.heads[0].mirrors
    short = own.model_copy(update={"outer_radius_mm": own.outer_radius_mm - 2.0})
    problems = problems_of(ASKED, with_lower_mirrors(built, short, *others))
    assert any("required rays are lost" in problem for problem in problems)
    assert any("of the light arrives" in problem for problem in problems)


def test_what_stands_in_the_way_is_found():
    built = stacked()
    own, *others = built.heads[0].mirrors
    pole = cylinder("pole", 60.0, own.vertex_mm + 30.0, own.vertex_mm + 31.0)
    problems = problems_of(ASKED, with_lower_mirrors(built, own, pole, *others))
    assert any(problem.startswith("lower view") and "lost" in problem for problem in problems)
    plug = cylinder("plug", own.inner_radius_mm + 5.0, own.vertex_mm, own.vertex_mm + 40.0)
    problems = problems_of(ASKED, with_lower_mirrors(built, own, plug, *others))
    assert any("penetrate each other" in problem for problem in problems)


def test_plane_mirrors_that_hide_each_other_are_found():
    room = Asked.of(requirement_as_shipped("indoor_robot"), REQUIREMENT.camera.lenses[0])
    values = np.array([-0.45, 0.45, 30.0, 75.0, 5.0, 0.0, 0.18, 3.6, 0.0, 8.0])
    free, hidden = values.copy(), values.copy()
    hidden[0], hidden[1] = 0.3, 0.35
    assert problems_of_planar(room, planar(room, free)) == []
    assert any("meet the other mirror first" in problem for problem in problems_of_planar(room, planar(room, hidden)))
