"""The compiled loops against the NumPy tracer, and against what makes a stereo system: one viewpoint for each view."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from designer import api
from designer.design import Design
from designer.verify.compiled import BLOCK, trace_many
from designer.verify.surfaces import Pose, build_scene
from designer.verify.tracer import pinhole_directions, trace_sequential, widest_pinhole_angle

DESIGNS = [
    Design.model_validate(record)
    for record in json.loads((Path(__file__).parents[1] / "data" / "studied_designs.json").read_text())
]


def directions_of(design: Design, number: int) -> np.ndarray:
    """Directions all over the image and a little beyond it, one along the axis, one across it, one backwards."""
    random = np.random.default_rng(5)
    psi = 1.1 * widest_pinhole_angle(design) * np.sqrt(random.uniform(size=number))
    directions = pinhole_directions(psi, random.uniform(-np.pi, np.pi, number))
    directions[:3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.6, -0.8]]
    return directions


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_compiled_loops_and_numpy_trace_the_same_rays(design):
    scene = build_scene(design)
    directions = directions_of(design, 3000)
    landed = 0
    for view in (design.views.upper, design.views.lower):
        path = scene.path(view.path)
        for apertures in (True, False):
            loops = trace_many(scene, path, directions, apertures=apertures)
            arrays = trace_sequential(scene, path, directions, np.zeros_like(directions), apertures=apertures)
            np.testing.assert_array_equal(loops.missed, arrays.missed)
            np.testing.assert_allclose(loops.direction, arrays.direction, atol=1e-13)
            for hit, same in zip(loops.hits, arrays.hits, strict=True):
                np.testing.assert_allclose(hit, same, rtol=1e-11, atol=1e-11)
            landed += int((loops.missed < 0).sum())
            assert not apertures or (loops.missed >= 0).any()
    assert landed > 1000


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_rays_that_leave_point_back_to_the_viewpoint(design):
    scene = build_scene(design)
    for view in (design.views.upper, design.views.lower):
        trace = trace_many(scene, scene.path(view.path), directions_of(design, 2000))
        left = trace.missed < 0
        towards = np.array([0.0, 0.0, view.viewpoint_mm]) - trace.point[left]
        miss = np.linalg.norm(np.cross(towards, trace.direction[left]), axis=1)
        assert miss.max() < 1e-9


@pytest.mark.parametrize("number", [0, 1, BLOCK - 1, BLOCK, 2 * BLOCK + 1])
def test_batches_of_any_size_give_the_same_rays(number):
    design = DESIGNS[0]
    scene = build_scene(design)
    path = scene.path(design.views.lower.path)
    directions = directions_of(design, 1000)
    together, few = trace_many(scene, path, directions), trace_many(scene, path, directions[:number])
    np.testing.assert_array_equal(few.direction, together.direction[:number])
    np.testing.assert_array_equal(few.missed, together.missed[:number])


def test_a_mirror_off_the_axis_is_refused():
    design = DESIGNS[0]
    scene = build_scene(design, {design.mirrors[0].name: Pose(np.eye(3), np.array([0.1, 0.0, 0.0]))})
    with pytest.raises(ValueError, match="on the axis only"):
        trace_many(scene, scene.path(design.views.upper.path), [[0.0, 0.0, 1.0]])


def test_the_api_traces_with_and_without_the_compiler(monkeypatch):
    design = DESIGNS[0]
    directions = directions_of(design, 500)
    compiled = api.trace_rays(design, "lower", directions)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    plain = api.trace_rays(design, "lower", directions)
    np.testing.assert_array_equal(plain.missed, compiled.missed)
    np.testing.assert_allclose(plain.point, compiled.point, atol=1e-11)
    assert not np.array_equal(plain.point, compiled.point)
