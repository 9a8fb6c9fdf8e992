"""The compiled loops against the NumPy tracer, and against what makes a stereo system: one viewpoint for each view."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer import api
from designer.design import Design
from designer.files import InputError
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.bundles import pinhole_directions
from designer.trace.compiled import BLOCK, trace_many
from designer.trace.instrument import Pose, build_instrument
from designer.trace.sequential import trace_sequential
from support import DATA

DESIGNS = [Design.model_validate(record) for record in json.loads((DATA / "studied_designs.json").read_text())]


def directions_of(design: Design, number: int) -> np.ndarray:
    """Directions all over the image and a little beyond it, one along the axis, one across it, one backwards."""
    random = np.random.default_rng(5)
    psi = 1.1 * widest_pinhole_angle(design) * np.sqrt(random.uniform(size=number))
    directions = pinhole_directions(psi, random.uniform(-np.pi, np.pi, number))
    directions[:3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.6, -0.8]]
    return directions


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_compiled_loops_and_numpy_trace_the_same_rays(design):
    instrument = build_instrument(design)
    directions = directions_of(design, 3000)
    landed = 0
    for view in (design.views.upper, design.views.lower):
        path = instrument.path(view.path)
        for apertures in (True, False):
            loops = trace_many(instrument, path, directions, apertures=apertures)
            arrays = trace_sequential(instrument, path, directions, np.zeros_like(directions), apertures=apertures)
            np.testing.assert_array_equal(loops.missed, arrays.missed)
            np.testing.assert_allclose(loops.direction, arrays.direction, atol=1e-13)
            for hit, same in zip(loops.hits, arrays.hits, strict=True):
                np.testing.assert_allclose(hit, same, rtol=1e-11, atol=1e-11)
            landed += int((loops.missed < 0).sum())
            assert not apertures or (loops.missed >= 0).any()
    assert landed > 1000


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_rays_that_leave_point_back_to_the_viewpoint(design):
    instrument = build_instrument(design)
    for view in (design.views.upper, design.views.lower):
        trace = trace_many(instrument, instrument.path(view.path), directions_of(design, 2000))
        left = trace.missed < 0
        towards = np.array([0.0, 0.0, view.viewpoint_mm]) - trace.point[left]
        miss = np.linalg.norm(np.cross(towards, trace.direction[left]), axis=1)
        assert miss.max() < 1e-9


@pytest.mark.parametrize("number", [0, 1, BLOCK - 1, BLOCK, 2 * BLOCK + 1])
def test_batches_of_any_size_give_the_same_rays(number):
    design = DESIGNS[0]
    instrument = build_instrument(design)
    path = instrument.path(design.views.lower.path)
    directions = directions_of(design, 1000)
    together, few = trace_many(instrument, path, directions), trace_many(instrument, path, directions[:number])
    np.testing.assert_array_equal(few.direction, together.direction[:number])
    np.testing.assert_array_equal(few.missed, together.missed[:number])


def test_a_mirror_off_the_axis_is_refused():
    design = DESIGNS[0]
    instrument = build_instrument(design, {design.mirrors[0].name: Pose(np.eye(3), np.array([0.1, 0.0, 0.0]))})
    with pytest.raises(ValueError, match="only mirrors that are on the axis"):
        trace_many(instrument, instrument.path(design.views.upper.path), [[0.0, 0.0, 1.0]])


def test_the_api_traces_with_and_without_the_compiler(monkeypatch):
    design = DESIGNS[0]
    directions = directions_of(design, 500)
    calls = []

    def trace_and_note(*arguments):
        calls.append(arguments)
        return trace_many(*arguments)

    monkeypatch.setattr("designer.trace.compiled.trace_many", trace_and_note)
    compiled = api.trace_rays(design, "lower", directions)
    assert len(calls) == 1
    monkeypatch.setattr("designer.extras.find_spec", lambda name: None)
    plain = api.trace_rays(design, "lower", directions)
    np.testing.assert_array_equal(plain.missed, compiled.missed)
    np.testing.assert_allclose(plain.point, compiled.point, atol=1e-11)
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("view", "directions", "words"),
    [
        ("middle", [[0.0, 0.0, 1.0]], "must be upper or lower"),
        ("upper", [[0.15, 0.0, 1.0]], "must be unit vectors"),
        ("upper", [[np.nan, 0.0, 1.0]], "must be unit vectors"),
        ("upper", np.eye(3)[:, :2], "must have shape"),
        ("upper", [0.0, 0.0, 1.0], "must have shape"),
    ],
)
def test_rays_that_are_none_are_refused(view, directions, words):
    with pytest.raises(InputError, match=words):
        api.trace_rays(DESIGNS[0], view, directions)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_any_two_mirrors_trace_alike(seed):
    """Planes, every kind of conic, both facings, holes; rays along the axis, across it and backwards."""
    random = np.random.default_rng(seed)
    mirrors = tuple(
        mirror.model_copy(
            update={
                "vertex_mm": random.uniform(-50.0, 200.0),
                "radius_mm": random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(0.5, 4.0),
                "conic": random.choice([0.0, -1.0, -0.5, -2.0, random.uniform(-5.0, 1.0)]),
                "inner_radius_mm": random.choice([0.0, random.uniform(0.0, 5.0)]),
                "outer_radius_mm": random.uniform(5.0, 80.0),
                "faces": str(random.choice(["up", "down"])),
            }
        )
        for mirror in DESIGNS[0].mirrors[:2]
    )
    plane = {"radius_mm": None, "conic": 0.0}
    mirrors = tuple(m.model_copy(update=plane) if random.uniform() < 0.25 else m for m in mirrors)
    instrument = build_instrument(DESIGNS[0].model_copy(update={"mirrors": mirrors}))
    directions = random.standard_normal((400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    directions[:3] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]
    for path in ((0,), (1,), (0, 1), (1, 0)):
        loops = trace_many(instrument, path, directions)
        arrays = trace_sequential(instrument, path, directions, np.zeros_like(directions))
        np.testing.assert_array_equal(loops.missed, arrays.missed)
        np.testing.assert_allclose(loops.direction, arrays.direction, atol=1e-9)
        np.testing.assert_allclose(loops.point, arrays.point, rtol=1e-9, atol=1e-8)
