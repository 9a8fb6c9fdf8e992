"""Tolerances as people name them: by a grade, or by a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from designer.as_built.tolerances import GRADES, Tolerances, read_tolerances, tolerances_of_grade
from designer.design import Design
from designer.files import InputError


@dataclass(frozen=True, slots=True)
class NamedTolerances:
    """Tolerances, and the name of the grade or file that they come from."""

    name: str
    values: Tolerances

    @property
    def in_words(self) -> str:
        """The name as a sentence has it."""
        return f"the {self.name} grade" if self.name in GRADES else self.name


def named_tolerances(named: str, design: Design | None = None) -> NamedTolerances:
    """The tolerances of a grade or of a TOML file, for a design or for any.

    Raises
    ------
    InputError
        There is no such grade, the file cannot be used, or it does not fit the design.
    """
    if named in GRADES:
        return NamedTolerances(named, tolerances_of_grade(named))
    if not named.endswith(".toml"):
        raise InputError(f"tolerances {named}: must be {', '.join(GRADES)}, or a TOML file")
    return NamedTolerances(Path(named).name, read_tolerances(Path(named), design))
