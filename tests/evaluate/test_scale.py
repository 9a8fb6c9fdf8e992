"""An error of the image's scale: against the gain law, the tracer, and what the depth error makes of it."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
import sympy as sp

from designer.design import Design
from designer.evaluate.depth import (
    StereoPair,
    Volume,
    depth_error_map,
    depth_error_rms,
    depth_error_rms_second_order,
    depth_shift_per_scale,
    depth_shift_per_scale_rms,
    noise_mm_of,
    slopes_of_point,
    stereo_pair_of,
    volume_grid,
    volume_of,
    worst_depth_error,
    worst_depth_shift_per_scale,
)
from designer.evaluate.limit import ImageBounds, arrangement_of, depth_error_limit, limit_gains
from designer.evaluate.scale import relative_depth_shift_per_scale, slope_shift_per_scale
from designer.evaluate.score import depth_score
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius
from designer.trace.aiming import exit_lines, project
from designer.trace.instrument import build_instrument
from designer.verify.montecarlo import depth_error_monte_carlo
from support.closed_forms import direct_ellipsoid_pair, folded_hypl_hy
from support.studied_designs import NAMES, studied_design

ROBOT = StereoPair(0.046, "folded", 0.11, "direct", 100.0, 12.0)
ROBOT_VOLUME = Volume((np.radians(-16.0), np.radians(16.0)), (1000.0, 5000.0))
PIPE_VOLUME = Volume((np.radians(-8.0), np.radians(8.0)), (120.0, 250.0))
PAIRS = [
    ROBOT,
    StereoPair(-0.06, "folded", 0.11, "direct", 100.0, 12.0),
    StereoPair(0.07, "direct", -0.12, "direct", 80.0, 8.0),
    StereoPair(-0.05, "folded", -0.13, "direct", 150.0, 6.0),
]


def traced_depths(design: Design, distances: np.ndarray, elevations: np.ndarray, scale: float) -> np.ndarray:
    """Distances that a camera measures whose principal distance is ``scale`` times the one that the rays are read by.

    Nothing but the traced mirrors is used.
    """
    principal_distance, instrument = design.camera.focal_length_mm, build_instrument(design)
    heights = design.views.middle_mm + distances * np.tan(elevations)
    lines = {}
    for name, view in design.views.by_name.items():
        radius = scale * principal_distance * np.tan(project(design, name, distances, heights))
        read_as = np.arctan2(radius, principal_distance)
        (start_x, start_z), (ahead_x, ahead_z) = exit_lines(instrument, instrument.path(view.path), read_as)
        lines[name] = start_z - ahead_z / ahead_x * start_x, np.sign(view.gain) * ahead_z / ahead_x
    return (lines["upper"][0] - lines["lower"][0]) / (lines["lower"][1] - lines["upper"][1])


@pytest.mark.parametrize("name", NAMES)
def test_the_depth_shift_is_what_the_tracer_finds(name: str) -> None:
    design, step = studied_design(name), 1e-5
    pair = stereo_pair_of(design)
    grid = np.broadcast_arrays(*volume_grid(volume_of(design), 9, 5))
    elevations, distances = (axis.ravel() for axis in grid)
    larger, smaller = (traced_depths(design, distances, elevations, 1.0 + sign * step) for sign in (1.0, -1.0))
    traced = (larger - smaller) / (2.0 * step * distances)
    closed_form = depth_shift_per_scale(pair, np.tan(elevations), distances)
    # What the difference leaves out is of third order: (shift x step)^2, at most 7e-6.
    np.testing.assert_allclose(traced, closed_form, atol=1e-5 * np.abs(closed_form).max())


@pytest.mark.parametrize("sense", ["direct", "folded"])
def test_the_slope_shift_is_the_radius_over_its_slope(sense: str) -> None:
    """r / (dr/dm), differentiated symbolically, at random directions and gains of either sign."""
    slope, gain = sp.symbols("m kappa", real=True)
    tangent = gain * (sp.sqrt(1 + slope**2) + (slope if sense == "direct" else -slope))
    radius = 2 * tangent / (1 - tangent**2)
    shift = sp.lambdify((slope, gain), radius / sp.diff(radius, slope))
    generator = np.random.default_rng(2)
    slopes, gains = (
        generator.uniform(-1.5, 1.5, 200),
        generator.choice([-1, 1], 200) * generator.uniform(0.01, 0.2, 200),
    )
    np.testing.assert_allclose(slope_shift_per_scale(slopes, gains, sense), shift(slopes, gains), rtol=1e-12)


@pytest.mark.parametrize("pair", PAIRS)
def test_the_depth_shift_is_a_finite_difference_of_the_gain_law(pair: StereoPair) -> None:
    elevation_slope, distance, step = np.array([-0.4, 0.0, 0.3])[:, None], np.array([300.0, 2000.0]), 1e-5
    seen = slopes_of_point(elevation_slope, distance, pair.baseline)
    views = (
        (seen.lower, pair.gain_lower, pair.sense_lower),
        (seen.upper, pair.gain_upper, pair.sense_upper),
    )
    measured = []
    for scale in (1.0 + step, 1.0 - step):
        lower, upper = (
            elevation_tangent(
                image_half_tangent(
                    scale * image_radius(slope, gain, pair.principal_distance, sense), pair.principal_distance
                )
                / gain,
                sense,
            )
            for slope, gain, sense in views
        )
        measured.append(pair.baseline / (lower - upper))
    difference = (measured[0] - measured[1]) / (2.0 * step * distance)
    np.testing.assert_allclose(depth_shift_per_scale(pair, elevation_slope, distance), difference, rtol=1e-6)


def test_two_equal_views_of_the_horizon_of_a_narrow_image_do_not_shift() -> None:
    """At psi = 0 a direct view shifts by epsilon sqrt(1 + m^2): two of them shift alike where they look alike."""
    assert relative_depth_shift_per_scale(0.1, -0.1, 1e-9, "direct", 1e-9, "direct") == pytest.approx(0.0, abs=1e-12)
    # A folded one shifts the other way: 2 sqrt(1 + m^2) / (m_l - m_u) in all.
    folded = relative_depth_shift_per_scale(0.1, -0.1, 1e-9, "folded", 1e-9, "direct")
    assert folded == pytest.approx(2.0 * np.sqrt(1.01) / 0.2, rel=1e-12)


def test_sizes_of_the_shipped_requirements() -> None:
    """0.1 percent of scale shifts the depth by percents if one view is folded, and by a tenth of that near field."""

    def of(name: str) -> tuple[float, float]:
        design = studied_design(name)
        pair, volume = stereo_pair_of(design), volume_of(design)
        return float(depth_shift_per_scale_rms(pair, volume)), worst_depth_shift_per_scale(pair, volume)

    # 2 D / b within a few percent, at the root of the mean D^2 = (far^2 - near^2) / (2 ln(far / near)).
    robot = 2.0 * np.sqrt((5000.0**2 - 1000.0**2) / (2.0 * np.log(5.0))) / 100.0
    assert of("indoor_robot:folded-HyPl-Hy-upper_outer")[0] == pytest.approx(robot, rel=0.03)
    assert of("indoor_robot:folded-HyPl-Hy-upper_outer")[1] == pytest.approx(2.0 * 5000.0 / 100.0, rel=0.05)
    assert of("pipe_inspection:folded-HyHy-Hy-upper_outer")[0] == pytest.approx(3.16, rel=0.01)
    assert of("ceiling_watch:folded-HyEl-Hy-upper_outer")[0] > 100.0 * of("ceiling_watch:direct-ElEl-upper_inner")[0]
    assert of("ceiling_watch:direct-ElEl-upper_inner")[1] < 2.0


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("volume", [ROBOT_VOLUME, PIPE_VOLUME])
def test_noise_and_scale_add_in_squares(pair: StereoPair, volume: Volume) -> None:
    noise, scale = 0.0022, 2e-4
    alone = depth_error_rms(pair, volume, noise)
    both = depth_error_rms(pair, volume, noise, scale)
    assert both == pytest.approx(np.hypot(alone, scale * depth_shift_per_scale_rms(pair, volume)), rel=1e-12)
    assert depth_error_rms(pair, volume, noise, 0.0) == alone
    elevations, distances = volume_grid(volume)
    shift = depth_shift_per_scale(pair, np.tan(elevations), distances)
    everywhere = np.hypot(depth_error_map(pair, elevations, distances, noise), scale * shift)
    np.testing.assert_allclose(depth_error_map(pair, elevations, distances, noise, scale), everywhere, rtol=1e-12)
    assert worst_depth_error(pair, volume, noise, scale) == pytest.approx(everywhere.max(), rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_quadrature_of_the_shift_holds_a_thousandth(name: str) -> None:
    design = studied_design(name)
    pair, volume = stereo_pair_of(design), volume_of(design)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    nodes, weights = (nodes + 1) / 2, weights / 2
    elevations = volume.elevations[0] + np.diff(volume.elevations) * nodes
    distances = np.exp(np.log(volume.distances[0]) + np.diff(np.log(volume.distances)) * nodes)
    shifts = depth_shift_per_scale(pair, np.tan(elevations)[:, None], distances)
    fine = np.sqrt(weights @ shifts**2 @ weights)
    assert depth_shift_per_scale_rms(pair, volume) == pytest.approx(fine, rel=1e-3)


def test_symbols_and_arrays_of_designs_give_the_same() -> None:
    lower, upper, baseline, scale = symbols = [casadi.SX.sym(name) for name in ("lower", "upper", "baseline", "scale")]
    pair = StereoPair(lower, "folded", upper, "direct", baseline, 12.0)
    function = casadi.Function("score", symbols, [depth_error_rms(pair, ROBOT_VOLUME, 0.0022, scale)])
    generator = np.random.default_rng(5)
    gains, baselines = generator.uniform(0.03, 0.12, (2, 30)), generator.uniform(50, 200, 30)
    for uncertainty in (0.0, 3e-4):
        many = StereoPair(gains[0], "folded", gains[1], "direct", baselines, 12.0)
        together = depth_error_rms(many, ROBOT_VOLUME, 0.0022, uncertainty)
        one_by_one = [float(function(*gains[:, index], baselines[index], uncertainty)) for index in range(30)]
        np.testing.assert_allclose(one_by_one, together, rtol=1e-12)


@pytest.mark.parametrize("topology", ["upper_outer", "upper_inner"])
@pytest.mark.parametrize("family", ["direct", "folded"])
@pytest.mark.parametrize(
    ("volume", "baseline", "principal_distance"), [(ROBOT_VOLUME, 100.0, 12.0), (PIPE_VOLUME, 120.0, 6.0)]
)
@pytest.mark.parametrize("scale", [2e-4, 1e-2])
def test_no_smaller_gains_beat_the_limit(family, topology, volume, baseline, principal_distance, scale) -> None:
    """Also where the scale matters more than the noise."""
    arrangement, bounds = arrangement_of(family, topology), ImageBounds(2.64, 0.02)
    at = (arrangement, volume, baseline, principal_distance, bounds)
    limit = depth_error_limit(*at, 0.0022, scale)
    largest = limit_gains(*at)
    shares = np.meshgrid(np.linspace(0.05, 1.0, 40), np.linspace(0.05, 1.0, 40))
    pair = StereoPair(
        largest.lower * shares[0],
        arrangement.sense_lower,
        largest.upper * shares[1],
        arrangement.sense_upper,
        baseline,
        principal_distance,
    )
    errors = depth_error_rms(pair, volume, 0.0022, scale)
    assert errors.min() >= limit * (1 - 1e-12)
    if family == "folded":
        assert errors.min() == pytest.approx(limit, rel=1e-12)
    else:
        assert limit == depth_error_limit(*at, 0.0022)


@pytest.mark.parametrize("build", [folded_hypl_hy, direct_ellipsoid_pair], ids=lambda f: f.__name__)
def test_depths_traced_with_an_uncertain_scale(build) -> None:
    """As many random scales as points, through the tracer, to second order."""
    design = build().model_copy(update={"scale_uncertainty": 3e-4})
    pair, volume = stereo_pair_of(design), volume_of(design)
    measured = depth_error_monte_carlo(design, samples=40_000, seed=4)
    predicted = depth_error_rms_second_order(pair, volume, noise_mm_of(design), design.scale_uncertainty)
    assert measured.rms == pytest.approx(predicted, rel=0.02)


def test_the_score_counts_the_scale_that_a_design_records() -> None:
    design = folded_hypl_hy()
    without, with_scale = depth_score(design), depth_score(design.model_copy(update={"scale_uncertainty": 2e-4}))
    pair, volume = stereo_pair_of(design), volume_of(design)
    assert design.scale_uncertainty == 0.0
    assert without.depth_error_rms == float(depth_error_rms(pair, volume, noise_mm_of(design)))
    assert without.depth_shift_per_scale == with_scale.depth_shift_per_scale
    systematic = 2e-4 * with_scale.depth_shift_per_scale
    assert with_scale.depth_error_rms == pytest.approx(np.hypot(without.depth_error_rms, systematic), rel=1e-12)
    assert 1.0 <= with_scale.limit_ratio < without.limit_ratio
