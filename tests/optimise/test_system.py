"""One formula for NumPy and CasADi: equal numbers for every variant, and derivatives confirmed."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

from designer.goals import GOALS
from designer.optics.clearance import (
    LEG_DIRECTIONS,
    LEG_NORMALS,
    NOT_APART_MM,
    SOLID_DIRECTIONS,
    SOLID_NORMALS,
    leg_rows,
    leg_separations,
    normal_weights,
    pair_up,
    separations,
    solid_rows,
    solid_separations,
)
from designer.optics.image_law import PERSPECTIVE
from designer.optimise.constraints import constraints_of
from designer.optimise.problem import Problem
from designer.optimise.required_numbers import SPECIFICATION_NAMES, specification_from, specification_values
from designer.optimise.system import enclosure, put_together
from designer.optimise.variables import VARIABLE_NAMES, with_principal_distance
from designer.optimise.variants import Variant
from support.shipped_problems import (
    VARIANTS,
    at,
    is_coherent,
    problem_of,
    random_designs,
    shipped_requirement,
    variant_name,
)
from support.shipped_problems import (
    put_together as enclosed,
)

REQUIREMENTS = ("pipe_inspection", "ceiling_watch", "sky_watch")
DESIGNS = 4


def coherent_problem(variant: Variant) -> tuple[Problem, dict[str, np.ndarray]]:
    """A problem of the variant, and a few random designs for which the formulas hold."""
    for name in REQUIREMENTS:
        problem = problem_of(shipped_requirement(name), variant)
        values = random_designs(problem, 3000, seed=2)
        coherent = np.flatnonzero(is_coherent(enclosed(problem, values)))[:DESIGNS]
        if coherent.size == DESIGNS:
            return problem, {key: value[coherent] for key, value in values.items()}
    raise AssertionError("no coherent designs")


def symbolic(problem: Problem) -> casadi.Function:
    """Constraints, goals and every separation as a CasADi function of the physical variables and the rules."""
    variables = {name: casadi.SX.sym(name) for name in VARIABLE_NAMES}
    values = with_principal_distance(variables)
    numbers = [casadi.SX.sym(name) for name in SPECIFICATION_NAMES]
    specification = specification_from(numbers, PERSPECTIVE)
    system = put_together(problem.variant, values, specification)
    pairs = pair_up(system.layout)
    legs, solids = leg_rows(system.layout.legs), solid_rows(pairs.solids)
    light = [
        leg_separations(legs, solids, pairs.leg_solid, casadi.repmat(casadi.DM(weights).T, len(pairs.leg_solid), 1))
        for weights in normal_weights(LEG_DIRECTIONS, LEG_NORMALS)
    ]
    bodies = [
        solid_separations(solids, pairs.solid_solid, casadi.repmat(casadi.DM(weights).T, len(pairs.solid_solid), 1))
        for weights in normal_weights(SOLID_DIRECTIONS, SOLID_NORMALS)
    ]
    goals = casadi.vertcat(*(goal.expression(system) for goal in GOALS.values()))
    return casadi.Function(
        "system",
        [casadi.vertcat(*variables.values()), casadi.vertcat(*numbers)],
        [
            casadi.vertcat(*(item.value for item in constraints_of(system, {}))),
            goals,
            casadi.horzcat(*light),
            casadi.horzcat(*bodies),
        ],
    )


@pytest.mark.parametrize("variant", VARIANTS, ids=variant_name)
def test_symbols_and_arrays_give_the_same_numbers(variant):
    problem, values = coherent_problem(variant)
    function = symbolic(problem)
    for index in range(DESIGNS):
        one = at(values, index)
        system = put_together(variant, one, problem.specification)
        constraints, goals, light, bodies = (
            np.asarray(part)
            for part in function(
                [float(one[name][0]) for name in VARIABLE_NAMES], specification_values(problem.specification)
            )
        )
        expected = [float(np.ravel(item.value)[0]) for item in constraints_of(system, {})]
        assert constraints.ravel() == pytest.approx(expected, rel=1e-9, abs=1e-9)
        expected = [float(np.ravel(goal.expression(system))[0]) for goal in GOALS.values()]
        assert goals.ravel() == pytest.approx(expected, rel=1e-12)
        expected_light, expected_bodies = separations(system.layout, pair_up(system.layout))
        found = bodies.T
        assert found == pytest.approx(expected_bodies[:, :, 0], rel=1e-9, abs=1e-7)
        strict = expected_light[:, :, 0]
        defined = strict > NOT_APART_MM / 2
        assert light.T[defined] == pytest.approx(strict[defined], rel=1e-9, abs=1e-7)
        # A leg's end that is a point has no normal: to NumPy it is not apart, to symbols it touches.
        assert light.T[strict < NOT_APART_MM / 2].max(initial=0.0) < 1e-7


@pytest.mark.parametrize("variant", VARIANTS[::4], ids=variant_name)
def test_exact_derivatives_agree_with_finite_differences(variant):
    problem, values = coherent_problem(variant)
    function = symbolic(problem)
    point, numbers = casadi.SX.sym("point", len(VARIABLE_NAMES)), casadi.SX.sym("numbers", function.numel_in(1))
    outputs = casadi.vertcat(*(casadi.vec(part) for part in function(point, numbers)[:2]))
    jacobian = casadi.Function("jacobian", [point, numbers], [casadi.jacobian(outputs, point)])
    specification = specification_values(problem.specification)
    at_point = np.array([values[name][0] for name in VARIABLE_NAMES])
    exact = np.asarray(jacobian(at_point, specification))
    for column, name in enumerate(VARIABLE_NAMES):
        step = 1e-6 * max(1.0, abs(at_point[column])) * (1e-2 if name.endswith("gain") else 1.0)
        sides = []
        for sign in (1.0, -1.0):
            moved = dict(zip(VARIABLE_NAMES, at_point, strict=True)) | {name: at_point[column] + sign * step}
            system = put_together(variant, with_principal_distance(moved), problem.specification)
            goals = [goal.expression(system) for goal in GOALS.values()]
            sides.append([float(item.value) for item in constraints_of(system, {})] + [float(goal) for goal in goals])
        difference = (np.array(sides[0]) - np.array(sides[1])) / (2.0 * step)
        scale = max(1.0, float(np.abs(difference).max()))
        assert exact[:, column] == pytest.approx(difference, rel=2e-5, abs=1e-6 * scale)


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_the_unit_box_maps_back_and_forth(variant):
    problem = problem_of(shipped_requirement("pipe_inspection"), variant)
    scaled = np.random.default_rng(4).random((len(VARIABLE_NAMES), 50))
    fixed = [problem.bounds[name].is_fixed for name in VARIABLE_NAMES]
    scaled[fixed] = 0.0
    values = problem.physical(scaled)
    assert problem.scaled(values) == pytest.approx(scaled, abs=1e-12)
    for name in VARIABLE_NAMES:
        value, interval = values[name], problem.bounds[name]
        low, high = min(interval.low, interval.high), max(interval.low, interval.high)
        assert value.min() >= low - 1e-9 * abs(low)
        assert value.max() <= high + 1e-9 * abs(high)
    for view in ("lower", "upper"):
        assert (np.sign(values[f"{view}_gain"]) == variant.gain_sign(view)).all()


@pytest.mark.parametrize("variant", VARIANTS[::5], ids=variant_name)
def test_the_enclosure_is_what_sampled_mirrors_need(variant):
    """Height and diameter as docs/theory.md, section 7, defines them, from points on every face and back."""
    problem, values = coherent_problem(variant)
    for index in range(DESIGNS):
        one = at(values, index)
        system = enclosed(problem, one)
        layout = system.layout
        heights, radii = [problem.specification.lens_front], []
        for mirror in layout.mirrors:
            inner, outer = (float(np.ravel(radius)[0]) for radius in (mirror.inner_radius, mirror.outer_radius))
            face = mirror.surface.height(np.linspace(inner, outer, 101))
            heights += [face.min(), face.max()]
            heights += [
                (face + mirror.direction * mirror.thickness).min(),
                (face + mirror.direction * mirror.thickness).max(),
            ]
            radii.append(outer)
        tight = enclosure(system)
        assert float(np.ravel(tight["top"])[0]) == pytest.approx(max(heights[1:]), abs=1e-9)
        assert float(np.ravel(tight["bottom"])[0]) == pytest.approx(min(heights), abs=1e-9)
        assert float(np.ravel(tight["radius"])[0]) == pytest.approx(max(radii), abs=1e-9)
