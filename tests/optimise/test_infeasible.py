"""What is called impossible or infeasible, against a search with much wider ranges and without the rules."""

from __future__ import annotations

import numpy as np
import pytest

from designer.configurations import Configuration
from designer.optimise.limit import limiting_gains
from designer.optimise.search import search
from designer.optimise.variables import fixed_parameters
from designer.optimise.variants import enumerate_variants
from designer.requirement import Requirement, set_key
from support.random_requirements import random_requirement
from support.shipped_problems import CONFIGURATIONS, problem_of, shipped_requirement
from support.wide_search import nearest_to_feasible

STARTS = 40


def drawn(seed: int) -> tuple[Requirement, list[Configuration]]:
    """An unusual requirement, and the configurations in an order of its own."""
    random = np.random.default_rng(seed)
    requirement = random_requirement(random)
    every = list(CONFIGURATIONS.values())
    return requirement, [every[place] for place in random.permutation(len(every))]


def found_all_the_same(requirement: Requirement, configuration: Configuration, seed: int) -> list[str]:
    """The variants of a configuration that the wider search finds a design of."""
    (lens,) = requirement.camera.lenses
    fixed = tuple(sorted(fixed_parameters(requirement).items()))
    reached = {
        variant.label: nearest_to_feasible(problem_of(requirement, variant, fixed), lens, STARTS, seed)
        for variant in enumerate_variants(configuration)
    }
    return [label for label, design in reached.items() if design.is_feasible]


def refuted(seed: int, count: int) -> list[str]:
    """The configurations, of so many, that are called infeasible or impossible though they have a design."""
    requirement, configurations = drawn(seed)
    wrong = []
    for configuration in configurations[:count]:
        result = search(requirement, configuration)
        if result.status != "feasible" and found_all_the_same(requirement, configuration, seed):
            wrong.append(f"{configuration.name}: {result.reason}")
    return wrong


@pytest.mark.parametrize("seed", [1, 5])
def test_what_has_no_design_has_none_in_wider_ranges_either(seed):
    assert not refuted(seed, count=2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 124))
def test_what_has_no_design_has_none_in_wider_ranges_either_for_many_requirements(seed):
    assert not refuted(seed, count=3)


@pytest.mark.slow
def test_the_wider_search_finds_designs_where_there_are_some():
    """Else the tests above would be hollow."""
    found, feasible = 0, 0
    for seed in range(200, 212):
        requirement, configurations = drawn(seed)
        for configuration in configurations[:3]:
            if search(requirement, configuration).status == "feasible":
                feasible += 1
                found += bool(found_all_the_same(requirement, configuration, seed))
    assert feasible > 5
    assert found >= 0.8 * feasible


def test_gains_are_ranged_over_all_baselines():
    """Looking steeply down from near by, the inner view's largest gain belongs to a baseline within the range."""
    requirement = shipped_requirement("pipe_inspection")
    (variant,) = enumerate_variants(CONFIGURATIONS["direct-HyHy-upper_inner"])
    for key, value in (
        ("working_volume.distance_mm", [236, 287]),
        ("working_volume.elevation_deg", [-66.5, -58.25]),
        ("baseline_mm", [1, 1087]),
        ("manufacture.zone_gap_px", 0),
    ):
        requirement = set_key(requirement, key, value)
    problem = problem_of(requirement, variant)
    distance = problem.bounds["focal_length"].low
    baselines = np.linspace(1.0, 1087.0, 400)
    gains = limiting_gains(variant, problem.specification, baselines, distance)["upper"]
    assert gains.max() > 1.08 * max(gains[0], gains[-1])
    assert problem.bounds["upper_gain"].high >= gains.max()
