"""Depth errors measured through the tracer, against the first-order formula integrated here on its own."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import Design
from designer.evaluate.depth import depth_error_rms_second_order, stereo_pair_of, volume_of, worst_depth_error
from designer.trace.aiming import project
from designer.verify.montecarlo import depth_error_by_distance, depth_error_monte_carlo
from support.closed_forms import (
    convex_ellipsoid_pair,
    direct_ellipsoid_pair,
    folded_hypl_hy,
    half_tangent,
    paraboloid_pair,
)

DESIGNS = [folded_hypl_hy, convex_ellipsoid_pair, paraboloid_pair, direct_ellipsoid_pair]


def first_order(design: Design, noise_px: float, distances: np.ndarray | None = None) -> float:
    """Root mean square sigma_D / D (docs/theory.md, section 5) by Gauss-Legendre quadrature over the volume.

    The slope of the image radius against elevation is a central difference of the gain law.
    """
    nodes, weights = np.polynomial.legendre.leggauss(32)
    low, high = np.radians(design.working_volume.elevation_deg)
    elevation = (low + high) / 2 + (high - low) / 2 * nodes[:, None]
    near, far = np.log(design.working_volume.distance_mm)
    distance = np.exp((near + far) / 2 + (far - near) / 2 * nodes) if distances is None else distances
    views, camera = design.views, design.camera
    height = (views.upper.viewpoint_mm + views.lower.viewpoint_mm) / 2 + distance * np.tan(elevation)
    terms = []
    for view in (views.upper, views.lower):
        phi = np.arctan((height - view.viewpoint_mm) / distance)

        def radius(angle, view=view):
            t = view.gain * np.tan(np.pi / 4 + (1 if view.sense == "direct" else -1) * angle / 2)
            return camera.focal_length_mm * np.tan(2 * np.arctan(t))

        slope = (radius(phi + 1e-6) - radius(phi - 1e-6)) / 2e-6
        terms.append(noise_px * camera.pixel_pitch_mm / np.abs(slope) / np.cos(phi) ** 2)
    relative = distance / design.baseline_mm * np.hypot(*terms)
    over_distance = weights / 2 if distances is None else np.ones(1)
    return float(np.sqrt(np.sum(weights[:, None] / 2 * over_distance * relative**2)))


@pytest.mark.parametrize("build", DESIGNS, ids=lambda f: f.__name__)
def test_measured_depth_error_agrees_with_first_order(build):
    design = build()
    measured = depth_error_monte_carlo(design, samples=40_000, seed=1, noise_px=0.1)
    assert measured.lost == 0
    assert measured.rms_standard_error < 0.006 * measured.rms
    assert measured.rms == pytest.approx(first_order(design, 0.1), rel=0.02)
    assert abs(measured.relative_errors.mean()) < 0.1 * measured.rms


@pytest.mark.parametrize("build", DESIGNS, ids=lambda f: f.__name__)
def test_measured_depth_error_agrees_with_second_order_where_first_order_fails(build):
    """Noise that makes the worst point uncertain by 0.14 of its distance."""
    design = build()
    pair, volume = stereo_pair_of(design), volume_of(design)
    noise_px = 0.14 / worst_depth_error(pair, volume, design.camera.pixel_pitch_mm)
    noise_mm = noise_px * design.camera.pixel_pitch_mm
    measured = depth_error_monte_carlo(design, samples=200_000, seed=5, noise_px=noise_px)
    assert measured.lost == 0
    assert measured.rms == pytest.approx(depth_error_rms_second_order(pair, volume, noise_mm), rel=0.02)
    assert measured.rms > 1.02 * first_order(design, noise_px)


def test_the_standard_error_is_the_spread_from_seed_to_seed():
    found = [depth_error_monte_carlo(folded_hypl_hy(), samples=1000, seed=seed, noise_px=0.1) for seed in range(60)]
    spread = np.std([one.rms for one in found], ddof=1)
    # Of sixty values a standard deviation is known to a tenth.
    assert np.mean([one.rms_standard_error for one in found]) == pytest.approx(spread, rel=0.3)


def test_measured_depth_error_at_given_distances():
    design = folded_hypl_hy()
    distances = np.array([1000.0, 2200.0, 5000.0])
    measured = depth_error_by_distance(design, distances, samples=40_000, seed=2, noise_px=0.1)
    expected = [first_order(design, 0.1, distances=np.array([distance])) for distance in distances]
    np.testing.assert_allclose(measured, expected, rtol=0.02)


@pytest.mark.parametrize("build", DESIGNS, ids=lambda f: f.__name__)
def test_without_noise_the_depth_is_exact(build):
    measured = depth_error_monte_carlo(build(), samples=500, seed=3, noise_px=1e-9)
    assert measured.lost == 0
    assert np.abs(measured.relative_errors).max() < 1e-8


@pytest.mark.parametrize("build", DESIGNS, ids=lambda f: f.__name__)
def test_projection_obeys_the_gain_law(build):
    design = build()
    random = np.random.default_rng(4)
    near, far = design.working_volume.distance_mm
    distance = random.uniform(near, far, 200)
    for name in ("upper", "lower"):
        view = getattr(design.views, name)
        elevation = random.uniform(*view.elevation_deg, 200)
        psi = project(design, name, distance, view.viewpoint_mm + distance * np.tan(np.radians(elevation)))
        expected = [2 * np.arctan(abs(view.gain) * half_tangent(phi, view.sense)) for phi in elevation]
        np.testing.assert_allclose(psi, expected, atol=1e-11)


def test_the_same_seed_gives_the_same_errors_and_points_out_of_reach_are_counted():
    design = folded_hypl_hy()
    first, again = (depth_error_monte_carlo(design, samples=300, seed=7) for _ in range(2))
    np.testing.assert_array_equal(first.relative_errors, again.relative_errors)
    assert np.isnan(project(design, "upper", [1000.0], [1e7])).all()
