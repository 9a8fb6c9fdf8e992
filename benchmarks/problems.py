"""The problems that the benchmarks share: every shipped requirement times every configuration."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from designer.configurations import Configuration
from designer.optimise.problem import Problem
from designer.optimise.program import forget_programs
from designer.optimise.required_numbers import specification_of
from designer.optimise.search import SearchResult, search
from designer.optimise.variables import bounds_of, fixed_parameters, free_ranges
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement, read_requirement

ROOT = Path(__file__).parents[1]
RESULTS = Path(__file__).parent / "results"
SHIPPED = ("indoor_robot", "pipe_inspection", "ceiling_watch", "sky_watch")


@dataclass(frozen=True, slots=True)
class Ours:
    """What the designer says of one configuration, and the processor time it took to say so."""

    requirement: Requirement
    configuration: Configuration
    result: SearchResult
    seconds: float

    @property
    def value(self) -> float | None:
        """The first objective; None unless feasible."""
        first = self.result.first
        return None if first is None else first.goals[self.requirement.objective.minimise]

    @property
    def limit_ratio(self) -> float | None:
        """Depth error over the closed-form limit; None unless feasible."""
        first = self.result.first
        return None if first is None else first.goals["depth_error"] / self.result.limit_of_first


def shipped_requirement(name: str) -> Requirement:
    """One of the requirements that come with the designer."""
    return read_requirement(ROOT / "configs" / f"{name}.toml")


def solve_afresh(requirement: Requirement, configuration: Configuration) -> Ours:
    """Search one configuration with no program built beforehand."""
    forget_programs()
    started = time.process_time()
    result = search(requirement, configuration)
    return Ours(requirement, configuration, result, time.process_time() - started)


def problems_of(requirement: Requirement, configuration: Configuration) -> Iterator[Problem]:
    """One problem for each lens and variant, impossible or not: no rule has a say here."""
    fixed = tuple(sorted(fixed_parameters(requirement).items()))
    for lens in requirement.camera.lenses:
        specification = specification_of(requirement, lens)
        ranges = free_ranges(requirement, lens)
        for variant in enumerate_variants(configuration):
            yield Problem(variant, specification, bounds_of(variant, specification, ranges), fixed)
