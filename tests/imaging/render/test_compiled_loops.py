"""Compiled loops against the same in NumPy: shapes that rays meet, scenes, and waves."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from designer.imaging.render import textures
from designer.imaging.render.scenes.compiled_shapes import as_numbers, meet_run
from designer.imaging.render.scenes.library import SCENES, build_world
from designer.imaging.render.scenes.shapes import Box, Cylinder, Ellipsoid, Rectangle, Sphere
from designer.imaging.render.scenes.world import first_surfaces
from designer.imaging.render.textures import make_texture, texture_values
from support.imaging_designs import prototype

SHAPES = {
    "rectangle": Rectangle((10.0, -20.0, 30.0), (40.0, 30.0, 0.0), (0.0, 0.0, 25.0)),
    "box": Box((-40.0, 10.0, -30.0), (20.0, 60.0, 50.0)),
    "turned box": Box((-40.0, 10.0, -30.0), (20.0, 60.0, 50.0), 33.0),
    "sphere": Sphere((5.0, -10.0, 20.0), 45.0),
    "ellipsoid": Ellipsoid((5.0, -10.0, 20.0), (20.0, 60.0, 35.0), -70.0),
    "upright cylinder": Cylinder((0.0, 10.0, -50.0), (0.0, 10.0, 40.0), 30.0),
    "slanting cylinder": Cylinder((-30.0, 10.0, -50.0), (20.0, -10.0, 40.0), 25.0),
}
# Starts inside and outside, on faces and corners; along the axes, where slabs and caps are parallel to the ray, too.
coordinates = st.one_of(st.floats(-90.0, 90.0), st.sampled_from([-40.0, -30.0, 0.0, 10.0, 20.0, 40.0, 50.0, 60.0]))
headings = st.one_of(st.floats(-1.0, 1.0), st.just(0.0), st.sampled_from([-1.0, 1.0]))


def by_loops(shape, points, directions):
    count = points.shape[1]
    found, surface = np.full(count, np.inf), np.full(count, -1, dtype=np.intp)
    run = (7, 0, count, 0.0, -np.inf, np.inf)
    meet_run(*as_numbers(shape), *run, points, directions, np.zeros(count), np.ones(count), found, surface)
    np.testing.assert_array_equal(surface, np.where(np.isfinite(found), 7, -1))
    return found


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@settings(deadline=None)  # the loops are compiled on the first call
@given(points=arrays(float, (3, 20), elements=coordinates), directions=arrays(float, (3, 20), elements=headings))
def test_rays_meet_shapes_where_numpy_says(shape, points, directions):
    length = np.linalg.norm(directions, axis=0)
    points, directions = points[:, length > 0.1], (directions / np.where(length > 0.0, length, 1.0))[:, length > 0.1]
    loops, numpy = by_loops(shape, points, directions), shape.distances(points, directions)
    # A ray that only just grazes an edge may be held for a hit by one and for a miss by the other.
    certain = np.ones(loops.shape, dtype=bool)
    for seed in (3, 4):
        shifted = shape.distances(points + np.random.default_rng(seed).normal(size=(3, 1)) * 1e-7, directions)
        certain &= np.isclose(shifted, numpy, rtol=0.0, atol=1e-3)
    np.testing.assert_allclose(loops[certain], numpy[certain], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("scene", SCENES)
def test_a_scene_looks_the_same(scene):
    world = build_world(scene, prototype(), "rich")
    random = np.random.default_rng(8)
    directions = random.normal(size=(3, 20000))
    directions[:, :2] = [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]
    directions /= np.linalg.norm(directions, axis=0)
    points = random.uniform(-20.0, 20.0, (3, 20000))
    loops = first_surfaces(world, points, directions)
    plain = replace(world)
    object.__setattr__(plain, "numbers", (None,) * len(world.shapes))
    numpy = first_surfaces(plain, points, directions)
    assert sum(numbers is not None for numbers in world.numbers) > 0
    assert (loops.surface != numpy.surface).mean() < 1e-3
    same = loops.surface == numpy.surface
    np.testing.assert_allclose(loops.distance[same], numpy.distance[same], rtol=1e-9)


@pytest.mark.parametrize("kind", ["rich", "poor", "repetitive"])
def test_waves_add_up_to_the_same_texture(kind, monkeypatch):
    texture, random = make_texture(kind, 5000.0, 4), np.random.default_rng(2)
    places, footprint = random.uniform(-5000.0, 5000.0, (3, 3000)), random.uniform(0.0, 60.0, 3000)
    loops = texture_values(texture, places, footprint)
    monkeypatch.setattr(textures, "compiled_loops", lambda name: None)
    numpy = texture_values(texture, places, footprint)
    # Both work in single precision: the phase of the finest waves is that of some thousand turns.
    np.testing.assert_allclose(loops, numpy, atol=2e-3 * numpy.std())
    assert numpy.std() > 0.005
