"""What is left of boxes of designs: narrowed by the rules, or empty, or no better than asked; in compiled loops.

Three stages, each dearer and sharper: ranges forwards and backwards, affine forms of the rules and what they leave of
the box, and the lower bound of the score.
"""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from designer.certify.affine import HUGE, form_all
from designer.certify.intervals import above, below, compiled, evaluate, propagate
from designer.certify.score_bound import least_score

# Propagation goes on while it leaves less than this share of a box, at most so often.
WORTH_ANOTHER_ROUND = 0.6
MOST_ROUNDS = 4
# The score's affine forms are found where its ranges come this near to the target, in boxes of at most this share of
# the variables' ranges: in wider ones they say no more than ranges.
WORTH_FORMS, NARROW = 0.95, 0.1
SWEEPS = 3

_FILES = ("boxes.py", "affine.py", "intervals.py", "score_bound.py")
_DIGEST = zlib.crc32(b"".join((Path(__file__).parent / name).read_bytes() for name in _FILES))
SOURCES = tuple(0 if _DIGEST >> bit & 1 else 0.0 for bit in range(24))
"""What the loops are compiled from, told by the types of some numbers.

The cache of compiled loops knows when the file of a loop changes, but not those of the loops that it calls; of what it
is called with, it knows the types."""


@compiled
def _volume(least, greatest):
    volume = 1.0
    for t in range(least.size):
        volume *= max(greatest[t] - least[t], 1e-30)
    return volume


@compiled
def _width(least, greatest, widths):
    """The largest width of a box, in terms of ``widths``."""
    widest = 0.0
    for t in range(least.size):
        widest = max(widest, (greatest[t] - least[t]) / widths[t])
    return widest


@compiled
def _require(low, high, results, least_allowed, greatest_allowed):
    """Narrow results to what is allowed; False if one cannot be."""
    for row in range(results.size):
        k = results[row]
        low[k], high[k] = max(low[k], least_allowed[row]), min(high[k], greatest_allowed[row])
        if not low[k] <= high[k]:
            return False
    return True


@compiled
def _narrow_by_ranges(codes, first, second, constants, results, allowed, low, high, least, greatest):
    """Narrow a box by the ranges of the rules; False if nothing is left."""
    for _ in range(MOST_ROUNDS):
        before = _volume(least, greatest)
        evaluate(codes, first, second, constants, low, high, least, greatest)
        if not _require(low, high, results, allowed[0], allowed[1]):
            return False
        if not propagate(codes, first, second, low, high, least, greatest):
            return False
        if _volume(least, greatest) > WORTH_ANOTHER_ROUND * before:
            break
    return True


@compiled
def _sweep(offsets, slopes, count, left, right):
    """Narrow e in left..right by rows offset + slopes e >= 0; -1 if nothing is left, else how much moved."""
    moved = 0.0
    for row in range(count):
        most = offsets[row]
        if not most < HUGE:
            continue
        for t in range(left.size):
            most += slopes[row, t] * (right[t] if slopes[row, t] > 0.0 else left[t])
        # What rounding of this sum can be.
        most += 1e-12 * abs(offsets[row])
        for t in range(left.size):
            most += 1e-12 * abs(slopes[row, t])
        if most < 0.0:
            return -1.0
        for t in range(left.size):
            slope = slopes[row, t]
            if abs(slope) < 1e-250:
                continue
            step = most / abs(slope) * (1.0 + 1e-12) + 1e-13
            if slope > 0.0 and right[t] - step > left[t]:
                moved = max(moved, right[t] - step - left[t])
                left[t] = right[t] - step
            elif slope < 0.0 and left[t] + step < right[t]:
                moved = max(moved, right[t] - left[t] - step)
                right[t] = left[t] + step
            if not left[t] <= right[t]:
                return -1.0
    return moved


