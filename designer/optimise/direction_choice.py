"""Which direction keeps each pair of leg and solid apart: chosen at the starts, and chosen anew at a result."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.optimise.screening import Evaluation
from designer.optimise.separating_directions import FAR, Separators

Array = NDArray[np.float64]

# A pair this much farther apart than asked, as a share of the envelope, is left out until it comes nearer.
FAR_SHARE_OF_ENVELOPE = 0.15
# A direction serves a start while it leaves this much more than the clearance asked, mm.
COMFORTABLE_MM = 1.0
# A pair nearer to its clearance than this holds the design; another direction must gain more than that to replace it.
ACTIVE_MM = 1e-4
GAIN_MM = 1e-5


def choose_separators(evaluation: Evaluation, clearance: float, envelope: float) -> list[Separators]:
    """Separators for every design of a check, as few different ones as will do.

    Each choice means building a program, so a direction that serves most designs is taken wherever it serves.
    """
    legs = _choose(evaluation.light - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    solids = _choose(evaluation.bodies - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    return [
        Separators(tuple(legs[:, design].tolist()), tuple(solids[:, design].tolist()))
        for design in range(legs.shape[1])
    ]


def rechoose(separators: Separators, evaluation: Evaluation, clearance: float, violation: float) -> Separators:
    """Separators for one checked design: those it was solved with, but for pairs that hold it and need not.

    ``violation`` is the design's largest scaled violation: at a point that is not feasible, the pairs that fail by
    that much are the ones that hold it.
    """
    threshold = ACTIVE_MM - violation
    return Separators(
        _rechoose(separators.legs, evaluation.light[:, :, 0] - clearance, threshold),
        _rechoose(separators.solids, evaluation.bodies[:, :, 0] - clearance, threshold),
    )


def _choose(spare: Array, far: float) -> NDArray[np.intp]:
    """Directions for spare separations of shape (directions, pairs, designs): shape (pairs, designs)."""
    best = spare.argmax(axis=0)
    serves = (spare >= COMFORTABLE_MM) | (np.arange(len(spare))[:, None, None] == best)
    common = serves.sum(axis=2).argmax(axis=0)
    chosen = np.where(np.take_along_axis(serves, common[None, :, None], axis=0)[0], common[:, None], best)
    near = spare.max(axis=0).min(axis=1) < far
    return np.where(near[:, None], chosen, FAR)


def _rechoose(directions: tuple[int, ...], spare: Array, threshold: float) -> tuple[int, ...]:
    best = spare.argmax(axis=0)
    chosen = []
    for pair, direction in enumerate(directions):
        most = spare[best[pair], pair]
        if direction == FAR:
            chosen.append(int(best[pair]) if most < threshold else FAR)
        else:
            held = spare[direction, pair]
            chosen.append(int(best[pair]) if held < threshold and most > held + GAIN_MM else direction)
    return tuple(chosen)
