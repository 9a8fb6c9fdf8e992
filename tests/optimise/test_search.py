"""The search keeps what is fixed, chooses what is free, minimises what is asked, and repeats itself to the bit."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest

from designer.design import Design
from designer.optimise.problem import evaluate
from designer.optimise.program import forget_programs
from designer.optimise.search import SearchResult, search
from designer.requirement import Requirement, requirement_to_toml, set_key
from designer.requirement.reading import read_requirement
from designer.study.record import design_of
from designer.verify.judge import judge
from support.shipped_problems import CONFIGURATIONS, however_blurred, put_together, shipped_requirement, with_thin_light

NAME = "folded-HyPl-Hy-upper_outer"
INDOOR = however_blurred(shipped_requirement("indoor_robot"))


@cache
def plain_design() -> Design:
    """The indoor robot's design of the paper's configuration, nothing fixed."""
    requirement = INDOOR
    return design_of(requirement, found(requirement))


def found(requirement: Requirement, name: str = NAME) -> SearchResult:
    result = search(requirement, CONFIGURATIONS[name])
    assert result.status == "feasible", result.reason
    return result


def with_objective(minimise: str, then: str, within_percent: float = 1.0) -> Requirement:
    objective = {"minimise": minimise, "then": then, "within_percent": within_percent}
    return set_key(INDOOR, "objective", objective)


def fixed_to(table: str, owner: str, values: dict[str, float]) -> Requirement:
    return set_key(INDOOR, f"fixed.{table}", {owner: values})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("owner", "change"),
    [
        ("direct", {"radius_mm": 1.02}),
        ("direct", {"conic": 0.99}),
        ("primary", {"radius_mm": 0.98, "conic": 0.99}),
        ("secondary", {"vertex_mm": 0.99}),
        ("direct", {"vertex_mm": 1.01}),
    ],
    ids=str,
)
def test_a_given_mirror_is_kept(owner, change):
    """An engineer's own mirror, a little unlike the best one: its numbers are kept to 1e-6."""
    own = {key: getattr(plain_design().mirror(owner), key) * factor for key, factor in change.items()}
    requirement = fixed_to("mirror", owner, own)
    design = design_of(requirement, found(requirement))
    for key, value in own.items():
        assert getattr(design.mirror(owner), key) == pytest.approx(value, rel=1e-6)
    assert judge(design).passed
    plain = plain_design()
    assert design.score["first_stage"]["depth_error_rms"] >= plain.score["first_stage"]["depth_error_rms"] * (1 - 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("view", "change"), [("upper", {"gain": 0.97}), ("lower", {"viewpoint_mm": 1.05})], ids=str)
def test_a_given_view_is_kept(view, change):
    own = {key: getattr(getattr(plain_design().views, view), key) * factor for key, factor in change.items()}
    requirement = fixed_to("view", view, own)
    design = design_of(requirement, found(requirement))
    for key, value in own.items():
        assert getattr(getattr(design.views, view), key) == pytest.approx(value, rel=1e-6)
    assert judge(design).passed


def test_a_mirror_that_does_not_belong_makes_a_configuration_impossible():
    requirement = fixed_to("mirror", "direct", {"conic": -0.5})
    result = search(requirement, CONFIGURATIONS[NAME])
    assert result.status == "impossible"
    assert result.reason.startswith("the fixed direct mirror (conic constant -0.5) is a")


