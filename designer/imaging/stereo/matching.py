"""Matching along the scan lines of a pair of panoramas, and why each pixel that has no match was dropped.

Disparity is row_upper - row_lower in panorama rows, for the same azimuth: the lower viewpoint sees a point higher
than the upper one does. The paper's matcher is the sum of absolute differences (SAD) over a 9 x 9 window with
reverse verification: the lower pixel that an upper pixel matches must itself match that upper pixel best. Both
searches read the same costs. Semi-global matching is OpenCV's. Either may be refined by windows that follow the
surface found (:mod:`designer.imaging.stereo.refinement`).

Scan-line images have shape (columns + 2 AZIMUTH_PADDING, rows): a row of the array is one azimuth.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import PerView
from designer.evaluate.noise import Matcher
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.costs import LARGEST_WINDOW, UNSEARCHED, equiangular_fit, least_sums, sums_beside
from designer.imaging.stereo.panorama import AZIMUTH_PADDING, PanoramaGrid
from designer.imaging.stereo.reconstruction import disparity_from_distance, distance_map
from designer.imaging.stereo.refinement import refine_disparities


class MatchOutcome(IntEnum):
    """What became of a pixel of the upper panorama: kept, or why dropped. Of several reasons the largest counts."""

    KEPT = 0
    SPECKLE = 1
    """A small island of disparities unlike those around it."""
    UNLIKE = 2
    """The two windows differ by more than noise and contrast explain: what one view shows, the other does not."""
    REVERSE_CHECK = 3
    """The match found backwards, from the lower panorama, is another one."""
    OUT_OF_RANGE = 4
    """The best match lies at an end of the search, or outside the range of distances."""
    BORDER = 5
    """The best match lies at the upper or lower edge of the other panorama: the true one may lie beyond."""
    NO_TEXTURE = 6
    """Too little contrast along the scan line within the window."""
    OUTSIDE_ZONE = 7
    """Its direction, or its match's, is not imaged: outside the asked elevations, the image circle or the sensor."""


@dataclass(frozen=True, slots=True)
class MatchingOptions:
    """How to match.

    ``window`` is the odd side of the SAD window in panorama pixels; ``least_contrast`` the mean absolute difference
    of neighbours along the scan line, in grey levels; ``reverse_tolerance`` in rows; islands of up to
    ``speckle_size`` pixels whose disparity differs by more than ``speckle_difference`` rows from their surroundings
    are dropped (0 keeps them). A match is unlike if the mean absolute difference that remains at it exceeds both
    ``largest_difference`` times the contrast and ``noise_floor`` grey levels. A least contrast of 0 and an infinite
    difference skip the two checks. ``level_brightness`` first takes each image's own local mean away, for cameras
    whose two views are not equally bright. ``follow_slants`` refines what was kept by windows that follow the surface.
    """

    matcher: Matcher = "sad"
    window: int = 9
    least_contrast: float = 1.0
    reverse_tolerance: float = 1.0
    speckle_size: int = 60
    speckle_difference: float = 1.5
    largest_difference: float = 0.7
    noise_floor: float = 3.0
    level_brightness: bool = False
    follow_slants: bool = False
    threads: int = 2

    def __post_init__(self) -> None:
        """Raise ValueError for a window that is even or too wide."""
        if self.window % 2 == 0 or not 1 <= self.window <= LARGEST_WINDOW:
            raise ValueError(f"window must be odd and at most {LARGEST_WINDOW}, not {self.window}")


DEFAULT_OPTIONS = MatchingOptions()
# For accuracy rather than frames per second.
ACCURATE_OPTIONS = MatchingOptions(follow_slants=True)

# A disparity far from all others, and what marks a dropped pixel among sixteenths of a row.
_NOWHERE = -30000
_DROPPED = -32768


