"""The smooth program of a variant: CasADi expressions built once, the requirement passed as parameters.

Variables live in 0..1. Every inequality reads value / scale + slack >= 0 with one slack for all: held at zero the
program is the design problem, and minimised it finds the point of least largest scaled violation. Which direction
keeps a pair of leg and solid apart is chosen before a run (``Separators``), so every expression stays smooth; a
program holds every direction of a ``Menu``, so that runs with different choices share it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

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
from designer.optimise.bounds import is_logarithmic, physical
from designer.optimise.screening import Problem
from designer.optimise.separating_directions import Menu, Separators
from designer.optimise.specification import SPECIFICATION_NAMES, Specification, specification_values
from designer.optimise.system import VARIABLES, System, assemble
from designer.optimise.variants import Variant

SOLVED = "solved"
STALLED = "stalled"
GOALS = ("depth_error", "height", "diameter", "volume")
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
            "mu_strategy": "adaptive",
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
_ENDS = {"Solve_Succeeded": SOLVED, "Search_Direction_Becomes_Too_Small": STALLED}


@dataclass(frozen=True, slots=True)
class Target:
    """What to minimise, and how large the other goals may become; in the goals' own units, each with its scale."""

    minimise: str
    at_most: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class SolverResult:
    """What the solver says of one run, before anyone has checked it.

    ``slopes`` are the derivatives of the least objective by the program's parameters, from the multipliers.
    """

    scaled: NDArray[np.float64]
    slack: float
    objective: float
    converged: bool
    status: str
    slopes: NDArray[np.float64]


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
    """A variant put together from symbols, whatever the menu.

    What a pair has to spare along a direction is built when a menu first asks for it, and kept by direction and row.
    """

    scaled: Any
    specification: Specification
    parameters: Any
    weights: Any
    scales: Any
    system: System
    pairs: Pairs
    legs: LegRows
    solids: SolidRows
    known_light: dict[tuple[int, int], Any]
    known_bodies: dict[tuple[int, int], Any]


@lru_cache(maxsize=128)
def _build_symbols(variant: Variant, fixed: tuple[tuple[str, float], ...], free: tuple[str, ...]) -> _Symbols:
    scaled = casadi.SX.sym("scaled", len(free))
    # A variable without a choice is its lower end, a parameter: no derivatives by it are ever needed.
    position = {name: scaled[i] for i, name in enumerate(free)}
    numbers = casadi.SX.sym("rules", len(SPECIFICATION_NAMES))
    low, high = casadi.SX.sym("low", len(VARIABLES)), casadi.SX.sym("high", len(VARIABLES))
    weights, scales = casadi.SX.sym("weights", len(GOALS) + 1), casadi.SX.sym("scales", len(GOALS))
    specification = Specification(*(numbers[i] for i in range(len(SPECIFICATION_NAMES))))
    values = {
        name: physical(variant, name, position.get(name, 0.0), low[i], high[i], is_logarithmic(variant, name))
        for i, name in enumerate(VARIABLES)
    }
    system = assemble(variant, values, specification, dict(fixed))
    parameters = casadi.vertcat(numbers, low, high, weights, scales)
    pairs = pair_up(system.layout)
    legs, solids = leg_rows(system.layout.legs), solid_rows(system.layout.solids)
    return _Symbols(scaled, specification, parameters, weights, scales, system, pairs, legs, solids, {}, {})


@lru_cache(maxsize=512)
def build_program(variant: Variant, fixed: tuple[tuple[str, float], ...], free: tuple[str, ...], menu: Menu) -> Program:
    """Build the program of a variant, with the given variables free, for one menu of separators."""
    symbols = _build_symbols(variant, fixed, free)
    system = symbols.system
    slack = casadi.SX.sym("slack")
    equal = np.array([constraint.equality for constraint in system.constraints])
    residuals = casadi.vertcat(*(constraint.value / constraint.scale for constraint in system.constraints))
    chosen = casadi.SX.sym("chosen", sum(map(len, (*menu.legs, *menu.solids))))
    clear = _clearance_rows(symbols, menu, chosen)
    goals = casadi.vertcat(system.depth_error, system.height, system.diameter, system.volume) / symbols.scales
    twins = residuals[np.flatnonzero(equal).tolist()] - slack if equal.any() else casadi.SX(0, 1)
    constraints = casadi.vertcat(residuals + slack, clear + slack, twins, goals)
    objective = casadi.dot(symbols.weights, casadi.vertcat(goals, slack))
    # Rows share most of their geometry; found once, it is computed once, and so are its derivatives.
    shared = casadi.cse(casadi.vertcat(objective, constraints))
    problem = {
        "x": casadi.vertcat(symbols.scaled, slack),
        "p": casadi.vertcat(symbols.parameters, chosen),
        "f": shared[0],
        "g": shared[1:],
    }
    equalities = np.concatenate([equal, np.zeros(clear.shape[0], dtype=bool)])
    return Program(problem, equalities, constraints.shape[0])


def forget_programs() -> None:
    """Give back the memory of all programs built so far: about two megabytes each."""
    build_program.cache_clear()
    _build_symbols.cache_clear()


