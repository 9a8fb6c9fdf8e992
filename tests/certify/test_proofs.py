"""Bounds lie below every design, and near the best; conflicts are what was planted; nothing feasible is denied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.certify import intervals
from designer.certify.branch_and_bound import TOLERANCE, bound_score
from designer.certify.prove import bound_of, branches_of, prove_infeasible
from designer.certify.score_bound import least_score
from designer.goals import GOALS
from designer.optimise.operations import state
from designer.optimise.problem import evaluate
from designer.optimise.search import search
from designer.optimise.variables import with_principal_distance
from support.proved import configuration_of, requirement_of


def at(problem, names, points):
    """Designs put together from their free variables, shape (variables, n); the others as their bounds fix them."""
    fixed = {name: np.full(points.shape[1], bounds.low) for name, bounds in problem.bounds.items()}
    return problem.enclosed(with_principal_distance(fixed | dict(zip(names, points, strict=True))))


def score_over(statement, least, greatest):
    """The lower bound of the score over a box, by ranges alone."""
    score = statement.score
    low, high = np.empty(len(score.codes)), np.empty(len(score.codes))
    intervals.evaluate(score.codes, score.first, score.second, score.constants, low, high, least, greatest)
    return least_score(low, high, score.results, statement.weights, *statement.texture)


def rules_at(statement, point):
    rules = statement.rules
    low, high = np.empty(len(rules.codes)), np.empty(len(rules.codes))
    intervals.evaluate(rules.codes, rules.first, rules.second, rules.constants, low, high, point, point)
    return low[rules.results], high[rules.results]


@pytest.mark.parametrize("noise", ["predicted", 0.1])
@pytest.mark.parametrize(
    "name", ["direct-HyEl-upper_inner", "folded-ElHy-Hy-upper_outer", "folded-PaPa-Hy-upper_inner"]
)
def test_bound_over_a_box_lies_below_every_design_in_it(name, noise):
    asked = requirement_of("pipe_inspection", noise_px=noise)
    random = np.random.default_rng(7)
    for branch in branches_of(asked, configuration_of(asked, name)):
        statement = state(branch.problem)
        for width in (0.3, 0.03, 0.0):
            for _ in range(12):
                span = statement.high - statement.low
                middle = statement.low + random.random(len(span)) * span
                least = np.maximum(statement.low, middle - width * span)
                greatest = np.minimum(statement.high, middle + width * span)
                points = least[:, None] + random.random((len(span), 60)) * (greatest - least)[:, None]
                with np.errstate(all="ignore"):
                    _, system = at(branch.problem, statement.variables, points)
                    scores = np.asarray(GOALS["depth_error"].expression(system))
                bound = score_over(statement, least, greatest)
                scores = scores[np.isfinite(scores)]
                assert np.all(bound <= scores * (1.0 + 1e-9))
                if width == 0.0 and noise == 0.1 and len(scores):
                    assert bound == pytest.approx(scores[0], rel=1e-9)


def test_bound_at_a_design_misses_only_its_aliasing(found):
    statement = state(found.design.problem)
    point = np.array([found.design.values[name] for name in statement.variables])
    value = found.design.goals["depth_error"]
    assert 0.99 * value <= score_over(statement, point, point) <= value


def test_a_design_keeps_the_rules_that_a_proof_knows(found):
    for is_conflict in (False, True):
        statement = state(found.design.problem, is_conflict=is_conflict)
        point = np.array([found.design.values[name] for name in statement.variables])
        low, _ = rules_at(statement, point)
        assert np.all(low >= -TOLERANCE)


def test_rules_are_those_of_the_optimiser(found):
    """The optimiser's rules come first and have its values; what a proof adds fails only where they fail."""
    problem, random = found.design.problem, np.random.default_rng(3)
    statement = state(problem)
    at_design = np.array([found.design.values[name] for name in statement.variables])
    points = at_design[:, None] * (1.0 + 0.05 * random.standard_normal((len(at_design), 40)))
    points = np.clip(points, statement.low[:, None], statement.high[:, None])
    _, system = at(problem, statement.variables, points)
    evaluation = evaluate(problem, system)
    known = [np.asarray(rule.value / rule.scale) for rule in problem.constraints(system) if rule.kind != "encloses"]
    failed = 0
    for place in range(points.shape[1]):
        low, high = rules_at(statement, points[:, place])
        for rule, least, most in zip(known, low, high, strict=False):
            value = np.broadcast_to(rule, points.shape[1])[place]
            assert least - 1e-9 <= value <= most + 1e-9
        if np.any(high < -TOLERANCE):
            failed += 1
            assert evaluation.largest_violations[place] > 0.0
    assert failed > 5


