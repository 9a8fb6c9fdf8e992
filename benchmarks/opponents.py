"""SciPy's SLSQP on the optimiser's own programs, in place of their solver: the same variables, scaling and starts.

An :class:`Instance` is one call that the search made of its solver, recorded with its arguments. SLSQP gets the same
objective and constraints three ways: with CasADi's exact derivatives, with finite differences of the same compiled
function, and with finite differences of the NumPy evaluation, as one would write it without CasADi.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from designer.goals import GOALS
from designer.optics.clearance import pair_up, separations
from designer.optimise import solver
from designer.optimise.program import Program
from designer.optimise.required_numbers import SPECIFICATION_NAMES
from designer.optimise.separating_directions import FAR
from designer.optimise.solver import Run, StageTarget
from designer.optimise.system import put_together
from designer.optimise.variables import VARIABLE_NAMES

Array = NDArray[np.float64]

# Both sides stop at these; constraints count as kept within the search's own tolerance.
MOST_ITERATIONS = 150
PRECISION = 1e-9
TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Instance:
    """One recorded call: the program, what its solver was given, and what the program was built from."""

    program: Program
    arguments: dict[str, Array]
    run: Run

    @property
    def oracle(self) -> Any:
        """Objective and constraints as a CasADi function of x and p."""
        return self.program.solver.oracle()


@dataclass(frozen=True, slots=True)
class Attempt:
    """What a contestant made of an instance: processor seconds, objective, and the largest violation."""

    seconds: float
    objective: float
    violation: float

    @property
    def is_feasible(self) -> bool:
        """Whether bounds and constraints are kept."""
        return self.violation <= TOLERANCE


@contextmanager
def recording() -> Iterator[list[Instance]]:
    """Record every program that searches solve meanwhile."""
    instances: list[Instance] = []
    arguments_of = solver.arguments_of

    def recorded(run: Run, program: Program, target: StageTarget, violation: float | None) -> dict[str, Array]:
        arguments = arguments_of(run, program, target, violation)
        instances.append(Instance(program, arguments, run))
        return arguments

    solver.arguments_of = recorded
    try:
        yield instances
    finally:
        solver.arguments_of = arguments_of


def ours(instance: Instance) -> Attempt:
    """The search's own solvers; like those of the opponents, they are built before the clock starts."""
    _ = instance.program.solver
    started = time.process_time()
    result, _ = solver.call_solver(instance.program, instance.arguments)
    seconds = time.process_time() - started
    return _attempt(instance, np.asarray(result["x"]).ravel(), seconds)


def slsqp(instance: Instance, derivatives: str) -> Attempt:
    """SLSQP with ``exact`` derivatives, or with finite differences of the ``compiled`` or the ``numpy`` functions."""
    values, gradient, jacobian = _compiled(instance)
    if derivatives == "numpy":
        values = _plain(instance)
    if derivatives != "exact":
        gradient = jacobian = None
    problem = _one_sided(instance, values, jacobian)
    x0 = instance.arguments["x0"]
    with np.errstate(all="ignore"):
        started = time.process_time()
        result = minimize(
            lambda x: values(x)[0],
            x0,
            jac=gradient,
            method="SLSQP",
            bounds=list(zip(instance.arguments["lbx"], instance.arguments["ubx"], strict=True)),
            constraints=problem,
            options={"maxiter": MOST_ITERATIONS, "ftol": PRECISION},
        )
        seconds = time.process_time() - started
    return _attempt(instance, np.asarray(result.x), seconds)


Values = Callable[[Array], tuple[float, Array]]


def _compiled(instance: Instance) -> tuple[Values, Callable[[Array], Array], Callable[[Array], Array]]:
    """Objective and constraints, gradient and Jacobian, from the very expressions the program holds."""
    oracle, parameters = instance.oracle, instance.arguments["p"]
    value = oracle.factory("value", ["x", "p"], ["f", "g"])
    slope = oracle.factory("slope", ["x", "p"], ["grad:f:x"])
    slopes = oracle.factory("slopes", ["x", "p"], ["jac:g:x"])

    def values(x: Array) -> tuple[float, Array]:
        objective, constraints = value(x, parameters)
        return float(objective), np.asarray(constraints).ravel()

    return (
        _last(values),
        lambda x: np.asarray(slope(x, parameters)).ravel(),
        lambda x: np.asarray(slopes(x, parameters).full()),
    )


