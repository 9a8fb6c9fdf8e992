"""Images through lenses that are not r = f tan(psi): rays by the tracer's law, the rig by the closed form."""

from itertools import product

import numpy as np
import pytest

from designer.design import VIEW_NAMES, PerView
from designer.evaluate.depth import depth_error_of_slopes, stereo_pair_of
from designer.evaluate.noise import MATCHER_PERFORMANCE, CollectedLight, rich_texture
from designer.evaluate.predicted_noise import Conditions, noise_model
from designer.imaging.endtoend.check import CheckOptions, check_design
from designer.imaging.render.camera_rays import on_sensor, ray_directions, sample_places
from designer.imaging.render.dots import project_points, render_dots, traced_spot
from designer.imaging.render.lens import RenderedLens, pupil_of
from designer.imaging.render.passage import find_passage, trace_pupil
from designer.imaging.render.raytracing import LOWER_VIEW, NO_VIEW, UPPER_VIEW, ground_truth, render
from designer.imaging.render.scenes.shapes import Sphere
from designer.imaging.render.scenes.world import World
from designer.imaging.render.textures import Texture
from designer.imaging.stereo.illumination import brightening
from designer.imaging.stereo.panorama import panorama_grid, view_images
from designer.imaging.stereo.placement import view_image
from designer.optics.focus import lens_of_camera, light_path_of_design
from designer.optics.image_law import image_law_of
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.image_law import image_radius
from designer.trace.instrument import build_instrument
from support.studied_designs import with_coarse_pixels
from support.wide_designs import LAWS, wide_design

WHITE = World("white", (Sphere((0.0, 0.0, -1e6), 1.0),), np.array([1.0]), np.zeros((1, 3)), Texture(()), background=1.0)


def points_in_volume(design, count: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    low, high = np.radians(design.working_volume.elevation_deg)
    elevation = random.uniform(0.9 * low, 0.9 * high, count)
    distance = np.exp(random.uniform(*np.log(design.working_volume.distance_mm), count))
    azimuth = random.uniform(-np.pi, np.pi, count)
    heights = design.views.middle_mm + distance * np.tan(elevation)
    return np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), heights], axis=-1)


def centroid_of(image: np.ndarray, at: np.ndarray, half: int) -> tuple[np.ndarray, float]:
    column, row = np.rint(at).astype(int)
    window = image[row - half : row + half + 1, column - half : column + half + 1]
    rows, columns = np.mgrid[row - half : row + half + 1, column - half : column + half + 1]
    light = float(window.sum())
    return np.array([(window * columns).sum(), (window * rows).sum()]) / light, light


@pytest.mark.parametrize("law", LAWS)
def test_dots_land_where_the_rig_looks_for_them(law):
    design = wide_design(law)
    points = points_in_volume(design, 6, seed=1)
    image = render_dots(design, points, samples=8)
    for view in VIEW_NAMES:
        predicted = np.stack(view_image(design, view).project(points), axis=-1)
        np.testing.assert_allclose(project_points(design, view, points), predicted, atol=1e-6)
        for place in predicted:
            centroid, light = centroid_of(image, place, 5)
            assert light > 2.0
            np.testing.assert_allclose(centroid, place, atol=0.06)


