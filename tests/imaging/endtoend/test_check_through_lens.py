"""The check through a design's own lens: what studies find passes and keeps a pinhole's points; a blurred one fails."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import read_design
from designer.imaging.endtoend.bands import LARGEST_BIAS, LARGEST_BIAS_SIGMAS
from designer.imaging.endtoend.check import CheckOptions, EndToEndCheck, check_with_control
from designer.imaging.endtoend.description import describe_comparison, summarise_comparison
from designer.imaging.stereo.matching import MatchOutcome
from support import DATA
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels

COARSER = 2
SCENES = {"indoor_robot": "office", "pipe_inspection": "pipe", "ceiling_watch": "hall", "sky_watch": "sky"}
WINNERS = {name.split(":")[0]: name for name in reversed(SHARP_NAMES)}.values()
LEAST_KEPT_OF_PINHOLE = 0.95


@pytest.mark.slow
@pytest.mark.parametrize("name", WINNERS)
def test_winners_pass_and_keep_what_a_pinhole_keeps(name: str) -> None:
    checks = check_with_control(sharp_design(name))
    assert checks.kept_of_pinhole is not None
    assert checks.kept_of_pinhole >= LEAST_KEPT_OF_PINHOLE, describe_comparison(checks)
    for check in (checks.lens, checks.pinhole):
        assert_it_passes_everywhere(check, name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed"), [(name, number % 3) for number, name in enumerate(SHARP_NAMES) if name not in WINNERS]
)
def test_every_family_folding_pair_and_sign_of_gain_does(name: str, seed: int) -> None:
    """Over pixels twice as large, a quarter of the work: blur as an angle is the same.

    Through a pinhole such pixels fold fine texture down; the lens takes it away and so keeps more.
    """
    design = with_coarse_pixels(sharp_design(name), COARSER)
    checks = check_with_control(design, CheckOptions(seed=seed))
    assert checks.kept_of_pinhole is not None
    assert checks.kept_of_pinhole >= LEAST_KEPT_OF_PINHOLE, describe_comparison(checks)
    assert_it_passes_everywhere(checks.lens, name)
    for band in checks.lens.bands:
        assert abs(band.bias) <= max(LARGEST_BIAS, LARGEST_BIAS_SIGMAS * band.predicted / COARSER)


def assert_it_passes_everywhere(check: EndToEndCheck, name: str) -> None:
    """In all four bands, in the scene of its requirement, and with numbers that agree with each other."""
    assert check.passed, name
    assert check.untested == ()
    assert check.scene == SCENES[name.split(":")[0]]
    # What is measured is the noise of matching, not of the pixels: a fraction of a pixel for rich texture.
    assert 0.01 < check.noise.summary["median"] < 0.2
    kept = check.both_see & (check.matches.outcomes == MatchOutcome.KEPT)
    assert check.points == kept.sum()
    np.testing.assert_array_equal(np.isfinite(check.relative_error[kept]), True)
    np.testing.assert_allclose(
        check.matches.distances_mm[kept], (check.true_distance_mm * (1 + check.relative_error))[kept], rtol=1e-5
    )


@pytest.mark.slow
def test_the_prototype_focused_at_infinity_is_told_that_it_is_blurred() -> None:
    checks = check_with_control(with_coarse_pixels(read_design(DATA / "folded_hypl_hy.json"), COARSER))
    assert checks.pinhole.passed
    assert not checks.lens.passed
    assert checks.kept_of_pinhole is not None
    assert checks.kept_of_pinhole < 0.2
    *_, last = describe_comparison(checks).splitlines()
    assert last.startswith("geometry passed, through the lens FAILED")
    assert not summarise_comparison(checks)["passed"]