def _plain(instance: Instance) -> Values:
    """Objective and constraints as NumPy evaluates them, in the program's order."""
    problem, choice = instance.run.problem, instance.run.directions
    parameters = instance.arguments["p"]
    first = len(SPECIFICATION_NAMES) + 2 * len(VARIABLE_NAMES)
    weights = parameters[first : first + len(GOALS) + 1]
    scales = parameters[first + len(GOALS) + 1 : first + 2 * len(GOALS) + 1]
    free = instance.run.free

    def values(x: Array) -> tuple[float, Array]:
        slack = x[-1]
        scaled = np.zeros(len(VARIABLE_NAMES))
        scaled[free] = x[:-1]
        system = put_together(problem.variant, problem.physical(scaled[:, None]), problem.specification)
        residuals = [np.ravel(item.value)[0] / item.scale for item in problem.constraints(system)]
        light, bodies = separations(system.layout, pair_up(system.layout))
        spare = [
            1.0 if direction == FAR else along[direction, row, 0] - problem.specification.asked.manufacture.clearance_mm
            for directions, along in ((choice.legs, light), (choice.solids, bodies))
            for row, direction in enumerate(directions)
        ]
        rows = [np.array(residuals) + slack, np.array(spare) + slack]
        if not instance.program.goals:
            return float(slack), np.concatenate(rows)
        goals = np.array([np.ravel(goal.expression(system))[0] for goal in GOALS.values()]) / scales
        return float(weights @ np.append(goals, slack)), np.concatenate([*rows, goals])

    return _last(values)


def _last(values: Values) -> Values:
    """Remember the last point: SLSQP asks for objective and constraints one after the other."""
    known: list[Any] = [None, None]

    def remembered(x: Array) -> tuple[float, Array]:
        if known[0] is None or not np.array_equal(known[0], x):
            known[:] = [x.copy(), values(x)]
        return known[1]  # type: ignore[no-any-return]

    return remembered


def _one_sided(instance: Instance, values: Values, jacobian: Callable[[Array], Array] | None) -> list[dict[str, Any]]:
    """The two-sided constraints as SLSQP wants them; rows without bounds are dropped."""
    lower, upper = instance.arguments["lbg"], instance.arguments["ubg"]
    equal = np.flatnonzero(lower == upper)
    above = np.flatnonzero(np.isfinite(lower) & (lower != upper))
    below = np.flatnonzero(np.isfinite(upper) & (lower != upper))
    kinds: list[dict[str, Any]] = [
        {
            "type": "ineq",
            "fun": lambda x: np.concatenate([values(x)[1][above] - lower[above], upper[below] - values(x)[1][below]]),
        }
    ]
    if equal.size:
        kinds.append({"type": "eq", "fun": lambda x: values(x)[1][equal] - lower[equal]})
    if jacobian is not None:
        kinds[0]["jac"] = lambda x: _signed(jacobian(x), above, below)
        if equal.size:
            kinds[1]["jac"] = lambda x: jacobian(x)[equal]
    return kinds


def _signed(rows: Array, above: Array, below: Array) -> Array:
    return np.concatenate([rows[above], -rows[below]])


def _attempt(instance: Instance, x: Array, seconds: float) -> Attempt:
    arguments = instance.arguments
    objective, constraints = instance.oracle(x, arguments["p"])
    rows = np.asarray(constraints).ravel()
    excess = [arguments["lbg"] - rows, rows - arguments["ubg"], arguments["lbx"] - x, x - arguments["ubx"]]
    violation = float(np.max(np.concatenate(excess)))
    return Attempt(seconds, float(objective), violation if np.isfinite(violation) else np.inf)