@pytest.mark.parametrize("law", LAWS)
def test_pixels_and_directions_undo_each_other(law):
    design = wide_design(law)
    for view in VIEW_NAMES:
        image, points = view_image(design, view), points_in_volume(design, 50, seed=3)
        u, v = image.project(points)
        slope, azimuth = image.direction_of(u, v)
        distance = np.hypot(points[:, 0], points[:, 1])
        np.testing.assert_allclose(slope, (points[:, 2] - image.viewpoint_mm) / distance, atol=1e-9)
        np.testing.assert_allclose(np.cos(azimuth - np.arctan2(points[:, 1], points[:, 0])), 1.0, atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_light_through_the_pupil_takes_the_ways_that_rays_followed_one_by_one_take(law):
    design = wide_design(law)
    camera, instrument, pupil = design.camera, build_instrument(design), pupil_of(design.camera)
    passage = find_passage(design, instrument, pupil)
    rows, columns = (grid.ravel() for grid in np.mgrid[0 : camera.height_px : 23, 0 : camera.width_px : 23])
    u, v, starts = sample_places(rows, columns, 2, pupil, np.random.default_rng(5))
    ahead = ray_directions(camera, u, v, starts, pupil)
    # Wherever in the pupil it starts, the ray crosses the plane in focus where the chief ray of its pixel does.
    chief = ray_directions(camera, u, v, None, None)
    focus = pupil.focus_distance_mm
    crossing = starts + ahead * (focus / ahead[:, 2:])
    np.testing.assert_allclose(crossing, chief * (focus / chief[:, 2:]), atol=1e-9 * focus)
    fast = trace_pupil(passage, instrument, np.hypot(*on_sensor(camera, u, v)), ahead, starts)
    direct = trace_first_hits(instrument, ahead, starts)
    np.testing.assert_array_equal(fast.leaves, direct.status == Status.ESCAPED)


@pytest.mark.parametrize("law", LAWS)
def test_spots_are_stretched_as_the_law_stretches_a_disc(law):
    design = wide_design(law)
    narrow = design.camera.model_copy(update={"focus_distance_mm": 1.2 * design.camera.focus_distance_mm})
    blurred = design.model_copy(update={"camera": narrow})
    perspective = blurred.model_copy(
        update={"camera": narrow.model_copy(update={"projection": "perspective", "distortion": ()})}
    )
    for point in points_in_volume(design, 3, seed=4):
        for view in VIEW_NAMES:
            radius_px = np.hypot(*(project_points(design, view, point[None])[0] - design.camera.principal_point_px))
            ratio = radius_px * design.camera.pixel_pitch_mm / design.camera.focal_length_mm
            along, across = image_law_of(design.camera).stretch(image_law_of(design.camera).half_tangent(ratio))
            expected = np.sqrt((along**2 + across**2) / 2.0)
            spot, round_spot = (traced_spot(each, view, point).rms_radius_px for each in (blurred, perspective))
            assert spot / round_spot == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("aperture", [False, True])
@pytest.mark.parametrize("law", LAWS)
def test_a_white_world_is_as_bright_as_pupil_and_solid_angle_of_a_pixel_say(law, aperture):
    """One cosine for the pupil seen from aside; sin(psi) dpsi / (r dr) for the solid angle behind an area of sensor."""
    design = with_coarse_pixels(wide_design(law), 8)
    lens = RenderedLens(wavelength_nm=None, mirror_reflectivity=0.8)
    image = render(design, WHITE, samples=3, aperture=aperture, lens=lens)
    plain = render(design, WHITE, samples=3, aperture=aperture)
    camera, view = design.camera, ground_truth(design, WHITE).view
    free = (plain > 1.0 - 1e-6) & (view != NO_VIEW)
    reach = 3 if aperture else 1
    for down, right in product((-reach, 0, reach), repeat=2):
        free &= np.roll(view, (down, right), (0, 1)) == view
    assert min((free & (view == number)).sum() for number in (LOWER_VIEW, UPPER_VIEW)) > 100
    rows, columns = np.nonzero(free)
    u0, v0 = camera.principal_point_px
    radius = np.hypot(columns - u0, rows - v0) * camera.pixel_pitch_mm / camera.focal_length_mm
    imaged = image_law_of(camera)
    tangent = imaged.half_tangent(radius)
    psi = 2.0 * np.arctan(tangent)
    solid_angle = np.sin(psi) / (radius * imaged.ratio_slope(tangent))
    mirrors = np.where(view[free] == UPPER_VIEW, len(design.views.upper.path), len(design.views.lower.path))
    np.testing.assert_allclose(image[free], 0.8**mirrors * np.cos(psi) * solid_angle, rtol=4e-3)


@pytest.mark.parametrize("law", LAWS)
def test_the_rig_evens_out_what_the_law_darkens(law):
    design = with_coarse_pixels(wide_design(law), 8)
    grid = panorama_grid(design, columns=300)
    images = view_images(design)
    factors = brightening(design, grid, images, 0.8)
    products = []
    for name in VIEW_NAMES:
        psi = 2.0 * np.arctan(images[name].law.half_tangent(
            np.abs(images[name].radius_px(grid.slope(name, np.arange(grid.rows)))) / images[name].principal_distance_px
        ))  # fmt: skip
        radius, step = image_radius(design.camera, psi), 1e-6
        slope = (image_radius(design.camera, psi + step) - image_radius(design.camera, psi - step)) / (2.0 * step)
        light = 0.8 ** len(design.views.by_name[name].path) * np.cos(psi) * np.sin(psi) / (radius * slope)
        products.append(light * factors[name])
    every = np.concatenate(products)
    capped = np.concatenate(list(factors.values())) >= 15.9
    np.testing.assert_allclose(every[~capped], every[~capped].mean(), rtol=1e-6)


@pytest.mark.parametrize("aperture", [False, True])
def test_beyond_the_field_of_a_lens_the_image_is_dark(aperture):
    # 85 degrees are 2.37 mm from the centre of a lens of 1.6 mm; the sensor's corner is at 4.4 mm.
    design = with_coarse_pixels(wide_design("equidistant"), 8)
    camera = design.camera.model_copy(update={"focal_length_mm": 1.6, "image_circle_radius_px": None})
    image = render(
        design.model_copy(update={"camera": camera}), WHITE, samples=2, aperture=aperture, lens=RenderedLens()
    )
    rows, columns = np.mgrid[0 : camera.height_px, 0 : camera.width_px]
    u0, v0 = camera.principal_point_px
    radius = np.hypot(columns - u0, rows - v0) * camera.pixel_pitch_mm
    end = 1.6 * np.radians(85.0)
    assert np.isfinite(image).all()
    # Diffraction carries a little light across the edge.
    assert np.all(image[radius > end + 3.0 * camera.pixel_pitch_mm] < 0.005)
    assert np.all(image[radius < end - 3.0 * camera.pixel_pitch_mm] > 0.0)


@pytest.mark.slow
def test_a_design_for_an_equidistant_lens_is_measured_as_predicted_end_to_end():
    """Over pixels twice as large; the scene is rendered through the lens with the tracer's law."""
    design = with_coarse_pixels(wide_design("equidistant"), 2)
    check = check_design(design, CheckOptions(lens=RenderedLens(), seed=2))
    assert check.passed
    assert check.untested == ()
    # The noise of the calibration scene is what blur, light and texture foretell through the law.
    assert np.nanmedian(check.noise.table_px / predicted_noise_px(check)) == pytest.approx(1.0, abs=0.2)
    # Read by another law, the same image gives other distances: the check would see it.
    wrong = design.model_copy(update={"camera": design.camera.model_copy(update={"distortion": (0.02,)})})
    assert not check_design(design, CheckOptions(lens=None, samples=1, seed=2, built=wrong)).passed


def predicted_noise_px(check) -> np.ndarray:
    """The predicted noise, alike in both views, at the distances and rows of a check's own measurement."""
    design, grid = check.rig.design, check.rig.grid
    camera, pair = design.camera, stereo_pair_of(design)
    # The detector's own light: its full well at white, whatever the f-number.
    light = CollectedLight(10_000.0, camera.f_number, 8.0)
    texture = rich_texture(design.working_volume.distance_mm[1])
    conditions = Conditions(0.0, 1.0, camera.pixel_pitch_mm, 550e-6, 0.88, texture, light, MATCHER_PERFORMANCE["sad"])
    paths = {name: light_path_of_design(design, name) for name in VIEW_NAMES}
    model = noise_model(conditions, pair, lens_of_camera(camera), paths)
    distance = np.exp(check.noise.log_distances)[:, None]
    upper = np.asarray(grid.slope("upper", np.arange(grid.rows)))[None, :]
    slopes = PerView(lower=upper + pair.baseline / distance, upper=upper)
    predicted = depth_error_of_slopes(pair, slopes, model(slopes, distance))
    return predicted / depth_error_of_slopes(pair, slopes, camera.pixel_pitch_mm)
