"""Rays through a tube against Snell's law worked out with forty digits, by angles; struts against brute force."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from designer.housing import Struts, Tube
from designer.trace.housing import leave_housing, refract, strikes_struts
from support.housings import with_struts, with_tube
from support.imaging_designs import prototype

WITHIN = 1e-9


def tube_of(inner: float, wall: float, index: float, low: float = -1e4, high: float = 1e4) -> Tube:
    return Tube(kind="tube", inner_radius_mm=inner, wall_mm=wall, refractive_index=index, low_mm=low, high_mm=high)


def by_angles(tube: Tube, start, ahead):
    """Point on the outer wall and direction behind it, with 40 digits.

    At either wall the ray is turned in the plane of incidence from the angle of incidence to that of refraction.
    """
    with mpmath.workdps(40):
        point, direction = mpmath.matrix(start), mpmath.matrix(ahead)
        direction /= mpmath.norm(direction)
        for radius, before, behind in (
            (tube.inner_radius_mm, 1.0, tube.refractive_index),
            (tube.outer_radius_mm, tube.refractive_index, 1.0),
        ):
            dx, dy, x, y = direction[0], direction[1], point[0], point[1]
            a, b = dx * dx + dy * dy, x * dx + y * dy
            c = x * x + y * y - mpmath.mpf(radius) ** 2
            point = point + direction * ((-b + mpmath.sqrt(b * b - a * c)) / a)
            normal = mpmath.matrix([point[0], point[1], 0]) / mpmath.hypot(point[0], point[1])
            along = (normal.T * direction)[0]
            in_wall = direction - normal * along
            sine = mpmath.norm(in_wall)
            if sine == 0:
                continue
            refracted = mpmath.asin(mpmath.mpf(before) * sine / mpmath.mpf(behind))
            direction = normal * mpmath.cos(refracted) + in_wall * (mpmath.sin(refracted) / sine)
        return [float(value) for value in point], [float(value) for value in direction]


@settings(max_examples=60, deadline=None)
@given(
    st.floats(5.0, 200.0),
    st.floats(0.5, 10.0),
    st.floats(1.2, 2.2),
    st.floats(-1.3, 1.3),
    st.floats(-0.95, 0.95),
    st.floats(-3.0, 3.0),
    st.floats(-0.9, 0.9),
)
@example(20.0, 3.0, 1.49, 0.0, 0.0, 0.0, 0.0)
def test_a_ray_obeys_snells_law_at_both_walls(inner, wall, index, elevation, aside, azimuth, inwards):
    """Skew rays too: they pass the axis at up to 0.95 of the inner radius."""
    tube = tube_of(inner, wall, index)
    ahead = np.array([math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth)])
    left = np.array([-math.sin(azimuth), math.cos(azimuth)])
    foot = inner * (aside * left + inwards * math.sqrt(1.0 - aside**2) * np.array([math.cos(azimuth), left[0] * -1.0]))
    start, direction = np.array([*foot, 7.0]), np.array([*ahead, math.sin(elevation)])
    found = refract(tube, start[None], direction[None])
    point, behind = by_angles(tube, start.tolist(), direction.tolist())
    np.testing.assert_allclose(found.at_outer[0], point, rtol=0.0, atol=WITHIN * max(1.0, abs(point[2])))
    np.testing.assert_allclose(found.direction[0], behind, rtol=0.0, atol=WITHIN)
    # Bouguer's law and its like: what a round and long wall cannot change.
    assert found.direction[0, 2] == pytest.approx(direction[2], abs=WITHIN)
    moment = found.at_outer[0, 0] * found.direction[0, 1] - found.at_outer[0, 1] * found.direction[0, 0]
    assert moment == pytest.approx(foot[0] * direction[1] - foot[1] * direction[0], abs=WITHIN * inner)


def test_a_wall_of_air_does_nothing():
    design = with_tube(prototype(), refractive_index=1.2)
    tube = design.tube.model_copy(update={"refractive_index": 1.0})
    random = np.random.default_rng(3)
    start = random.uniform(-5.0, 5.0, (50, 3))
    ahead = random.standard_normal((50, 3))
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    left = leave_housing(tube.model_copy(update={"low_mm": -1e5, "high_mm": 1e5}), start, ahead)
    np.testing.assert_allclose(left.point, start, atol=1e-9)
    np.testing.assert_allclose(left.direction, ahead, atol=1e-12)


def test_a_ray_past_the_ends_of_a_tube_goes_straight_and_one_into_an_end_goes_nowhere():
    """Steep rays from the axis over a tube of 10 mm with a wall of 2 mm that ends at height 5."""
    tube = tube_of(10.0, 2.0, 1.5, -5.0, 5.0)
    heights = np.array([4.0, 5.5, 7.0, -5.5, -7.0])  # at the inner wall; the outer one is 0.2 to 1.4 farther on
    ahead = np.column_stack([np.full(5, 10.0), np.zeros(5), heights])
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    left = leave_housing(tube, np.zeros((5, 3)), ahead)
    # The second passes over the inner wall and the outer one: past the end, not into it.
    assert left.is_free.tolist() == [True, True, True, True, True]
    np.testing.assert_array_equal(left.direction[1:], ahead[1:])
    # Rises past the inner wall's edge at 4.9, and has passed 5 within the wall.
    into = np.array([[10.0, 0.0, 4.9]]) / np.hypot(10.0, 4.9)
    assert not leave_housing(tube, np.zeros((1, 3)), into).is_free[0]
    # From below the foot into the wall's lower end.
    start, up = np.array([[9.0, 0.0, -6.0]]), np.array([[1.0, 0.0, 0.6]]) / np.hypot(1.0, 0.6)
    assert not leave_housing(tube, start, up).is_free[0]


def test_struts_hide_the_azimuths_that_they_say():
    design = with_struts(prototype(), number=5, width_mm=3.0)
    struts = design.housing
    azimuth = np.linspace(0.0, 2.0 * np.pi, 200_000, endpoint=False)
    ahead = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)
    start = np.tile([0.0, 0.0, 50.0], (len(azimuth), 1))
    free = leave_housing(struts, start, ahead).is_free
    assert np.mean(~free) == pytest.approx(struts.blocked_share, abs=1e-4)
    assert not free[0]  # the first stands in +x
    apart = np.abs(np.remainder(np.degrees(azimuth[~free]) + 36.0, 72.0) - 36.0)
    assert apart.max() == pytest.approx(struts.half_width_deg, abs=0.01)


def test_struts_against_brute_force():
    """Rays followed in small steps, skew ones and ones that pass over the struts' ends too."""
    struts = Struts(kind="struts", number=3, width_mm=6.0, radius_mm=20.0, low_mm=0.0, high_mm=30.0)
    random = np.random.default_rng(8)
    start = np.column_stack([random.uniform(-8.0, 8.0, (400, 2)), random.uniform(-10.0, 40.0, 400)])
    ahead = random.standard_normal((400, 3)) * (1.0, 1.0, 0.6)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    steps = np.linspace(0.0, 120.0, 12_001)
    along = start[:, None] + steps[:, None] * ahead[:, None]
    nearest = np.full(along.shape[:2], np.inf)
    for azimuth in np.radians(struts.azimuths_deg):
        axis = struts.radius_mm * np.array([np.cos(azimuth), np.sin(azimuth)])
        nearest = np.minimum(nearest, np.linalg.norm(along[..., :2] - axis, axis=-1))
    within = (nearest <= struts.width_mm / 2.0) & (along[..., 2] >= 0.0) & (along[..., 2] <= 30.0)
    struck = strikes_struts(struts, start, ahead)
    # A graze shorter than a step is missed here.
    assert np.sum(struck != within.any(axis=1)) <= 2
    assert 20 < struck.sum() < 300
