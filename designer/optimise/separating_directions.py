"""Which direction keeps each pair of leg and solid apart, and the menu of directions that a program offers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

FAR = -1


@dataclass(frozen=True, slots=True)
class Separators:
    """The direction that keeps each pair apart: index per row of ``Pairs``, legs and solids, then solids alone.

    ``FAR`` leaves a pair out of the program, because it is far from touching.
    """

    legs: tuple[int, ...]
    solids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Menu:
    """The directions a program can choose from for each pair, ascending; none for a pair that is left out."""

    legs: tuple[tuple[int, ...], ...]
    solids: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, choices: Sequence[Separators]) -> Menu:
        """The smallest menu with all the given choices."""
        return cls(
            _union([choice.legs for choice in choices]),
            _union([choice.solids for choice in choices]),
        )

    def offers(self, choice: Separators) -> bool:
        """Whether a choice can be made from this menu."""
        chosen = zip((*choice.legs, *choice.solids), (*self.legs, *self.solids), strict=True)
        return all(direction == FAR or direction in directions for direction, directions in chosen)

    def with_choice(self, choice: Separators) -> Menu:
        """The menu with one more choice."""
        return Menu(_extended(self.legs, choice.legs), _extended(self.solids, choice.solids))

    @property
    def groups(self) -> tuple[tuple[tuple[int, tuple[int, ...]], ...], tuple[tuple[int, tuple[int, ...]], ...]]:
        """For legs and for solids: each direction with the rows of the pairs that may choose it, in a fixed order."""
        return _grouped(self.legs), _grouped(self.solids)

    def weights(self, choice: Separators) -> list[float]:
        """One for each direction chosen, zero for the others, in the order of ``groups``."""
        return [
            float(chosen[row] == direction)
            for chosen, groups in zip((choice.legs, choice.solids), self.groups, strict=True)
            for direction, rows in groups
            for row in rows
        ]


def _grouped(menu: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, tuple[int, ...]], ...]:
    members = defaultdict(list)
    for row, directions in enumerate(menu):
        for direction in directions:
            members[direction].append(row)
    return tuple((direction, tuple(rows)) for direction, rows in sorted(members.items()))


def _union(choices: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted(set(directions) - {FAR})) for directions in zip(*choices, strict=True))


def _extended(menu: tuple[tuple[int, ...], ...], choice: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted({*directions, chosen} - {FAR})) for directions, chosen in zip(menu, choice, strict=True))
