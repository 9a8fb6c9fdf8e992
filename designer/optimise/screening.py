"""Starting points: many random designs of a variant, evaluated at once, of which the most promising are kept."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import STARTING_SOLID_DIRECTIONS
from designer.optimise.limit import limiting_gains
from designer.optimise.problem import Array, Problem, evaluate, violations_of
from designer.optimise.system import System, put_together
from designer.optimise.variables import VARIABLES, with_principal_distance

# Random designs screened for every start that is kept, and how many of them have all their clearances looked at.
DESIGNS_PER_START = 384
CLEARANCES_PER_START = 8
# Starts nearer to each other than this, as a share of the unit box, lead to the same place.
LEAST_DISTANCE = 0.12
# A gain is first drawn between this share of the largest possible and all of it: the objective wants it large.
LARGE_GAIN_SHARE = 0.55

_SHAPES = np.array([variable.role == "shape" for variable in VARIABLES])


def draw(
    problem: Problem, count: int, random: np.random.Generator, least_gain_share: float = LARGE_GAIN_SHARE
) -> dict[str, Array]:
    """Random designs: free variables uniform in their bounds, gains by their share of what the image zones can hold.

    What is fixed is so in every design as far as it is a variable; other fixed numbers are left to the solver.
    """
    values = _placed_as_fixed(problem, problem.physical(random.random((len(VARIABLES), count))))
    limits = limiting_gains(problem.variant, problem.specification, values["baseline"], values["principal_distance"])
    configuration = problem.variant.configuration
    outer_share = least_gain_share ** (random.random(count) ** 2)
    inner_share = outer_share * least_gain_share ** (random.random(count) ** 2)
    for view, share in ((configuration.outer_view, outer_share), (configuration.inner_view, inner_share)):
        values[f"{view}_gain"] = problem.variant.gain_sign(view) * share * limits[view]
    for name, given in problem.fixed:
        if name in {"lower.gain", "upper.gain"}:
            values[name.replace(".", "_")] = np.full(count, given)
    return _focused(problem, values)


def _placed_as_fixed(problem: Problem, values: dict[str, Array]) -> dict[str, Array]:
    """The designs with fixed viewpoints and a fixed vertex of the secondary in their places."""
    fixed, baseline = dict(problem.fixed), values["baseline"]
    lower, upper = fixed.get("lower.viewpoint_mm"), fixed.get("upper.viewpoint_mm")
    if lower is not None and upper is not None:
        shortest, longest = problem.bounds["baseline"].low, problem.bounds["baseline"].high
        baseline = np.full_like(baseline, np.clip(upper - lower, shortest, longest))
    placed = {"baseline": baseline}
    if lower is not None:
        placed["lower_viewpoint"] = np.full_like(baseline, lower)
    elif upper is not None:
        placed["lower_viewpoint"] = upper - baseline
    if problem.variant.fold is not None and "secondary.vertex_mm" in fixed:
        placed["secondary_height"] = np.full_like(baseline, fixed["secondary.vertex_mm"])
    return values | placed


def _focused(problem: Problem, values: dict[str, Array]) -> dict[str, Array]:
    """The designs focused midway between their virtual images, as far as the lens can; a random focus blurs all."""
    low, high = problem.bounds["reciprocal_focus"].low, problem.bounds["reciprocal_focus"].high
    depths = [blur.reciprocal_depth for blur in put_together(problem.variant, values, problem.specification).blurs]
    middle = (np.max(depths, axis=0) + np.min(depths, axis=0)) / 2.0
    best = np.clip(np.where(np.isfinite(middle), middle, low), low, high)
    return with_principal_distance(values | {"reciprocal_focus": best})


def screen(
    problem: Problem, starts: int, random: np.random.Generator, least_gain_share: float = LARGE_GAIN_SHARE
) -> Array:
    """The most promising of many random designs, apart from one another: shape (variables, kept).

    Arrangements of the mirrors take turns: each holds about one optimum, and the one whose random designs violate
    least need not hold the best.
    """
    with np.errstate(all="ignore"):
        values, system = problem.enclosed(draw(problem, DESIGNS_PER_START * starts, random, least_gain_share))
        merit = violations_of(problem.constraints(system)).max(axis=0)
        kept = _in_turns(merit, arrangements(problem, values, system))[: CLEARANCES_PER_START * starts]
        values = {name: np.broadcast_to(value, merit.shape)[kept] for name, value in values.items()}
        values, system = problem.enclosed(values)
        violation = evaluate(problem, system, STARTING_SOLID_DIRECTIONS).largest_violations
        order = _in_turns(violation, arrangements(problem, values, system))
    return _apart(problem.scaled(values)[:, order], starts)


def arrangements(problem: Problem, values: Mapping[str, Array], system: System) -> NDArray[np.intp]:
    """A number for each design that tells how its mirrors are arranged along the axis.

    It says in which order mirrors and lens front follow, and in which half of its range the lower viewpoint lies.
    """
    heights = [mirror.rim_heights[0] for mirror in system.layout.mirrors]
    if len(heights) == 3:
        secondary, primary, direct = heights
        order = (direct > secondary) + 2 * (primary > problem.specification.lens_front)
    else:
        order = heights[1] > heights[0]
    lower = problem.bounds["lower_viewpoint"]
    return np.asarray(order + 4 * (values["lower_viewpoint"] > (lower.low + lower.high) / 2.0)).astype(np.intp)


def _in_turns(merit: Array, groups: NDArray[np.intp]) -> NDArray[np.intp]:
    """Indices such that groups take turns, each with its members in the order of their merit, smallest first."""
    order = np.argsort(merit, kind="stable")
    place = np.empty(len(merit), dtype=np.intp)
    for group in np.unique(groups):
        members = order[groups[order] == group]
        place[members] = np.arange(len(members))
    return np.lexsort((merit, place))


def _apart(scaled: Array, count: int) -> Array:
    """The first designs, in order, that keep the least distance from those before; fewer if there are none."""
    chosen: list[int] = []
    for index in range(scaled.shape[1]):
        distances = [np.linalg.norm(scaled[_SHAPES, index] - scaled[_SHAPES, other]) for other in chosen]
        if np.all(np.isfinite(scaled[:, index])) and all(distance > LEAST_DISTANCE for distance in distances):
            chosen.append(index)
        if len(chosen) == count:
            break
    return scaled[:, chosen]
