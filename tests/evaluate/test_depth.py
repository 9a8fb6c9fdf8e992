"""The depth error against sampling, its quadrature against a fine one, and its symmetries."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.evaluate.depth import (
    StereoPair,
    Volume,
    depth_error_map,
    depth_error_rms,
    disparity_steps,
    point_covariance,
    slopes_of_point,
    worst_depth_error,
)
from designer.optics.view import (
    elevation_tangent,
    elevation_tangents_of_views,
    half_angle_tangent,
    image_half_tangent,
    image_radius,
)

ROBOT = StereoPair(0.046, "folded", 0.11, "direct", 100.0, 12.0)
ROBOT_VOLUME = Volume((np.radians(-16.0), np.radians(16.0)), (1000.0, 5000.0))
SHIPPED_VOLUMES = [  # baseline, elevations in degrees, distances
    (100.0, (-16.0, 16.0), (1000.0, 5000.0)),
    (120.0, (-8.0, 8.0), (120.0, 250.0)),
    (60.0, (-50.0, -10.0), (1000.0, 5000.0)),
    (60.0, (10.0, 50.0), (1000.0, 5000.0)),
]
PAIRS = [
    ROBOT,
    StereoPair(-0.06, "folded", 0.11, "direct", 100.0, 12.0),
    StereoPair(0.07, "direct", -0.12, "direct", 80.0, 8.0),
    StereoPair(-0.05, "folded", -0.13, "direct", 150.0, 6.0),
]


def random_requirements(count: int):
    """Pairs that fit an image circle of 2.64 mm, with the volumes that they serve, near and far."""
    generator = np.random.default_rng(20)
    for index in range(count):
        if index % 3 == 0:
            baseline, elevations_deg, distances = SHIPPED_VOLUMES[index // 3 % len(SHIPPED_VOLUMES)]
        else:
            baseline = generator.uniform(30, 200)
            nearest = generator.uniform(1, 3) * baseline if index % 3 == 1 else generator.uniform(300, 2000)
            distances = (nearest, nearest * generator.uniform(1.2, 8))
            middle, half = generator.uniform(-30, 30), generator.uniform(3, 30)
            elevations_deg = (middle - half, middle + half)
        low, high = np.radians(elevations_deg)
        principal_distance = generator.uniform(4, 20)
        ranges = elevation_tangents_of_views((np.tan(low), np.tan(high)), distances, baseline)
        senses = generator.choice(["direct", "folded"], 2)
        gains = [
            generator.uniform(0.1, 1)
            * image_half_tangent(2.64, principal_distance)
            / max(half_angle_tangent(end, sense) for end in ends)
            for sense, ends in zip(senses, (ranges.upper, ranges.lower), strict=True)
        ]
        pair = StereoPair(gains[1], senses[1], gains[0], senses[0], baseline, principal_distance)
        yield pair, Volume((low, high), distances)


def fine_score(pair: StereoPair, volume: Volume) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(64)
    nodes, weights = (nodes + 1) / 2, weights / 2
    elevations = volume.elevations[0] + np.diff(volume.elevations) * nodes
    distances = np.exp(np.log(volume.distances[0]) + np.diff(np.log(volume.distances)) * nodes)
    errors = depth_error_map(pair, elevations[:, None], distances, 0.0022)
    return float(np.sqrt(weights @ errors**2 @ weights))


def test_quadrature_holds_a_thousandth():
    errors = [
        abs(depth_error_rms(pair, volume, 0.0022) / fine_score(pair, volume) - 1)
        for pair, volume in random_requirements(600)
    ]
    assert max(errors) < 5e-5


@pytest.mark.parametrize("elevations_deg", [(-70, 70), (-10, 70), (-60, 60), (20, 65)])
@pytest.mark.parametrize("distances", [(120.0, 250.0), (1000.0, 5000.0), (500.0, 15_000.0)])
@pytest.mark.parametrize("sense_lower", ["direct", "folded"])
def test_quadrature_holds_a_thousandth_of_steep_and_deep_volumes(elevations_deg, distances, sense_lower):
    volume = Volume(tuple(np.radians(elevations_deg)), distances)
    pair = StereoPair(0.02, sense_lower, 0.035, "direct", 100.0, 6.0)
    assert depth_error_rms(pair, volume, 0.0022) == pytest.approx(fine_score(pair, volume), rel=1e-3)


def test_score_is_the_plain_average_of_random_points():
    generator = np.random.default_rng(3)
    elevations = generator.uniform(*ROBOT_VOLUME.elevations, 200_000)
    distances = np.exp(generator.uniform(*np.log(ROBOT_VOLUME.distances), 200_000))
    sampled = np.sqrt(np.mean(depth_error_map(ROBOT, elevations, distances, 0.0022) ** 2))
    assert depth_error_rms(ROBOT, ROBOT_VOLUME, 0.0022) == pytest.approx(sampled, rel=0.01)


def test_symbols_and_arrays_of_designs_give_the_same_score():
    names = ("gain_lower", "gain_upper", "baseline", "principal_distance", "low", "high", "near", "far")
    lower, upper, baseline, focal, low, high, near, far = symbols = [casadi.SX.sym(name) for name in names]
    pair = StereoPair(lower, "folded", upper, "direct", baseline, focal)
    score = casadi.Function("score", symbols, [depth_error_rms(pair, Volume((low, high), (near, far)), 0.0022)])
    generator = np.random.default_rng(5)
    count = 40
    gains = generator.uniform(0.03, 0.12, (2, count))
    baselines = generator.uniform(50, 200, count)
    many = StereoPair(gains[0], "folded", gains[1], "direct", baselines, 12.0)
    together = depth_error_rms(many, ROBOT_VOLUME, 0.0022)
    assert together.shape == (count,)
    for index in range(count):
        values = (*gains[:, index], baselines[index], 12.0, *ROBOT_VOLUME.elevations, *ROBOT_VOLUME.distances)
        assert float(score(*values)) == pytest.approx(together[index], rel=1e-12)


@given(st.floats(0.01, 100), st.floats(0.01, 100), st.sampled_from(PAIRS))
def test_score_has_no_unit(scene_scale: float, sensor_scale: float, pair: StereoPair):
    scaled_pair = StereoPair(
        -pair.gain_lower,
        pair.sense_lower,
        -pair.gain_upper,
        pair.sense_upper,
        pair.baseline * scene_scale,
        pair.principal_distance * sensor_scale,
    )
    near, far = ROBOT_VOLUME.distances
    scaled_volume = Volume(ROBOT_VOLUME.elevations, (near * scene_scale, far * scene_scale))
    scaled = depth_error_rms(scaled_pair, scaled_volume, 0.0022 * sensor_scale)
    assert scaled == pytest.approx(depth_error_rms(pair, ROBOT_VOLUME, 0.0022), rel=1e-12)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize(("elevation_deg", "distance"), [(-20.0, 300.0), (5.0, 900.0), (30.0, 2000.0)])
def test_covariance_against_noisy_image_points(pair: StereoPair, elevation_deg: float, distance: float):
    """Two noisy image points, back through the gain law, intersected: no derivative is used."""
    noise, count = 2e-5, 200_000
    generator = np.random.default_rng(7)
    slope = np.tan(np.radians(elevation_deg))
    measured_slopes, unit_vectors, weights = [], [], []
    seen_at = slopes_of_point(slope, distance, pair.baseline)
    for gain, sense, true_slope in (
        (pair.gain_lower, pair.sense_lower, seen_at.lower),
        (pair.gain_upper, pair.sense_upper, seen_at.upper),
    ):
        radius = image_radius(true_slope, gain, pair.principal_distance, sense)
        point = np.stack([radius + noise * generator.normal(size=count), noise * generator.normal(size=count)])
        seen = np.hypot(*point)
        measured_slopes.append(elevation_tangent(image_half_tangent(seen, pair.principal_distance) / abs(gain), sense))
        unit_vectors.append(np.arctan2(*(np.sign(gain) * point)[::-1]))
        weights.append(radius**2)
    lower, upper = measured_slopes
    distances = pair.baseline / (lower - upper)
    heights = distances * (lower + upper) / 2
    azimuths = np.average(unit_vectors, axis=0, weights=weights)
    sampled = np.cov(np.stack([distances, heights, azimuths]))
    predicted = point_covariance(pair, slope, distance, noise)
    scale = np.sqrt(np.diagonal(predicted))
    assert np.allclose(sampled / np.outer(scale, scale), predicted / np.outer(scale, scale), atol=0.015)
    relative = depth_error_map(pair, np.radians(elevation_deg), distance, noise)
    assert scale[0] / distance == pytest.approx(float(relative), rel=1e-12)


@pytest.mark.parametrize("pair", PAIRS)
def test_disparity_step_is_one_pixel(pair: StereoPair):
    pitch = 0.0044
    elevation_slope, distance = 0.2, np.array([400.0, 800.0, 1500.0])
    slopes = slopes_of_point(elevation_slope, distance, pair.baseline)
    step = disparity_steps(pair, elevation_slope, distance, pitch)
    assert np.all(step.lower > 0)
    assert np.all(step.upper > 0)
    moved_lower = slopes.upper + pair.baseline / (distance + step.lower)
    moved_upper = slopes.lower - pair.baseline / (distance + step.upper)
    for slope, moved, gain, sense in (
        (slopes.lower, moved_lower, pair.gain_lower, pair.sense_lower),
        (slopes.upper, moved_upper, pair.gain_upper, pair.sense_upper),
    ):
        radii = [image_radius(value, gain, pair.principal_distance, sense) for value in (slope, moved)]
        assert np.abs(radii[1] - radii[0]) == pytest.approx(pitch, rel=1e-9)


def test_disparity_step_is_infinite_beyond_the_last_disparity():
    assert np.isinf(disparity_steps(ROBOT, 0.0, 1e6, 0.0044).lower)


@given(st.floats(0, 1), st.floats(0, 1), st.sampled_from(PAIRS))
def test_nothing_in_the_volume_is_worse_than_the_worst(across: float, away: float, pair: StereoPair):
    low, high = ROBOT_VOLUME.elevations
    near, far = ROBOT_VOLUME.distances
    error = depth_error_map(pair, low + (high - low) * across, near * (far / near) ** away, 0.0022)
    assert error <= worst_depth_error(pair, ROBOT_VOLUME, 0.0022) * (1 + 1e-9)
