"""A study: what was asked, and everything that was found, whether a moment ago or read from its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pydantic import JsonValue

from designer.design import Design
from designer.requirement import Requirement
from designer.study.row import Row

if TYPE_CHECKING:  # OpenCV, which a study without checks does not need
    from designer.study.checked import CheckedDesign


@dataclass(frozen=True, slots=True)
class ParetoRow:
    """One row of ``fronts.csv``: the design of least depth error with ``swept`` (a column) at most ``limit_mm``."""

    configuration: str
    swept: str
    limit_mm: float
    status: str
    depth_error_rms: float | None
    height_mm: float | None
    diameter_mm: float | None


@dataclass(frozen=True, slots=True)
class Study:
    """The outcome of a study.

    ``rows`` has one row for each configuration, best first; ``designs`` the feasible ones by configuration, in the same
    order; ``pareto`` the Pareto fronts of the best; ``provenance`` where the results come from, as JSON. ``checked``
    holds the end-to-end checks by configuration, ``unchecked`` the reason for each design whose check broke down.
    """

    requirement: Requirement
    rows: tuple[Row, ...]
    designs: Mapping[str, Design]
    pareto: tuple[ParetoRow, ...] = ()
    provenance: Mapping[str, JsonValue] = field(default_factory=dict)
    checked: Mapping[str, CheckedDesign] = field(default_factory=dict)
    unchecked: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The study's name."""
        return self.requirement.name

    @property
    def title(self) -> str:
        """The study's title, or its name if it has none."""
        return self.requirement.title or self.name

    @property
    def feasible(self) -> tuple[Row, ...]:
        """Feasible rows, best first."""
        return self.with_status("feasible")

    def with_status(self, status: str) -> tuple[Row, ...]:
        """Rows of one status, in order."""
        return tuple(row for row in self.rows if row.status == status)

    def best(self, count: int = 5) -> tuple[tuple[Row, Design], ...]:
        """The best feasible rows with their designs."""
        return tuple((row, self.designs[row.configuration]) for row in self.feasible[:count])

    def checks(self) -> tuple[tuple[Row, CheckedDesign], ...]:
        """The rows of designs that were checked end to end, best first, with their checks."""
        return tuple(
            (row, self.checked[row.configuration]) for row in self.feasible if row.configuration in self.checked
        )

    def not_checked(self) -> tuple[tuple[Row, str], ...]:
        """The rows of designs that could not be checked, best first, with the reason."""
        return tuple(
            (row, self.unchecked[row.configuration]) for row in self.feasible if row.configuration in self.unchecked
        )

    def row(self, configuration: str) -> Row | None:
        """The row of one configuration, or None."""
        return next((row for row in self.rows if row.configuration == configuration), None)
