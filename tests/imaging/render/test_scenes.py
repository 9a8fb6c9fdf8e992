"""Rays against solids: closed forms against marching, boxes against meshes, and what scenes promise."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from designer.design import Design, read_design
from designer.files import InputError
from designer.imaging.render.scenes.library import SCENE_NAMES, build_world, choose_scene, make_world
from designer.imaging.render.scenes.shapes import Box, Cylinder, Ellipsoid, Rectangle, Shape, Sphere
from designer.imaging.render.scenes.world import first_surfaces, radiance
from designer.imaging.render.textures import TEXTURE_KINDS, make_texture, texture_values
from support import DATA

PROTOTYPE = DATA / "folded_hypl_hy.json"


@pytest.fixture(scope="module")
def prototype() -> Design:
    return read_design(PROTOTYPE)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=0)


def _turned_back(points: np.ndarray, box: Box) -> np.ndarray:
    """Points in the box's own axes, about its centre, written with complex numbers rather than as the box does."""
    centre = (np.array(box.low) + np.array(box.high)) / 2
    across = (points[0] - centre[0] + 1j * (points[1] - centre[1])) * np.exp(-1j * np.radians(box.yaw_deg))
    return np.stack([across.real, across.imag, points[2] - centre[2]])


def _is_inside(shape: Shape, points: np.ndarray) -> np.ndarray:
    """The solids' definitions, with no ray in them."""
    if isinstance(shape, Sphere):
        return np.linalg.norm(points - np.array(shape.centre)[:, None], axis=0) < shape.radius
    if isinstance(shape, Ellipsoid):
        across = (points[0] - shape.centre[0] + 1j * (points[1] - shape.centre[1])) * np.exp(
            -1j * np.radians(shape.yaw_deg)
        )
        place = np.stack([across.real, across.imag, points[2] - shape.centre[2]])
        return np.linalg.norm(place / np.array(shape.radii)[:, None], axis=0) < 1.0
    if isinstance(shape, Box):
        half = (np.array(shape.high) - np.array(shape.low)) / 2
        return (np.abs(_turned_back(points, shape)) < half[:, None]).all(axis=0)
    assert isinstance(shape, Cylinder)
    start, end = np.array(shape.start), np.array(shape.end)
    part = (end - start) @ (points - start[:, None]) / ((end - start) @ (end - start))
    foot = start[:, None] + part * (end - start)[:, None]
    return (part > 0) & (part < 1) & (np.linalg.norm(points - foot, axis=0) < shape.radius)


SOLIDS = [
    Sphere((30.0, -20.0, 10.0), 45.0),
    Box((-40.0, -60.0, -20.0), (55.0, 10.0, 35.0), yaw_deg=27.0),
    Cylinder((10.0, 5.0, -50.0), (10.0, 5.0, 40.0), 25.0),
    Cylinder((-40.0, 30.0, 5.0), (60.0, -20.0, 25.0), 18.0),
    Ellipsoid((15.0, -10.0, 5.0), (60.0, 25.0, 40.0), yaw_deg=35.0),
]
SOLID_NAMES = ["sphere", "turned box", "upright cylinder", "slanted cylinder", "ellipsoid"]


@pytest.mark.parametrize("shape", SOLIDS, ids=SOLID_NAMES)
def test_the_first_hit_is_where_marching_first_crosses_the_surface(shape: Shape) -> None:
    random = np.random.default_rng(4)
    points = random.uniform(-120, 120, (3, 400))
    directions = _unit(random.standard_normal((3, 400)))
    aimed = slice(0, 300)
    directions[:, aimed] = _unit(random.uniform(-40, 40, (3, 300)) - points[:, aimed])
    step = 0.05
    marks = np.arange(1, 6000) * step
    inside = _is_inside(shape, points)
    crossing = np.full(400, np.inf)
    for ray in range(400):
        along = _is_inside(shape, points[:, [ray]] + directions[:, [ray]] * marks)
        changed = np.flatnonzero(along != inside[ray])
        crossing[ray] = marks[changed[0]] if changed.size else np.inf
    distance = shape.distances(points, directions)
    marched = np.isfinite(crossing)
    assert marched.sum() > 120
    assert np.all(np.abs(distance[marched] - crossing[marched]) <= step)
    # What marching misses may only be a chord shorter than its step.
    grazed = np.isfinite(distance) & ~marched
    chord_middle = points[:, grazed] + directions[:, grazed] * (distance[grazed] + step)
    assert not _is_inside(shape, chord_middle).any()


