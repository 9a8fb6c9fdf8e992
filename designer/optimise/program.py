"""The smooth program of a variant: CasADi expressions built once, the requirement passed as parameters.

Variables live in 0..1. Every inequality reads value / scale + slack >= 0 with one slack for all: held at zero the
program is the design problem, and minimised it finds the point of least largest scaled violation. Which direction
keeps a pair of leg and solid apart is chosen before a run (``SeparatingDirections``), so every expression stays
smooth; a program holds all the ``OfferedDirections``, so that runs with different choices share it.

The solver's vector holds the free variables and the slack; the constraint vector holds the residuals of constraints,
the clearances, the twins of equalities (their other side) and the goals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from designer.goals import GOALS
from designer.optics.clearance import (
    LegRows,
    Pairs,
    SolidRows,
    leg_rows,
    leg_separation,
    pair_up,
    solid_rows,
    solid_separation,
)
from designer.optimise.constraints import Constraint, constraints_of
from designer.optimise.problem import Problem
from designer.optimise.separating_directions import Groups, OfferedDirections
from designer.optimise.specification import SPECIFICATION_NAMES, Specification, specification_values
from designer.optimise.system import System, put_together
from designer.optimise.variables import VARIABLE_NAMES, VARIABLES, unscaled, with_principal_distance
from designer.optimise.variants import Variant

SOLVERS: dict[str, dict[str, Any]] = {
    "sqpmethod": {
        "hessian_approximation": "limited-memory",
        "lbfgs_memory": 20,
        "max_iter": 50,
        "tol_pr": 1e-9,
        "tol_du": 1e-6,
        "qpsol": "daqp",
        # Its own tolerance leaves rows violated by a millionth; without proximal steps it gives up where more
        # constraints meet than there are variables.
        "qpsol_options": {"error_on_fail": False, "daqp": {"primal_tol": 1e-10, "eps_prox": 1e-3}},
        "error_on_fail": False,
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "print_time": False,
        "show_eval_warnings": False,
    },
    "ipopt": {
        "print_time": False,
        "error_on_fail": False,
        "show_eval_warnings": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": 1e-8,
            "constr_viol_tol": 1e-9,
            "acceptable_tol": 1e-6,
            "max_iter": 150,
            # It starts at the minimum, on the constraints that hold it: pushed off them it may not find back.
            "mu_strategy": "monotone",
            "mu_init": 1e-7,
            "bound_push": 1e-8,
            "bound_frac": 1e-8,
            "bound_relax_factor": 0.0,
            "honor_original_bounds": "yes",
        },
    },
}
"""Options by solver, as the provenance of a study records them.

Runs go to sequential quadratic programming with an updated Hessian: a program has about seven variables and eighty
cheap constraints, where an interior-point method with exact second derivatives takes ten times as long. A run in which
it goes astray is given up, since others start elsewhere. Multipliers alone come from the interior-point method.
"""


@dataclass(frozen=True)
class Program:
    """A nonlinear program in CasADi's terms, and the layout of its constraint vector."""

    expressions: dict[str, Any]
    equalities: NDArray[np.bool_]
    rows: int

    @cached_property
    def solver(self) -> Any:
        """The solver that every run is given to."""
        return casadi.nlpsol("program", "sqpmethod", self.expressions, SOLVERS["sqpmethod"])

    @cached_property
    def interior_point_solver(self) -> Any:
        """The solver that multipliers come from."""
        return casadi.nlpsol("program", "ipopt", self.expressions, SOLVERS["ipopt"])


@dataclass(frozen=True, slots=True)
class _Symbols:
    """A variant put together from symbols, whatever directions are offered.

    What a pair has to spare along a direction is built when it is first offered, and kept by direction and row.
    """

    scaled: Any
    specification: Specification
    parameters: Any
    weights: Any
    scales: Any
    system: System
    constraints: tuple[Constraint, ...]
    pairs: Pairs
    legs: LegRows
    solids: SolidRows
    known_light: dict[tuple[int, int], Any]
    known_bodies: dict[tuple[int, int], Any]


@lru_cache(maxsize=128)
def _build_symbols(
    variant: Variant, fixed: tuple[tuple[str, float], ...], free: tuple[str, ...], predicts_noise: bool
) -> _Symbols:
    scaled = casadi.SX.sym("scaled", len(free))
    # A variable without a choice is its lower end, a parameter: no derivatives by it are ever needed.
    position = {name: scaled[i] for i, name in enumerate(free)}
    numbers = casadi.SX.sym("specification", len(SPECIFICATION_NAMES))
    low, high = casadi.SX.sym("low", len(VARIABLES)), casadi.SX.sym("high", len(VARIABLES))
    weights, scales = casadi.SX.sym("weights", len(GOALS) + 1), casadi.SX.sym("scales", len(GOALS))
    specification = Specification(*(numbers[i] for i in range(len(SPECIFICATION_NAMES))))
    if not predicts_noise:
        # A prediction is hundreds of operations at each of the volume's nodes: none where a number stands for it.
        specification = replace(specification, predicted_share=0.0)
    values = with_principal_distance(
        {
            variable.name: unscaled(variable, variant, position.get(variable.name, 0.0), low[i], high[i])
            for i, variable in enumerate(VARIABLES)
        }
    )
    system = put_together(variant, values, specification)
    pairs = pair_up(system.layout)
    return _Symbols(
        scaled,
        specification,
        casadi.vertcat(numbers, low, high, weights, scales),
        weights,
        scales,
        system,
        constraints_of(system, dict(fixed)),
        pairs,
        leg_rows(system.layout.legs),
        solid_rows(pairs.solids),
        {},
        {},
    )


