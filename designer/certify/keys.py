"""Which rules each key of a requirement makes: what is left out to find the keys that conflict."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from designer.optimise.problem import Problem
from designer.optimise.required_numbers import SPECIFICATION_NAMES, specification_from, specification_values
from designer.optimise.variables import bounds_of, free_ranges
from designer.requirement import Lens, Requirement


@dataclass(frozen=True, slots=True)
class Key:
    """A key of the requirement: the kinds of rule it makes, and by what its number is multiplied where it is left out.

    The ranges of variables follow from some numbers too: without the key these are as wide as its ``loosened`` number
    makes them.
    """

    name: str
    kinds: tuple[str, ...]
    loosened: tuple[tuple[str, float], ...] = ()


KEYS = (
    Key("fixed", ("fixed",)),
    Key("camera.lens.radius_mm", ("lens_barrel", "lens_field")),
    Key("manufacture.zone_gap_px", ("zone_gap",), (("manufacture.zone_gap_px", 0.0),)),
    Key("manufacture.smallest_mirror_radius_mm", ("smallest_radius",)),
    Key("manufacture.clearance_mm", ("clearance",)),
    Key("manufacture.largest_slope_deg", ("steepest_slope",)),
    Key("envelope.mirror_diameter_mm", ("largest_diameter",), (("envelope.mirror_diameter_mm", 3.0),)),
    Key("envelope.diameter_mm", ("envelope_diameter",), (("envelope.diameter_mm", 3.0),)),
    Key("camera.nearest_mirror_mm", ("nearest_mirror",), (("camera.nearest_mirror_mm", 0.2),)),
    Key("camera.height_px", ("image_circle",), (("image_radius", 2.0),)),
    Key("envelope.height_mm", ("envelope_height",), (("envelope.height_mm", 3.0),)),
    Key("sharpness.max_blur_deg", ("blur",)),
)
"""Every key that a proof can do without, in the order in which they are left out: the likeliest last."""


def kinds_of(keys: Collection[Key]) -> frozenset[str]:
    """The kinds of rule that keys make."""
    return frozenset(kind for key in keys for kind in key.kinds)


def loosened(problem: Problem, requirement: Requirement, lens: Lens, keys: Collection[Key]) -> Problem:
    """A problem whose ranges do not follow from the keys that are left out."""
    factors = {name: factor for key in keys for name, factor in key.loosened}
    if not factors:
        return problem
    asked = problem.specification
    numbers = zip(SPECIFICATION_NAMES, specification_values(asked), strict=True)
    wider = specification_from((value * factors.get(name, 1.0) for name, value in numbers), asked.law, asked.housing)
    return replace(problem, bounds=bounds_of(problem.variant, wider, free_ranges(requirement, lens)))
