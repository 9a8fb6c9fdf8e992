"""No admissible pair of gains beats the closed form, and the closed form is admissible."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from designer.evaluate.depth import StereoPair, Volume, depth_error_rms
from designer.evaluate.limit import (
    ImageBounds,
    arrangement_of,
    depth_error_limit,
    least_limit_over,
    limit_gains,
)
from designer.optics.view import elevation_tangents_of_views, image_radius
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.instrument import build_instrument
from support.shipped_problems import (
    CONFIGURATIONS,
    at,
    design_record,
    is_coherent,
    problems_of,
    put_together,
    random_designs,
    shipped_requirement,
    zones_fit,
)

NOISE_MM = 0.0022
ARRANGEMENTS = [
    arrangement_of(family, topology) for family in ("direct", "folded") for topology in ("upper_outer", "upper_inner")
]
ROBOT = Volume((np.radians(-16.0), np.radians(16.0)), (1000.0, 5000.0))
PIPE = Volume((np.radians(-8.0), np.radians(8.0)), (120.0, 250.0))

volumes = st.builds(
    lambda middle, half, near, ratio: Volume(
        (np.radians(middle - half), np.radians(middle + half)), (near, near * ratio)
    ),
    st.floats(-30, 30),
    st.floats(2, 25),
    st.floats(150, 2000),
    st.floats(1.2, 6),
)


def zones(arrangement, volume, gains, baseline, principal_distance):
    """Image radii (inner, outer) of the outer view and of the inner view, from the gain law alone."""
    slopes = tuple(np.tan(end) for end in volume.elevations)
    ranges = elevation_tangents_of_views(slopes, volume.distances, baseline)
    radii = {}
    for name, ends, gain, sense in (
        ("lower", ranges.lower, gains[0], arrangement.sense_lower),
        ("upper", ranges.upper, gains[1], arrangement.sense_upper),
    ):
        # Every direction in between too, so that nothing hangs on which end is the outer one.
        inside = np.linspace(*ends, 9)
        radius = np.abs([image_radius(slope, gain, principal_distance, sense) for slope in inside])
        radii[name] = radius.min(axis=0), radius.max(axis=0)
    inner_view = "lower" if arrangement.outer_view == "upper" else "upper"
    return radii[arrangement.outer_view], radii[inner_view]


def score(arrangement, volume, gains, baseline, principal_distance):
    pair = StereoPair(
        gains[0], arrangement.sense_lower, gains[1], arrangement.sense_upper, baseline, principal_distance
    )
    return depth_error_rms(pair, volume, NOISE_MM)


@given(
    st.sampled_from(ARRANGEMENTS),
    volumes,
    st.floats(40, 200),
    st.floats(3, 20),
    st.floats(0, 0.1),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.tuples(st.sampled_from([-1, 1]), st.sampled_from([-1, 1])),
)
def test_limit_is_attained_and_never_beaten(arrangement, volume, baseline, principal_distance, gap, shares, signs):
    bounds = ImageBounds(2.64, gap)
    largest = limit_gains(arrangement, volume, baseline, principal_distance, bounds)
    best = largest.lower, largest.upper
    assume(min(best) > 0)
    limit = depth_error_limit(arrangement, volume, baseline, principal_distance, bounds, NOISE_MM)
    outer, inner = zones(arrangement, volume, best, baseline, principal_distance)
    assert outer[1] == pytest.approx(2.64, rel=1e-12)
    assert inner[1] + gap == pytest.approx(outer[0], rel=1e-10)
    # Any other admissible pair, drawn without knowing the closed form: shrink each until it fits.
    gains = [2.0 * gain * share for gain, share in zip(best, shares, strict=True)]
    assume(min(gains) > 1e-6)
    outer, inner = zones(arrangement, volume, gains, baseline, principal_distance)
    admissible = outer[0] > 0 and outer[1] <= 2.64 and inner[1] <= outer[0] - gap
    if admissible:
        signed = [gain * sign for gain, sign in zip(gains, signs, strict=True)]
        assert score(arrangement, volume, signed, baseline, principal_distance) >= limit * (1 - 1e-12)


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
@pytest.mark.parametrize(("volume", "baseline", "principal_distance"), [(ROBOT, 100.0, 12.0), (PIPE, 120.0, 6.0)])
def test_limit_against_every_pair_of_gains_on_a_grid(arrangement, volume, baseline, principal_distance):
    gap = 0.04
    axis = np.linspace(0.001, 0.4, 600)
    gains = np.meshgrid(axis, axis)
    outer, inner = zones(arrangement, volume, gains, baseline, principal_distance)
    # A gain that turns a ray past 90 degrees folds its image radius back.
    in_front = np.maximum(*gains) < 0.3
    admissible = in_front & (outer[1] <= 2.64) & (inner[1] <= outer[0] - gap)
    scores = np.where(admissible, score(arrangement, volume, gains, baseline, principal_distance), np.inf)
    bounds = ImageBounds(2.64, gap)
    limit = depth_error_limit(arrangement, volume, baseline, principal_distance, bounds, NOISE_MM)
    assert limit <= scores.min() <= 1.03 * limit


def test_least_limit_is_below_every_other():
    generator = np.random.default_rng(11)
    baselines, principal_distances = (40.0, 400.0), (6.0, 16.0)
    for arrangement in ARRANGEMENTS:
        for volume in (ROBOT, PIPE):
            bounds = ImageBounds(2.64, 0.02)
            least = least_limit_over(arrangement, volume, baselines, principal_distances, bounds, NOISE_MM)
            baseline, focal = (generator.uniform(*ends, 5000) for ends in (baselines, principal_distances))
            gains = limit_gains(arrangement, volume, baseline, focal, bounds)
            has_room = np.minimum(gains.lower, gains.upper) > 0
            limits = depth_error_limit(arrangement, volume, baseline, focal, bounds, NOISE_MM)[has_room]
            assert least.depth_error_rms <= limits.min()
            assert least.depth_error_rms == pytest.approx(limits.min(), rel=0.02)
            here = depth_error_limit(
                arrangement, volume, least.baseline_mm, least.principal_distance_mm, bounds, NOISE_MM
            )
            assert here == pytest.approx(least.depth_error_rms, rel=1e-12)


def test_least_limit_of_single_values_is_the_limit():
    bounds = ImageBounds(2.64, 0.0)
    least = least_limit_over(ARRANGEMENTS[2], ROBOT, (100.0, 100.0), (12.0, 12.0), bounds, NOISE_MM)
    limit = depth_error_limit(ARRANGEMENTS[2], ROBOT, 100.0, 12.0, bounds, NOISE_MM)
    assert least.depth_error_rms == pytest.approx(limit, rel=1e-12)


def test_without_an_envelope_there_is_a_best_baseline():
    """A longer baseline gains parallax but widens the range of elevations that each view has to hold."""
    arrangement, bounds = arrangement_of("folded", "upper_outer"), ImageBounds(2.64)
    least = least_limit_over(arrangement, ROBOT, (20.0, 8000.0), (12.0, 12.0), bounds, NOISE_MM)
    assert 3000 < least.baseline_mm < 3500
    beside = least.baseline_mm * np.array([0.97, 1.03])
    assert np.all(depth_error_limit(arrangement, ROBOT, beside, 12.0, bounds, NOISE_MM) > least.depth_error_rms)


def test_no_room_is_an_error():
    with pytest.raises(ValueError, match="leave no space for the inner zone"):
        least_limit_over(ARRANGEMENTS[0], ROBOT, (50.0, 100.0), (12.0, 12.0), ImageBounds(2.64, 2.6), NOISE_MM)


@pytest.mark.parametrize("configuration", CONFIGURATIONS.values(), ids=CONFIGURATIONS)
def test_the_arrangement_is_what_traced_rays_see(configuration):
    """Of a random design: which view lies farther out in the image, and whether its elevation rises outwards."""
    requirement, problem, values = design_with_both_zones(configuration)
    design = design_record(requirement, problem, values)
    scene, widest = build_instrument(design), widest_pinhole_angle(design)
    arrangement = arrangement_of(configuration.family, configuration.topology)
    psi = {}
    for name, sense in (("lower", arrangement.sense_lower), ("upper", arrangement.sense_upper)):
        view = getattr(design.views, name)
        psi[name] = pinhole_angles(scene, scene.path(view.path), np.radians(view.elevation_deg), widest)
        assert (psi[name][0] < psi[name][1]) == (sense == "direct")
    inner_view = "lower" if arrangement.outer_view == "upper" else "upper"
    assert psi[arrangement.outer_view].min() > psi[inner_view].max()


def design_with_both_zones(configuration):
    """A random design that the formulas hold for, its zones apart in the image: requirement, problem, variables."""
    for name in ("pipe_inspection", "sky_watch"):
        for problem in problems_of(shipped_requirement(name), configuration):
            values = random_designs(problem, 1000, seed=6)
            system = put_together(problem, values)
            with np.errstate(all="ignore"):
                kept = np.flatnonzero(is_coherent(system) & zones_fit(system))
            if kept.size:
                return shipped_requirement(name), problem, at(values, kept[0])
    raise AssertionError("no random design has both zones in the image")