def test_bound_is_that_of_a_grid(found):
    """Two gains are free and all else is held: every design of a grid is tried."""
    problem = found.design.problem
    statement = state(problem)
    point = np.array([found.design.values[name] for name in statement.variables])
    gains = [place for place, name in enumerate(statement.variables) if name.endswith("gain")]
    low, high = point.copy(), point.copy()
    low[gains], high[gains] = 0.9 * point[gains], 1.1 * point[gains]
    held = replace(statement, low=low, high=high)
    lines = [np.linspace(low[place], high[place], 161) for place in gains]
    mesh = np.stack([line.ravel() for line in np.meshgrid(*lines)])
    points = np.repeat(point[:, None], mesh.shape[1], axis=1)
    points[gains] = mesh
    with np.errstate(all="ignore"):
        _, system = at(problem, statement.variables, points)
        keeps = evaluate(problem, system).largest_violations <= TOLERANCE
        scores = np.asarray(GOALS["depth_error"].expression(system))
    best = float(scores[keeps].min())
    outcome = bound_score(held, best / 1.01, 20.0)
    assert outcome.is_complete
    assert outcome.bound == pytest.approx(best / 1.01)
    # Nor does it go through where it must not: the design itself is there.
    too_much = bound_score(held, 1.001 * max(best, found.design.goals["depth_error"]), 0.5)
    assert not too_much.is_complete
    assert too_much.bound <= found.design.goals["depth_error"] * (1.0 + 1e-6)


def test_nothing_feasible_is_proven_infeasible(found):
    certificate = prove_infeasible(found.requirement, found.configuration, 2.0)
    assert certificate.status == "not proven"
    assert certificate.conflicting_keys == ()


def test_a_planted_conflict_is_named_and_nothing_else():
    """Mirrors from 141.95 mm on, below 142 mm with their 2 mm of substrate: edges alone reach farther."""
    asked = requirement_of("indoor_robot", camera__nearest_mirror_mm=141.95)
    certificate = prove_infeasible(asked, configuration_of(asked, "folded-HyPl-Hy-upper_outer"), 60.0)
    assert certificate.status == "infeasible"
    assert set(certificate.conflicting_keys) == {"camera.nearest_mirror_mm", "envelope.height_mm"}
    assert certificate.is_smallest
    # Nearer ones fit.
    fits = requirement_of("indoor_robot", camera__nearest_mirror_mm=30.0)
    assert prove_infeasible(fits, configuration_of(fits, "folded-HyPl-Hy-upper_outer"), 1.0).status == "not proven"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("study", "name"),
    [
        ("pipe_inspection", "folded-HyHy-Hy-upper_outer"),
        ("pipe_inspection", "folded-ElHy-El-upper_inner"),
        ("indoor_robot", "folded-HyHy-Hy-upper_outer"),
        ("ceiling_watch", "direct-ElHy-upper_outer"),
        ("sky_watch", "folded-ElPl-Hy-upper_inner"),
    ],
)
def test_bounds_lie_below_the_designs_of_the_shipped_requirements(study, name):
    asked = requirement_of(study)
    configuration = configuration_of(asked, name)
    first = search(asked, configuration).first
    least = first.goals["depth_error"]
    statement = state(first.problem)
    point = np.array([first.values[each] for each in statement.variables])
    assert np.all(rules_at(statement, point)[0] >= -TOLERANCE)
    assert score_over(statement, point, point) <= least
    # Asked for more than there is, no bound passes the design.
    outcome = bound_score(statement, 1.02 * least, 5.0)
    assert not outcome.is_complete
    assert outcome.bound <= least * (1.0 + 1e-6)
    certificate = bound_of(asked, configuration, least, None, 8.0)
    assert certificate.depth_error_bound <= least
    if study == "pipe_inspection":
        assert certificate.status == "optimal"
        assert certificate.gap_percent == pytest.approx(1.0, abs=1e-6)
