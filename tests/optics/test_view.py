"""A view's four numbers against angles: the gain law, image radii and their slope, and what a volume asks for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.optics.view import (
    elevation_tangent,
    elevation_tangents_of_views,
    half_angle_tangent,
    image_half_tangent,
    image_radius,
    image_radius_slope,
)

elevations = st.floats(-1.4, 1.4)
senses = st.sampled_from(["direct", "folded"])
gains = st.floats(0.01, 0.15) | st.floats(-0.15, -0.01)


def pinhole_angle(elevation: float, gain: float, sense: str) -> float:
    """The signed angle at the pinhole, by the angles of the gain law themselves."""
    half = math.pi / 4 + (elevation if sense == "direct" else -elevation) / 2
    return 2 * math.atan(gain * math.tan(half))


@given(elevations, senses)
def test_the_half_angle_is_that_between_the_ray_and_the_axis(elevation, sense):
    # A direct view counts from straight down, a folded one from straight up.
    from_axis = math.pi / 2 + elevation if sense == "direct" else math.pi / 2 - elevation
    tangent = half_angle_tangent(math.tan(elevation), sense)
    assert 2 * math.atan(tangent) == pytest.approx(from_axis, rel=1e-9)
    assert elevation_tangent(tangent, sense) == pytest.approx(math.tan(elevation), rel=1e-9, abs=1e-9)


@given(elevations.filter(lambda angle: abs(angle) < 1.2), gains, senses)
def test_image_radii_are_tangents_of_pinhole_angles_and_their_slope_a_difference(elevation, gain, sense):
    def radius(angle: float) -> float:
        return 12.0 * math.tan(pinhole_angle(angle, gain, sense))

    slope = math.tan(elevation)
    found = image_radius(slope, gain, 12.0, sense)
    assert found == pytest.approx(radius(elevation), rel=1e-9)
    assert 2 * math.atan(image_half_tangent(found, 12.0)) == pytest.approx(
        pinhole_angle(elevation, gain, sense), rel=1e-9
    )
    step = 1e-5
    difference = (radius(elevation + step) - radius(elevation - step)) / (2 * step)
    assert image_radius_slope(slope, gain, 12.0, sense) == pytest.approx(difference, rel=1e-6)


@given(st.floats(-60, 40), st.floats(1, 30), st.floats(100, 2000), st.floats(1.1, 8), st.floats(5, 400))
def test_both_views_just_see_every_point_of_the_volume(low, width, near, depth, baseline):
    """The volume is seen from the middle of the baseline; its points are seen from half a baseline above and below."""
    slopes = np.tan(np.radians([low, low + width]))
    found = elevation_tangents_of_views((slopes[0], slopes[1]), (near, near * depth), baseline)
    distance, slope = np.meshgrid(np.linspace(near, near * depth, 9), np.linspace(*slopes, 9))
    height = distance * slope
    for ends, viewpoint in ((found.upper, baseline / 2), (found.lower, -baseline / 2)):
        seen = (height - viewpoint) / distance
        assert ends == pytest.approx((seen.min(), seen.max()), rel=1e-12, abs=1e-12)
