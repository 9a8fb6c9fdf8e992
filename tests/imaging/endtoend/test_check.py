"""The end-to-end check: designs that are right pass, systems that are wrong fail."""

import numpy as np
import pytest

from designer.design import Design
from designer.imaging.endtoend import description
from designer.imaging.endtoend.check import CheckOptions, check_design
from designer.imaging.endtoend.description import definition_of_passing, describe_check, summarise_check
from designer.imaging.stereo.matching import MatchOutcome
from support.studied_designs import NAMES, studied_design

PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "name"), [(number % 3, name) for number, name in enumerate(NAMES)])
def test_the_winners_and_one_of_each_kind_pass(name: str, seed: int) -> None:
    check = check_design(studied_design(name), CheckOptions(seed=seed))
    assert check.passed, describe_check(check)
    assert sum(band.is_judged for band in check.bands) == 4
    assert check.scene == {"indoor": "office", "pipe": "pipe", "ceiling": "hall", "sky": "sky"}[name.split("_")[0]]
    # What is measured is the noise of matching, not of the pixels: a fraction of a pixel for rich texture.
    assert 0.01 < check.noise.summary["median"] < 0.2
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
    check = check_design(design, CheckOptions(samples=1, built=design.model_copy(update={"mirrors": mirrors})))
    assert not check.passed
    assert any("bias" in band.problems for band in check.bands)


@pytest.mark.slow
def test_a_repetitive_texture_deceives_matching_and_the_check_says_so() -> None:
    check = check_design(studied_design(PROTOTYPE), CheckOptions(samples=1, texture="repetitive"))
    assert not check.passed
    assert describe_check(check).endswith("FAILED")


@pytest.mark.slow
def test_a_wall_of_known_distance_is_measured_as_predicted() -> None:
    design: Design = studied_design(PROTOTYPE)
    check = check_design(design, CheckOptions(scene="cylinder", samples=1, seed=7))
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
        "LARGEST_ERROR_RATIO", "LEAST_KEPT", "NORMAL_PER_MAD",
    ],
)  # fmt: skip
def test_the_definition_of_passing_names_every_bound(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = definition_of_passing()
    monkeypatch.setattr(description, name, 777)
    assert "777" in definition_of_passing()
    assert "777" not in before
