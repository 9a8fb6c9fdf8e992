"""Runs of the solver: from a start and a target to a point of the unit box, before anyone has checked it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.goals import GOALS
from designer.optimise.problem import Array, Problem
from designer.optimise.program import Noise, Program, build_program, problem_parameters
from designer.optimise.separating_directions import SeparatingDirections, normals_of
from designer.optimise.variables import VARIABLE_NAMES

SOLVED = "solved"
STALLED = "stalled"
_ENDS = {"Solve_Succeeded": SOLVED, "Search_Direction_Becomes_Too_Small": STALLED}

LARGEST_SLACK = 1e4


@dataclass(frozen=True, slots=True)
class StageTarget:
    """What to minimise, by the name of a goal, and how large other goals may become, in the optimiser's units."""

    minimise: str
    at_most: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Run:
    """What a run of the solver starts from.

    ``start`` is a point of the unit box, ``scales`` hold a typical size of each goal.
    """

    problem: Problem
    directions: SeparatingDirections
    start: Array
    scales: Sequence[float]

    @property
    def free(self) -> list[bool]:
        """Which variables have a choice."""
        return [not self.problem.bounds[name].is_fixed for name in VARIABLE_NAMES]

    def program(self, *, with_goals: bool) -> Program:
        """The program to solve; built once for all runs that share it."""
        names = tuple(name for name, is_free in zip(VARIABLE_NAMES, self.free, strict=True) if is_free)
        variant, asked, fixed = self.problem.variant, self.problem.specification, self.problem.fixed
        noise: Noise = "predicted" if asked.predicted_share else "constant"
        return build_program(variant, fixed, names, asked.law, noise if with_goals else None, asked.housing)


@dataclass(frozen=True, slots=True)
class SolverResult:
    """What the solver says of one run, before anyone has checked it.

    ``slopes`` are the derivatives of the least objective by the program's parameters, from the multipliers.
    """

    scaled: Array
    slack: float
    objective: float
    converged: bool
    status: str
    slopes: Array


Solver = Callable[[Program, dict[str, Array]], tuple[Any, dict[str, Any]]]
"""Takes a program and the solver's arguments; returns its result and its statistics."""


def minimise(run: Run, target: StageTarget) -> SolverResult:
    """Minimise a goal from a start in the unit box, with every constraint kept."""
    return _solve(run, target, None, call_solver)


def minimise_for_multipliers(run: Run, target: StageTarget) -> SolverResult:
    """Minimise a goal from its minimum, where the usual solver may stall, by one whose multipliers converge too."""
    return _solve(run, target, None, _call_interior_point)


def reduce_violation(run: Run, violation: float) -> SolverResult:
    """Find the point of least largest scaled violation near a start that violates by ``violation``."""
    return _solve(run, StageTarget("violation"), violation, call_solver)


def call_solver(program: Program, arguments: dict[str, Array]) -> tuple[Any, dict[str, Any]]:
    """What the usual solver returns, and its statistics."""
    return program.solver(**arguments), program.solver.stats()


def _call_interior_point(program: Program, arguments: dict[str, Array]) -> tuple[Any, dict[str, Any]]:
    return program.interior_point_solver(**arguments), program.interior_point_solver.stats()


def _solve(run: Run, target: StageTarget, violation: float | None, solver: Solver) -> SolverResult:
    """One run; with a ``violation`` to start from the slack is free and minimised."""
    program = run.program(with_goals=violation is None)
    result, statistics = solver(program, arguments_of(run, program, target, violation))
    return _read(run, result, statistics)


def arguments_of(run: Run, program: Program, target: StageTarget, violation: float | None) -> dict[str, Array]:
    """Start, parameters and bounds of a run as the solver takes them."""
    is_elastic = violation is not None
    least, greatest = (ends[run.free] for ends in run.problem.reach)
    start = np.append(np.clip(run.start[run.free], least, greatest), violation or 0.0)
    lower, upper = _row_bounds(run, program, target, is_elastic)
    return {
        "x0": start,
        "p": _parameters(run, target, is_elastic),
        "lbx": np.append(least, 0.0),
        "ubx": np.append(greatest, LARGEST_SLACK if is_elastic else 0.0),
        "lbg": lower,
        "ubg": upper,
    }


def _parameters(run: Run, target: StageTarget, is_elastic: bool) -> Array:
    """The requirement's numbers, what is minimised, the goals' typical sizes, and the chosen directions."""
    weights = [float(name == target.minimise) for name in GOALS] + [float(is_elastic)]
    return np.concatenate([problem_parameters(run.problem), weights, run.scales, normals_of(run.directions)])


def _row_bounds(run: Run, program: Program, target: StageTarget, is_elastic: bool) -> tuple[Array, Array]:
    """Least and greatest value of each row: constraints and clearances, twins of equalities, goals."""
    lower, upper = np.zeros(program.rows), np.full(program.rows, np.inf)
    constraints, goals = len(program.equalities), program.rows - program.goals
    # A twin is the other side of an equality that the slack relaxes; without slack the equality alone holds.
    lower[constraints:] = -np.inf
    upper[constraints:goals] = 0.0 if is_elastic else np.inf
    if not is_elastic:
        upper[:constraints][program.equalities] = 0.0
    for place, (name, scale) in enumerate(zip(GOALS, run.scales, strict=True) if program.goals else ()):
        upper[goals + place] = min((bound / scale for goal, bound in target.at_most if goal == name), default=np.inf)
    return lower, upper


def _read(run: Run, result: Any, statistics: dict[str, Any]) -> SolverResult:
    point: NDArray[np.float64] = np.asarray(result["x"]).ravel()
    scaled = np.zeros(len(VARIABLE_NAMES))
    scaled[run.free] = point[:-1]
    said = str(statistics["return_status"])
    return SolverResult(
        scaled,
        slack=float(point[-1]),
        objective=float(result["f"]),
        converged=bool(statistics["success"]),
        status=_ENDS.get(said, said),
        slopes=-np.asarray(result["lam_p"]).ravel(),
    )