@dataclass(frozen=True, slots=True, eq=False)
class SearchRange:
    """Which disparities are tried, and for which rows of the upper panorama.

    ``lowest`` is the smallest disparity; ``spans`` holds the first row and the row after the last for each disparity
    from there on, in steps of one; distances outside ``distances_mm`` are not kept.
    """

    lowest: int
    spans: tuple[tuple[int, int], ...]
    distances_mm: tuple[float, float]
    baseline_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Disparities (not a number where dropped), distances in mm (likewise) and outcomes, each (columns, rows)."""

    disparities: NDArray[np.float32]
    distances_mm: NDArray[np.float32]
    outcomes: NDArray[np.uint8]

    @property
    def fractions(self) -> dict[str, float]:
        """The fraction of all pixels that met each outcome."""
        counts = np.bincount(self.outcomes.ravel(), minlength=len(MatchOutcome))
        return {outcome.name.lower(): float(counts[outcome]) / self.outcomes.size for outcome in MatchOutcome}


def search_range(grid: PanoramaGrid, baseline_mm: float, distances_mm: tuple[float, float]) -> SearchRange:
    """The disparities of points between two horizontal distances, at each row of the upper panorama.

    One row is added at either end, so that a match at the limit has neighbours to interpolate between.
    """
    near, far = distances_mm
    rows = np.arange(grid.rows)
    largest = np.floor(disparity_from_distance(grid, rows, near, baseline_mm)).astype(int) + 2
    smallest = np.ceil(disparity_from_distance(grid, rows, far, baseline_mm)).astype(int) - 2
    # A match must lie on a row of the lower panorama.
    smallest = np.maximum(smallest, rows - (grid.rows - 1))
    largest = np.minimum(largest, rows)
    lowest, highest = int(smallest.min()), int(largest.max())
    spans = []
    for disparity in range(lowest, highest + 1):
        searched = np.flatnonzero((smallest <= disparity) & (disparity <= largest))
        spans.append((int(searched[0]), int(searched[-1]) + 1) if searched.size else (0, 0))
    return SearchRange(lowest, tuple(spans), distances_mm, baseline_mm)


def match(
    grid: PanoramaGrid,
    search: SearchRange,
    upper: Image,
    lower: Image,
    imaged: PerView[NDArray[np.bool_]] | None = None,
    options: MatchingOptions = DEFAULT_OPTIONS,
) -> Matches:
    """Match every pixel of the upper panorama with the lower one.

    Parameters
    ----------
    upper, lower
        Grey scan lines of both views, (columns + 2 AZIMUTH_PADDING, rows).
    imaged
        Which samples each view images, (columns, rows); all of them by default.

    Raises
    ------
    InputError
        The panoramas have fewer rows than the window, or than semi-global matching needs.
    """
    if grid.rows < options.window:
        raise InputError(
            f"--columns {grid.columns}: panoramas {grid.rows} px high, less than the matching --window of "
            f"{options.window}: use more columns, or a wider --elevation-deg"
        )
    if options.level_brightness:
        upper, lower = _levelled(upper), _levelled(lower)
    shape = (grid.columns, grid.rows)
    matches = Matches(np.empty(shape, np.float32), np.empty(shape, np.float32), np.empty(shape, np.uint8))
    whole = _semi_global(grid, search, upper, lower, options) if options.matcher == "semi_global" else None

    def match_part(columns: slice) -> None:
        padded = slice(columns.start, columns.stop + 2 * AZIMUTH_PADDING)
        found = _least_differences(search, upper[padded], lower[padded], options) if whole is None else whole[columns]
        seen = None if imaged is None else PerView(upper=imaged.upper[columns], lower=imaged.lower[columns])
        part = _judged(grid, search, found, upper[padded], seen, options)
        matches.disparities[columns], matches.distances_mm[columns], matches.outcomes[columns] = part

    edges = np.linspace(0, grid.columns, options.threads + 1).astype(int)
    with ThreadPoolExecutor(options.threads) as pool:
        list(pool.map(match_part, (slice(*pair) for pair in pairwise(edges))))
    if options.speckle_size:
        _drop(matches, _speckles(matches.disparities, options), MatchOutcome.SPECKLE)
    if options.follow_slants:
        matches.disparities[:] = refine_disparities(matches.disparities, upper, lower, options.window)
        matches.distances_mm[:] = distance_map(grid, matches.disparities, search.baseline_mm)
        near, far = search.distances_mm
        _drop(matches, (matches.distances_mm < near) | (matches.distances_mm > far), MatchOutcome.OUT_OF_RANGE)
    return matches


@dataclass(frozen=True, slots=True, eq=False)
class _Candidates:
    """What a search found for each pixel, before anything is checked; arrays of shape (columns, rows).

    A disparity is ``whole`` plus ``fraction``; ``remaining`` is the sum of absolute differences there. ``reverse``
    belongs to the lower panorama: the whole disparity found from there, or one far from all others.
    """

    whole: NDArray[np.int16]
    fraction: NDArray[np.float32]
    found: NDArray[np.bool_]
    at_end: NDArray[np.bool_]
    remaining: NDArray[np.float32]
    reverse: NDArray[np.int16]

    def __getitem__(self, columns: slice) -> _Candidates:
        return _Candidates(
            self.whole[columns],
            self.fraction[columns],
            self.found[columns],
            self.at_end[columns],
            self.remaining[columns],
            self.reverse[columns],
        )


def _least_differences(search: SearchRange, upper: Image, lower: Image, options: MatchingOptions) -> _Candidates:
    margin = AZIMUTH_PADDING - options.window // 2
    needed = slice(margin, len(upper) - margin)
    winners = least_sums(upper[needed], lower[needed], search.lowest, search.spans, options.window)
    fraction, remaining = equiangular_fit(winners.before, winners.best, winners.after)
    whole = winners.index.astype(np.int16) + np.int16(search.lowest)
    reverse = winners.reverse_index.astype(np.int16) + np.int16(search.lowest)
    _overwrite(reverse, winners.reverse_best == UNSEARCHED, _NOWHERE)
    at_end = np.maximum(winners.before, winners.after) == UNSEARCHED
    return _Candidates(whole, fraction, winners.best < UNSEARCHED, at_end, remaining, reverse)


def _semi_global(
    grid: PanoramaGrid, search: SearchRange, upper: Image, lower: Image, options: MatchingOptions
) -> _Candidates:
    """OpenCV's semi-global matcher, run from either view; it cannot limit its search row by row.

    Its own interpolation pulls towards whole rows, so the whole rows that it finds are refined by the SAD.
    """
    count = -(-len(search.spans) // 16) * 16
    # The matcher gives nothing where its search leaves the image, so the image is made wide enough.
    padding = max(abs(search.lowest), abs(search.lowest + count)) + 1
    wide = [np.pad(lines, ((0, 0), (padding, padding)), mode="edge") for lines in (upper, lower)]
    inside = (slice(None), slice(padding, padding + grid.rows))

    def disparities_of(first: Image, second: Image, lowest: int) -> NDArray[np.float32]:
        area = options.window**2
        matcher = cv2.StereoSGBM.create(
            lowest, count, options.window, P1=4 * area, P2=32 * area, preFilterCap=31, mode=cv2.STEREO_SGBM_MODE_SGBM
        )
        return np.asarray(matcher.compute(first, second)[inside], dtype=np.float32) / np.float32(16.0)

    with ThreadPoolExecutor(options.threads) as pool:
        forward = pool.submit(disparities_of, wide[0], wide[1], search.lowest)
        backward = pool.submit(disparities_of, wide[1], wide[0], -(search.lowest + count - 1))
        try:
            disparities, reverse = forward.result(), -backward.result()
        except cv2.error:
            raise InputError(
                f"--columns {grid.columns}: semi-global matching needs panoramas higher than {grid.rows} px for "
                f"{len(search.spans)} disparities: use more columns, greater --distance-mm, or --matcher sad"
            ) from None
    margin = AZIMUTH_PADDING - options.window // 2
    needed = slice(margin, len(upper) - margin)
    columns = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    whole, opposite = (np.rint(found[columns]).astype(np.int16) for found in (disparities, reverse))
    fraction, remaining = equiangular_fit(*sums_beside(upper[needed], lower[needed], whole, options.window))
    highest = search.lowest + len(search.spans) - 1
    rows_lower = np.arange(grid.rows) - whole
    found = (whole >= search.lowest) & (rows_lower >= 0) & (rows_lower <= grid.rows - 1)
    return _Candidates(whole, fraction, found, (whole <= search.lowest) | (whole >= highest), remaining, opposite)


def _judged(
    grid: PanoramaGrid,
    search: SearchRange,
    candidates: _Candidates,
    upper: Image,
    imaged: PerView[NDArray[np.bool_]] | None,
    options: MatchingOptions,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]:
    """Disparities, distances and outcomes of some columns, all but the search for speckles."""
    whole = candidates.whole
    disparities = candidates.fraction + whole
    distances = distance_map(grid, disparities, search.baseline_mm)
    rows_lower = np.arange(grid.rows, dtype=np.int16) - whole
    at_edge = (rows_lower <= 0) | (rows_lower >= grid.rows - 1)
    np.clip(rows_lower, 0, grid.rows - 1, out=rows_lower)
    matched = rows_lower + (np.arange(len(whole)) * grid.rows)[:, None]
    near, far = search.distances_mm
    reasons = {
        MatchOutcome.REVERSE_CHECK: np.abs(_taken(candidates.reverse, matched) - whole) > options.reverse_tolerance,
        MatchOutcome.OUT_OF_RANGE: candidates.at_end | (distances < near) | (distances > far),
        MatchOutcome.BORDER: ~candidates.found | (candidates.at_end & at_edge),
    }
    if options.least_contrast > 0 or np.isfinite(options.largest_difference):
        contrast = contrast_of(upper, options.window)
        reasons[MatchOutcome.NO_TEXTURE] = contrast < options.least_contrast
        if np.isfinite(options.largest_difference):
            explained = np.maximum(contrast * np.float32(options.largest_difference), np.float32(options.noise_floor))
            reasons[MatchOutcome.UNLIKE] = candidates.remaining > explained * np.float32(options.window**2)
    if imaged is not None:
        reasons[MatchOutcome.OUTSIDE_ZONE] = ~(imaged.upper & _taken(imaged.lower, matched))
    outcomes = np.zeros(whole.shape, np.uint8)
    for outcome, applies in reasons.items():
        np.maximum(outcomes, applies.view(np.uint8) * np.uint8(outcome), out=outcomes)
    dropped = outcomes != MatchOutcome.KEPT
    _overwrite(disparities, dropped, np.nan)
    _overwrite(distances, dropped, np.nan)
    return disparities, distances, outcomes


def _taken(array: NDArray[Any], places: NDArray[np.intp]) -> NDArray[Any]:
    """The values at flat places, which the caller has made sure lie inside."""
    return array.reshape(-1).take(places, mode="clip")


def _overwrite(array: NDArray[Any], where: NDArray[np.bool_], value: float) -> None:
    """Set the marked entries of a contiguous array; several times faster than NumPy's masked assignment."""
    cv2.copyTo(np.full_like(array, value), where.view(np.uint8), array)


