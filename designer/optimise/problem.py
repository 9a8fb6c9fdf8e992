"""One variant under one requirement and lens, and what its designs keep or fail: evaluated in NumPy, solver or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import SOLID_DIRECTIONS, pair_up, separations
from designer.optimise.constraints import Constraint, constraints_of
from designer.optimise.required_numbers import Specification
from designer.optimise.system import System, enclosure, put_together
from designer.optimise.variables import VARIABLE_NAMES, VariableBounds, physical_values, scaled_values
from designer.optimise.variants import Variant

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """One variant of a configuration under one requirement and lens: all that the optimiser needs to know.

    ``fixed`` are parameters that must have a given value, by names such as ``primary.radius_mm``.
    """

    variant: Variant
    specification: Specification
    bounds: VariableBounds
    fixed: tuple[tuple[str, float], ...]

    def physical(self, scaled: Array) -> dict[str, Array]:
        """Physical variables of designs in the unit box, and what follows; ``scaled`` has shape (variables, ...)."""
        return physical_values(self.variant, self.bounds, scaled)

    def scaled(self, values: Mapping[str, Array]) -> Array:
        """Inverse of :meth:`physical`."""
        return scaled_values(self.bounds, values)

    @property
    def reach(self) -> tuple[Array, Array]:
        """How far the solver may go in each variable, on the scale on which its range is 0..1."""
        ends = np.array([self.bounds[name].scaled_reach for name in VARIABLE_NAMES])
        return ends[:, 0], ends[:, 1]

    @property
    def within_ranges(self) -> Problem:
        """The problem of a solver that keeps to the ranges in which starts are drawn."""
        bounds = {name: replace(each, least=None, greatest=None) for name, each in self.bounds.items()}
        return replace(self, bounds=bounds)

    def constraints(self, system: System) -> tuple[Constraint, ...]:
        """Every constraint but the clearances."""
        return constraints_of(system, dict(self.fixed))

    def enclosed(self, values: dict[str, Array]) -> tuple[dict[str, Array], System]:
        """The designs put together, with top, bottom and radius set to what their mirrors need."""
        loose = put_together(self.variant, values, self.specification)
        tight = values | enclosure(loose)
        # What encloses the mirrors moves none of them.
        return tight, replace(loose, values=tight)


@dataclass(frozen=True, slots=True)
class ConstraintEvaluation:
    """What designs keep and fail, by NumPy alone; arrays of shape (..., n) for n designs.

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

    def of_design(self, index: int) -> ConstraintEvaluation:
        """The evaluation of one design: arrays of shape (..., 1)."""
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


def evaluate(problem: Problem, system: System, solid_directions: int = len(SOLID_DIRECTIONS)) -> ConstraintEvaluation:
    """Evaluate every constraint and every clearance of designs, none left to the solver's word.

    Solids are looked at along the first ``solid_directions``: all of them where the result is a judgement.
    """
    pairs = pair_up(system.layout)
    light, bodies = separations(system.layout, pairs, solid_directions)
    constraints = problem.constraints(system)
    scalar = violations_of(constraints)
    clearance = problem.specification.asked.manufacture.clearance_mm
    spare = np.concatenate([light.max(axis=0), bodies.max(axis=0)]) - clearance
    shape = np.broadcast_shapes(scalar.shape[1:], spare.shape[1:])
    violations = np.concatenate(
        [np.broadcast_to(scalar, (len(scalar), *shape)), np.broadcast_to(np.maximum(-spare, 0.0), (len(spare), *shape))]
    )
    amounts = [np.broadcast_to(np.asarray(item.value, dtype=float), shape) for item in constraints]
    return ConstraintEvaluation(
        tuple(item.name for item in constraints) + pairs.names,
        tuple(item.unit for item in constraints) + ("mm",) * len(pairs.names),
        np.concatenate([np.stack(amounts), np.broadcast_to(spare, (len(spare), *shape))]),
        np.where(np.isfinite(violations), violations, np.inf),
        light,
        bodies,
    )


def violations_of(constraints: tuple[Constraint, ...]) -> Array:
    """Scaled violation of each constraint, shape (constraints, ...)."""
    rows = []
    for constraint in constraints:
        value = np.asarray(constraint.value, dtype=float) / constraint.scale
        violation = np.abs(value) if constraint.equality else np.maximum(-value, 0.0)
        rows.append(np.where(np.isfinite(violation), violation, np.inf))
    return np.stack(np.broadcast_arrays(*rows))
