"""Intervals of angles: what they have in common, what they leave uncovered, and how they read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.design import Interval


def hull(intervals: Sequence[Interval]) -> Interval | None:
    """The smallest interval that holds all the given ones, or None."""
    if not intervals:
        return None
    return min(low for low, _ in intervals), max(high for _, high in intervals)


def uncovered(wanted: Interval, intervals: Sequence[Interval], tolerance: float) -> list[Interval]:
    """The parts of an interval, wider than the tolerance, that no other interval covers."""
    gaps = []
    reached = wanted[0]
    for low, high in [*sorted(intervals), (wanted[1], np.inf)]:
        low = min(low, wanted[1])
        if low - reached > tolerance:
            gaps.append((reached, low))
        reached = max(reached, high)
    return gaps


def joined(intervals: Sequence[Interval], tolerance: float) -> list[Interval]:
    """Intervals in rising order, those that meet within the tolerance made one."""
    merged: list[Interval] = []
    for low, high in sorted(intervals):
        if merged and low - merged[-1][1] <= tolerance:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged


def common(first: Interval, second: Interval) -> Interval:
    """The interval that two have in common; falling if they have none."""
    return max(first[0], second[0]), min(first[1], second[1])


def common_width(first: Interval, second: Interval) -> float:
    """Width of what two intervals have in common; negative by the gap between them."""
    low, high = common(first, second)
    return high - low


def in_degrees(interval: Interval) -> str:
    """An interval in words, with as many digits as its width needs."""
    low, high = interval
    digits = 2 if high - low >= 0.02 else 9
    return f"{low:.{digits}f} to {high:.{digits}f} deg"