@lru_cache(maxsize=512)
def build_program(
    variant: Variant,
    fixed: tuple[tuple[str, float], ...],
    free: tuple[str, ...],
    predicts_noise: bool,
    offered: OfferedDirections,
) -> Program:
    """Build the program of a variant, with the given variables free, for the directions offered."""
    symbols = _build_symbols(variant, fixed, free, predicts_noise)
    constraints = symbols.constraints
    slack = casadi.SX.sym("slack")
    equal = np.array([constraint.equality for constraint in constraints])
    residuals = casadi.vertcat(*(constraint.value / constraint.scale for constraint in constraints))
    chosen = casadi.SX.sym("chosen", sum(map(len, (*offered.legs, *offered.solids))))
    clear = _clearance_rows(symbols, offered, chosen)
    goals = casadi.vertcat(*(goal.expression(symbols.system) for goal in GOALS.values())) / symbols.scales
    twins = residuals[np.flatnonzero(equal).tolist()] - slack if equal.any() else casadi.SX(0, 1)
    rows = casadi.vertcat(residuals + slack, clear + slack, twins, goals)
    objective = casadi.dot(symbols.weights, casadi.vertcat(goals, slack))
    # Rows share most of their geometry; found once, it is computed once, and so are its derivatives.
    shared = casadi.cse(casadi.vertcat(objective, rows))
    expressions = {
        "x": casadi.vertcat(symbols.scaled, slack),
        "p": casadi.vertcat(symbols.parameters, chosen),
        "f": shared[0],
        "g": shared[1:],
    }
    equalities = np.concatenate([equal, np.zeros(clear.shape[0], dtype=bool)])
    return Program(expressions, equalities, rows.shape[0])


def forget_programs() -> None:
    """Give back the memory of all programs built so far: about two megabytes each."""
    build_program.cache_clear()
    _build_symbols.cache_clear()


def problem_parameters(problem: Problem) -> NDArray[np.float64]:
    """The parameters of a program that come from the requirement: its numbers, then the ends of the bounds."""
    ends = np.array([problem.bounds[name].scaled_ends for name in VARIABLE_NAMES])
    return np.concatenate([specification_values(problem.specification), ends[:, 0], ends[:, 1]])


def _clearance_rows(symbols: _Symbols, offered: OfferedDirections, chosen: Any) -> Any:
    """What every pair has to spare along its chosen direction, as a column; one if none is chosen."""
    pairs, legs, solids = symbols.pairs, symbols.legs, symbols.solids
    clearance = symbols.specification.clearance
    of_legs, of_solids = offered.groups
    count = sum(len(rows) for _, rows in of_legs)

    def light_along(rows: Sequence[int], direction: int) -> Any:
        chosen_legs, chosen_solids = zip(*(pairs.leg_solid[row] for row in rows), strict=True)
        return leg_separation(legs.take(chosen_legs), solids.take(chosen_solids), direction) - clearance

    def bodies_along(rows: Sequence[int], direction: int) -> Any:
        first, second = zip(*(pairs.solid_solid[row] for row in rows), strict=True)
        return solid_separation(solids.take(first), solids.take(second), direction) - clearance

    light = _chosen_rows(len(pairs.leg_solid), of_legs, light_along, symbols.known_light, chosen[:count])
    bodies = _chosen_rows(len(pairs.solid_solid), of_solids, bodies_along, symbols.known_bodies, chosen[count:])
    near = [bool(directions) for directions in (*offered.legs, *offered.solids)]
    return casadi.vertcat(light, bodies)[np.flatnonzero(near).tolist()]


def _chosen_rows(
    count: int,
    groups: Groups,
    spare_along: Callable[[Sequence[int], int], Any],
    known: dict[tuple[int, int], Any],
    chosen: Any,
) -> Any:
    """One row for each pair; those along a direction that are not known yet are built at once, as a vector."""
    spare, begin = casadi.SX.ones(count, 1), 0
    for direction, rows in groups:
        weights = chosen[begin : begin + len(rows)]
        begin += len(rows)
        unknown = [row for row in rows if (direction, row) not in known]
        if unknown:
            built = spare_along(unknown, direction)
            known.update({(direction, row): built[place] for place, row in enumerate(unknown)})
        along = casadi.vertcat(*(known[direction, row] for row in rows))
        # A plain product would turn a direction that is undefined here and not chosen into a NaN.
        spare[list(rows)] += casadi.if_else(weights, along, 0.0) - weights
    return spare
