"""The smooth program of a variant: CasADi expressions built once, the requirement passed as parameters.

Variables live in 0..1. Every inequality reads value / scale + slack >= 0 with one slack for all: held at zero the
program is the design problem, and minimised it finds the point of least largest scaled violation. Which direction
keeps a pair of leg and solid apart is chosen before a run (``Separators``), so every expression stays smooth; a
program holds every direction of a ``Menu``, so that runs with different choices share it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from designer.optics.clearance import (
    leg_rows,
    leg_separation,
    pair_up,
    solid_rows,
    solid_separation,
)
from designer.optimise.assembly import VARIABLES, Assembly, assemble
from designer.optimise.box import physical
from designer.optimise.rules import RULE_NAMES, Rules, rule_values
from designer.optimise.screening import Problem
from designer.optimise.variants import Variant

FAR = -1
GOALS = ("depth_error", "height", "diameter", "volume")
IPOPT_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
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
}
"""Solver options, as the provenance of a study records them."""


@dataclass(frozen=True, slots=True)
class Separators:
    """The direction that keeps each pair apart: index per row of ``Pairs``, legs and solids, then solids alone.

    ``FAR`` leaves a pair out of the program, because it is far from touching.
    """

    legs: tuple[int, ...]
    solids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Menu:
    """The directions a program can choose from for each pair, ascending; none for a pair that is left out."""

    legs: tuple[tuple[int, ...], ...]
    solids: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, choices: Sequence[Separators]) -> Menu:
        """The smallest menu with all the given choices."""
        return cls(
            _union([choice.legs for choice in choices]),
            _union([choice.solids for choice in choices]),
        )

    def offers(self, choice: Separators) -> bool:
        """Whether a choice can be made from this menu."""
        chosen = zip((*choice.legs, *choice.solids), (*self.legs, *self.solids), strict=True)
        return all(direction == FAR or direction in directions for direction, directions in chosen)

    def with_choice(self, choice: Separators) -> Menu:
        """The menu with one more choice."""
        return Menu(_extended(self.legs, choice.legs), _extended(self.solids, choice.solids))

    def weights(self, choice: Separators) -> list[float]:
        """One for each direction chosen, zero for the others, in the order of the program's expressions."""
        return [
            float(direction == chosen)
            for chosen, directions in zip((*choice.legs, *choice.solids), (*self.legs, *self.solids), strict=True)
            for direction in directions
        ]


def _union(choices: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted(set(directions) - {FAR})) for directions in zip(*choices, strict=True))


def _extended(menu: tuple[tuple[int, ...], ...], choice: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted({*directions, chosen} - {FAR})) for directions, chosen in zip(menu, choice, strict=True))


