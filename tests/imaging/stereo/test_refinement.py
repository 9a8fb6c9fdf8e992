"""Refinement by windows that follow the surface: slants, edges, noise, and what it must leave alone."""

import numpy as np
import pytest

from designer.imaging.stereo.matching import Matches, MatchingOptions, MatchOutcome, SearchRange, match
from designer.imaging.stereo.panorama import AZIMUTH_PADDING, PanoramaGrid
from designer.imaging.stereo.refinement import refine_disparities

COLUMNS, ROWS, WINDOW = 240, 120, 9
INSIDE = (slice(30, -30), slice(25, -25))


def waves(seed=0, count=60):
    """A texture of plane waves, 5 to 40 pixels long, as a function of column and row."""
    random = np.random.default_rng(seed)
    lengths, headings = 5.0 * 8.0 ** random.random(count), random.uniform(0, np.pi, count)
    phases = random.uniform(0, 2 * np.pi, count)

    def shade(column, row):
        total = 0.0
        for length, heading, phase in zip(lengths, headings, phases, strict=True):
            total = total + np.cos(2 * np.pi / length * (column * np.cos(heading) + row * np.sin(heading)) + phase)
        return 128.0 + 90.0 * np.sqrt(2.0 / count) * total / 2.0

    return shade


def slanted_pair(middle, along, across, noise=0.0):
    """Scan lines of both views of a plane, and its disparities ``middle + along * row + across * column`` exactly.

    The lower view shows at row r - D(r) what the upper one shows at row r.
    """
    shade = waves()
    column = np.arange(-AZIMUTH_PADDING, COLUMNS + AZIMUTH_PADDING)[:, None].astype(float)
    row = np.arange(ROWS)[None].astype(float)
    shift = middle + across * (column - COLUMNS / 2)
    upper = shade(column, row)
    lower = shade(column, (row + shift - along * ROWS / 2) / (1.0 - along))
    random = np.random.default_rng(1)
    images = [
        np.clip(np.rint(image + noise * random.standard_normal(image.shape)), 0, 255).astype(np.uint8)
        for image in (upper, lower)
    ]
    inner = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    return *images, (shift + along * (row - ROWS / 2))[inner]


def matched(upper, lower, follow_slants):
    grid = PanoramaGrid("cylindrical", COLUMNS, ROWS, 0.01, 0.0, 0.6)
    spans = tuple((max(disparity, 0), min(ROWS, ROWS + disparity)) for disparity in range(-20, 21))
    search = SearchRange(-20, spans, (1.0, 1e9), 1000.0)
    options = MatchingOptions(follow_slants=follow_slants, reverse_tolerance=3.0)
    return match(grid, search, upper, lower, options=options)


@pytest.mark.parametrize(
    ("along", "across"), [(0.0, 0.0), (0.12, 0.0), (-0.1, 0.0), (0.0, 0.08), (0.0, -0.1), (0.08, 0.06)]
)
def test_a_slanted_surface_is_found_to_a_hundredth_of_a_row(along, across):
    upper, lower, truth = slanted_pair(1.37, along, across)
    error = {follow: (matched(upper, lower, follow).disparities - truth)[INSIDE] for follow in (False, True)}
    known = np.isfinite(error[False]) & np.isfinite(error[True])
    assert known.mean() > 0.95
    assert abs(np.median(error[True][known])) < 0.01
    deviation = {follow: np.median(np.abs(values[known])) for follow, values in error.items()}
    assert deviation[True] < 0.02
    assert deviation[True] < 0.5 * deviation[False]


def test_noise_leaves_what_the_pixels_can_tell():
    """With noise s in both views the error of a window of n pixels is s sqrt(2) / (steepness sqrt(n))."""
    noise = 3.0
    upper, lower, truth = slanted_pair(0.4, 0.05, 0.05, noise)
    error = (refine_disparities(truth.astype(np.float32), upper, lower, WINDOW) - truth)[INSIDE]
    clean, _, _ = slanted_pair(0.4, 0.05, 0.05)
    steepness = np.sqrt(np.mean(np.gradient(clean.astype(float), axis=1) ** 2))
    assert np.std(error) == pytest.approx(noise * np.sqrt(2.0) / steepness / WINDOW, rel=0.3)


def test_a_depth_edge_stays_where_it_is():
    shade = waves()
    column = np.arange(-AZIMUTH_PADDING, COLUMNS + AZIMUTH_PADDING)[:, None].astype(float)
    row = np.arange(ROWS)[None].astype(float)
    disparity = np.where(column < COLUMNS / 2, 2.0, 7.0)
    upper = np.rint(shade(column, row)).astype(np.uint8)
    lower = np.rint(shade(column, row + disparity)).astype(np.uint8)
    truth = (disparity + 0 * row)[AZIMUTH_PADDING:-AZIMUTH_PADDING].astype(np.float32)
    random = np.random.default_rng(2)
    start = truth + random.normal(0.0, 0.05, truth.shape).astype(np.float32)
    error = np.abs(refine_disparities(start, upper, lower, WINDOW) - truth)[:, INSIDE[1]]
    edge, half = COLUMNS // 2, WINDOW // 2
    beside = error[edge - half : edge + half]
    # Five rows apart; a window that mixed the two surfaces would be off by more than a row beside the edge.
    assert np.median(beside) < 0.08
    assert np.quantile(beside, 0.95) < 0.25
    assert np.abs(error[30 : edge - 2 * half]).max() < 0.1


def test_what_was_dropped_stays_dropped_and_nothing_strays():
    random = np.random.default_rng(3)
    upper, lower = (random.integers(0, 255, (COLUMNS + 2 * AZIMUTH_PADDING, ROWS)).astype(np.uint8) for _ in range(2))
    disparities = random.uniform(-5, 5, (COLUMNS, ROWS)).astype(np.float32)
    disparities[random.random(disparities.shape) < 0.3] = np.nan
    before = disparities.copy()
    refined = refine_disparities(disparities, upper, lower, WINDOW)
    np.testing.assert_array_equal(disparities, before)
    np.testing.assert_array_equal(np.isnan(refined), np.isnan(before))
    assert np.nanmax(np.abs(refined - before)) <= 1.0
    nothing = refine_disparities(np.full_like(disparities, np.nan), upper, lower, WINDOW)
    assert np.isnan(nothing).all()


def test_refined_matches_keep_to_the_range_and_their_outcomes():
    upper, lower, _ = slanted_pair(1.37, 0.1, 0.05, noise=2.0)
    found: Matches = matched(upper, lower, True)
    kept = found.outcomes == MatchOutcome.KEPT
    np.testing.assert_array_equal(np.isfinite(found.disparities), kept)
    np.testing.assert_array_equal(np.isfinite(found.distances_mm), kept)
