"""One comparison: what others found, what the designer gives now."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

THEIRS = Path(__file__).parent / "theirs"


@dataclass(frozen=True, slots=True)
class Row:
    """A quantity that others computed, measured or published, and our function for it.

    Attributes
    ----------
    key
        Its name on the command line, and in the files of ``theirs/``.
    quantity, unit
        What is compared.
    ours
        Computes our number, from the inputs alone.
    format
        How our digits are written, a format specification.
    convergence
        How our number settles, for a numerical one; a sentence.
    few_digits
        Why fewer than six digits are compared; empty where six or more are.
    is_quick
        Whether it takes less than a second.
    is_bound
        Theirs is a bound that ours must keep, not a value that it must equal; the quantity says on which side.
    """

    key: str
    quantity: str
    unit: str
    ours: Callable[[], float]
    format: str
    convergence: str = "closed form"
    few_digits: str = ""
    is_quick: bool = True
    is_bound: bool = False

    @property
    def theirs(self) -> Theirs:
        """What others have."""
        return all_of_theirs()[self.key]


@dataclass(frozen=True, slots=True)
class Theirs:
    """A number of others: its digits as they stand in the source, the source, and how it was found there."""

    digits: str
    source: str
    how: str


@cache
def all_of_theirs() -> dict[str, Theirs]:
    """Every number in ``theirs/`` by its key."""
    found: dict[str, Theirs] = {}
    for file in sorted(THEIRS.glob("*.json")):
        content = json.loads(file.read_text(encoding="utf-8"))
        for key, digits in content["values"].items():
            if key in found:
                raise ValueError(f"{file.name}: {key} is in another file too")
            found[key] = Theirs(digits, content["source"], content["how"])
    return found