@compiled
def _narrow_by_forms(results, allowed, centres, slopes, errors, offsets, rows, least, greatest):
    """Narrow a box by the affine forms of the rules; False if nothing is left."""
    count = 0
    for row in range(results.size):
        k = results[row]
        for side in (0, 1):
            sign = 1.0 - 2.0 * side
            if abs(allowed[side, row]) > HUGE:
                continue
            offsets[count] = sign * (centres[k] - allowed[side, row]) + errors[k]
            for t in range(least.size):
                rows[count, t] = sign * slopes[k, t]
            count += 1
    left, right = -np.ones(least.size), np.ones(least.size)
    for _ in range(SWEEPS):
        moved = _sweep(offsets, rows, count, left, right)
        if moved < 0.0:
            return False
        if moved < 0.05:
            break
    for t in range(least.size):
        middle = 0.5 * least[t] + 0.5 * greatest[t]
        radius = above(max(greatest[t] - middle, middle - least[t]))
        least[t] = max(least[t], below(middle + below(radius * left[t])))
        greatest[t] = min(greatest[t], above(middle + above(radius * right[t])))
    return True


@compiled
def _where_to_cut(results, allowed, centres, slopes, errors, least, greatest, widths):
    """The variable along which a box is cut: wide, and deciding whether rules are kept."""
    shares, undecided = np.zeros(least.size), 0
    for row in range(results.size):
        k, total = results[row], 0.0
        for t in range(least.size):
            total += abs(slopes[k, t])
        if total > 0.0 and centres[k] - total - errors[k] < allowed[0, row]:
            undecided += 1
            for t in range(least.size):
                shares[t] += abs(slopes[k, t]) / total
    best, most = 0, -1.0
    for t in range(least.size):
        value = (greatest[t] - least[t]) / widths[t] + 0.1 * shares[t] / max(undecided, 1)
        if greatest[t] > least[t] and value > most:
            best, most = t, value
    return best


@compiled
def examine(
    least,
    greatest,
    bounds,
    cuts,
    codes,
    first,
    second,
    constants,
    results,
    allowed,
    score_codes,
    score_first,
    score_second,
    score_constants,
    score_results,
    weights,
    texture,
    target,
    widths,
    sources,
):
    """Examine boxes in place: narrow each, raise its bound, and note along which variable to cut it.

    Parameters
    ----------
    least, greatest
        The boxes' ends, shape (boxes, variables).
    bounds
        A lower bound of the score in each box.
    cuts
        The variable to cut along; -1 where nothing is left.
    allowed
        The least and the greatest that each rule may be, shape (2, rules).
    target
        A box whose score is at least this is left; infinite where only the rules count.
    sources
        ``SOURCES``, which takes no part.
    """
    size, score_size, count = codes.size, score_codes.size, least.shape[1]
    low, high, centres, errors = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    slopes = np.zeros((size, count))
    offsets, rows = np.empty(2 * results.size), np.empty((2 * results.size, count))
    score_low, score_high = np.empty(score_size), np.empty(score_size)
    score_centres, score_errors = np.empty(score_size), np.empty(score_size)
    score_slopes = np.zeros((score_size, count))
    for box in range(least.shape[0]):
        ends = least[box], greatest[box]
        cuts[box] = -1
        if not _narrow_by_ranges(codes, first, second, constants, results, allowed, low, high, ends[0], ends[1]):
            continue
        if not form_all(
            codes, first, second, constants, low, high, centres, slopes, errors, ends[0], ends[1]
        ) or not _require(low, high, results, allowed[0], allowed[1]):
            continue
        if not _narrow_by_forms(results, allowed, centres, slopes, errors, offsets, rows, ends[0], ends[1]):
            continue
        if target < HUGE:
            evaluate(score_codes, score_first, score_second, score_constants, score_low, score_high, ends[0], ends[1])
            score = least_score(score_low, score_high, score_results, weights, texture[0], texture[1], texture[2])
            if WORTH_FORMS * target < score < target and _width(ends[0], ends[1], widths) < NARROW:
                if not form_all(
                    score_codes,
                    score_first,
                    score_second,
                    score_constants,
                    score_low,
                    score_high,
                    score_centres,
                    score_slopes,
                    score_errors,
                    ends[0],
                    ends[1],
                ):
                    continue
                score = least_score(score_low, score_high, score_results, weights, texture[0], texture[1], texture[2])
            bounds[box] = max(bounds[box], score)
            if bounds[box] >= target:
                continue
        cuts[box] = _where_to_cut(results, allowed, centres, slopes, errors, ends[0], ends[1], widths)
