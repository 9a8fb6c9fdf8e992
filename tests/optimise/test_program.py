"""The program that the solver is given, against the same system evaluated in NumPy, row by row."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest

from designer.goals import GOALS
from designer.optics.clearance import pair_up, separations
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.optimise.problem import Problem
from designer.optimise.program import Program, build_program
from designer.optimise.separating_directions import FAR, SeparatingDirections
from designer.optimise.solver import Run, StageTarget, arguments_of
from designer.optimise.system import put_together
from designer.optimise.variables import VARIABLE_NAMES
from support.shipped_problems import (
    VARIANTS,
    is_coherent,
    problem_of,
    random_designs,
    shipped_requirement,
    variant_name,
)
from support.shipped_problems import put_together as enclosed

SCALES = tuple(float(2**place) for place in range(len(GOALS)))


def coherent_design(problem: Problem) -> np.ndarray:
    """A random design of the unit box for which the formulas hold; variables without a choice are zero."""
    values = random_designs(problem, 3000, seed=3)
    place = int(np.flatnonzero(is_coherent(enclosed(problem, values)))[0])
    scaled = problem.scaled({name: value[place : place + 1] for name, value in values.items()})[:, 0]
    is_free = [not problem.bounds[name].is_fixed for name in VARIABLE_NAMES]
    return np.where(is_free, scaled, 0.0)


def every_row(program: Program, arguments: dict[str, np.ndarray]) -> tuple[float, np.ndarray]:
    """Objective and rows at the start, as CasADi evaluates them."""
    names = ("f", "g")
    function = casadi.Function(
        "rows", [program.expressions["x"], program.expressions["p"]], [program.expressions[name] for name in names]
    )
    objective, rows = function(arguments["x0"], arguments["p"])
    return float(objective), np.asarray(rows).ravel()


@pytest.mark.parametrize("variant", VARIANTS[::3], ids=variant_name)
@pytest.mark.parametrize(
    ("noise_mm", "law"),
    [(0.0, PERSPECTIVE), (3e-4, PERSPECTIVE), (0.0, ImageLaw("equidistant", (-0.5, 0.02)))],
    ids=["predicted", "constant", "fisheye"],
)
def test_rows_are_what_numpy_makes_of_the_system(variant, noise_mm, law):
    problem = problem_of(shipped_requirement("sky_watch"), variant)
    specification = replace(problem.specification, predicted_share=float(not noise_mm), noise=noise_mm, law=law)
    problem = replace(problem, specification=specification)
    scaled = coherent_design(problem)
    system = put_together(variant, problem.physical(scaled[:, None]), specification)
    light, bodies = (part[:, :, 0] for part in separations(system.layout, pair_up(system.layout)))
    directions = SeparatingDirections(tuple(light.argmax(axis=0).tolist()), (FAR, *bodies.argmax(axis=0)[1:].tolist()))
    run = Run(problem, directions, scaled, SCALES)
    free = tuple(name for name in VARIABLE_NAMES if not problem.bounds[name].is_fixed)
    residuals = np.array([np.ravel(item.value)[0] / item.scale for item in problem.constraints(system)])
    equal = np.array([item.equality for item in problem.constraints(system)])
    spare = np.concatenate([light.max(axis=0), bodies.max(axis=0)]) - specification.asked.manufacture.clearance_mm
    spare[light.shape[1]] = 1.0  # the pair that is left out
    goals = np.array([np.ravel(goal.expression(system))[0] for goal in GOALS.values()]) / SCALES

    program = build_program(variant, (), free, law, "constant" if noise_mm else "predicted")
    objective, rows = every_row(program, arguments_of(run, program, StageTarget("blur"), None))
    expected = np.concatenate([residuals, spare, residuals[equal], goals])
    assert rows == pytest.approx(expected, rel=1e-9, abs=1e-7)
    assert objective == pytest.approx(goals[list(GOALS).index("blur")], rel=1e-12)

    program = build_program(variant, (), free, law, None)
    objective, rows = every_row(program, arguments_of(run, program, StageTarget("violation"), 0.25))
    expected = np.concatenate([residuals + 0.25, spare + 0.25, residuals[equal] - 0.25])
    assert rows == pytest.approx(expected, rel=1e-9, abs=1e-7)
    assert objective == 0.25