@pytest.mark.parametrize("shape", SOLIDS, ids=SOLID_NAMES)
def test_normals_point_out_of_the_solid(shape: Shape) -> None:
    random = np.random.default_rng(5)
    points = _unit(random.standard_normal((3, 500))) * 200
    directions = _unit(random.uniform(-20, 20, (3, 500)) - points)
    distance = shape.distances(points, directions)
    met = np.isfinite(distance)
    places = points[:, met] + distance[met] * directions[:, met]
    normals = shape.normals(places, directions[:, met])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1, atol=1e-9)
    assert np.all(np.einsum("in,in->n", normals, directions[:, met]) < 0)
    assert not _is_inside(shape, places + 1e-6 * normals).any()
    assert _is_inside(shape, places - 1e-6 * normals).all()
    centre, radius = shape.bounding_disc()
    assert np.all(np.hypot(*(places[:2] - centre[:, None])) <= radius * (1 + 1e-12))
    lowest, highest = shape.heights()
    # As tight as 500 rays can tell.
    unmet = 0.1 * (highest - lowest)
    assert lowest - 1e-9 <= places[2].min() < lowest + unmet
    assert highest - unmet < places[2].max() <= highest + 1e-9


@given(st.tuples(*[st.floats(-50, 50)] * 2), st.tuples(*[st.floats(-1.6, 1.6)] * 2), st.floats(1, 30), st.floats(1, 30))
def test_a_rectangle_is_met_within_its_sides_only(
    start: tuple[float, float], aim: tuple[float, float], width: float, depth: float
) -> None:
    assume(all(abs(abs(part) - 1.0) > 1e-9 for part in aim))
    origin = np.array([[start[0]], [start[1]], [80.0]])
    # Five in eight of either coordinate lie within.
    target = np.array([[5.0 + aim[0] * width], [-3.0 + aim[1] * depth], [2.0]])
    away = np.linalg.norm(target - origin)
    flat = Rectangle((5.0, -3.0, 2.0), (width, 0.0, 0.0), (0.0, depth, 0.0))
    expected = away if max(abs(aim[0]), abs(aim[1])) < 1.0 else np.inf
    assert flat.distances(origin, (target - origin) / away)[0] == pytest.approx(expected, rel=1e-12)


def test_a_ray_along_an_axis_or_in_a_face_gives_no_false_hit() -> None:
    points = np.array([[0.0, 50.0, 0.0], [0.0, 0.0, 0.0], [-100.0, -100.0, 0.0]])
    directions = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    bar = Cylinder((0.0, 0.0, -10.0), (0.0, 0.0, 30.0), 20.0)
    np.testing.assert_allclose(bar.distances(points, directions), [90.0, np.inf, 30.0])
    box = Box((-20.0, -20.0, -10.0), (20.0, 20.0, 30.0))
    np.testing.assert_allclose(box.distances(points, directions), [90.0, np.inf, 30.0])


def test_a_box_and_a_ball_are_met_where_their_meshes_are(tmp_path: Path, prototype: Design) -> None:
    trimesh = pytest.importorskip("trimesh")
    middle = (prototype.views.upper.viewpoint_mm + prototype.views.lower.viewpoint_mm) / 2
    crate = trimesh.creation.box(extents=(300, 200, 100))
    crate.apply_translation((700, 100, 30))
    crate.export(tmp_path / "crate.stl")
    meshed = build_world(str(tmp_path / "crate.stl"), prototype)
    solid = make_world("crate", [Box((550.0, 0.0, middle - 20), (850.0, 200.0, middle + 80))], 5000.0)
    random = np.random.default_rng(6)
    points = random.uniform(-30, 30, (3, 3000))
    directions = _unit(random.uniform([500, -100, -50], [900, 300, 250], (3000, 3)).T - points)
    by_mesh, by_box = first_surfaces(meshed, points, directions), first_surfaces(solid, points, directions)
    both = np.isfinite(by_mesh.distance) & np.isfinite(by_box.distance)
    assert both.mean() > 0.2
    # The search among triangles is single precision: it may differ at the very edge, never in the place.
    assert np.mean(np.isfinite(by_mesh.distance) != np.isfinite(by_box.distance)) < 1e-3
    np.testing.assert_allclose(by_mesh.distance[both], by_box.distance[both], rtol=1e-6)
    looked = radiance(meshed, by_mesh, np.full(3000, 2.0))
    assert looked[both].std() > 0.01


