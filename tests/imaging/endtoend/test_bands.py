"""The verdict band by band: each bound by itself, on numbers and on pixels drawn at random."""

import dataclasses
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from designer.imaging.endtoend.bands import Band, judge_bands
from designer.imaging.endtoend.noise import distance_bands
from designer.imaging.stereo.matching import MatchOutcome
from support.imaging_designs import prototype

GOOD = Band(
    (1000.0, 1500.0),
    9000,
    8000,
    kept=0.9,
    bias=0.001,
    error=0.02,
    error_ratio=1.0,
    worst_part_ratio=1.2,
    predicted=0.02,
)


@pytest.mark.parametrize(
    ("changes", "problems"),
    [
        ({}, ()),
        ({"bias": 0.0101}, ("bias",)),
        ({"bias": -0.0101}, ("bias",)),
        # A quarter of a sigma of 8 percent is more than one percent.
        ({"bias": 0.0195, "predicted": 0.08}, ()),
        ({"bias": 0.0205, "predicted": 0.08}, ("bias",)),
        ({"error_ratio": 0.49}, ("error ratio",)),
        ({"error_ratio": 1.51}, ("error ratio",)),
        ({"worst_part_ratio": 0.39}, ("error ratio at some elevation",)),
        ({"worst_part_ratio": 2.01}, ("error ratio at some elevation",)),
        ({"kept": 0.59}, ("kept",)),
        ({"kept": float("nan"), "bias": float("nan"), "error_ratio": float("nan")}, ("bias", "error ratio", "kept")),
        ({"textured": 500}, ("no texture",)),
        # Too few pixels say nothing.
        ({"pixels": 400, "bias": 0.5}, ()),
    ],
)
def test_a_band_fails_for_each_of_its_reasons(changes: dict[str, float], problems: tuple[str, ...]) -> None:
    assert dataclasses.replace(GOOD, **changes).problems == problems


def test_bands_measure_bias_scatter_and_what_is_kept() -> None:
    random = np.random.default_rng(6)
    shape = (400, 300)
    edges = distance_bands(prototype())
    distance = np.exp(random.uniform(np.log(edges[0]), np.log(edges[-1]), shape))
    outcomes = random.choice(
        [MatchOutcome.KEPT, MatchOutcome.SPECKLE, MatchOutcome.NO_TEXTURE], shape, p=[0.6, 0.2, 0.2]
    )
    predicted = 0.01 * distance / edges[0]
    error = 0.003 + 1.2 * predicted * random.standard_normal(shape)
    both_see = random.random(shape) < 0.9
    matches: Any = SimpleNamespace(outcomes=outcomes)
    bands = judge_bands(prototype(), matches, distance, both_see, predicted, error)
    assert [band.distance_mm for band in bands] == [
        (pytest.approx(low), pytest.approx(high)) for low, high in pairwise(edges)
    ]
    assert sum(band.pixels for band in bands) == both_see.sum()
    for band in bands:
        middle = 0.01 * np.sqrt(band.distance_mm[0] * band.distance_mm[1]) / edges[0]
        assert band.kept == pytest.approx(0.75, abs=0.02)
        assert band.textured == pytest.approx(0.8 * band.pixels, rel=0.02)
        assert band.predicted == pytest.approx(middle, rel=0.02)
        # Four standard errors of the median of normal deviates.
        standard_error = np.sqrt(np.pi / 2.0) * 1.2 * middle / np.sqrt(band.kept * band.textured)
        assert band.bias == pytest.approx(0.003, abs=4.0 * standard_error)
        assert band.error_ratio == pytest.approx(1.2, rel=0.03)
        assert band.problems == ()


def test_a_band_of_which_nothing_is_kept_has_no_numbers_and_fails() -> None:
    shape = (100, 100)
    matches: Any = SimpleNamespace(outcomes=np.full(shape, MatchOutcome.SPECKLE))
    near, *_ = distance_bands(prototype())
    everything = np.ones(shape, dtype=bool)
    bands = judge_bands(
        prototype(), matches, np.full(shape, 1.01 * near), everything, np.full(shape, 0.01), np.zeros(shape)
    )
    assert (bands[0].pixels, bands[0].kept) == (10_000, 0.0)
    assert np.isnan(bands[0].error_ratio)
    assert bands[0].problems == ("bias", "error ratio", "kept")
    assert [band.is_judged for band in bands] == [True, False, False, False]


def test_a_bad_part_in_elevation_does_not_hide_behind_good_ones() -> None:
    random = np.random.default_rng(7)
    shape = (400, 200)
    edges = distance_bands(prototype())
    distance = np.full(shape, np.sqrt(edges[0] * edges[1]))
    outcomes = np.full(shape, MatchOutcome.KEPT)
    predicted = np.full(shape, 0.02)
    error = predicted * random.standard_normal(shape)
    matches: Any = SimpleNamespace(outcomes=outcomes)
    band, *_ = judge_bands(prototype(), matches, distance, np.ones(shape, bool), predicted, error)
    assert band.problems == ()
    error[:, 150:] *= 2.5
    band, *_ = judge_bands(prototype(), matches, distance, np.ones(shape, bool), predicted, error)
    assert band.error_ratio < 1.5
    assert band.worst_part_ratio == pytest.approx(2.5, rel=0.05)
    assert band.problems == ("error ratio at some elevation",)
