"""The least depth error with lenses that are not r = f tan(psi): a bound at every gain, by brute force."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from designer.evaluate.depth import StereoPair, Volume, depth_error_rms
from designer.evaluate.limit import Arrangement, ImageBounds, depth_error_limit, least_limit_over, limit_gains
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.optics.view import elevation_tangents_of_views, image_radius

NOISE_MM = 0.1 * 0.0044
LAWS = (
    ImageLaw("equidistant"),
    ImageLaw("equisolid"),
    ImageLaw("stereographic"),
    ImageLaw("equidistant", (-0.08, 0.01, -0.004, 0.0003)),
    ImageLaw("perspective", (-0.12, 0.01)),
    ImageLaw("perspective", (0.1, 0.02)),
)
IDS = [f"{law.projection}{list(law.coefficients) or ''}" for law in LAWS]
ARRANGEMENTS = tuple(
    Arrangement(lower, "direct", outer) for lower in ("direct", "folded") for outer in ("lower", "upper")
)
VOLUME = Volume((np.radians(-20.0), np.radians(25.0)), (400.0, 3000.0))


def zones(arrangement: Arrangement, gains: tuple, baseline: float, focal: float, law: ImageLaw) -> dict:
    """Inner and outer image radius of each view."""
    tangents = tuple(np.tan(VOLUME.elevations))
    ranges = elevation_tangents_of_views(tangents, VOLUME.distances, baseline)
    found = {}
    for name, gain, sense, slopes in (
        ("lower", gains[0], arrangement.sense_lower, ranges.lower),
        ("upper", gains[1], arrangement.sense_upper, ranges.upper),
    ):
        radii = np.abs([image_radius(slope, gain, focal, sense, law) for slope in np.linspace(*slopes, 7)])
        found[name] = radii.min(axis=0), radii.max(axis=0)
    return found


@pytest.mark.parametrize("law", LAWS, ids=IDS)
@given(
    arrangement=st.sampled_from(ARRANGEMENTS),
    baseline=st.floats(40, 200),
    share=st.floats(0.3, 0.97),
    gap=st.floats(0, 0.1),
    shares=st.tuples(st.floats(0.05, 1.0), st.floats(0.05, 1.0)),
    scale_uncertainty=st.sampled_from([0.0, 2e-4, 2e-3]),
)
def test_no_smaller_gains_beat_the_limit(law, arrangement, baseline, share, gap, shares, scale_uncertainty):
    # A lens so short that the image circle reaches that share of the law's whole field.
    focal = 2.64 / float(law.ratio(np.tan(share * law.widest / 2.0)))
    bounds = ImageBounds(2.64, gap, law)
    largest = limit_gains(arrangement, VOLUME, baseline, focal, bounds)
    best = largest.lower, largest.upper
    assume(min(best) > 1e-4)
    outer, inner = arrangement.outer_view, "lower" if arrangement.outer_view == "upper" else "upper"
    found = zones(arrangement, best, baseline, focal, law)
    assert found[outer][1] == pytest.approx(2.64, rel=1e-9)
    assert found[inner][1] + gap == pytest.approx(found[outer][0], rel=1e-8)

    limit = depth_error_limit(arrangement, VOLUME, baseline, focal, bounds, NOISE_MM, scale_uncertainty)
    gains = [gain * part for gain, part in zip(best, shares, strict=True)]
    pair = StereoPair(gains[0], arrangement.sense_lower, gains[1], arrangement.sense_upper, baseline, focal, law)
    assert depth_error_rms(pair, VOLUME, NOISE_MM, scale_uncertainty) >= limit * (1.0 - 1e-9)


@pytest.mark.parametrize("law", [*LAWS[:1], *LAWS[2:4], LAWS[5]], ids=[*IDS[:1], *IDS[2:4], IDS[5]])
def test_the_limit_of_noise_is_reached_where_larger_angles_are_the_better(law):
    # (dr/dpsi) sin(psi) rises: c sin(psi) of an equidistant lens, 2 c tan(psi/2) of a stereographic one.
    focal = 2.64 / float(law.ratio(np.tan(0.25)))
    for arrangement in ARRANGEMENTS:
        bounds = ImageBounds(2.64, 0.02, law)
        gains = limit_gains(arrangement, VOLUME, 80.0, focal, bounds)
        pair = StereoPair(gains.lower, arrangement.sense_lower, gains.upper, arrangement.sense_upper, 80.0, focal, law)
        limit = depth_error_limit(arrangement, VOLUME, 80.0, focal, bounds, NOISE_MM)
        assert depth_error_rms(pair, VOLUME, NOISE_MM) == pytest.approx(limit, rel=1e-12)


def test_an_equisolid_lens_is_not_at_its_best_at_the_rim():
    # Beyond 70.5 degrees it resolves elevation ever less: a smaller gain beats the largest, not the limit.
    law, arrangement = ImageLaw("equisolid"), ARRANGEMENTS[0]
    focal = 2.64 / float(law.ratio(np.tan(np.radians(84.0) / 2.0)))
    narrow = Volume((np.radians(-2.0), np.radians(2.0)), (2000.0, 3000.0))
    bounds = ImageBounds(2.64, 0.0, law)
    gains = limit_gains(arrangement, narrow, 60.0, focal, bounds)

    def score(share):
        pair = StereoPair(share * gains.lower, "direct", share * gains.upper, "direct", 60.0, focal, law)
        return depth_error_rms(pair, narrow, NOISE_MM)

    limit = depth_error_limit(arrangement, narrow, 60.0, focal, bounds, NOISE_MM)
    assert score(1.0) > 1.01 * limit
    assert limit <= min(score(share) for share in np.linspace(0.6, 1.0, 200)) < 0.995 * score(1.0)


def test_the_least_limit_of_another_law_is_below_every_other():
    law, random = ImageLaw("equidistant"), np.random.default_rng(3)
    bounds = ImageBounds(2.64, 0.02, law)
    least = least_limit_over(ARRANGEMENTS[3], VOLUME, (40.0, 200.0), (3.0, 8.0), bounds, NOISE_MM, 2e-4)
    baselines, focals = random.uniform(40.0, 200.0, 2000), random.uniform(3.0, 8.0, 2000)
    gains = limit_gains(ARRANGEMENTS[3], VOLUME, baselines, focals, bounds)
    limits = depth_error_limit(ARRANGEMENTS[3], VOLUME, baselines, focals, bounds, NOISE_MM, 2e-4)
    limits = limits[np.minimum(gains.lower, gains.upper) > 0]
    assert least.depth_error_rms <= limits.min() * (1.0 + 1e-12)
    assert least.depth_error_rms == pytest.approx(limits.min(), rel=0.02)


def test_a_fisheye_lens_far_from_its_rim_has_the_limit_of_a_perspective_one():
    focal, arrangement = 150.0, ARRANGEMENTS[2]
    limits = [
        depth_error_limit(arrangement, VOLUME, 80.0, focal, ImageBounds(2.64, 0.0, law), NOISE_MM, 2e-4)
        for law in (PERSPECTIVE, ImageLaw("equidistant"), ImageLaw("equisolid"), ImageLaw("stereographic"))
    ]
    assert limits == pytest.approx([limits[0]] * 4, rel=5e-4)
