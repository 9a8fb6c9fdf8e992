"""Ranges of variables: wide enough that constraints decide, also for unusual requirements."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st

from designer.optimise.reach import lower_viewpoints, secondary_vertices
from designer.optimise.screening import draw
from designer.optimise.search import search
from designer.optimise.variables import free_ranges
from designer.requirement import read_requirement
from designer.study.record import design_of
from designer.verify.judge import judge
from support import DATA
from support.random_requirements import random_requirement
from support.shipped_problems import CONFIGURATIONS, VARIANTS, is_coherent, problem_of, put_together


@pytest.mark.parametrize(
    ("file", "configuration"),
    [
        ("steep_in_a_flat_box", "folded-PlHy-Hy-upper_inner"),
        ("steep_in_a_flat_box", "folded-HyHy-Hy-upper_inner"),
        ("small_gain", "folded-PlHy-Hy-upper_inner"),
    ],
)
def test_a_design_is_found_where_there_is_one(file, configuration):
    requirement = read_requirement(DATA / f"{file}.toml")
    result = search(requirement, CONFIGURATIONS[configuration])
    assert result.status == "feasible", result.reason
    verdict = judge(design_of(requirement, result))
    assert verdict.passed, verdict.problems


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(VARIANTS))
@example(3562, next(each for each in VARIANTS if each.configuration.name == "folded-PaPa-Hy-upper_outer"))
def test_nothing_outside_its_interval_has_its_mirrors_in_the_envelope(seed, variant):
    """Random designs anywhere: those whose last mirrors lie in the envelope have viewpoints and vertices within."""
    requirement = random_requirement(np.random.default_rng(seed))
    problem = problem_of(requirement, variant)
    specification, free = problem.specification, free_ranges(requirement, requirement.camera.lenses[0])
    random = np.random.default_rng(seed)
    values = draw(problem, 2000, random, 0.01)
    envelope = specification.asked.envelope
    far = envelope.height_mm + envelope.diameter_mm
    values["lower_viewpoint"] = random.uniform(-6.0, 6.0, 2000) * far
    values["secondary_height"] = random.uniform(0.0, 4.0, 2000) * far
    system = put_together(problem, values)
    in_envelope = is_coherent(system)
    for mirror in system.layout.mirrors:
        for radius in mirror.used_radii:
            off = np.abs(mirror.surface.height(radius) - specification.lens_front)
            in_envelope &= (radius > 0.0) & (2.0 * radius < envelope.mirror_diameter_mm) & (off < envelope.height_mm)
    low, high = lower_viewpoints(variant, specification, free.baseline, {})
    viewpoints = np.broadcast_to(values["lower_viewpoint"], in_envelope.shape)[in_envelope]
    assert np.all((viewpoints >= low) & (viewpoints <= high))
    if variant.fold is not None:
        low, high = secondary_vertices(variant, specification, free.baseline, free.principal_distance[0])
        from_pinhole = system.layout.mirrors[0].surface.height(system.layout.mirrors[0].used_radii[0])
        near = in_envelope & (from_pinhole > specification.asked.camera.nearest_mirror_mm)
        heights = np.broadcast_to(values["secondary_height"], in_envelope.shape)[near]
        assert np.all((heights >= low) & (heights <= high))
    event(f"{min(viewpoints.size, 10)} in the envelope")
