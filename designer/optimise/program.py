"""The smooth program of a variant: CasADi expressions built once, the requirement passed as parameters.

Variables live in 0..1. Every inequality reads value / scale + slack >= 0 with one slack for all: held at zero the
program is the design problem, and minimised it finds the point of least largest scaled violation. Which direction
keeps a pair of leg and solid apart is chosen before a run (``SeparatingDirections``), so every expression stays
smooth; the choice is a parameter, so that all runs of a variant share one program.

The solver's vector holds the free variables and the slack; the constraint vector holds the residuals of constraints,
the clearances, the twins of equalities (their other side) and the goals. Where only what fits is sought there are no
goals: a predicted noise alone is hundreds of operations at each of the volume's nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import casadi
import numpy as np
from numpy.typing import NDArray

from designer.goals import GOALS
from designer.optics.clearance import (
    LEG_NORMALS,
    SOLID_NORMALS,
    leg_rows,
    leg_separations,
    pair_up,
    solid_rows,
    solid_separations,
)
from designer.optics.image_law import ImageLaw
from designer.optimise.constraints import constraints_of
from designer.optimise.problem import Problem
from designer.optimise.required_numbers import (
    SPECIFICATION_NAMES,
    HousingKind,
    specification_from,
    specification_values,
)
from designer.optimise.symbols import symbolic_numbers, with_numbers
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
        "expand": True,
        # Nobody asks it for derivatives by parameters.
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "calc_lam_x": False,
    },
    "ipopt": {
        "print_time": False,
        "expand": True,
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


Noise = Literal["constant", "predicted"]


@dataclass(frozen=True)
class Program:
    """A nonlinear program in CasADi's terms, and the layout of its constraint vector: ``goals`` are its last rows."""

    expressions: dict[str, Any]
    equalities: NDArray[np.bool_]
    rows: int
    goals: int

    @cached_property
    def solver(self) -> Any:
        """The solver that every run is given to."""
        return casadi.nlpsol("program", "sqpmethod", self.expressions, SOLVERS["sqpmethod"])

    @cached_property
    def interior_point_solver(self) -> Any:
        """The solver that multipliers come from."""
        return casadi.nlpsol("program", "ipopt", self.expressions, SOLVERS["ipopt"])


@dataclass(frozen=True, slots=True, eq=False)
class _Geometry:
    """A variant put together from symbols.

    ``function`` takes the scaled variables, the requirement's numbers, the ends of the bounds and the chosen
    directions; it returns the constraints' residuals, the clearances, and the numbers of the ``system`` that are not
    constants. ``equal`` tells which residuals are equalities.
    """

    system: System
    function: Any
    equal: NDArray[np.bool_]


@lru_cache(maxsize=128)
def _build_geometry(
    variant: Variant, fixed: tuple[tuple[str, float], ...], free: tuple[str, ...], law: ImageLaw, housing: HousingKind
) -> _Geometry:
    scaled = casadi.SX.sym("scaled", len(free))
    # A variable without a choice is its lower end, a parameter: no derivatives by it are ever needed.
    position = {name: scaled[i] for i, name in enumerate(free)}
    numbers = casadi.SX.sym("specification", len(SPECIFICATION_NAMES))
    low, high = casadi.SX.sym("low", len(VARIABLES)), casadi.SX.sym("high", len(VARIABLES))
    specification = specification_from((numbers[i] for i in range(len(SPECIFICATION_NAMES))), law, housing)
    values = with_principal_distance(
        {
            variable.name: unscaled(variable, variant, position.get(variable.name, 0.0), low[i], high[i])
            for i, variable in enumerate(VARIABLES)
        }
    )
    system = put_together(variant, values, specification)
    constraints = constraints_of(system, dict(fixed))
    residuals = casadi.vertcat(*(constraint.value / constraint.scale for constraint in constraints))
    clear, directions = _clearance_rows(system)
    given = [scaled, numbers, low, high, directions]
    # Rows share most of their geometry; found once, it is computed once, and so are its derivatives.
    results = [residuals, clear, casadi.vertcat(*symbolic_numbers(system))]
    equal = np.array([constraint.equality for constraint in constraints])
    return _Geometry(system, casadi.Function("geometry", given, results, {"cse": True}), equal)


