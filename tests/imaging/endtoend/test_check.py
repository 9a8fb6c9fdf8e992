"""The end-to-end check through a pinhole: designs that are right pass, systems that are wrong fail."""

import numpy as np
import pytest

from designer.design import Design
from designer.imaging.endtoend import description
from designer.imaging.endtoend.bands import LARGEST_BIAS, LARGEST_BIAS_SIGMAS
from designer.imaging.endtoend.check import CheckOptions, EndToEndCheck, check_design
from designer.imaging.endtoend.description import definition_of_passing, describe_check, summarise_check
from designer.imaging.stereo.matching import MatchOutcome
from support.studied_designs import NAMES, studied_design, with_coarse_pixels

PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"
# The winner of each shipped requirement comes first. These see the near half of the pipe just finely enough for its
# texture: with larger pixels too little is kept.
NEEDS_ITS_PIXELS = (
    "pipe_inspection:folded-PlEl-El-upper_inner",
    "pipe_inspection:folded-HyHy-El-upper_inner",
    "pipe_inspection:folded-PlHy-El-upper_inner",
)
AS_THEY_ARE = {name: number % 3 for number, name in enumerate(NAMES) if number < 4 or name in NEEDS_ITS_PIXELS}
OVER_LARGER_PIXELS = {name: number % 3 for number, name in enumerate(NAMES) if name not in AS_THEY_ARE}
COARSER = 2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), AS_THEY_ARE.items())
def test_the_winners_pass_and_two_that_need_their_pixels(name: str, seed: int) -> None:
    check = check_design(studied_design(name), CheckOptions(lens=None, seed=seed))
    assert_it_passes_everywhere(check, name)
    # What is measured is the noise of matching, not of the pixels: a fraction of a pixel for rich texture.
    assert 0.01 < check.noise.summary["median"] < 0.2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), OVER_LARGER_PIXELS.items())
def test_the_other_kinds_pass(name: str, seed: int) -> None:
    """Over pixels twice as large, a quarter of the work, and with no more bias than the design's own would allow."""
    check = check_design(with_coarse_pixels(studied_design(name), COARSER), CheckOptions(lens=None, seed=seed))
    assert_it_passes_everywhere(check, name)
    assert 0.01 < check.noise.summary["median"] < 0.2
    for band in check.bands:
        assert abs(band.bias) <= max(LARGEST_BIAS, LARGEST_BIAS_SIGMAS * band.predicted / COARSER)


def assert_it_passes_everywhere(check: EndToEndCheck, name: str) -> None:
    """In all four bands, in the scene of its requirement, and with numbers that agree with each other."""
    assert check.passed, describe_check(check)
    assert sum(band.is_judged for band in check.bands) == 4
    assert check.scene == {"indoor": "office", "pipe": "pipe", "ceiling": "hall", "sky": "sky"}[name.split("_")[0]]
    kept = check.both_see & (check.matches.outcomes == MatchOutcome.KEPT)
    np.testing.assert_array_equal(np.isfinite(check.relative_error[kept]), True)
    np.testing.assert_allclose(
        check.matches.distances_mm[kept], (check.true_distance_mm * (1 + check.relative_error))[kept], rtol=1e-5
    )


@pytest.mark.slow
def test_a_system_built_wrongly_fails_by_its_bias() -> None:
    design = studied_design(PROTOTYPE)
    mirrors = tuple(
        mirror.model_copy(update={"vertex_mm": mirror.vertex_mm + 0.25}) if mirror.name == "direct" else mirror
        for mirror in design.mirrors
    )
    check = check_design(
        design, CheckOptions(lens=None, samples=1, built=design.model_copy(update={"mirrors": mirrors}))
    )
    assert not check.passed
    assert any("bias" in band.problems for band in check.bands)


@pytest.mark.slow
def test_a_repetitive_texture_deceives_matching_and_the_check_says_so() -> None:
    check = check_design(studied_design(PROTOTYPE), CheckOptions(lens=None, samples=1, texture="repetitive"))
    assert not check.passed
    assert describe_check(check).endswith("FAILED")


@pytest.mark.slow
def test_a_wall_of_known_distance_is_measured_as_predicted() -> None:
    design: Design = studied_design(PROTOTYPE)
    check = check_design(design, CheckOptions(lens=None, scene="cylinder", samples=1, seed=7))
    # The wall stands where two bands meet.
    for band in check.bands[1:3]:
        assert band.error_ratio == pytest.approx(1.0, abs=0.15)
        assert abs(band.bias) < 2e-3
        assert band.kept > 0.95
    assert sum(band.pixels for band in check.bands[1:3]) == check.both_see.sum() > 100_000
    np.testing.assert_allclose(check.true_distance_mm[check.both_see], np.sqrt(1000.0 * 5000.0), rtol=1e-9)
    summary = summarise_check(check)
    assert summary["passed"] is True
    assert [entry["pixels"] > 0 for entry in summary["bands"]] == [False, True, True, False]


@pytest.mark.parametrize(
    "name",
    [
        "BANDS", "FEWEST_PIXELS", "LEAST_TEXTURED", "LARGEST_BIAS", "LARGEST_BIAS_SIGMAS", "LEAST_ERROR_RATIO",
        "LARGEST_ERROR_RATIO", "LEAST_PART_RATIO", "LARGEST_PART_RATIO", "PARTS", "LEAST_KEPT", "NORMAL_PER_MAD",
    ],
)  # fmt: skip
def test_the_definition_of_passing_names_every_bound(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = definition_of_passing()
    monkeypatch.setattr(description, name, 777)
    assert "777" in definition_of_passing()
    assert "777" not in before
