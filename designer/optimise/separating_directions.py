"""Which direction keeps each pair of leg and solid, or of two solids, apart.

A run of the solver has one direction for each pair, so that its expressions stay smooth. Directions are chosen at the
starts, and chosen anew at a result; a program offers several for each pair, so that runs with different choices
share it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import STARTING_SOLID_DIRECTIONS
from designer.optimise.problem import Array, Evaluation

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

    ``FAR`` leaves a pair out of the program, because it is far from touching.
    """

    legs: tuple[int, ...]
    solids: tuple[int, ...]


Groups = tuple[tuple[int, tuple[int, ...]], ...]
"""Directions, each with the rows of the pairs that may choose it."""


@dataclass(frozen=True, slots=True)
class OfferedDirections:
    """The directions a program can choose from for each pair, ascending; none for a pair that is left out."""

    legs: tuple[tuple[int, ...], ...]
    solids: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, choices: Sequence[SeparatingDirections]) -> OfferedDirections:
        """The fewest directions that allow all the given choices."""
        return cls(
            _union([choice.legs for choice in choices]),
            _union([choice.solids for choice in choices]),
        )

    def allow(self, choice: SeparatingDirections) -> bool:
        """Whether a choice can be made from these."""
        chosen = zip((*choice.legs, *choice.solids), (*self.legs, *self.solids), strict=True)
        return all(direction == FAR or direction in directions for direction, directions in chosen)

    def with_choice(self, choice: SeparatingDirections) -> OfferedDirections:
        """These and those of one more choice."""
        return OfferedDirections(_extended(self.legs, choice.legs), _extended(self.solids, choice.solids))

    @property
    def groups(self) -> tuple[Groups, Groups]:
        """For legs and for solids: each direction with the rows of the pairs that may choose it, in a fixed order."""
        return _grouped(self.legs), _grouped(self.solids)

    def weights(self, choice: SeparatingDirections) -> list[float]:
        """One for each direction chosen, zero for the others, in the order of ``groups``."""
        return [
            float(chosen[row] == direction)
            for chosen, groups in zip((choice.legs, choice.solids), self.groups, strict=True)
            for direction, rows in groups
            for row in rows
        ]


def choose_directions(evaluation: Evaluation, clearance: float, envelope: float) -> list[SeparatingDirections]:
    """Directions for every design of an evaluation, as few different ones as will do.

    Each choice means building a program, so a direction that serves most designs is taken wherever it serves.
    """
    legs = _choose(evaluation.light - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    solids = _choose(evaluation.bodies[:STARTING_SOLID_DIRECTIONS] - clearance, FAR_SHARE_OF_ENVELOPE * envelope)
    return [
        SeparatingDirections(tuple(legs[:, design].tolist()), tuple(solids[:, design].tolist()))
        for design in range(legs.shape[1])
    ]


def rechoose_directions(
    directions: SeparatingDirections, evaluation: Evaluation, clearance: float, violation: float
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


def _grouped(offered: tuple[tuple[int, ...], ...]) -> Groups:
    members = defaultdict(list)
    for row, directions in enumerate(offered):
        for direction in directions:
            members[direction].append(row)
    return tuple((direction, tuple(rows)) for direction, rows in sorted(members.items()))


def _union(choices: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted(set(directions) - {FAR})) for directions in zip(*choices, strict=True))


def _extended(offered: tuple[tuple[int, ...], ...], choice: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    return tuple(
        tuple(sorted({*directions, chosen} - {FAR})) for directions, chosen in zip(offered, choice, strict=True)
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