@lru_cache(maxsize=128)
def _build_goals(geometry: _Geometry, noise: Noise) -> Any:
    """Every goal as a column, a function of the numbers that a geometry's function returns last."""
    count = len(symbolic_numbers(geometry.system))
    symbols = [casadi.MX.sym(f"number_{i}") for i in range(count)]
    system = with_numbers(geometry.system, symbols)
    if noise == "constant":
        # A number that is no symbol spares every operation of the prediction.
        system = replace(system, specification=replace(system.specification, predicted_share=0.0))
    goals = casadi.vertcat(*(goal.expression(system) for goal in GOALS.values()))
    places = {symbol.name(): i for i, symbol in enumerate(symbols)}
    used = casadi.symvar(goals)
    function = casadi.Function("goals", used, [goals])
    numbers = casadi.MX.sym("numbers", count)
    return casadi.Function("goals_of_system", [numbers], [function(*(numbers[places[each.name()]] for each in used))])


@lru_cache(maxsize=512)
def build_program(
    variant: Variant,
    fixed: tuple[tuple[str, float], ...],
    free: tuple[str, ...],
    law: ImageLaw,
    noise: Noise | None,
    housing: HousingKind = "none",
) -> Program:
    """Build the program of a variant, with the given variables free, that keeps solids and light apart.

    Its parameters are the requirement's numbers, the ends of the bounds, what is minimised, the goals' typical sizes,
    and the chosen directions. ``law`` is the lens's, ``housing`` the kind. ``noise`` is what goals need to know; None
    for a program without goals.
    """
    geometry = _build_geometry(variant, fixed, free, law, housing)
    given = [geometry.function.size1_in(i) for i in range(1, 5)]
    sizes = [*given[:3], len(GOALS) + 1, len(GOALS), given[3]]
    variables, parameters = casadi.MX.sym("variables", len(free) + 1), casadi.MX.sym("parameters", sum(sizes))
    numbers, low, high, weights, scales, directions = casadi.vertsplit(parameters, [0, *np.cumsum(sizes).tolist()])
    residuals, clear, measures = geometry.function(variables[:-1], numbers, low, high, directions)
    slack = variables[-1]
    equal = np.flatnonzero(geometry.equal).tolist()
    twins = residuals[equal] - slack if equal else casadi.MX(0, 1)
    objective, goals = weights[-1] * slack, casadi.MX(0, 1)
    if noise is not None:
        goals = _build_goals(geometry, noise)(measures) / scales
        objective += casadi.dot(weights[:-1], goals)
    rows = casadi.vertcat(residuals + slack, clear + slack, twins, goals)
    expressions = {"x": variables, "p": parameters, "f": objective, "g": rows}
    equalities = np.concatenate([geometry.equal, np.zeros(clear.shape[0], dtype=bool)])
    return Program(expressions, equalities, rows.shape[0], goals.shape[0])


def forget_programs() -> None:
    """Give back the memory of all programs built so far: about two megabytes each."""
    build_program.cache_clear()
    _build_goals.cache_clear()
    _build_geometry.cache_clear()


def problem_parameters(problem: Problem) -> NDArray[np.float64]:
    """The parameters of a program that come from the requirement: its numbers, then the ends of the bounds."""
    ends = np.array([problem.bounds[name].scaled_ends for name in VARIABLE_NAMES])
    return np.concatenate([specification_values(problem.specification), ends[:, 0], ends[:, 1]])


def _clearance_rows(system: System) -> tuple[Any, Any]:
    """What every pair has to spare along its direction, as a column, and the symbols that choose the directions.

    A pair without a direction has one to spare.
    """
    pairs = pair_up(system.layout)
    legs, solids = leg_rows(system.layout.legs), solid_rows(pairs.solids)
    # Row by row, as normals_of() has them.
    of_legs = casadi.SX.sym("leg_normals", len(LEG_NORMALS) + 2, len(pairs.leg_solid)).T
    of_solids = casadi.SX.sym("solid_normals", len(SOLID_NORMALS) + 2, len(pairs.solid_solid)).T
    clearance = system.specification.asked.manufacture.clearance_mm
    rows = []
    for weights, separations in (
        (of_legs, leg_separations(legs, solids, pairs.leg_solid, of_legs)),
        (of_solids, solid_separations(solids, pairs.solid_solid, of_solids)),
    ):
        is_chosen = casadi.sum2(weights * weights)
        rows.append(casadi.if_else(is_chosen, separations - clearance, 1.0))
    return casadi.vertcat(*rows), casadi.vertcat(casadi.vec(of_legs.T), casadi.vec(of_solids.T))