@pytest.mark.slow
def test_the_best_lens_of_a_catalogue_is_chosen():
    requirement = INDOOR
    lens = requirement.camera.model_dump(exclude_unset=True)["lens"]
    lenses = [lens | {"name": f"{focal:g} mm", "focal_length_mm": focal} for focal in (10.0, 14.0, 12.0)]
    alone = [found(set_key(requirement, "camera.lens", one)).first for one in lenses]
    together = found(set_key(requirement, "camera.lens", lenses)).first
    errors = [candidate.goals["depth_error"] for candidate in alone]
    assert together.goals["depth_error"] == pytest.approx(min(errors), rel=1e-6)
    assert together.lens.name == alone[int(np.argmin(errors))].lens.name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "asked", "others"),
    [
        # The envelope ends it: at 130 mm nothing fits.
        ("baseline_mm", (90.0, 130.0), (90.0, 110.0, 120.0)),
        ("camera.lens.focal_length_mm", (8.0, 13.0), (8.0, 10.5, 13.0)),
    ],
)
def test_of_a_range_the_best_value_is_chosen(key, asked, others):
    """It lies within the range; every other value gives a larger error, and that one alone gives the same again."""
    requirement = set_key(INDOOR, key, list(asked))
    free = found(requirement).first
    if key == "baseline_mm":
        chosen = free.values["baseline"]
    else:
        chosen = 1.0 / (1.0 / free.values["principal_distance"] + 1.0 / free.lens.focus_distance_mm)
    assert asked[0] < chosen < asked[1]
    least = free.goals["depth_error"]
    for value in others:
        assert found(set_key(requirement, key, value)).first.goals["depth_error"] > 1.0005 * least
    assert found(set_key(requirement, key, chosen)).first.goals["depth_error"] == pytest.approx(least, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("goal", ["height", "diameter", "volume"])
def test_any_goal_can_come_first(goal):
    then = "depth_error"
    result = found(with_objective(goal, then))
    plain = found(with_objective("depth_error", "height"))
    assert result.first.goals[goal] <= min(plain.first.goals[goal], plain.best.goals[goal]) * (1.0 + 1e-6)
    assert result.best.goals[goal] <= 1.01 * result.first.goals[goal] * (1.0 + 1e-6)
    assert result.best.goals[then] <= result.first.goals[then] * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("percent", [0.0, 0.5, 5.0])
def test_the_second_stage_gives_up_no_more_than_it_may(percent):
    result = found(with_objective("depth_error", "height", percent))
    bound = result.first.goals["depth_error"] * (1.0 + percent / 100.0)
    assert result.best.goals["depth_error"] <= bound * (1.0 + 2e-6)
    assert result.best.goals["height"] <= result.first.goals["height"] * (1.0 + 1e-6)


@pytest.mark.slow
def test_more_tolerance_never_costs_height():
    heights = [
        found(with_objective("depth_error", "height", percent)).best.goals["height"] for percent in (0.0, 1.0, 5.0)
    ]
    assert heights == sorted(heights, reverse=True)
    assert heights[2] < heights[0]


def test_the_same_seed_repeats_itself_to_the_bit():
    requirement = INDOOR
    runs = []
    for _ in range(2):
        forget_programs()
        runs.append(found(requirement))
    first, second = runs
    assert first.first.values == second.first.values
    assert first.best.values == second.best.values
    assert first.best.goals == second.best.goals
    assert first.statuses == second.statuses


def test_another_seed_reaches_the_same_optimum():
    requirement = INDOOR
    other = found(set_key(requirement, "solve.seed", 12345))
    assert other.first.goals["depth_error"] == pytest.approx(found(requirement).first.goals["depth_error"], rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "configuration", "least"),
    [
        ("ceiling_watch", "folded-HyEl-Hy-upper_outer", 0.0301786),
        ("sky_watch", "folded-HyPl-Hy-upper_outer", 0.0365728),
        ("sky_watch", "folded-HyHy-El-upper_outer", 0.0445817),
    ],
)
def test_no_seed_misses_the_optimum_where_there_are_several(name, configuration, least):
    """Each has local optima 0.4 to 7 percent above the least, at an f-number at which light is almost without width.

    For chief rays alone differential evolution or 64 starts found 0.0301540, 0.0363200 and 0.0443976: a little less.
    """
    requirement = set_key(with_thin_light(shipped_requirement(name)), "camera.lens.focus_distance_mm", 150)
    for seed in range(4):
        result = found(set_key(requirement, "solve.seed", seed), configuration)
        assert result.first.goals["depth_error"] == pytest.approx(least, rel=1e-3)


def test_a_written_requirement_gives_the_same_design(tmp_path):
    path = tmp_path / "indoor_robot.toml"
    path.write_text(requirement_to_toml(INDOOR), encoding="utf-8")
    assert found(read_requirement(path)).best.values == found(INDOOR).best.values


def test_what_is_called_feasible_is_so_when_evaluated_anew():
    result = found(INDOOR)
    for candidate in (result.first, result.best):
        values: dict[str, Any] = {name: np.array([value]) for name, value in candidate.values.items()}
        evaluation = evaluate(candidate.problem, put_together(candidate.problem, values))
        assert evaluation.largest_violations[0] <= 1e-6
        assert evaluation.clearances.min() >= candidate.problem.specification.asked.manufacture.clearance_mm - 1e-6


@pytest.mark.parametrize(
    ("requirement", "name"),
    [("indoor_robot", "direct-HyHy-upper_outer"), ("sky_watch", "folded-PlEl-Hy-upper_outer")],
)
def test_a_miss_names_its_constraint_and_by_how_much(requirement, name):
    result = search(shipped_requirement(requirement), CONFIGURATIONS[name])
    assert result.status == "infeasible"
    shortfall = result.shortfall
    assert shortfall is not None
    assert shortfall.amount > 0.0
    assert shortfall.unit in {"mm", "px", "deg", "(a ratio)", "(in the gain)"}
    assert f": {shortfall.constraint} by {shortfall.amount:.3g} {shortfall.unit}" in result.reason
    assert result.first is None
    assert result.best is None


@pytest.mark.parametrize(("conic", "side"), [(-30.0, "too high"), (-1.001, "too low")])
def test_a_fixed_number_that_is_missed_is_missed_on_one_side(conic, side):
    asked = set_key(set_key(INDOOR, "solve.starts", 4), "fixed", {"mirror": {"direct": {"conic": conic}}})
    result = search(asked, CONFIGURATIONS["folded-HyPl-Hy-upper_outer"])
    # Other constraints may fail by as much, in front of it.
    missed = re.search(r"fixed conic of the direct mirror by (\S+) (too \w+) \(in the conic constant\)", result.reason)
    assert missed is not None, result.reason
    assert float(missed[1]) > 0.0
    assert missed[2] == side


def test_all_that_miss_equally_are_named_whatever_the_seed():
    asked = however_blurred(shipped_requirement("sky_watch"))
    reasons = set()
    for seed in (0, 1):
        result = search(set_key(asked, "solve.seed", seed), CONFIGURATIONS["folded-PlEl-Hy-upper_outer"])
        assert result.shortfall is not None
        first, *others = [said.rsplit(" by ", 1)[0] for said in result.reason.split(": ", 1)[1].split("; equally, ")]
        assert first == result.shortfall.constraint
        assert [first, *others] == sorted({first, *others})
        assert others
        reasons.add(result.reason)
    assert len(reasons) == 1


def test_a_larger_envelope_makes_a_near_miss_feasible():
    """The named constraint is what stands in the way: the indoor robot's direct pair wants room."""
    requirement = set_key(INDOOR, "envelope", {"height_mm": 400, "diameter_mm": 200})
    found(requirement, "direct-HyHy-upper_outer")
