"""The sum of absolute differences over a window, at every disparity of a search, and its least values both ways.

Costs are never stored as a volume: one disparity at a time updates the best so far, with the costs beside it that
the interpolation needs. That keeps the working set in the cache, and forward and reverse search share every cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.imaging.images import Image

Costs = NDArray[np.uint16]
Numbers = NDArray[np.uint8] | NDArray[np.uint16]

# Above any sum: not searched. Windows of up to 15 x 15 pixels fit below it.
UNSEARCHED = 65535
LARGEST_WINDOW = 15


@dataclass(frozen=True, slots=True, eq=False)
class Winners:
    """The best disparity of each pixel, all arrays of shape (columns, rows).

    ``index`` counts disparities from the lowest of the search; ``best``, ``before`` and ``after`` are the costs of the
    winner and its neighbours (``UNSEARCHED`` where there is none). ``reverse_index`` belongs to the lower view's
    pixels: the disparity that suits each of them best, meaningful where ``reverse_best`` is below ``UNSEARCHED``.
    """

    index: Numbers
    best: Costs
    before: Costs
    after: Costs
    reverse_index: Numbers
    reverse_best: Costs


def equiangular_fit(before: Costs, best: Costs, after: Costs) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Interpolate a winner whose cost and neighbouring costs are given, by two lines of equal and opposite slope.

    They fit better than a parabola, since sums of absolute differences rise linearly on both sides of the true
    disparity.

    Returns
    -------
    The fraction of a disparity to add to the winner, within half of one, and the cost where the lines meet.
    """
    fraction, following = before.astype(np.float32), after.astype(np.float32)
    rise = np.maximum(fraction, following)
    rise -= best
    fraction -= following
    # A flat minimum stays where it is; one that is none, half a disparity at most.
    np.maximum(rise, np.float32(0.5), out=rise)
    fraction /= rise
    fraction *= np.float32(0.5)
    np.clip(fraction, -0.5, 0.5, out=fraction)
    rise *= np.abs(fraction)
    return fraction, np.subtract(best, rise, out=rise)


def sums_beside(upper: Image, lower: Image, disparities: NDArray[np.int16], window: int) -> tuple[Costs, Costs, Costs]:
    """Sums of absolute differences one below, at and one above a whole disparity given for each pixel.

    Parameters
    ----------
    upper, lower
        Scan lines of both views, (columns + window - 1, rows).
    disparities
        Of shape (columns, rows), not necessarily the best ones.

    Returns
    -------
    Three arrays of shape (columns, rows), ``UNSEARCHED`` where the other view has no such row.
    """
    half = window // 2
    columns, rows = disparities.shape
    before, best, after = (np.full((columns, rows), UNSEARCHED, np.uint16) for _ in range(3))
    for disparity in range(int(disparities.min()) - 1, int(disparities.max()) + 2):
        low, high = max(disparity, 0), min(rows + disparity, rows)
        if low >= high:
            continue
        differences = cv2.absdiff(upper[:, low:high], lower[:, low - disparity : high - disparity])
        sums = _windowed(np.asarray(differences, dtype=np.uint8), window)[half : half + columns]
        for costs, offset in ((before, 1), (best, 0), (after, -1)):
            wanted = disparities[:, low:high] == disparity + offset
            np.copyto(costs[:, low:high], sums, where=wanted)
    return before, best, after


def least_sums(upper: Image, lower: Image, lowest: int, spans: tuple[tuple[int, int], ...], window: int) -> Winners:
    """Search scan lines for the least sum of absolute differences.

    Parameters
    ----------
    upper, lower
        Scan lines of both views, (columns + window - 1, rows): half a window beyond the columns asked for.
    lowest, spans
        The smallest disparity, and for each disparity from there on the first row and the row after the last of the
        upper view for which it is tried; a row minus its disparity is a row of the lower view.
    window
        Odd side of the window, at most ``LARGEST_WINDOW``. Beyond the first and last row it repeats the outermost.
    """
    shape, rows = upper.shape, upper.shape[1]
    best, before, after, reverse_best, cost, previous = (np.full(shape, UNSEARCHED, np.uint16) for _ in range(6))
    smallest = np.uint8 if len(spans) <= 256 else np.uint16
    index, reverse_index, label = (np.zeros(shape, smallest) for _ in range(3))
    improved, better, differences = (np.zeros(shape, np.uint8) for _ in range(3))
    half = window // 2
    for number, (first, last) in enumerate(spans):
        disparity = lowest + number
        cost, previous = previous, cost
        label.fill(number)
        if last > first:
            # The window sees half of itself beyond the rows asked for, as far as both views have any.
            low, high = max(first - half, disparity, 0), min(last + half, rows + disparity, rows)
            overlap = differences[:, low:high]
            cv2.absdiff(upper[:, low:high], lower[:, low - disparity : high - disparity], overlap)
            _windowed(overlap, window, cost[:, low:high])
        cost[:, :first] = UNSEARCHED
        cost[:, last:] = UNSEARCHED
        cv2.copyTo(cost, improved, after)
        cv2.compare(cost, best, cv2.CMP_LT, improved)
        cv2.copyTo(previous, improved, before)
        cv2.copyTo(label, improved, index)
        cv2.min(cost, best, best)
        if last > first:
            seen = slice(first - disparity, last - disparity)
            cv2.compare(cost[:, first:last], reverse_best[:, seen], cv2.CMP_LT, better[:, seen])
            cv2.copyTo(label[:, seen], better[:, seen], reverse_index[:, seen])
            cv2.min(cost[:, first:last], reverse_best[:, seen], reverse_best[:, seen])
    # The winners at the very last disparity have no neighbour after them.
    after[improved > 0] = UNSEARCHED
    inner = slice(half, shape[0] - half)
    return Winners(index[inner], best[inner], before[inner], after[inner], reverse_index[inner], reverse_best[inner])


def _windowed(differences: Image, window: int, into: Costs | None = None) -> Costs:
    """Sums over a window; beyond the ends it repeats the outermost value."""
    sums = cv2.boxFilter(
        differences, cv2.CV_16U, (window, window), into, normalize=False, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(sums, dtype=np.uint16)