@dataclass(frozen=True, slots=True)
class Goal:
    """What to minimise, and how large the other goals may become; in the goals' own units, each with its scale."""

    minimise: str
    bounds: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the solver says of one run, before anyone has checked it."""

    scaled: NDArray[np.float64]
    slack: float
    objective: float
    converged: bool
    status: str
    iterations: int


@dataclass(frozen=True, slots=True)
class Program:
    """A solver and the layout of its constraint vector."""

    solver: Any
    equalities: NDArray[np.bool_]
    rows: int


@lru_cache(maxsize=512)
def build_program(variant: Variant, fixed: tuple[tuple[str, float], ...], menu: Menu) -> Program:
    """Build the program of a variant for one menu of separators."""
    scaled = casadi.SX.sym("scaled", len(VARIABLES))
    slack = casadi.SX.sym("slack")
    numbers = casadi.SX.sym("rules", len(RULE_NAMES))
    low, high = casadi.SX.sym("low", len(VARIABLES)), casadi.SX.sym("high", len(VARIABLES))
    weights, scales = casadi.SX.sym("weights", len(GOALS) + 1), casadi.SX.sym("scales", len(GOALS))

    rules = Rules(*(numbers[i] for i in range(len(RULE_NAMES))))
    values = {
        name: physical(variant, name, scaled[i], low[i], high[i], _is_logarithmic(variant, name))
        for i, name in enumerate(VARIABLES)
    }
    assembly = assemble(variant, values, rules, dict(fixed))
    equal = np.array([constraint.equality for constraint in assembly.constraints])
    residuals = casadi.vertcat(*(constraint.value / constraint.scale for constraint in assembly.constraints))
    chosen = casadi.SX.sym("chosen", sum(map(len, (*menu.legs, *menu.solids))))
    clear = _clearance_rows(assembly, menu, chosen, rules.clearance)
    goals = casadi.vertcat(assembly.depth_error, assembly.height, assembly.diameter, assembly.volume) / scales
    twins = residuals[np.flatnonzero(equal).tolist()] - slack if equal.any() else casadi.SX(0, 1)
    constraints = casadi.vertcat(residuals + slack, clear + slack, twins, goals)
    objective = casadi.dot(weights, casadi.vertcat(goals, slack))
    problem = {
        "x": casadi.vertcat(scaled, slack),
        "p": casadi.vertcat(numbers, low, high, weights, scales, chosen),
        "f": objective,
        "g": constraints,
    }
    solver = casadi.nlpsol("program", "ipopt", problem, IPOPT_OPTIONS)
    equalities = np.concatenate([equal, np.zeros(clear.shape[0], dtype=bool)])
    return Program(solver, equalities, constraints.shape[0])


def _clearance_rows(assembly: Assembly, menu: Menu, chosen: Any, clearance: Any) -> Any:
    """What every pair on the menu has to spare along its chosen direction, as a column; one if none is chosen."""
    layout = assembly.layout
    pairs = pair_up(layout)
    legs, solids = leg_rows(layout.legs), solid_rows(layout.solids)
    separations = [
        *_by_pair(pairs.leg_solid, menu.legs, legs, solids, leg_separation),
        *_by_pair(pairs.solid_solid, menu.solids, solids, solids, solid_separation),
    ]
    rows, first = [], 0
    for of_pair in separations:
        weights = [chosen[first + i] for i in range(len(of_pair))]
        first += len(of_pair)
        if of_pair:
            # A plain product would turn a direction that is undefined here and not chosen into a NaN.
            spare = sum(
                casadi.if_else(weight, one - clearance, 0.0) for weight, one in zip(weights, of_pair, strict=True)
            )
            rows.append(spare + 1.0 - sum(weights))
    return casadi.vertcat(*rows) if rows else casadi.SX(0, 1)


def _by_pair(
    pairs: Sequence[tuple[int, int]], menu: Sequence[tuple[int, ...]], first: Any, second: Any, separation: Any
) -> list[list[Any]]:
    """Separations of each pair along the directions of its menu, built direction by direction as vectors."""
    members = defaultdict(list)
    for row, directions in enumerate(menu):
        for direction in directions:
            members[direction].append(row)
    built: dict[tuple[int, int], Any] = {}
    for direction, rows in members.items():
        one = first.take([pairs[row][0] for row in rows])
        other = second.take([pairs[row][1] for row in rows])
        column = separation(one, other, direction)
        built |= {(row, direction): column[i] for i, row in enumerate(rows)}
    return [[built[row, direction] for direction in directions] for row, directions in enumerate(menu)]


def solve(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    goal: Goal,
    scales: Sequence[float],
) -> Outcome:
    """Minimise a goal from a start in the unit box, with every constraint kept."""
    return _run(problem, menu, separators, start, goal, scales, None)


def reduce_violation(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    scales: Sequence[float],
    violation: float,
) -> Outcome:
    """Find the point of least largest scaled violation near a start that violates by ``violation``."""
    return _run(problem, menu, separators, start, Goal("violation"), scales, violation)


def _run(
    problem: Problem,
    menu: Menu,
    separators: Separators,
    start: NDArray[np.float64],
    goal: Goal,
    scales: Sequence[float],
    violation: float | None,
) -> Outcome:
    elastic = violation is not None
    program = build_program(problem.variant, problem.fixed, menu)
    ends = np.array([problem.box[name].scaled_ends for name in VARIABLES])
    weights = np.array([1.0 if name == goal.minimise else 0.0 for name in GOALS] + [1.0 if elastic else 0.0])
    numbers = rule_values(problem.rules)
    parameters = np.concatenate([numbers, ends[:, 0], ends[:, 1], weights, scales, menu.weights(separators)])
    count = len(program.equalities)
    lower = np.zeros(program.rows)
    upper = np.full(program.rows, np.inf)
    twins = slice(count, program.rows - len(GOALS))
    lower[twins] = -np.inf
    upper[twins] = 0.0 if elastic else np.inf
    if not elastic:
        upper[:count][program.equalities] = 0.0
    lower[-len(GOALS) :] = -np.inf
    for name, bound in goal.bounds:
        index = GOALS.index(name)
        upper[program.rows - len(GOALS) + index] = bound / scales[index]
    free = ends[:, 0] != ends[:, 1]
    x0 = np.append(np.where(free, np.clip(start, 0.0, 1.0), 0.0), violation or 0.0)
    result = program.solver(
        x0=x0,
        p=parameters,
        lbx=np.zeros(len(x0)),
        ubx=np.append(np.where(free, 1.0, 0.0), 1e4 if elastic else 0.0),
        lbg=lower,
        ubg=upper,
    )
    stats = program.solver.stats()
    point = np.asarray(result["x"]).ravel()
    return Outcome(
        point[:-1],
        float(point[-1]),
        float(result["f"]),
        bool(stats["success"]),
        str(stats["return_status"]),
        int(stats["iter_count"]),
    )


def _is_logarithmic(variant: Variant, name: str) -> bool:
    if name == "secondary_inverse_gain" and variant.fold is not None:
        return max(abs(end) for end in variant.fold.inverse_gains) > 1.0
    return name in {"lower_gain", "upper_gain"}
