"""Pictures and materials: what a pixel sees is their average over it; no seams; the same seed, the same place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import read_design
from designer.imaging.render.pictures import make_picture, picture_values
from designer.imaging.render.scenes.artwork import ARTWORK
from designer.imaging.render.scenes.library import build_world
from designer.imaging.render.scenes.materials import GRAINS, Finishes, brightness, make_material
from designer.imaging.render.scenes.shapes import Box, Cylinder, Ellipsoid, Rectangle, Shape, Sphere
from designer.imaging.render.scenes.world import first_surfaces, radiance
from support import DATA

MATERIALS = (*ARTWORK, *GRAINS)
ROUND = [
    Cylinder((0.0, 0.0, -500.0), (0.0, 0.0, 500.0), 330.0),
    Cylinder((-300.0, 0.0, 20.0), (350.0, 40.0, 0.0), 90.0),
    Sphere((0.0, 0.0, 0.0), 260.0),
    Ellipsoid((0.0, 0.0, 0.0), (250.0, 140.0, 320.0), 25.0),
]


def _seen(shape: Shape, points: np.ndarray, material: str, footprint: float, scale: float = 1.0) -> np.ndarray:
    finishes = Finishes((make_material(material),), np.ones(1), np.array([137.0]), scale)
    inward = -points / np.linalg.norm(points, axis=0)
    normals = shape.normals(points, inward)
    width = np.full(points.shape[1], footprint)
    return brightness(finishes, 0, shape, points, normals, inward, width).astype(float)


@pytest.mark.parametrize("footprint", [2.0, 5.0, 12.0, 30.0, 90.0, 400.0])
def test_a_picture_is_averaged_over_the_footprint(footprint: float) -> None:
    random = np.random.default_rng(1)
    texels = np.kron(random.random((16, 32)), np.ones((8, 8)))
    picture = make_picture(texels, 2.0)
    across, up = random.uniform(-600, 600, (2, 300))
    seen = picture_values(picture, across, up, np.full(300, footprint))
    # The average under a Gaussian of half the footprint, by as many samples as make it good to half a percent.
    blur = random.standard_normal((2, 300, 4000)) * footprint / 2.0
    columns = np.floor((across[:, None] + blur[0]) / 2.0).astype(int) % 256
    rows = np.floor((up[:, None] + blur[1]) / 2.0).astype(int) % 128
    averaged = texels[rows, columns].mean(axis=1)
    contrast = texels.std()
    assert np.sqrt(np.mean((seen - averaged) ** 2)) < 0.12 * contrast
    assert abs(np.mean(seen - averaged)) < 0.015
    assert seen.std() < 1.15 * averaged.std() + 0.01 * contrast


def test_a_picture_finer_than_its_samples_is_flat() -> None:
    stripes = np.tile([0.0, 1.0], (64, 32))
    picture = make_picture(stripes, 1.0)
    places = np.linspace(0.0, 300.0, 997)
    seen = picture_values(picture, places, places, np.full(997, 8.0))
    np.testing.assert_allclose(seen, 0.5, atol=0.01)


def test_a_picture_repeats_after_its_size_and_needs_sides_of_powers_of_two() -> None:
    random = np.random.default_rng(2)
    picture = make_picture(random.random((32, 64)), 3.0)
    width, height = picture.size_mm
    assert (width, height) == (192.0, 96.0)
    across, up, footprint = *random.uniform(0, 100, (2, 50)), random.uniform(0.5, 60, 50)
    once = picture_values(picture, across, up, footprint)
    np.testing.assert_allclose(picture_values(picture, across - 2 * width, up + 3 * height, footprint), once, atol=1e-5)
    with pytest.raises(ValueError, match="powers of two"):
        make_picture(np.zeros((30, 64)), 1.0)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("scale", [1.0, 0.3])
def test_what_a_pixel_sees_of_a_material_is_the_average_of_finer_samples(material: str, scale: float) -> None:
    """On a wall of 2 m, at 25 places: a footprint of 60 mm against a Gaussian cloud of fine samples."""
    wall = Rectangle((1000.0 * scale, 0.0, 0.0), (0.0, -1024.0 * scale, 0.0), (0.0, 0.0, 1024.0 * scale))
    random = np.random.default_rng(3)
    width = 60.0 * scale
    centres = random.uniform(-850.0 * scale, 850.0 * scale, (2, 25))
    points = np.stack([np.full(25, 1000.0 * scale), *centres])
    cloud = np.repeat(points, 1500, axis=1)
    cloud[1:] += random.standard_normal((2, 25 * 1500)) * width / 2.0
    fine = _seen(wall, cloud, material, 0.5 * scale, scale)
    averaged = fine.reshape(25, 1500).mean(axis=1)
    coarse = _seen(wall, points, material, width, scale)
    assert np.sqrt(np.mean((coarse - averaged) ** 2)) < 0.2 * fine.std() + 0.01
    assert abs(np.mean(coarse - averaged)) < 0.04 * fine.mean()


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(MATERIALS), st.sampled_from(ROUND), st.floats(0.5, 40.0), st.floats(0.2, 2.0))
def test_round_things_have_no_seam(material: str, shape: Shape, footprint: float, scale: float) -> None:
    """All round a circle on the surface, neighbours differ no more at one place than at the others."""
    if isinstance(shape, Cylinder):
        start, end = np.array(shape.start), np.array(shape.end)
        axis = (end - start) / np.linalg.norm(end - start)
        first = np.cross(axis, [0.3, 0.5, 0.81])
        first /= np.linalg.norm(first)
        second, middle, radii = np.cross(axis, first), (start + end) / 2.0 + 61.0 * axis, (shape.radius, shape.radius)
    else:
        first, second, middle = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.zeros(3)
        radii = shape.radii[:2] if isinstance(shape, Ellipsoid) else (shape.radius, shape.radius)  # type: ignore[attr-defined]
        if isinstance(shape, Ellipsoid):
            turn = np.radians(shape.yaw_deg)
            first, second = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    angles = np.linspace(0.0, 2.0 * np.pi, 4001)
    circle = middle[:, None] + radii[0] * np.cos(angles) * first[:, None] + radii[1] * np.sin(angles) * second[:, None]
    seen = _seen(shape, circle, material, footprint, scale)
    jumps = np.abs(np.diff(seen))
    worst = jumps.argmax()
    others = np.delete(jumps, worst)
    assert jumps[worst] < 2.0 * others.max() + 2e-3
    assert seen[0] == pytest.approx(seen[-1], abs=1e-4)


def test_a_fitted_picture_covers_each_face_once_and_reads_from_left_to_right() -> None:
    # A box that faces the origin from azimuth 40 degrees; the right edge is that of who looks from the origin.
    heading, right = np.radians(40.0), np.array([np.sin(np.radians(40.0)), -np.cos(np.radians(40.0)), 0.0])
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    centre = 1050.0 * ahead
    box = Box((centre[0] - 50.0, centre[1] - 200.0, -300.0), (centre[0] + 50.0, centre[1] + 200.0, 300.0), 40.0)
    picture = make_material("screen").picture
    assert picture is not None
    columns = np.linspace(0.02, 0.98, 400)
    for height in (0.2, 0.6):
        points = (1000.0 * ahead)[:, None] + right[:, None] * (400.0 * (columns - 0.5))
        points[2] = 600.0 * (height - 0.5)
        seen = _seen(box, points, "screen", 1.0)
        width, tall = picture.size_mm
        drawn = picture_values(picture, columns * width, np.full(400, height * tall), np.full(400, 1.0))
        assert np.corrcoef(seen, drawn)[0, 1] > 0.97
        assert np.corrcoef(seen, drawn[::-1])[0, 1] < 0.9


@pytest.mark.parametrize("name", ["office", "pipe", "hall", "sky"])
def test_a_place_is_the_same_for_the_same_seed_and_another_for_another(name: str) -> None:
    design = read_design(DATA / "folded_hypl_hy.json")
    random = np.random.default_rng(6)
    directions = random.standard_normal((3, 4000)) * [[1.0], [1.0], [0.2]]
    directions /= np.linalg.norm(directions, axis=0)
    start = np.tile([[0.0], [0.0], [design.views.middle_mm]], 4000)

    def look(seed: int) -> tuple[np.ndarray, np.ndarray]:
        world = build_world(name, design, "natural", seed)
        hits = first_surfaces(world, start, directions)
        return hits.distance, radiance(world, hits, np.where(np.isfinite(hits.distance), hits.distance, 0.0) * 1e-3)

    (distance, first), (same_distance, again), (other_distance, other) = look(3), look(3), look(4)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(distance, same_distance)
    np.testing.assert_array_equal(distance, other_distance)
    assert np.abs(first - other).mean() > 0.01
    # Tones as a camera is exposed for: from dark to white, hardly any saturated.
    assert 0.2 < np.median(first) < 0.7
    assert np.mean(first >= 0.999) < 0.05
