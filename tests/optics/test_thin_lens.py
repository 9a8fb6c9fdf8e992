"""The thin lens against two constructed rays: through the lens's centre, and parallel to the axis through its focus."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.optics.thin_lens import nominal_focal_length, principal_distance, pupil_radius

focal_lengths = st.floats(1.0, 200.0)
# In focal lengths: nearer there is no real image.
focus_distances = st.floats(1.05, 1e4)


def image_by_construction(focal_length: float, distance: float) -> float:
    """Where the image of a point off the axis lies behind the lens: the two rays as lines, intersected."""
    height = 1.0
    # Behind the lens, at x: the ray through the centre goes on straight, the parallel one is bent through the focus.
    through_centre = (0.0, -height / distance)
    parallel = (height, -height / focal_length)
    (x, _) = np.linalg.solve([[through_centre[1], -1.0], [parallel[1], -1.0]], [-through_centre[0], -parallel[0]])
    return float(x)


@given(focal_lengths, focus_distances)
def test_the_principal_distance_is_where_two_rays_meet(focal_length, focal_lengths_away):
    distance = focal_length * focal_lengths_away
    assert principal_distance(focal_length, distance) == pytest.approx(
        image_by_construction(focal_length, distance), rel=1e-9
    )


@given(focal_lengths, focus_distances)
def test_the_nominal_focal_length_comes_back(focal_length, focal_lengths_away):
    distance = focal_length * focal_lengths_away
    image = image_by_construction(focal_length, distance)
    assert nominal_focal_length(image, distance) == pytest.approx(focal_length, rel=1e-9)


def test_a_lens_focused_at_infinity_images_at_its_focal_length():
    assert principal_distance(12.0, math.inf) == 12.0
    assert nominal_focal_length(12.0, math.inf) == 12.0


def test_published_numbers():
    """12 mm focused at 100 mm images at 13.6 mm; at f/5.6 its entrance pupil is 2.14 mm across."""
    assert principal_distance(12.0, 100.0) == pytest.approx(13.6364, abs=1e-4)
    assert 2.0 * pupil_radius(12.0, 5.6) == pytest.approx(2.143, abs=1e-3)


def test_arrays_and_symbols_give_what_floats_give():
    focal, distance = np.array([4.0, 12.0, 50.0]), np.array([60.0, 100.0, 1e5])
    expected = [principal_distance(f, u) for f, u in zip(focal.tolist(), distance.tolist(), strict=True)]
    np.testing.assert_array_equal(principal_distance(focal, distance), expected)
    f, u = casadi.SX.sym("f"), casadi.SX.sym("u")
    function = casadi.Function("image", [f, u], [principal_distance(f, u), nominal_focal_length(f, u)])
    for a, b in zip(focal.tolist(), distance.tolist(), strict=True):
        image, nominal = (float(value) for value in function(a, b))
        assert (image, nominal) == (principal_distance(a, b), nominal_focal_length(a, b))