def _clearance_rows(symbols: _Symbols, menu: Menu, chosen: Any) -> Any:
    """What every pair on the menu has to spare along its chosen direction, as a column; one if none is chosen."""
    pairs, legs, solids = symbols.pairs, symbols.legs, symbols.solids
    clearance = symbols.specification.clearance
    of_legs, of_solids = menu.groups
    count = sum(len(rows) for _, rows in of_legs)

    def light_along(rows: Sequence[int], direction: int) -> Any:
        chosen_legs, chosen_solids = zip(*(pairs.leg_solid[row] for row in rows), strict=True)
        return leg_separation(legs.take(chosen_legs), solids.take(chosen_solids), direction) - clearance

    def bodies_along(rows: Sequence[int], direction: int) -> Any:
        first, second = zip(*(pairs.solid_solid[row] for row in rows), strict=True)
        return solid_separation(solids.take(first), solids.take(second), direction) - clearance

    light = _chosen_rows(len(pairs.leg_solid), of_legs, light_along, symbols.known_light, chosen[:count])
    bodies = _chosen_rows(len(pairs.solid_solid), of_solids, bodies_along, symbols.known_bodies, chosen[count:])
    near = [bool(directions) for directions in (*menu.legs, *menu.solids)]
    return casadi.vertcat(light, bodies)[np.flatnonzero(near).tolist()]


def _chosen_rows(
    count: int,
    groups: tuple[tuple[int, tuple[int, ...]], ...],
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


def solve(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    goal: Target,
    scales: Sequence[float],
) -> SolverResult:
    """Minimise a goal from a start in the unit box, with every constraint kept."""
    return _run(problem, menu, separators, start, goal, scales, None, _solve_program)


def solve_for_multipliers(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    goal: Target,
    scales: Sequence[float],
) -> SolverResult:
    """Minimise a goal from its minimum, where the usual solver may stall, by one whose multipliers converge too."""

    def interior_point(program: Program, arguments: dict[str, NDArray[np.float64]]) -> tuple[Any, dict[str, Any]]:
        return program.interior_point_solver(**arguments), program.interior_point_solver.stats()

    return _run(problem, menu, separators, start, goal, scales, None, interior_point)


def reduce_violation(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    scales: Sequence[float],
    violation: float,
) -> SolverResult:
    """Find the point of least largest scaled violation near a start that violates by ``violation``."""
    return _run(problem, menu, separators, start, Target("violation"), scales, violation, _solve_program)


def problem_parameters(problem: Problem) -> NDArray[np.float64]:
    """The parameters of a program that come from the requirement: its numbers, then the ends of the box."""
    ends = np.array([problem.bounds[name].scaled_ends for name in VARIABLES])
    return np.concatenate([specification_values(problem.specification), ends[:, 0], ends[:, 1]])


def _run(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    goal: Target,
    scales: Sequence[float],
    violation: float | None,
    solver: Callable[[Program, dict[str, NDArray[np.float64]]], tuple[Any, dict[str, Any]]],
) -> SolverResult:
    elastic = violation is not None
    free = [not problem.bounds[name].is_fixed for name in VARIABLES]
    names = tuple(name for name, is_free in zip(VARIABLES, free, strict=True) if is_free)
    program = build_program(problem.variant, problem.fixed, names, menu)
    weights = np.array([1.0 if name == goal.minimise else 0.0 for name in GOALS] + [1.0 if elastic else 0.0])
    parameters = np.concatenate([problem_parameters(problem), weights, scales, menu.weights(separators)])
    count = len(program.equalities)
    lower = np.zeros(program.rows)
    upper = np.full(program.rows, np.inf)
    twins = slice(count, program.rows - len(GOALS))
    lower[twins] = -np.inf
    upper[twins] = 0.0 if elastic else np.inf
    if not elastic:
        upper[:count][program.equalities] = 0.0
    lower[-len(GOALS) :] = -np.inf
    for name, bound in goal.at_most:
        index = GOALS.index(name)
        upper[program.rows - len(GOALS) + index] = bound / scales[index]
    x0 = np.append(np.clip(start[free], 0.0, 1.0), violation or 0.0)
    arguments = {
        "x0": x0,
        "p": parameters,
        "lbx": np.zeros(len(x0)),
        "ubx": np.append(np.ones(len(names)), 1e4 if elastic else 0.0),
        "lbg": lower,
        "ubg": upper,
    }
    result, stats = solver(program, arguments)
    point = np.asarray(result["x"]).ravel()
    scaled = np.zeros(len(VARIABLES))
    scaled[free] = point[:-1]
    return SolverResult(
        scaled,
        float(point[-1]),
        float(result["f"]),
        bool(stats["success"]),
        _ENDS.get(str(stats["return_status"]), str(stats["return_status"])),
        -np.asarray(result["lam_p"]).ravel(),
    )


def _solve_program(program: Program, arguments: dict[str, NDArray[np.float64]]) -> tuple[Any, dict[str, Any]]:
    """What the solver returns, and its statistics."""
    return program.solver(**arguments), program.solver.stats()
