"""A study: what was asked, and everything that was found, whether a moment ago or read from its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pydantic import JsonValue

from designer.comparators.row import ComparatorRow
from designer.design import Design
from designer.requirement import Requirement
from designer.study.row import Row

if TYPE_CHECKING:  # OpenCV, which a study without checks does not need; and the tracer of built sensors
    from designer.study.checked import CheckedDesign
    from designer.study.tolerances import StudyTolerances


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
class LensRow:
    """One row of ``lenses.csv``: what a configuration reaches with one lens of the requirement's catalogue alone.

    ``number`` counts the lenses from 1, ``lens`` is the lens's name, or its number where it has none. The chosen lens
    has the numbers of the configuration's design. A lens focused at infinity has no focus distance; numbers are None
    where nothing is feasible.
    """

    configuration: str
    number: int
    lens: str
    is_chosen: bool
    status: str
    depth_error_rms: float | None = None
    height_mm: float | None = None
    diameter_mm: float | None = None
    f_number: float | None = None
    focus_distance_mm: float | None = None
    largest_blur_px: float | None = None
    largest_blur_deg: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Study:
    """The outcome of a study.

    ``rows`` has one row for each configuration, best first; ``designs`` the feasible ones by configuration, in the same
    order; ``pareto`` the Pareto fronts of the best; ``provenance`` where the results come from, as JSON. ``checked``
    holds the end-to-end checks by configuration, ``unchecked`` the reason for each design whose check broke down.
    ``lenses`` has a row for each configuration and lens of a catalogue, in the order of ``rows``, then of the
    requirement; none if there is one lens only. ``tolerances`` is what the best designs forgive, ``comparators`` what
    else could be built, if that was asked.
    """

    requirement: Requirement
    rows: tuple[Row, ...]
    designs: Mapping[str, Design]
    pareto: tuple[ParetoRow, ...] = ()
    provenance: Mapping[str, JsonValue] = field(default_factory=dict)
    checked: Mapping[str, CheckedDesign] = field(default_factory=dict)
    unchecked: Mapping[str, str] = field(default_factory=dict)
    lenses: tuple[LensRow, ...] = ()
    tolerances: StudyTolerances | None = None
    comparators: tuple[ComparatorRow, ...] = ()

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

    def lenses_of(self, configuration: str) -> tuple[LensRow, ...]:
        """What each lens of a catalogue gives in one configuration; none if there is one lens only."""
        return tuple(row for row in self.lenses if row.configuration == configuration)

    def row(self, configuration: str) -> Row | None:
        """The row of one configuration, or None."""
        return next((row for row in self.rows if row.configuration == configuration), None)
