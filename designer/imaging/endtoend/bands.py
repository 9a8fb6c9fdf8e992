"""The verdict of an end-to-end check, band by band of true distance: its bounds, and what breaks them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.imaging.endtoend.noise import FEWEST_PIXELS, distance_bands, robust_deviation
from designer.imaging.render.scenes.world import Array
from designer.imaging.stereo.matching import Matches, MatchOutcome

Mask = NDArray[np.bool_]

LARGEST_BIAS = 0.01
LARGEST_BIAS_SIGMAS = 0.25
LEAST_ERROR_RATIO, LARGEST_ERROR_RATIO = 0.5, 1.5
# A band is judged by its parts in elevation too, so that a bad part does not hide behind good ones.
PARTS = 4
LEAST_PART_RATIO, LARGEST_PART_RATIO = 0.4, 2.0
LEAST_KEPT = 0.6
# With less contrast than this over a band, stereo has nothing to go by.
LEAST_TEXTURED = 0.1


@dataclass(frozen=True, slots=True)
class Band:
    """The verdict on one band of true distances.

    ``pixels`` are those of the upper panorama that show a point of the working volume there which both views can
    see; ``textured`` those of them with contrast; ``kept`` the fraction of the textured that has a depth. ``bias``
    is the median relative depth error of the kept and ``error`` its robust RMS; ``error_ratio`` is the robust RMS of
    their errors in units of the prediction, ``worst_part_ratio`` that of the part in elevation where it is farthest
    from 1, and ``predicted`` the median predicted sigma_D / D. Numbers are NaN where nothing was kept.
    """

    distance_mm: tuple[float, float]
    pixels: int
    textured: int
    kept: float
    bias: float
    error: float
    error_ratio: float
    worst_part_ratio: float
    predicted: float

    @property
    def is_judged(self) -> bool:
        """Whether there are enough pixels to judge."""
        return self.pixels >= FEWEST_PIXELS

    @property
    def bias_bound(self) -> float:
        """The largest median relative error allowed."""
        return max(LARGEST_BIAS, LARGEST_BIAS_SIGMAS * self.predicted)

    @property
    def problems(self) -> tuple[str, ...]:
        """What fails, in words; empty if the band passes or cannot be judged."""
        if not self.is_judged:
            return ()
        if self.textured < LEAST_TEXTURED * self.pixels:
            return ("no texture",)
        found = []
        # Written so that a number that is not there fails.
        if not abs(self.bias) <= self.bias_bound:
            found.append("bias")
        if not LEAST_ERROR_RATIO <= self.error_ratio <= LARGEST_ERROR_RATIO:
            found.append("error ratio")
        elif self.worst_part_ratio < LEAST_PART_RATIO or self.worst_part_ratio > LARGEST_PART_RATIO:
            found.append("error ratio at some elevation")
        if not self.kept >= LEAST_KEPT:
            found.append("kept")
        return tuple(found)


def judge_bands(
    design: Design, matches: Matches, true_distance_mm: Array, both_see: Mask, predicted: Array, error: Array
) -> tuple[Band, ...]:
    """Judge the matches of the upper panorama in each band of true distance.

    All arrays have the shape (columns, rows): the distance in mm, the pixels to judge, sigma_D / D, and the relative
    depth error.
    """
    return tuple(
        _judge(
            (float(low), float(high)),
            both_see & (true_distance_mm >= low) & (true_distance_mm < high),
            matches,
            error,
            predicted,
        )
        for low, high in pairwise(distance_bands(design))
    )


def _judge(distances: tuple[float, float], pixels: Mask, matches: Matches, error: Array, predicted: Array) -> Band:
    textured = pixels & (matches.outcomes != MatchOutcome.NO_TEXTURE)
    kept = textured & (matches.outcomes == MatchOutcome.KEPT)
    count = int(textured.sum())
    return Band(
        distance_mm=distances,
        pixels=int(pixels.sum()),
        textured=count,
        kept=float(kept.sum() / count) if count else np.nan,
        bias=float(np.median(error[kept])) if kept.any() else np.nan,
        error=robust_deviation(error[kept]),
        error_ratio=robust_deviation(error[kept] / predicted[kept]),
        worst_part_ratio=_worst_part_ratio(error / predicted, kept),
        predicted=float(np.median(predicted[pixels])) if pixels.any() else np.nan,
    )


def _worst_part_ratio(normalised: Array, kept: Mask) -> float:
    """Of ``PARTS`` ranges of rows with like numbers of kept pixels, the deviation that is farthest from 1, as a factor.

    Parts with too few pixels to judge are left out; with no other part it is NaN.
    """
    counts = kept.sum(axis=0)
    share = np.cumsum(counts) / max(int(counts.sum()), 1)
    part = np.minimum((share * PARTS).astype(int), PARTS - 1)
    ratios = [
        robust_deviation(normalised[:, part == number][kept[:, part == number]])
        for number in range(PARTS)
        if counts[part == number].sum() >= FEWEST_PIXELS / PARTS
    ]
    return max(ratios, key=lambda ratio: abs(np.log(ratio)), default=np.nan)
