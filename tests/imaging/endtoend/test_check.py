"""The end-to-end check through a pinhole: it knows known distances, and systems that are wrong fail."""

import numpy as np
import pytest

from designer.design import Design
from designer.imaging.endtoend import description
from designer.imaging.endtoend.check import CheckOptions, check_design
from designer.imaging.endtoend.description import definition_of_passing, describe_check, summarise_check
from support.studied_designs import studied_design

PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"


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
