"""Which direction keeps each pair of leg and solid, or of two solids, apart.

A run of the solver has one direction for each pair, so that its expressions stay smooth. Directions are chosen at the
starts, and chosen anew at a result; the choice is a parameter of the program.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import (
    LEG_DIRECTIONS,
    LEG_NORMALS,
    SOLID_DIRECTIONS,
    SOLID_NORMALS,
    STARTING_SOLID_DIRECTIONS,
    normal_weights,
)
from designer.optimise.problem import Array, ConstraintEvaluation

FAR = -1

# A pair this much farther apart than asked, as a share of the envelope, is left out until it comes nearer.
FAR_SHARE_OF_ENVELOPE = 0.15
# A direction serves a start while it leaves this much more than the clearance asked, mm.
COMFORTABLE_MM = 1.0
# A pair nearer to its clearance than this holds the design; another direction must gain more than that to replace it.
ACTIVE_MM = 1e-4
GAIN_MM = 1e-5


@dataclass(frozen=True, slots=True)
class SeparatingDirections:
    """The direction that keeps each pair apart: index per row of ``Pairs``, legs and solids, then solids alone.

    ``FAR`` lets a run ignore a pair, because it is far from touching.
    """

    legs: tuple[int, ...]
    solids: tuple[int, ...]


# The last row, of nothing but zeros, stands for ``FAR``.
_LEG_WEIGHTS = np.pad(normal_weights(LEG_DIRECTIONS, LEG_NORMALS), ((0, 1), (0, 0)))
_SOLID_WEIGHTS = np.pad(normal_weights(SOLID_DIRECTIONS, SOLID_NORMALS), ((0, 1), (0, 0)))


def normals_of(choice: SeparatingDirections) -> Array:
    """The chosen directions as a program takes them: all legs' normals, pair by pair, then those of solids."""
    legs = [_LEG_WEIGHTS[direction] for direction in choice.legs]
    solids = [_SOLID_WEIGHTS[direction] for direction in choice.solids]
    return np.concatenate([np.ravel(legs), np.ravel(solids)])


def choose_directions(
    evaluation: ConstraintEvaluation, clearance: float, envelope: float
) -> list[SeparatingDirections]:
    """Directions for every design of an evaluation: one that serves most designs is taken wherever it serves."""
    legs = _choose(evaluation.light - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    solids = _choose(evaluation.bodies[:STARTING_SOLID_DIRECTIONS] - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    return [
        SeparatingDirections(tuple(legs[:, design].tolist()), tuple(solids[:, design].tolist()))
        for design in range(legs.shape[1])
    ]


def rechoose_directions(
    directions: SeparatingDirections, evaluation: ConstraintEvaluation, clearance: float, violation: float
) -> SeparatingDirections:
    """Directions for one evaluated design: those it was solved with, but for pairs that hold it and need not.

    ``violation`` is the design's largest scaled violation: at a point that is not feasible, the pairs that fail by
    that much are the ones that hold it.
    """
    threshold = ACTIVE_MM - violation
    return SeparatingDirections(
        _rechoose(directions.legs, evaluation.light[:, :, 0] - clearance, threshold),
        _rechoose(directions.solids, evaluation.bodies[:, :, 0] - clearance, threshold),
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
