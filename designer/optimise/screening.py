"""Starting points: many random designs of a variant, evaluated at once, of which the most promising are kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import Pairs, pair_up, separations
from designer.optimise.bounds import Bounds, limits_at, physical
from designer.optimise.specification import Specification
from designer.optimise.system import VARIABLES, System, assemble, enclosing
from designer.optimise.variants import Variant

Array = NDArray[np.float64]

# Random designs screened for every start that is kept, and how many of them have all their clearances looked at.
DESIGNS_PER_START = 384
CLEARANCES_PER_START = 8
# Starts nearer to each other than this, as a share of the unit box, lead to the same place.
LEAST_DISTANCE = 0.12
# A gain is first drawn between this share of the largest possible and all of it: the objective wants it large.
LARGE_GAIN_SHARE = 0.55


@dataclass(frozen=True, slots=True)
class Problem:
    """One variant of a configuration under one requirement and lens: all that the optimiser needs to know."""

    variant: Variant
    specification: Specification
    bounds: Bounds
    fixed: tuple[tuple[str, float], ...]

    @property
    def fixed_values(self) -> Mapping[str, float]:
        """Fixed parameters by name."""
        return dict(self.fixed)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Independent evaluation of designs in NumPy; arrays of shape (..., n) for n designs.

    ``amounts`` are what constraints have to spare in their own ``units``, negative where they fail; ``violations`` are
    the scaled amounts by which they fail, zero if kept. Both follow ``names``: constraints, then pairs of leg and
    solid, then pairs of solids. ``light`` and ``bodies`` hold the separations along every direction, shape
    (directions, pairs, n).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    amounts: Array
    violations: Array
    light: Array
    bodies: Array

    @property
    def largest_violations(self) -> Array:
        """Largest scaled violation of each design."""
        return np.asarray(self.violations.max(axis=0))

    def of_design(self, index: int) -> Evaluation:
        """The check of one design: arrays of shape (..., 1)."""
        one = slice(index, index + 1)
        return replace(
            self,
            amounts=self.amounts[..., one],
            violations=self.violations[..., one],
            light=self.light[..., one],
            bodies=self.bodies[..., one],
        )

    @property
    def clearances(self) -> Array:
        """Separation of every pair along its best direction, mm."""
        return np.concatenate([self.light.max(axis=0), self.bodies.max(axis=0)])


def physical_values(problem: Problem, scaled: Array) -> dict[str, Array]:
    """Physical variables of designs in the unit box; ``scaled`` has shape (variables, ...)."""
    values = {}
    for name, row in zip(VARIABLES, scaled, strict=True):
        interval = problem.bounds[name]
        low, high = interval.scaled_ends
        values[name] = np.asarray(physical(problem.variant, name, row, low, high, interval.logarithmic))
    return values


def scaled_values(problem: Problem, values: Mapping[str, Array]) -> Array:
    """Inverse of :func:`physical_values`; a variable whose range is a point is 0."""
    rows = []
    for name in VARIABLES:
        interval = problem.bounds[name]
        low, high = interval.scaled_ends
        value = np.asarray(values[name], dtype=float)
        if high == low:
            rows.append(np.zeros_like(value))
            continue
        # A gain of 0 lies at minus infinity, and so outside every box.
        with np.errstate(divide="ignore"):
            on_scale = np.log(np.abs(value)) if interval.logarithmic else value
        rows.append((on_scale - low) / (high - low))
    return np.stack(np.broadcast_arrays(*rows))


def assemble_enclosed(problem: Problem, values: dict[str, Array]) -> tuple[dict[str, Array], System]:
    """Set top, bottom and radius to what the mirrors need, and put the designs together."""
    enclosed = values | enclosing(problem.variant, values, problem.specification)
    return enclosed, assemble(problem.variant, enclosed, problem.specification, problem.fixed_values)


def check(problem: Problem, system: System, pairs: Pairs | None = None) -> Evaluation:
    """Evaluate every constraint and every clearance of designs, none left to the solver's word."""
    pairs = pairs or pair_up(system.layout)
    light, bodies = separations(system.layout, pairs)
    clearances = np.concatenate([light.max(axis=0), bodies.max(axis=0)])
    scalar = constraint_violations(system)
    spare = clearances - problem.specification.clearance
    shape = np.broadcast_shapes(scalar.shape[1:], spare.shape[1:])
    violations = np.concatenate(
        [np.broadcast_to(scalar, (len(scalar), *shape)), np.broadcast_to(np.maximum(-spare, 0.0), (len(spare), *shape))]
    )
    amounts = [np.broadcast_to(np.asarray(item.value, dtype=float), shape) for item in system.constraints]
    return Evaluation(
        tuple(item.name for item in system.constraints) + pairs.names,
        tuple(item.unit for item in system.constraints) + ("mm",) * len(pairs.names),
        np.concatenate([np.stack(amounts), np.broadcast_to(spare, (len(spare), *shape))]),
        np.where(np.isfinite(violations), violations, np.inf),
        light,
        bodies,
    )


