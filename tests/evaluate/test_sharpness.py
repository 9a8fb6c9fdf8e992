"""Best focus and depth of field against brute force; the summary of a design against its parts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.evaluate.focus import best_focus, depth_of_field, focus_of_design, refocused
from designer.optics.focus import (
    FocusedLens,
    chief_ray,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from support.studied_designs import NAMES, studied_design


@given(
    depths=st.lists(st.floats(-0.01, 0.02), min_size=1, max_size=8),
    weights=st.lists(st.floats(0.1, 10.0), min_size=8, max_size=8),
)
def test_no_other_focus_has_a_smaller_largest_blur(depths, weights):
    depth, weight = np.array(depths), np.array(weights[: len(depths)])

    def largest(focus: np.ndarray) -> np.ndarray:
        return np.max(weight * np.abs(np.atleast_1d(focus)[:, None] - depth), axis=1)

    best = best_focus(depth, weight)
    assert best >= 0.0
    assert largest(best)[0] <= largest(np.linspace(0.0, 0.02, 2001)).min() + 1e-15


def test_equal_weights_put_the_focus_in_the_middle():
    assert best_focus([0.004, 0.010, 0.009]) == pytest.approx(0.007)
    # A lens cannot focus beyond infinity.
    assert best_focus([-0.004, 0.001]) == 0.0


def test_refocusing_keeps_the_glass():
    lens = FocusedLens(13.0, 5.6, 1.0 / 150.0)
    again = refocused(lens, 1.0 / 90.0)
    assert again.pupil_diameter == pytest.approx(lens.pupil_diameter, rel=1e-14)
    assert 1.0 / again.principal_distance + 1.0 / 90.0 == pytest.approx(1.0 / 13.0 + 1.0 / 150.0, rel=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_depth_of_field_ends_where_the_blur_reaches_its_bound(name):
    design = studied_design(name)
    distances = np.geomspace(60.0, 1e6, 4001)
    for view in ("upper", "lower"):
        slope = np.tan(np.radians(np.linspace(*getattr(design.views, view).elevation_deg, 4)))
        ray = chief_ray(light_path_of_design(design, view), slope)
        column = chief_ray(light_path_of_design(design, view), slope[:, None])
        depths = reciprocal_image_depth(column, reciprocal_along_ray(slope[:, None], distances))
        # A scene point lies in front of the last mirror.
        is_ahead = distances * np.sqrt(1.0 + slope[:, None] ** 2) > column.viewpoint_distance
        for focus in (float(depths[1, 2000]), 1.0 / 150.0):
            lens = refocused(lens_of_camera(design.camera), max(focus, 0.0))
            bound = 4.0 * design.camera.pixel_pitch_mm
            near, far = depth_of_field(ray, lens, bound)
            is_sharp = np.abs(lens.blur(depths)) <= bound
            inside = (distances >= near[:, None] * (1.0 + 1e-9)) & (distances <= far[:, None] * (1.0 - 1e-9))
            np.testing.assert_array_equal(is_sharp & is_ahead, inside)


@pytest.mark.parametrize("name", NAMES)
def test_a_design_blurs_least_at_its_best_focus(name):
    design = studied_design(name)
    found = focus_of_design(design)
    pitch = design.camera.pixel_pitch_mm
    depths = np.concatenate([found.upper.reciprocal_depths.ravel(), found.lower.reciprocal_depths.ravel()])
    trials = found.best_reciprocal_focus + np.linspace(-1e-3, 1e-3, 41)
    relative = [np.abs(focus - depths).max() for focus in trials[trials >= 0.0]]
    assert np.abs(found.best_reciprocal_focus - depths).max() <= min(relative) + 1e-15
    assert found.best_largest_blur_px <= found.largest_blur_px * 1.1
    sharpest = refocused(found.lens, found.best_reciprocal_focus)
    assert found.best_largest_blur_px == pytest.approx(np.abs(sharpest.blur(depths)).max() / pitch)
    # In the scene: a blur of so many pixels spans the elevations that as many pixels resolve.
    view, path = found.lower, light_path_of_design(design, "lower")
    radii = [
        design.camera.focal_length_mm * np.tan(2.0 * np.arctan(chief_ray(path, np.tan(angle)).half_tangent)) / pitch
        for angle in np.radians(view.elevations_deg[[8, 8]]) + np.array([-1e-5, 1e-5])
    ]
    per_degree = abs(radii[1] - radii[0]) / np.degrees(2e-5)
    assert view.blur_px[8, 0] / view.blur_deg[8, 0] == pytest.approx(per_degree, rel=1e-6)
