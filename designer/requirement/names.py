"""Choosing among the 44 by name or glob pattern, and naming the nearest when a name does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from fnmatch import fnmatchcase

from designer.configurations import Configuration, enumerate_configurations
from designer.requirement.quantity import refuse


def select_configurations(patterns: Iterable[str]) -> tuple[Configuration, ...]:
    """The configurations whose name matches any of the patterns, in the order of the 44.

    Raises
    ------
    PydanticCustomError
        A pattern matches none; a :class:`ValueError` whose text names the nearest configuration.
    """
    chosen = set()
    for pattern in patterns:
        matching = {name for name in _names() if fnmatchcase(name, pattern)}
        if not matching:
            refuse(f"{' '.join(pattern.split())!r} matches none of the 44 configurations; {nearest(pattern, _names())}")
        chosen |= matching
    return tuple(configuration for configuration in enumerate_configurations() if configuration.name in chosen)


def nearest(written: object, known: tuple[str, ...]) -> str:
    """Advice for a name that does not exist: the nearest one if it is near, and all of them if they are few."""
    close = difflib.get_close_matches(str(written), known, n=1)
    advice = f"did you mean {close[0]}?" if close else ""
    if len(known) <= 12 or not advice:
        listing = f"allowed: {', '.join(known)}" if len(known) <= 12 else f"an example is {known[0]}"
        return f"{advice} ({listing})" if advice else listing
    return advice


def _names() -> tuple[str, ...]:
    return tuple(configuration.name for configuration in enumerate_configurations())