def constraint_violations(system: System) -> Array:
    """Scaled violation of every constraint but the clearances, shape (constraints, ...)."""
    rows = []
    for constraint in system.constraints:
        value = np.asarray(constraint.value, dtype=float) / constraint.scale
        violation = np.abs(value) if constraint.equality else np.maximum(-value, 0.0)
        rows.append(np.where(np.isfinite(violation), violation, np.inf))
    return np.stack(np.broadcast_arrays(*rows))


def draw(
    problem: Problem, count: int, random: np.random.Generator, least_gain_share: float = LARGE_GAIN_SHARE
) -> dict[str, Array]:
    """Random designs: free variables uniform in the box, gains by their share of what the image zones can hold."""
    scaled = random.random((len(VARIABLES), count))
    values = physical_values(problem, scaled)
    limits = limits_at(problem.variant, problem.specification, values["baseline"], values["principal_distance"])
    outer = "upper" if problem.variant.configuration.topology == "upper_outer" else "lower"
    inner = "lower" if outer == "upper" else "upper"
    outer_share = least_gain_share ** (random.random(count) ** 2)
    inner_share = outer_share * least_gain_share ** (random.random(count) ** 2)
    for view, share in ((outer, outer_share), (inner, inner_share)):
        values[f"{view}_gain"] = problem.variant.gain_sign(view) * share * limits[view]
    return values


def screen(
    problem: Problem, starts: int, random: np.random.Generator, least_gain_share: float = LARGE_GAIN_SHARE
) -> Array:
    """The most promising of many random designs, apart from one another: shape (variables, kept).

    Arrangements of the mirrors take turns: each holds about one optimum, and the one whose random designs violate
    least need not hold the best.
    """
    with np.errstate(all="ignore"):
        values = draw(problem, DESIGNS_PER_START * starts, random, least_gain_share)
        values, system = assemble_enclosed(problem, values)
        merit = constraint_violations(system).max(axis=0)
        kept = _in_turns(merit, arrangements(problem, values, system))[: CLEARANCES_PER_START * starts]
        values = {name: np.broadcast_to(value, merit.shape)[kept] for name, value in values.items()}
        values, system = assemble_enclosed(problem, values)
        violation = check(problem, system).largest_violations
        order = _in_turns(violation, arrangements(problem, values, system))
    return _apart(scaled_values(problem, values)[:, order], starts)


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
    placed = np.array([name not in {"top", "bottom", "radius"} for name in VARIABLES])
    chosen: list[int] = []
    for index in range(scaled.shape[1]):
        distances = [np.linalg.norm(scaled[placed, index] - scaled[placed, other]) for other in chosen]
        if np.all(np.isfinite(scaled[:, index])) and all(distance > LEAST_DISTANCE for distance in distances):
            chosen.append(index)
        if len(chosen) == count:
            break
    return scaled[:, chosen]
