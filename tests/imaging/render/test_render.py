"""What the camera records: dots where the gain law says, blur as wide as the spot, flat fields flat."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.configurations import FOLDING_PAIRS
from designer.design import VIEW_NAMES, Design, ViewName
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.dots import Spot, render_dots, traced_spot
from designer.imaging.render.raytracing import (
    BLACK_PARTS_RADIANCE,
    NO_VIEW,
    Pupil,
    angular_spacing,
    ground_truth,
    pupil_of,
    render,
)
from designer.imaging.render.scenes.library import build_world, make_world
from designer.imaging.render.scenes.shapes import Cylinder, Sphere
from designer.imaging.render.scenes.world import World, first_surfaces
from designer.imaging.render.textures import Texture
from designer.optics.view import image_radius
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.instrument import build_instrument
from support.studied_designs import NAMES, studied_design, with_coarse_pixels

WINNER = "indoor_robot:folded-ElEl-Hy-upper_inner"
_NEIGHBOURS = tuple(product((-1, 0, 1), repeat=2))
PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"


def _middle(design: Design) -> float:
    return (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2


def _points_in_volume(design: Design, count: int, seed: int, part: float = 1.0) -> np.ndarray:
    """Points at random distances and elevations, in the middle part of the elevations."""
    random = np.random.default_rng(seed)
    volume = design.working_volume
    low, high = np.radians(volume.elevation_deg)
    slope = np.tan((low + high) / 2 + part * (high - low) * random.uniform(-0.5, 0.5, count))
    distance = np.exp(random.uniform(*np.log(volume.distance_mm), count))
    # Spread over the circle, so that dots do not overlap.
    azimuth = 2 * np.pi * (np.arange(count) + random.uniform(0, 0.5, count)) / count
    return np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), _middle(design) + slope * distance])


def _with_a_plane_mirror(vertex: float) -> Design:
    """The prototype's camera under a plane mirror alone, as its lower view: the pinhole's mirror image sees down."""
    design = studied_design(PROTOTYPE)
    shape = {"name": "flat", "kind": "plane", "vertex_mm": vertex, "radius_mm": None, "conic": 0.0}
    flat = design.mirrors[0].model_copy(update=shape | {"faces": "down"})
    changes = {"path": ("flat",), "viewpoint_mm": 2 * vertex, "gain": 1.0, "sense": "direct"}
    view = design.views.lower.model_copy(update=changes)
    return design.model_copy(
        update={"mirrors": (flat,), "views": design.views.model_copy(update={"lower": view, "upper": view})}
    )


def _by_gain_law(design: Design, name: str, points: np.ndarray) -> np.ndarray:
    view, camera = getattr(design.views, name), design.camera
    across = np.hypot(points[:, 0], points[:, 1])
    radius = image_radius((points[:, 2] - view.viewpoint_mm) / across, view.gain, camera.focal_length_mm, view.sense)
    return camera.principal_point_px + (radius / camera.pixel_pitch_mm / across)[:, None] * points[:, :2]


def _moments(image: np.ndarray, centre: np.ndarray, half: int) -> tuple[np.ndarray, float, float]:
    """Centroid (u, v), root mean square distance from it, and total light of a window of an image."""
    u, v = np.round(centre).astype(int)
    window = image[v - half : v + half + 1, u - half : u + half + 1].astype(float)
    rows, columns = np.mgrid[v - half : v + half + 1, u - half : u + half + 1]
    total = window.sum()
    mean = np.array([(columns * window).sum(), (rows * window).sum()]) / total
    spread = (((columns - mean[0]) ** 2 + (rows - mean[1]) ** 2) * window).sum() / total
    return mean, float(np.sqrt(spread)), float(total)


def _dot_moments(
    design: Design, view: ViewName, point: np.ndarray, spot: Spot, radius: float, *, aperture: bool
) -> tuple[np.ndarray, float, float]:
    """Moments of a dot whose sharp image has that radius, as one view shows it."""
    half = int(np.ceil(radius + (3.0 * spot.rms_radius_px if aperture else 2.0))) + 4
    samples = 3 if radius > 6.0 else 8
    dot = render_dots(
        design, point, views=(view,), radius_px=radius, samples=samples, aperture=aperture, window_px=half
    )
    return _moments(dot, np.array(spot.centre_px), half)


def test_the_samples_hold_every_folding_pair_family_and_sign() -> None:
    designs = [studied_design(name) for name in NAMES]
    pairs = {design.configuration.split("-")[1] for design in designs if design.configuration.startswith("folded")}
    assert pairs == {primary.value + secondary.value for primary, secondary in FOLDING_PAIRS}
    assert len({(design.views.lower.gain > 0, design.views.upper.gain > 0) for design in designs}) == 4
    assert {design.configuration.split("-")[0] for design in designs} == {"direct", "folded"}


@pytest.mark.parametrize("name", NAMES)
def test_dots_land_where_the_gain_law_says(name: str) -> None:
    design = studied_design(name)
    points = _points_in_volume(design, 8, seed=1)
    image = render_dots(design, points, samples=8)
    for view in VIEW_NAMES:
        for predicted in _by_gain_law(design, view, points):
            centroid, _, light = _moments(image, predicted, 5)
            assert light > 3.0
            np.testing.assert_allclose(centroid, predicted, atol=0.05)


@pytest.mark.parametrize(
    "name", [WINNER, PROTOTYPE, "pipe_inspection:folded-PlHy-El-upper_inner", "ceiling_watch:direct-ElEl-upper_inner"]
)
def test_blur_is_as_wide_as_the_spot_of_a_traced_bundle(name: str) -> None:
    design = studied_design(name)
    for view in VIEW_NAMES:
        spots = [(traced_spot(design, view, point), point) for point in _points_in_volume(design, 8, seed=2, part=0.4)]
        # Two thirds of a pixel and more can be told from the pixels themselves.
        spot, point = max(spots, key=lambda pair: pair[0].rms_radius_px)
        assert spot.rms_radius_px > 0.6
        radius = max(2.0, spot.rms_radius_px)

        sharp = _dot_moments(design, view, point, spot, radius, aperture=False)
        blurred = _dot_moments(design, view, point, spot, radius, aperture=True)
        # Nothing of the bundle is lost at a rim, or the spot would not be the whole one.
        assert blurred[2] == pytest.approx(sharp[2], rel=0.05)
        assert np.sqrt(blurred[1] ** 2 - sharp[1] ** 2) == pytest.approx(spot.rms_radius_px, rel=0.15)
        assert np.hypot(*(blurred[0] - spot.centre_px)) < 0.1 * radius


def test_the_lens_is_focused_where_the_camera_says() -> None:
    camera = studied_design(PROTOTYPE).camera
    pupil = pupil_of(camera)
    assert pupil.focus_distance_mm == 100.0
    assert 2 * pupil.radius_mm * camera.f_number == pytest.approx(12.0, rel=1e-12)
    far = camera.model_copy(update={"focus_distance_mm": None})
    assert pupil_of(far).focus_distance_mm == np.inf
    assert 2 * pupil_of(far).radius_mm * camera.f_number == pytest.approx(camera.focal_length_mm, rel=1e-12)


@settings(deadline=None, max_examples=40)
@given(st.floats(20.0, 2000.0), st.floats(0.02, 0.3), st.floats(0.5, 3.0), st.floats(30.0, 500.0))
def test_a_pupil_over_a_plane_mirror_spreads_light_as_similar_triangles_say(
    vertex: float, slope: float, pupil_radius: float, focus: float
) -> None:
    design = _with_a_plane_mirror(vertex)
    depth = 700.0
    image_depth = 2 * vertex + depth
    point = np.array([slope * image_depth, 0.0, -depth])
    camera = design.camera
    width = pupil_radius * abs(1 / image_depth - 1 / focus) * camera.focal_length_mm / camera.pixel_pitch_mm
    spot = traced_spot(design, "lower", point, pupil=Pupil(pupil_radius, focus))
    # A uniform disc has the root mean square radius of 1 / sqrt(2) of its own.
    assert spot.rms_radius_px == pytest.approx(width / np.sqrt(2), rel=1e-6, abs=1e-6)


def test_a_trace_of_one_quadrant_reflected_is_the_trace_of_the_whole_image() -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 25)
    world = build_world("office", design)
    truth = ground_truth(design, world)
    camera, scene = design.camera, build_instrument(design)
    rows, columns = np.mgrid[0 : camera.height_px, 0 : camera.width_px]
    u0, v0 = camera.principal_point_px
    across, down = (columns - u0) * camera.pixel_pitch_mm, (rows - v0) * camera.pixel_pitch_mm
    ahead = np.stack([across, down, np.full(rows.shape, camera.focal_length_mm)], axis=-1).reshape(-1, 3)
    trace = trace_first_hits(scene, ahead / np.linalg.norm(ahead, axis=1)[:, None])
    hits = first_surfaces(world, trace.exit_point.T, trace.exit_direction.T)
    assert camera.image_circle_radius_px is not None
    lit = (np.hypot(columns - u0, rows - v0) <= camera.image_circle_radius_px).ravel()
    free = (trace.status == Status.ESCAPED) & lit
    np.testing.assert_array_equal(truth.surface.ravel() >= 0, free)
    # Single precision holds a place in the scene to a thousandth of a millimetre.
    np.testing.assert_allclose(truth.point_mm.reshape(-1, 3)[free], hits.points.T[free], atol=2e-3)
    for number, name in ((1, "lower"), (2, "upper")):
        path = scene.path(getattr(design.views, name).path)
        expected = (compare_with_path(trace, path).status == Status.OK) & lit
        np.testing.assert_array_equal(truth.view.ravel() == number, expected)
        assert expected.sum() > 100


@pytest.mark.parametrize("aperture", [False, True])
def test_a_uniform_world_is_uniform_wherever_a_view_sees_and_black_elsewhere(aperture: bool) -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 16)
    out_of_sight = Sphere((0.0, 0.0, -1e6), 1.0)
    world = World("fog", (out_of_sight,), np.array([0.5]), np.zeros((1, 3)), Texture(()), background=0.5)
    image = render(design, world, samples=3, aperture=aperture)
    seen = ground_truth(design, world).view
    assert set(np.unique(seen)) == {0, 1, 2}
    interior = seen != NO_VIEW
    # Blur of some pixels reaches in from the edges of the zones.
    for _ in range(5 if aperture else 1):
        interior = np.all([np.roll(interior, (down, right), (0, 1)) for down, right in _NEIGHBOURS], axis=0)
    assert interior.sum() > 200
    np.testing.assert_allclose(image[interior], 0.5, atol=1e-6)
    camera = design.camera
    rows, columns = np.indices(image.shape)
    u0, v0 = camera.principal_point_px
    assert camera.image_circle_radius_px is not None
    outside = np.hypot(columns - u0, rows - v0) > camera.image_circle_radius_px
    assert np.all(image[outside] == 0)
    assert image.min() == 0
    assert np.all((image == 0) | (image >= BLACK_PARTS_RADIANCE - 1e-6))


def test_the_angle_between_pixels_is_the_traced_one() -> None:
    design = studied_design(PROTOTYPE)
    scene, camera = build_instrument(design), design.camera
    pitch, focal = camera.pixel_pitch_mm, camera.focal_length_mm
    for radius_px in (230.3, 420.7):
        corners = np.array([[radius_px, 0], [radius_px + 1, 0], [radius_px, 1]]) * pitch
        ahead = np.column_stack([corners, np.full(3, focal)])
        exits = trace_first_hits(scene, ahead / np.linalg.norm(ahead, axis=1)[:, None]).exit_direction
        along, across = (np.linalg.norm(exits[k] - exits[0]) for k in (1, 2))
        spacing = float(angular_spacing(design, scene)(np.array((radius_px + 0.5) * pitch)))
        assert spacing == pytest.approx(np.sqrt(along * across), rel=5e-3)


def test_points_of_the_truth_lie_on_the_cylinder_and_where_the_views_see_them() -> None:
    design = with_coarse_pixels(studied_design(WINNER), 8)
    world = make_world("wall", [Cylinder((0.0, 0.0, -1e5), (0.0, 0.0, 1e5), 2000.0)], 5000.0)
    truth = ground_truth(design, world)
    for number, name in ((1, "lower"), (2, "upper")):
        rows, columns = np.nonzero(truth.view == number)
        np.testing.assert_allclose(truth.distance_mm[rows, columns], 2000.0, rtol=1e-6)
        by_law = _by_gain_law(design, name, truth.point_mm[rows, columns].astype(float))
        np.testing.assert_allclose(by_law, np.column_stack([columns, rows]), atol=2e-3)


def test_more_samples_converge_and_the_same_seed_repeats() -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 16)
    world = build_world("office", design)
    few, some, many = (render(design, world, samples=count) for count in (1, 2, 6))
    assert np.abs(some - many).mean() < 0.6 * np.abs(few - many).mean()
    first, again, other = (render(design, world, samples=2, aperture=True, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_noise_has_the_variance_of_its_electrons() -> None:
    grey = np.full((400, 500), 0.36, dtype=np.float32)
    rig = Detector(full_well_electrons=8000.0, read_noise_electrons=30.0)
    noisy = expose(grey, rig, bits=16, seed=5).astype(float) / 65535
    np.testing.assert_allclose(noisy.mean(), 0.36, atol=1e-4)
    assert noisy.std() * 8000 == pytest.approx(np.sqrt(0.36 * 8000 + 30**2), rel=0.01)
    np.testing.assert_array_equal(expose(grey, rig, seed=5), expose(grey, rig, seed=5))
    assert not np.array_equal(expose(grey, rig, seed=5), expose(grey, rig, seed=6))
    np.testing.assert_array_equal(expose(grey), np.full(grey.shape, 92, np.uint8))