def test_a_meshs_own_colours_are_seen(tmp_path: Path, prototype: Design) -> None:
    trimesh = pytest.importorskip("trimesh")
    middle = (prototype.views.upper.viewpoint_mm + prototype.views.lower.viewpoint_mm) / 2
    ball = trimesh.creation.icosphere(subdivisions=3, radius=100.0)
    ball.apply_translation((600, 0, 0))
    greys = np.where(ball.vertices[:, 2] > 0, 200, 50).astype(np.uint8)
    ball.visual.vertex_colors = np.column_stack([greys, greys, greys, np.full_like(greys, 255)])
    ball.export(tmp_path / "ball.ply")
    world = build_world(str(tmp_path / "ball.ply"), prototype)
    aims = np.array([[600.0, 600.0], [0.0, 0.0], [middle + 60, middle - 60]])
    points = np.array([[0.0, 0.0], [0.0, 0.0], [middle, middle]])
    bright, dark = radiance(world, first_surfaces(world, points, _unit(aims - points)), np.full(2, 1.0))
    assert bright / dark == pytest.approx(4.0, rel=0.25)


@settings(deadline=None)
@given(st.sampled_from(TEXTURE_KINDS), st.integers(0, 1000))
def test_textures_fade_to_flat_where_pixels_are_coarse(kind: str, seed: int) -> None:
    texture = make_texture(kind, 5000.0, seed)
    places = np.random.default_rng(seed).uniform(-3000, 3000, (3, 2000))
    sharp = texture_values(texture, places, np.full(2000, 0.01))
    coarse = texture_values(texture, places, np.full(2000, 5000.0))
    assert np.abs(sharp).max() < 1
    assert sharp.std() > 0.01
    assert np.abs(coarse).max() < 1e-6


def test_only_the_repetitive_texture_repeats() -> None:
    places = np.random.default_rng(1).uniform(-2000, 2000, (3, 4000))
    footprint = np.full(4000, 1.0)

    def best_likeness(kind: str) -> float:
        texture = make_texture(kind, 5000.0)
        here = texture_values(texture, places, footprint)
        shifts = np.arange(60.0, 400.0, 2.0)
        return max(
            float(
                np.corrcoef(here, texture_values(texture, places + np.array([[0.0], [0.0], [shift]]), footprint))[0, 1]
            )
            for shift in shifts
        )

    assert best_likeness("repetitive") > 0.999
    assert best_likeness("rich") < 0.85


@pytest.mark.parametrize("seed", range(5))
def test_the_rich_texture_is_alike_rich_in_every_direction(seed: int) -> None:
    for octave in make_texture("rich", 5000.0, seed).octaves:
        headings = octave.waves / np.linalg.norm(octave.waves, axis=0)
        shares = np.linalg.eigvalsh(headings @ headings.T / headings.shape[1])
        np.testing.assert_allclose(shares, 1.0 / 3.0, atol=0.04)


def test_every_octave_of_the_rich_texture_has_the_same_contrast() -> None:
    places = np.random.default_rng(2).uniform(-2500, 2500, (3, 20000))
    whole = make_texture("rich", 5000.0)
    spreads = [texture_values(type(whole)((octave,)), places, np.full(20000, 1e-3)).std() for octave in whole.octaves]
    assert min(spreads) / max(spreads) > 0.9


@pytest.mark.parametrize("name", SCENE_NAMES)
def test_every_scene_surrounds_the_sensor_at_working_distances(name: str, prototype: Design) -> None:
    elevation = {"hall": (-50.0, -10.0), "sky": (10.0, 50.0)}.get(name, (-16.0, 16.0))
    reach = (120.0, 250.0) if name == "pipe" else (1000.0, 5000.0)
    record = json.loads(PROTOTYPE.read_text(encoding="utf-8"))
    record["working_volume"] = {"elevation_deg": elevation, "distance_mm": reach}
    design = Design.model_validate(record)
    world = build_world(name, design)
    middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2
    random = np.random.default_rng(3)
    phi, theta = np.radians(random.uniform(*elevation, 4000)), random.uniform(0, 2 * np.pi, 4000)
    directions = np.stack([np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)])
    hits = first_surfaces(world, np.tile([[0.0], [0.0], [middle]], 4000), directions)
    assert np.isfinite(hits.distance).all()
    across = np.hypot(hits.points[0], hits.points[1])
    assert np.mean((across > reach[0] * 0.7) & (across < reach[1])) > 0.6
    if name != "cylinder":
        assert np.quantile(across, 0.9) / np.quantile(across, 0.1) > 1.4
        assert len(np.unique(hits.surface)) >= min(6, len(world.shapes))


