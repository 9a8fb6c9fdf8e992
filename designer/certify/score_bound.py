"""A lower bound of the depth error over a box, from the ranges of what it is made of; in compiled loops.

At each node the square of the error is at least

    scale (p G(A + h, C + c) / S(A, C)^2 + r W(A, C) / S(A, C)^2) + edge + fixed

summed over both views, with A and C the mean variances of all blur along and across the meridian, h and c those that
equalisation adds, and S, W and G gradient energies of the texture, falling functions of both variances
(docs/certify.md). G over S^2 grows with A and with C, so the least of both gives the bound; with intervals alone, which
do not know that G and S fall together, the bound would be lost.
"""

from __future__ import annotations

import math

from designer.certify.intervals import INFINITE, compiled
from designer.optimise.operations import NODE_ROWS

ROWS = len(NODE_ROWS)
# The variances in G are at most so many times those in S: then G / S^2 grows with both (docs/certify.md).
MOST_RATIO = 3.9
# From here on G(3 y) / G(y)^2 grows with y, times the squared finest wave number.
BLURRED = 1.1
# Off every sum, for the rounding of some hundred operations.
SAFETY = 1.0 - 1e-12


@compiled
def gradient_energy(squared, contrast, fine, coarse):
    """The texture's gradient energy: noise.texture_gradient_energy, with a (a + b) / 2 of both blurs in mm^2."""
    lost = 0.0
    for sign, number in ((1.0, fine), (-1.0, coarse)):
        y = number * squared
        share = (70.0 + y * (32.0 + 8.0 * y)) / (105.0 + y * (90.0 + y * (36.0 + 8.0 * y)))
        lost += sign * number * share
    return contrast * lost


@compiled
def _match(low, high, at, contrast, fine, coarse):
    """What matching noise adds at a node at least; ``at`` are the places of its rows."""
    along, across, template = low[at[0]], low[at[1]], low[at[5]]
    if not (along > 0.0 and across > 0.0):
        return 0.0
    wider, most_template, most_across = along + 0.5 * template, high[at[5]], across + high[at[4]]
    squared = 0.5 * (wider + math.sqrt(wider * across))
    energy = gradient_energy(squared, contrast, fine, coarse)
    if not energy > 0.0:
        return 0.0
    # Whatever is added to the blur, G is at least this.
    floor = gradient_energy(3.0 * squared, contrast, fine, coarse) if fine * squared > BLURRED else 0.0
    total = 0.0
    for view in (0, 1):
        most_along = along + most_template + high[at[2 + view]]
        smoothed = floor
        if most_along <= MOST_RATIO * wider and most_across <= MOST_RATIO * across:
            mixed = 0.5 * (most_along + math.sqrt(most_along * most_across))
            smoothed = max(smoothed, gradient_energy(mixed, contrast, fine, coarse))
        total += max(low[at[6 + view]], 0.0) * smoothed
        most_along = along + most_template
        mixed = 0.5 * (most_along + math.sqrt(most_along * across))
        total += max(low[at[8 + view]], 0.0) * gradient_energy(mixed, contrast, fine, coarse)
    return max(low[at[10]], 0.0) * total / (energy * energy)


@compiled
def least_score(low, high, results, weights, contrast, fine, coarse):
    """The least depth error (rms) that the ranges of the score's rows allow."""
    total = 0.0
    for node in range(weights.size):
        at = results[node * ROWS : (node + 1) * ROWS]
        value = max(low[at[11]], 0.0) + max(low[at[12]], 0.0)
        if low[at[10]] > 0.0:
            value += _match(low, high, at, contrast, fine, coarse)
        total += weights[node] * value
    return math.sqrt(total * SAFETY) * SAFETY if total < INFINITE else 0.0
