"""The sum of absolute differences over a window, at every disparity of a search, and its least values both ways.

Costs are never stored as a volume: one disparity at a time updates the best so far, with the costs beside it that
the interpolation needs. That keeps the working set in the cache, and forward and reverse search share every cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.imaging.panorama import Image

Costs = NDArray[np.uint16]

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

    index: Costs
    best: Costs
    before: Costs
    after: Costs
    reverse_index: Costs
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
        sums = _windowed(differences, window)[half : half + columns]
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
    half = window // 2
    columns, rows = upper.shape[0] - 2 * half, upper.shape[1]
    best, before, after, reverse_best = (np.full((columns, rows), UNSEARCHED, np.uint16) for _ in range(4))
    index, reverse_index, label = (np.zeros((columns, rows), np.uint16) for _ in range(3))
    cost, previous = np.full_like(best, UNSEARCHED), np.full_like(best, UNSEARCHED)
    improved = np.zeros((columns, rows), np.uint8)
    for number, (first, last) in enumerate(spans):
        disparity = lowest + number
        cost, previous = previous, cost
        cost.fill(UNSEARCHED)
        label.fill(number)
        if last > first:
            low, high = max(first - half, disparity, 0), min(last + half, rows + disparity, rows)
            differences = cv2.absdiff(upper[:, low:high], lower[:, low - disparity : high - disparity])
            sums = _windowed(differences, window)
            cost[:, first:last] = sums[half : half + columns, first - low : last - low]
        cv2.copyTo(cost, improved, after)
        cv2.compare(cost, best, cv2.CMP_LT, improved)
        cv2.copyTo(previous, improved, before)
        cv2.copyTo(label, improved, index)
        cv2.min(cost, best, best)
        if last > first:
            seen = slice(first - disparity, last - disparity)
            reversed_cost, reversed_best = cost[:, first:last], reverse_best[:, seen]
            better = cv2.compare(reversed_cost, reversed_best, cv2.CMP_LT)
            reverse_index[:, seen] = cv2.copyTo(label[:, first:last], better, reverse_index[:, seen])
            cv2.min(reversed_cost, reversed_best, reversed_best)
    # The winners at the very last disparity have no neighbour after them.
    after[improved > 0] = UNSEARCHED
    return Winners(index, best, before, after, reverse_index, reverse_best)


def _windowed(differences: cv2.typing.MatLike, window: int) -> cv2.typing.MatLike:
    """Sums over a window; beyond the ends it repeats the outermost value."""
    return cv2.boxFilter(differences, cv2.CV_16U, (window, window), normalize=False, borderType=cv2.BORDER_REPLICATE)
