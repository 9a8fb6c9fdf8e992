"""Designs that keep what the limit with margins knows of, drawn near it, never beat it, and come close."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.design import VIEW_NAMES, PerView
from designer.evaluate.depth import Volume
from designer.evaluate.limit import ImageBounds, arrangement_of, limit_gains
from designer.evaluate.margin_limit import FirstMirrors, MirrorBounds, margin_gains
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.optimise.margin_limit import LensSetting, margin_gains_of, margin_limit_of
from designer.optimise.problem import evaluate
from designer.optimise.search import search
from designer.requirement import Requirement, set_key
from support.random_requirements import random_requirement
from support.shipped_problems import CONFIGURATIONS, problems_of, requirement_as_shipped, shipped_requirement

VOLUME = Volume((np.radians(-16.0), np.radians(16.0)), (1000.0, 5000.0))
IMAGE = ImageBounds(2.64, 0.02)
NO_MARGINS = MirrorBounds(0.0, 0.0, 1.0, 1e9, 1e9, 10.0, np.inf)
MARGINS = MirrorBounds(0.5, 0.5, 2.0, 142.0, 30.0, 2.7, 1.75, 0.55, 0.01)
MIRRORS = {"direct": FirstMirrors(1, 1), "folded": FirstMirrors(1, None)}
ARRANGEMENTS = [(family, topology) for family in ("direct", "folded") for topology in ("upper_outer", "upper_inner")]


@pytest.mark.parametrize(("family", "topology"), ARRANGEMENTS)
@pytest.mark.parametrize(
    "law",
    [PERSPECTIVE, ImageLaw("equidistant", (-0.02, 0.003)), ImageLaw("equisolid"), ImageLaw("stereographic")],
    ids=lambda law: law.projection,
)
def test_without_margins_and_envelope_it_is_the_limit(family, topology, law):
    arrangement = arrangement_of(family, topology)
    at = (VOLUME, 100.0, 13.0, replace(IMAGE, law=law))
    bound, limit = margin_gains(arrangement, MIRRORS[family], *at, NO_MARGINS), limit_gains(arrangement, *at)
    assert (bound.lower, bound.upper) == pytest.approx((limit.lower, limit.upper), rel=1e-9)


@pytest.mark.parametrize(("family", "topology"), ARRANGEMENTS)
@pytest.mark.parametrize(
    "tighter",
    [
        {"edge_margin": 1.0},
        {"clearance": 1.0},
        {"highest": 137.0},
        {"barrel": 0.15},
        {"upper_viewpoint": 120.0},
        {"gains": PerView(lower=0.03, upper=0.03)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_takes_up_room_takes_gain(family, topology, tighter):
    arrangement = arrangement_of(family, topology)
    at = (VOLUME, 100.0, 13.0, IMAGE)
    loose = margin_gains(arrangement, MIRRORS[family], *at, MARGINS)
    tight = margin_gains(arrangement, MIRRORS[family], *at, replace(MARGINS, **tighter))
    assert min(loose.lower, loose.upper) > 0.0
    shares = tight.lower / loose.lower, tight.upper / loose.upper
    assert max(shares) <= 1.0
    assert min(shares) < 0.999


def designs_near_the_limit(requirement: Requirement, name: str, count: int):
    """Random designs of gains near the largest, at one baseline and setting of the lens, that keep what the limit
    knows: (problem, values, gains (n, 2), whether each keeps it (n,))."""
    problem = next(iter(problems_of(requirement, CONFIGURATIONS[name])))
    random = np.random.default_rng(8)
    bounds = {key: (each.low, each.high) for key, each in problem.bounds.items()}
    scaled = random.uniform(0.0, 1.0, (len(bounds), count))
    values = problem.physical(scaled)
    configuration, specification = problem.variant.configuration, problem.specification
    fixed = {"baseline": bounds["baseline"][0], "reciprocal_focus": 1.0 / 150.0, "f_number": 11.0}
    values |= {key: np.full(count, value) for key, value in fixed.items()}
    values["principal_distance"] = values["focal_length"] / (1.0 - values["focal_length"] / 150.0)
    image = ImageBounds(specification.image_radius, specification.zone_gap, specification.law)
    volume = Volume(specification.elevations, specification.distances)
    arrangement = arrangement_of(configuration.family, configuration.topology)
    largest = limit_gains(arrangement, volume, fixed["baseline"], float(values["principal_distance"][0]), image)
    outer_share, inner_share = 1.0 - 0.02 * random.uniform(size=count) ** 2, random.uniform(0.88, 1.0, count)
    for view in VIEW_NAMES:
        share = outer_share if view == arrangement.outer_view else inner_share
        values[f"{view}_gain"] = problem.variant.gain_sign(view) * largest[view] * share
    # Mirrors as high up as they go, where edges cost least.
    highest = specification.asked.envelope.height_mm - fixed["baseline"]
    values["lower_viewpoint"] = highest * random.uniform(0.5 if configuration.family == "direct" else 0.0, 1.1, count)
    values["secondary_height"] = specification.asked.envelope.height_mm * random.uniform(0.6, 1.05, count)
    with np.errstate(all="ignore"):
        values, system = problem.enclosed(values)
        evaluation = evaluate(problem, system)
    first = {path.reflections[0].mirror for path in system.paths}
    known = [index for index, row in enumerate(evaluation.names) if is_known_to_the_limit(row, first)]
    assert len(known) >= 8
    keeps = (np.nan_to_num(evaluation.amounts[known], nan=-1.0) >= -1e-9).all(axis=0)
    gains = np.abs(np.stack([values["lower_gain"], values["upper_gain"]], axis=1))
    return problem, values, gains, keeps


def is_known_to_the_limit(row: str, first: set[str]) -> bool:
    """Whether a row is of the image, the envelope, or the two first mirrors and the light on its way to them."""
    if any(word in row for word in ("image circle", "image zones", "lens barrel", "height of the mirror system")):
        return True
    if "vertex sheet" in row or "steepest slope" in row or "largest diameter" in row:
        return any(name in row for name in first)
    left, _, right = row.partition(" against ")
    if not right or right.split()[0] not in first:
        return False
    return "pinhole" in left or left in first


CASES = [
    ("pipe_inspection", "direct-HyHy-upper_outer", 0.97),
    ("ceiling_watch", "direct-HyHy-upper_inner", 0.97),
    ("pipe_inspection", "direct-HyEl-upper_inner", 0.97),
    ("indoor_robot", "folded-HyPl-Hy-upper_outer", 0.94),
    ("indoor_robot", "folded-HyPl-Hy-upper_inner", 0.95),
    ("pipe_inspection", "folded-HyEl-El-upper_outer", 0.95),
]


@pytest.mark.parametrize(("requirement", "name", "reached"), CASES)
def test_designs_near_the_limit_stay_below_it_and_reach_it(requirement, name, reached):
    problem, values, gains, keeps = designs_near_the_limit(shipped_requirement(requirement), name, 3_000)
    setting = LensSetting(float(values["principal_distance"][0]), float(values["focal_length"][0]) / 11.0, 1.0 / 150.0)
    bounds = margin_gains_of(problem, float(values["baseline"][0]), setting)
    bound = np.array([bounds.lower, bounds.upper])
    assert keeps.sum() >= 20
    assert (gains[keeps] <= bound * (1.0 + 1e-9)).all()
    inner = "lower" if problem.variant.configuration.topology == "upper_outer" else "upper"
    column = 0 if inner == "lower" else 1
    assert gains[keeps][:, column].max() / bound[column] >= reached
    # Without the margins there would be more room: the limit of before is not reached.
    assert gains[keeps][:, column].max() < gains[:, column].max()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9000, 9012))
def test_no_design_of_a_random_requirement_beats_it(seed):
    """Whatever the first objective; three configurations each, feasible or not."""
    random = np.random.default_rng(seed)
    requirement = random_requirement(random)
    for index in random.choice(len(requirement.configurations), 3, replace=False):
        result = search(requirement, requirement.configurations[index])
        for design in (result.first, result.best):
            if design is None:
                continue
            values, specification = design.values, design.problem.specification
            pupil = values["focal_length"] / values["f_number"]
            setting = LensSetting(values["principal_distance"], pupil, values["reciprocal_focus"])
            limit = margin_limit_of(design.problem, values["baseline"], setting, float(specification.noise))
            assert limit is not None
            assert design.goals["depth_error"] >= limit * (1.0 - 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shipped", "name", "most"),
    [("pipe_inspection", "direct-HyHy-upper_outer", 1.01), ("ceiling_watch", "direct-HyHy-upper_outer", 1.01)],
)
def test_ratios_that_only_margins_cause_are_one(shipped, name, most):
    requirement = set_key(set_key(requirement_as_shipped(shipped), "noise_px", 0.1), "scale_uncertainty_percent", 0.0)
    design = search(requirement, CONFIGURATIONS[name]).first
    values = design.values
    pupil = values["focal_length"] / values["f_number"]
    setting = LensSetting(values["principal_distance"], pupil, values["reciprocal_focus"])
    specification = design.problem.specification
    limit = margin_limit_of(design.problem, values["baseline"], setting, specification.noise)
    assert 1.0 <= design.goals["depth_error"] / limit <= most
