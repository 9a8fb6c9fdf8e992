"""Pixels by brute force beside derivatives: the paper's figure 6 against the first-order depth error."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from designer.design import VIEW_NAMES, Design
from designer.evaluate.depth import depth_error_map, depth_error_rms, disparity_steps, stereo_pair_of, volume_of
from designer.evaluate.resolution import (
    angular_resolution_px_per_deg,
    azimuthal_resolution_px_per_deg,
    epipolar_lattice,
    image_zones,
    quantisation_error_rms,
    smallest_object,
)
from designer.evaluate.score import ROUNDING_NOISE_PX
from designer.optics.view import image_radius


@pytest.fixture(params=["published", "crossing"])
def design(request) -> Design:
    return request.getfixturevalue(request.param)


def test_resolution_adds_up_to_the_zone(design: Design):
    for name in VIEW_NAMES:
        low, high = getattr(design.views, name).elevation_deg
        pixels, _ = quad(lambda elevation, name=name: angular_resolution_px_per_deg(design, name, elevation), low, high)
        inner, outer = image_zones(design)[name]
        assert pixels == pytest.approx(outer - inner, rel=1e-9)


def test_azimuth_goes_round_the_zone(design: Design):
    for name in VIEW_NAMES:
        ends = azimuthal_resolution_px_per_deg(design, name, getattr(design.views, name).elevation_deg) * 360
        assert sorted(ends) == pytest.approx([2 * np.pi * radius for radius in image_zones(design)[name]], rel=1e-12)


def test_lattice_points_project_onto_pixel_centres(design: Design):
    distance, height = epipolar_lattice(design)
    met = np.isfinite(distance)
    for view in (design.views.upper, design.views.lower):
        slopes = (height - view.viewpoint_mm)[met] / distance[met]
        radii = np.abs(image_radius(slopes, view.gain, design.camera.focal_length_mm, view.sense))
        pixels = radii / design.camera.pixel_pitch_mm - 0.5
        assert np.abs(pixels - np.round(pixels)).max() < 1e-6


def test_neighbours_in_the_lattice_are_one_disparity_step_apart(design: Design):
    pair = stereo_pair_of(design)
    distance, height = epipolar_lattice(design)
    middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2
    slope = (height - middle) / distance
    steps = disparity_steps(pair, slope, distance, design.camera.pixel_pitch_mm)
    both = np.isfinite(distance[1:]) & np.isfinite(distance[:-1]) & (distance[:-1] < 5000)
    assert np.allclose(np.diff(distance, axis=0)[both], steps.lower[:-1][both], rtol=1e-6)
    both = np.isfinite(distance[:, 1:]) & np.isfinite(distance[:, :-1]) & (distance[:, :-1] < 5000)
    assert np.allclose(np.diff(distance, axis=1)[both], steps.upper[:, :-1][both], rtol=1e-6)


def test_lattice_spacing_is_the_first_order_error(design: Design):
    """Half the way from one neighbour to the other, in each view, added in squares: sigma_D at one pixel of noise."""
    distance, height = epipolar_lattice(design)
    middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2
    spacing_lower = (distance[2:, 1:-1] - distance[:-2, 1:-1]) / 2
    spacing_upper = (distance[1:-1, 2:] - distance[1:-1, :-2]) / 2
    at, level = distance[1:-1, 1:-1], (height - middle)[1:-1, 1:-1]
    near, far = design.working_volume.distance_mm
    inside = (at > near) & (at < far)
    assert inside.sum() > 10_000
    brute_force = np.hypot(spacing_lower, spacing_upper)[inside] / at[inside]
    predicted = depth_error_map(
        stereo_pair_of(design), np.arctan(level / at)[inside], at[inside], design.camera.pixel_pitch_mm
    )
    # The spacing of a hyperbola's points exceeds its slope by the square of the relative step.
    assert np.all(np.abs(brute_force / predicted - 1) < 2e-3 + 2 * predicted**2)


def test_rounding_to_pixels_is_the_first_order_error(design: Design):
    first_order = depth_error_rms(
        stereo_pair_of(design), volume_of(design), ROUNDING_NOISE_PX * design.camera.pixel_pitch_mm
    )
    assert quantisation_error_rms(design) == pytest.approx(first_order, rel=0.01)


def test_smallest_object_covers_two_pixels_in_the_coarser_view(design: Design):
    distance = 1500.0
    smallest = smallest_object(design, distance)
    heights, widths = [], []
    for view in (design.views.upper, design.views.lower):
        middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2
        ends = middle + np.array([-0.5, 0.5]) * smallest.height_mm - view.viewpoint_mm
        radii = image_radius(ends / distance, view.gain, design.camera.focal_length_mm, view.sense)
        heights.append(abs(np.diff(radii)[0]) / design.camera.pixel_pitch_mm)
        widths.append(abs(radii.mean()) * smallest.width_mm / distance / design.camera.pixel_pitch_mm)
    assert min(heights) == pytest.approx(2.0, rel=1e-4)
    assert min(widths) == pytest.approx(2.0, rel=1e-4)


def test_unknown_view_is_refused(published: Design):
    with pytest.raises(ValueError, match="side"):
        angular_resolution_px_per_deg(published, "side", 0.0)