@pytest.mark.parametrize("name", SCENE_NAMES)
def test_shapes_that_a_ray_does_not_head_for_are_left_out_rightly(name: str, prototype: Design) -> None:
    """The first surface equals the nearest of all shapes asked in turn, for starts on and off the axis."""
    world = build_world(name, prototype)
    random = np.random.default_rng(8)
    starts = random.uniform(-150, 150, (3, 3000))
    directions = _unit(random.standard_normal((3, 3000)))
    directions[:, :2] = [[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]
    hits = first_surfaces(world, starts, directions)
    distances = np.stack([shape.distances(starts, directions) for shape in world.shapes])
    np.testing.assert_allclose(hits.distance, distances.min(axis=0), rtol=1e-12)
    met = np.isfinite(hits.distance)
    np.testing.assert_array_equal(hits.surface[met], distances.argmin(axis=0)[met])


@pytest.mark.parametrize(
    ("elevation", "distance", "scene"),
    [
        ((-8.0, 8.0), (120.0, 250.0), "pipe"),
        ((-50.0, -10.0), (1000.0, 5000.0), "hall"),
        ((10.0, 50.0), (1000.0, 5000.0), "sky"),
        ((-16.0, 16.0), (1000.0, 5000.0), "office"),
    ],
)
def test_the_scene_follows_the_working_volume(
    prototype: Design, elevation: tuple[float, float], distance: tuple[float, float], scene: str
) -> None:
    volume = prototype.working_volume.model_copy(update={"elevation_deg": elevation, "distance_mm": distance})
    assert choose_scene(prototype.model_copy(update={"working_volume": volume})) == scene


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("attic",), "scene 'attic': must be one of auto, office"),
        (("office", "furry"), "texture 'furry': must be one of rich"),
        (("nowhere.obj",), "nowhere.obj: cannot be read"),
        (("office", "rich", 0, -5.0), "sensor height -5 mm: must be greater than 0"),
    ],
)
def test_what_cannot_be_built_is_said_in_a_line(prototype: Design, arguments: tuple[object, ...], said: str) -> None:
    name, *rest = arguments
    with pytest.raises(InputError, match=said.replace("(", r"\(")) as caught:
        build_world(str(name), prototype, *rest)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_an_empty_scene_is_refused(tmp_path: Path, prototype: Design) -> None:
    with pytest.raises(InputError, match="is empty"):
        make_world("nothing", [], 5000.0)
    pytest.importorskip("trimesh")
    (tmp_path / "empty.off").write_text("OFF\n0 0 0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"empty\.off: "):
        build_world(str(tmp_path / "empty.off"), prototype)


def test_no_rays_meet_nothing_and_nothing_is_warned_of(prototype: Design) -> None:
    none = np.empty((3, 0))
    with np.errstate(all="raise"):
        hits = first_surfaces(build_world("office", prototype), none, none)
    assert hits.surface.size == 0


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("a.obj", b"v 1 2\xff\nf 1 2 3\n", "OBJ"),
        ("a.stl", b"\x80\x81 garbage", "STL"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n\xff\xfe", "PLY"),
    ],
)
@pytest.mark.parametrize("has_charset_normalizer", [True, False])
def test_a_damaged_mesh_is_said_to_be_damaged(
    name, content, kind, has_charset_normalizer, tmp_path, prototype, monkeypatch
):
    pytest.importorskip("trimesh")
    if not has_charset_normalizer:
        monkeypatch.setitem(sys.modules, "charset_normalizer", None)
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"damaged, or not a mesh of the format {kind}: |: is empty; a scene") as error:
        build_world(str(path), prototype)
    assert "No module" not in str(error.value)
