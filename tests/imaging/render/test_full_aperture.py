"""The fast full-aperture renderer against rays traced directly, one by one, and against the blur of a thin lens."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from designer.design import Design
from designer.imaging.render import full_aperture
from designer.imaging.render.camera_rays import on_sensor, ray_directions, sample_places
from designer.imaging.render.full_aperture import (
    IDENTITY,
    OCTANTS,
    QUADRANTS,
    Optics,
    PixelBlock,
    cell_centres,
    render_block,
    sample_cells,
)
from designer.imaging.render.lens import LOSSLESS, pupil_of
from designer.imaging.render.passage import BLACK_PARTS_RADIANCE, UNKNOWN, find_passage, trace_pupil
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.render.scenes.shapes import Sphere
from designer.imaging.render.scenes.world import World, first_surfaces, radiance
from designer.imaging.render.textures import Texture
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.instrument import build_instrument
from support.studied_designs import NAMES, studied_design, with_coarse_pixels

PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"
CONVEX_ELLIPSOIDS = "indoor_robot:folded-ElEl-Hy-upper_inner"


def _radiance_along(
    design: Design, world: World, directions: np.ndarray, starts: np.ndarray, spread: np.ndarray
) -> np.ndarray:
    """Radiance (n,) along rays followed directly; ``spread`` (n,) in radians."""
    trace = trace_first_hits(build_instrument(design), directions, starts)
    seen = np.full(len(directions), BLACK_PARTS_RADIANCE)
    free = trace.status == Status.ESCAPED
    hits = first_surfaces(world, trace.exit_point[free].T, trace.exit_direction[free].T)
    seen[free] = radiance(world, hits, np.where(hits.surface >= 0, hits.distance, 0.0) * spread[free])
    return seen


@pytest.mark.parametrize("samples", range(1, 6))
def test_cells_and_their_centres_have_the_second_moments_of_square_and_disc(samples: int) -> None:
    in_pixel, in_pupil = cell_centres(samples)
    count = samples**2
    np.testing.assert_allclose(np.square(in_pixel).mean(axis=1) + 1 / 12 / count, 1 / 12, rtol=1e-12)
    # Of a disc of radius 1: a quarter along each axis, a half in all; of each of n equal parts: a quarter / n.
    assert np.square(in_pupil).sum(axis=0).mean() + 0.5 / count == pytest.approx(0.5, rel=1e-12)
    np.testing.assert_allclose(in_pupil.mean(axis=1), 0.0, atol=1e-12)
    assert len(np.unique(in_pixel.T.round(9), axis=0)) == count
    if samples > 2:
        # A tenth of the product of the standard deviations of square and disc.
        assert np.abs(in_pixel @ in_pupil.T / count).max() < 0.1 * np.sqrt(1 / 12) * 0.5


@pytest.mark.parametrize("name", NAMES)
def test_known_ways_are_those_of_rays_followed_to_the_first_surface(name: str) -> None:
    design = studied_design(name)
    camera, instrument, pupil = design.camera, build_instrument(design), pupil_of(design.camera)
    passage = find_passage(design, instrument, pupil)
    random = np.random.default_rng(4)
    count = 60_000
    u, v = random.uniform(-0.5, camera.width_px - 0.5, count), random.uniform(-0.5, camera.height_px - 0.5, count)
    reach, angle = pupil.radius_mm * np.sqrt(random.random(count)), random.uniform(0, 2 * np.pi, count)
    # A good part on the very rim of the pupil.
    reach[: count // 4] = pupil.radius_mm
    starts = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(count)])
    ahead = ray_directions(camera, u, v, starts, pupil)
    fast = trace_pupil(passage, instrument, np.hypot(*on_sensor(camera, u, v)), ahead, starts)
    direct = trace_first_hits(instrument, ahead, starts)
    np.testing.assert_array_equal(fast.leaves, direct.status == Status.ESCAPED)
    np.testing.assert_array_equal(fast.reflections, (direct.sequence >= 0).sum(axis=1))
    free = fast.leaves
    np.testing.assert_allclose(fast.exit_point[free], direct.exit_point[free], atol=1e-9)
    np.testing.assert_allclose(fast.exit_direction[free], direct.exit_direction[free], atol=1e-11)
    # Or nothing would be gained.
    assert np.mean(passage.way_of_ring == UNKNOWN) < 0.5


@pytest.mark.parametrize(
    ("width", "height", "circle"), [(90, 68, 34.0), (89, 68, None), (68, 90, None), (77, 61, None)]
)
def test_every_pixel_shows_what_its_rays_meet(width: int, height: int, circle: float | None) -> None:
    """All pixels of small images, reflected parts too, against rays that are themselves reflected and then followed."""
    coarse = with_coarse_pixels(studied_design(PROTOTYPE), 18)
    changes = {"width_px": width, "height_px": height, "image_circle_radius_px": circle}
    design = coarse.model_copy(update={"camera": coarse.camera.model_copy(update=changes)})
    camera, pupil = design.camera, pupil_of(design.camera)
    world = replace(build_world("office", design), texture=Texture(()))
    image = render(design, world, samples=2, aperture=True, seed=5)
    turn = float(np.random.default_rng(5).random())
    u0, v0 = camera.principal_point_px
    direct, times_shown = np.zeros_like(image), np.zeros(image.shape, dtype=int)
    for block in full_aperture._blocks(camera, 4):
        assert block.symmetries in (OCTANTS, QUADRANTS)
        u, v, starts = sample_cells(block.rows, block.columns, 2, pupil, turn)
        for symmetry in block.symmetries:
            here = symmetry.of(starts.T).T
            x, y = symmetry.of(np.stack([u - u0, v - v0]))
            seen = _radiance_along(
                design, world, ray_directions(camera, x + u0, y + v0, here, pupil), here, np.zeros(len(x))
            )
            columns, rows = symmetry.of(np.stack([block.columns - u0, block.rows - v0]))
            target = np.rint(rows + v0).astype(int), np.rint(columns + u0).astype(int)
            direct[target] = seen.reshape(-1, 4).mean(axis=1)
            times_shown[target] += 1
    lit = np.ones(image.shape, dtype=bool)
    if circle is not None:
        grid_rows, grid_columns = np.indices(image.shape)
        lit = np.hypot(grid_columns - u0, grid_rows - v0) <= circle
    np.testing.assert_array_equal(times_shown > 0, lit)
    difference = np.abs(image - direct)
    assert np.median(difference) == 0.0
    # One ray of four may fall to either side of a shape's outline: the last digits of its direction decide.
    assert np.quantile(difference, 0.999) < 1e-6
    assert difference.max() < 0.3


@pytest.mark.parametrize("name", [CONVEX_ELLIPSOIDS, PROTOTYPE, "pipe_inspection:folded-PlHy-El-upper_inner"])
def test_sixteen_rays_blur_a_texture_as_hundreds_do_with_less_noise_than_the_detector(name: str) -> None:
    design = studied_design(name)
    camera, pupil = design.camera, pupil_of(design.camera)
    world = build_world("auto", design)
    # Shapes of one tone: what differs is the texture.
    world = replace(world, tones=np.full(len(world.shapes), 0.5))
    random = np.random.default_rng(6)
    rows, columns = random.integers(0, camera.height_px, 500), random.integers(0, camera.width_px, 500)
    u0, v0 = camera.principal_point_px
    inside = np.hypot(columns - u0, rows - v0) < 0.98 * (camera.image_circle_radius_px or 1e9)
    rows, columns = rows[inside], columns[inside]
    u, v, starts = sample_places(rows, columns, 24, pupil, random)
    many = _radiance_along(design, world, ray_directions(camera, u, v, starts, pupil), starts, np.full(len(u), 1e-6))
    many = many.reshape(len(rows), -1)
    block = PixelBlock(rows, columns, (IDENTITY,))
    (_, _, (few,)) = next(render_block(Optics.of(design), [world], block, 4, LOSSLESS, turn=0.3))
    exact = many.mean(axis=1)
    seen = many.min(axis=1) > BLACK_PARTS_RADIANCE + 1e-6
    assert seen.sum() > 100
    slope = np.polyfit(exact[seen] - exact[seen].mean(), few[seen], 1)[0]
    assert slope == pytest.approx(1.0, abs=0.03)
    # Shot noise of white in a full well of 10,000 electrons: one per cent.
    assert np.std((few - exact)[seen]) < 0.01


@pytest.mark.parametrize("samples", [4, pytest.param(6, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("f_number", "focus"), [(2.0, 100.0), (4.0, 60.0)])
def test_a_points_image_is_as_wide_as_the_blur_of_a_thin_lens(samples: int, f_number: float, focus: float) -> None:
    """Blur diameter p f |1/u - 1/z_V|, with z_V the depth of the point's mirror image behind a plane mirror."""
    design = with_coarse_pixels(_under_a_plane_mirror(120.0), 4)
    camera = design.camera.model_copy(update={"focus_distance_mm": focus, "f_number": f_number})
    design = design.model_copy(update={"camera": camera})
    depth = 240.0 + 300.0
    ball = Sphere((0.13 * depth, 0.0, -300.0), 3.0)
    world = World("ball", (ball,), np.array([1.0]), np.zeros((1, 3)), Texture(()), background=0.0)
    radii = []
    for aperture in (False, True):
        image = render(design, world, samples=samples, aperture=aperture).astype(float)
        image[image <= BLACK_PARTS_RADIANCE * 1.01] = 0.0
        u0, v0 = camera.principal_point_px
        expected_u = u0 + 0.13 * camera.focal_length_mm / camera.pixel_pitch_mm
        rows, columns = np.indices(image.shape)
        window = np.hypot(columns - expected_u, rows - v0) < 45
        image = np.where(window, image, 0.0)
        total = image.sum()
        mean = (columns * image).sum() / total, (rows * image).sum() / total
        radii.append(np.sqrt((((columns - mean[0]) ** 2 + (rows - mean[1]) ** 2) * image).sum() / total))
    blur = 2 * camera.pupil_radius_mm * camera.focal_length_mm * abs(1 / focus - 1 / depth) / camera.pixel_pitch_mm
    assert 8.0 < blur < 50.0
    # Rays stand at the centres of their cells, see the module.
    closed_form = blur / np.sqrt(8) * np.sqrt(1 - 1 / samples**2)
    assert np.sqrt(radii[1] ** 2 - radii[0] ** 2) == pytest.approx(closed_form, rel=0.02)


def _under_a_plane_mirror(vertex: float) -> Design:
    """The prototype's camera, made thin, under a plane mirror alone."""
    design = studied_design(PROTOTYPE)
    shape = {"name": "flat", "kind": "plane", "vertex_mm": vertex, "radius_mm": None, "conic": 0.0}
    flat = design.mirrors[0].model_copy(
        update=shape | {"faces": "down", "inner_radius_mm": 0.0, "outer_radius_mm": 90.0}
    )
    changes = {"path": ("flat",), "viewpoint_mm": 2 * vertex, "gain": 1.0, "sense": "direct"}
    view = design.views.lower.model_copy(update=changes)
    return design.model_copy(
        update={"mirrors": (flat,), "views": design.views.model_copy(update={"lower": view, "upper": view})}
    )


def test_threads_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 12)
    world = build_world("office", design)
    threaded = render(design, world, samples=3, aperture=True, seed=2)

    def one_by_one(work: Callable[[int, object], None], blocks: Iterable[object]) -> None:
        for number, block in reversed(list(enumerate(blocks))):
            work(number, block)

    monkeypatch.setattr(full_aperture, "for_each", one_by_one)
    np.testing.assert_array_equal(threaded, render(design, world, samples=3, aperture=True, seed=2))
