"""Intervals against membership, point by point."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.verify.intervals import common, common_width, hull, in_degrees, joined, uncovered

# Whole ends, and points a quarter off them: none lies on an end.
ends = st.integers(-20, 20)
starts_and_widths = st.tuples(ends, st.integers(1, 15))
intervals = st.lists(starts_and_widths.map(lambda pair: (float(pair[0]), float(sum(pair)))), max_size=6)
POINTS = np.arange(-21.75, 40.0, 0.5)


def inside(parts: list[tuple[float, float]]) -> list[bool]:
    return [any(low < point < high for low, high in parts) for point in POINTS]


@given(intervals)
def test_joined_intervals_hold_the_same_points_and_lie_apart(parts):
    merged = joined(parts, 1e-9)
    assert inside(merged) == inside(parts)
    assert all(following[0] > earlier[1] for earlier, following in pairwise(merged))
    assert hull(merged) == hull(parts)


@given(starts_and_widths, intervals)
def test_uncovered_is_what_the_others_leave_of_it(wanted, parts):
    whole = (float(wanted[0]), float(sum(wanted)))
    gaps = uncovered(whole, parts, 1e-9)
    expected = [in_whole and not covered for in_whole, covered in zip(inside([whole]), inside(parts), strict=True)]
    assert inside(gaps) == expected


def test_gaps_within_the_tolerance_do_not_count():
    assert uncovered((0.0, 10.0), [(0.0, 4.0), (4.5, 10.0)], 0.6) == []
    assert uncovered((0.0, 10.0), [(0.0, 4.0), (4.5, 10.0)], 0.4) == [(4.0, 4.5)]


@given(starts_and_widths, starts_and_widths)
def test_common_width_is_negative_by_the_gap(first, second):
    a, b = ((float(low), float(low + width)) for low, width in (first, second))
    both = [one and other for one, other in zip(inside([a]), inside([b]), strict=True)]
    low, high = common(a, b)
    assert common_width(a, b) == high - low
    assert (inside([(low, high)]) if high > low else [False] * len(both)) == both
    if not any(both):
        assert -common_width(a, b) == pytest.approx(max(a[0] - b[1], b[0] - a[1]))


def test_narrow_intervals_are_written_with_more_digits():
    assert in_degrees((-15.5, 18.25)) == "-15.50 to 18.25 deg"
    assert in_degrees((1.0, 1.000001)) == "1.000000000 to 1.000001000 deg"