def _levelled(lines: Image) -> Image:
    """The image less its mean over a wide window, about middle grey."""
    side = 2 * AZIMUTH_PADDING - 1
    mean = cv2.blur(lines, (side, side), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.addWeighted(lines, 1.0, mean, -1.0, 128.0), dtype=np.uint8)


def contrast_of(lines: Image, window: int) -> NDArray[np.float32]:
    """Mean absolute difference of neighbours along the scan line, over the window: (columns, rows), unpadded."""
    differences = cv2.absdiff(lines[:, 1:], lines[:, :-1])
    # One column is missing: the first is its own neighbour's.
    differences = cv2.copyMakeBorder(differences, 0, 0, 1, 0, cv2.BORDER_REPLICATE)
    mean = cv2.boxFilter(differences, cv2.CV_32F, (window, window), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(mean[AZIMUTH_PADDING:-AZIMUTH_PADDING])


def _speckles(disparities: NDArray[np.float32], options: MatchingOptions) -> NDArray[np.bool_]:
    """Pixels of small islands; an island across the seam of the panorama counts as one."""
    margin = min(options.speckle_size, len(disparities))
    sixteenths = np.nan_to_num(disparities * np.float32(16.0), nan=_DROPPED).astype(np.int16)
    around = np.concatenate([sixteenths[-margin:], sixteenths, sixteenths[:margin]])
    cv2.filterSpeckles(around, _DROPPED, options.speckle_size, options.speckle_difference * 16.0)
    return np.asarray((around[margin:-margin] == _DROPPED) & (sixteenths != _DROPPED))


def _drop(matches: Matches, where: NDArray[np.bool_], reason: MatchOutcome) -> None:
    _overwrite(matches.outcomes, where, reason)
    _overwrite(matches.disparities, where, np.nan)
    _overwrite(matches.distances_mm, where, np.nan)
