"""A study of some of the configurations that its requirement selects."""

from __future__ import annotations

from collections.abc import Iterable

from designer.files import InputError
from designer.requirement import Requirement, set_key
from designer.requirement.names import select_configurations


def restrict(requirement: Requirement, only: Iterable[str], word: str = "only") -> Requirement:
    """The requirement for those of its configurations that match; ``solve.configurations`` then names them.

    Parameters
    ----------
    only
        Names or glob patterns; all that the requirement selects if empty.
    word
        What people call this selection, for messages.

    Raises
    ------
    InputError
        A pattern matches none of the 44, or only such as the requirement leaves out.
    """
    own = requirement.configurations
    chosen = set()
    for pattern in only:
        try:
            matching = set(select_configurations([pattern]))
        except ValueError as error:
            raise InputError(f"{word}: {error}") from None
        if matching.isdisjoint(own):
            raise InputError(
                f"{word}: {pattern!r} matches only configurations that the requirement excludes: "
                f"solve.configurations = {list(requirement.solve.configurations)}"
            )
        chosen |= matching
    if not chosen:
        return requirement
    names = [configuration.name for configuration in own if configuration in chosen]
    return set_key(requirement, "solve.configurations", names)
