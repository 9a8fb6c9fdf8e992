"""The front of depth error against size: the least depth error within each of several bounds on a size.

Bounds are tightened around a finished design and loosened again, and every bound gets fresh starts in all variants.
Then bounds share their designs, as the points of a sweep do, until none is better for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.optimise.again import Fresh, least_again
from designer.optimise.branch import WarmStart, limit_at
from designer.optimise.multistart import LARGEST_VIOLATION, Candidate, improve, task_of
from designer.optimise.solver import StageTarget
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement, set_key

# So many fresh starts for each variant at each bound but the tightest, which gets as many as a study: what fits there
# fits everywhere.
FEW_STARTS = 8


@dataclass(frozen=True, slots=True)
class ParetoPoint:
    """The least depth error found with one size (``height`` or ``diameter``) at most ``limit`` mm: all goals there."""

    swept: str
    limit: float
    goals: dict[str, float]


def trace_pareto_front(
    requirement: Requirement,
    first: Candidate,
    sizes: Sequence[str],
    points: int,
    unbounded: Sequence[WarmStart] = (),
) -> list[ParetoPoint]:
    """Bound each size in equal steps, from that of the least depth error down to the least found.

    No point is worse than a tighter one; the tightest lies a hair above the least size, where nothing is left to
    choose.

    Parameters
    ----------
    requirement
        What was asked; its objectives play no part.
    first
        A feasible design, whatever was minimised to find it.
    unbounded
        Where the search for the least depth error without any bound ended in each lens and variant, if known.
    """
    loosest = improve(task_of(first), [first], StageTarget("depth_error"))[0]
    front = []
    for size in sizes:
        ends = improve(task_of(first), [loosest, first], StageTarget(size))
        smallest = min(ends, key=lambda design: design.goals[size])
        least = smallest.goals[size]
        limits = [float(limit) for limit in np.linspace(loosest.goals[size], least, points)]
        bounds = [max(limit, least * (1.0 + 1e-6)) for limit in limits]
        found = _loosened(smallest, size, bounds, _tightened(loosest, size, bounds))
        found = _shared(requirement, size, bounds, found, unbounded)
        front += [ParetoPoint(size, limit, design.goals) for limit, design in zip(limits, found, strict=True)]
    return front


def _tightened(design: Candidate, size: str, bounds: Sequence[float]) -> list[Candidate | None]:
    """The least depth error within each bound, loosest first, each from its neighbour; None where it is stuck."""
    found: list[Candidate | None] = []
    for bound in bounds:
        start = design
        if start.goals[size] > bound:
            start = improve(task_of(design), [design], StageTarget(size))[0]
        if start.goals[size] > bound * (1.0 + LARGEST_VIOLATION):
            found.append(None)
            continue
        design = _least_depth_error(start, size, bound)
        found.append(design)
    return found


def _loosened(
    design: Candidate, size: str, bounds: Sequence[float], known: Sequence[Candidate | None]
) -> list[Candidate]:
    """The same from a design within the tightest bound on; where better is known, from there."""
    found = []
    for bound, other in zip(reversed(bounds), reversed(known), strict=True):
        design = _least_depth_error(design, size, bound)
        if other is not None and other.goals["depth_error"] < design.goals["depth_error"]:
            design = other
        found.append(design)
    return found[::-1]


def _least_depth_error(start: Candidate, size: str, bound: float) -> Candidate:
    return improve(task_of(start), [start], StageTarget("depth_error", ((size, bound),)))[0]


def _shared(
    requirement: Requirement,
    size: str,
    bounds: Sequence[float],
    designs: Sequence[Candidate],
    unbounded: Sequence[WarmStart],
) -> list[Candidate]:
    """The designs within their bounds, loosest first, after fresh starts and after what each has learnt from others."""
    found = list(designs)
    asked = [_bounded(requirement, size, bound) for bound in bounds]
    known: list[Sequence[WarmStart]] = [(_warm_start(requirement, design),) for design in designs]
    configuration = designs[0].problem.variant.configuration
    # A bound takes designs away and adds none: a variant does no better within it, if its search found the best.
    least = {(start.lens, start.variant): start.first_value for start in unbounded if start.first_value is not None}
    is_first = True
    waiting = set(range(len(bounds)))
    while waiting:
        better = set()
        for place in sorted(waiting):
            reached = found[place].goals["depth_error"]
            beside = [known[other] for other in (place - 1, place + 1) if 0 <= other < len(bounds)]
            result = least_again(
                asked[place],
                configuration,
                known[place],
                beside if place else [unbounded, *beside],
                (Fresh() if place == len(bounds) - 1 else Fresh(FEW_STARTS, place + 1)) if is_first else None,
                [branch for branch, value in least.items() if value >= reached],
            )
            if result is None:
                continue
            best, known[place] = result
            if best.goals["depth_error"] < reached:
                found[place] = best
            better.add(place)
        waiting = {other for place in better for other in (place - 1, place + 1) if 0 <= other < len(bounds)}
        is_first = False
    for place in reversed(range(len(bounds) - 1)):
        # What fits into the tighter bound fits into the looser one.
        found[place] = min(found[place], found[place + 1], key=lambda design: design.goals["depth_error"])
    return found


def _bounded(requirement: Requirement, size: str, bound: float) -> Requirement:
    """A requirement that minimises the depth error with a size at most a bound."""
    asked = set_key(requirement, "objective", {"minimise": "depth_error", "then": size})
    if size == "diameter" and bound < asked.envelope.mirror_diameter_mm:
        asked = set_key(asked, "envelope.mirror_diameter_mm", bound)
    return set_key(asked, f"envelope.{size}_mm", bound)


def _warm_start(requirement: Requirement, design: Candidate) -> WarmStart:
    variant = design.problem.variant
    return WarmStart(
        requirement.camera.lenses.index(design.lens),
        enumerate_variants(variant.configuration).index(variant),
        True,
        design.values,
        None,
        design.directions,
        first_value=design.goals["depth_error"],
        scale=limit_at(design),
    )
