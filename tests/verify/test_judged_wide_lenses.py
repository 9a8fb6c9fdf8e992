"""Designs for lenses that are not r = f tan(psi): what the gain law predicts through the law, the tracer finds."""

import numpy as np
import pytest

from designer.design import VIEW_NAMES, Design
from designer.evaluate.depth import depth_error_map, noise_mm_of, point_covariance, stereo_pair_of
from designer.evaluate.focus import focus_of_design
from designer.evaluate.penumbra import zone_rims
from designer.evaluate.resolution import image_zones
from designer.evaluate.score import depth_score, evaluate_design
from designer.files import InputError
from designer.optics.image_law import image_law_of
from designer.trace.aiming import exit_lines, project
from designer.trace.image_law import image_radius, pinhole_angle, sensor_places, stretches
from designer.trace.instrument import build_instrument, sag
from designer.trace.pencils import trace_bundles
from designer.verify.judge import judge
from designer.verify.light import view_light
from designer.verify.montecarlo import depth_error_monte_carlo
from support.studied_designs import NAMES, studied_design
from support.wide_designs import LAWS, wide_design

OTHERS = {"perspective": "perspective", "equidistant": "perspective", "equisolid": "equidistant"}


def with_camera(design: Design, **changes) -> Design:
    return design.model_copy(update={"camera": design.camera.model_copy(update=changes)})


@pytest.mark.parametrize("law", LAWS)
def test_the_judge_passes_them_with_their_lens_and_no_other(law):
    design = wide_design(law)
    assert judge(design).problems == ()
    other = with_camera(design, projection=OTHERS.get(design.camera.projection, "perspective"), distortion=())
    problems = judge(other).problems
    # Without its distortion, or by another projection, the image grows beyond its circle or shrinks.
    zones, elsewhere = image_zones(design), image_zones(other)
    assert max(abs(zones[view][1] / elsewhere[view][1] - 1.0) for view in VIEW_NAMES) > 0.005
    grows = max(elsewhere[view][1] for view in VIEW_NAMES) > design.camera.image_circle_radius_px
    assert any("beyond the image circle" in problem for problem in problems) == grows


def test_a_law_that_ends_before_the_image_circle_is_a_problem():
    design = wide_design("equidistant")
    # psi (1 - psi^2) rises to 33.1 degrees only, 0.385 f.
    problems = judge(with_camera(design, distortion=(-1.0,))).problems
    assert any(
        "images nothing beyond" in problem and "its image circle reaches 2.64 mm" in problem for problem in problems
    )


@pytest.mark.parametrize("name", NAMES[::5])
def test_a_perspective_lens_by_other_words_is_the_same_lens(name):
    """No distortion to the last bit; a fisheye polynomial that is the tangent's own series, to its next term."""
    design = studied_design(name)
    plain = with_camera(design, distortion=(0.0, 0.0))
    assert evaluate_design(plain).as_json() == evaluate_design(design).as_json()
    assert repr(judge(plain)) == repr(judge(design))
    series = with_camera(
        design, projection="equidistant", distortion=(1.0 / 3.0, 2.0 / 15.0, 17.0 / 315.0, 62.0 / 2835.0)
    )
    assert judge(series).problems == judge(design).problems
    found, expected = evaluate_design(series), evaluate_design(design)
    # The series' next term, psi^10 / 113 of the radius, is missing: 3e-9 at 13 degrees, and 3e-8 of its slope.
    assert found.depth.depth_error_rms == pytest.approx(expected.depth.depth_error_rms, rel=1e-6)
    assert found.depth.depth_error_limit == pytest.approx(expected.depth.depth_error_limit, rel=1e-6)
    assert found.focus.largest_blur_px == pytest.approx(expected.focus.largest_blur_px, rel=1e-6)
    for view, light in view_light(series).items():
        np.testing.assert_allclose(light.blur_px, view_light(design)[view].blur_px, rtol=1e-6)
        np.testing.assert_allclose(light.blur_deg, view_light(design)[view].blur_deg, rtol=1e-6)


def depth_of(lines: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    (upper_height, upper_slope), (lower_height, lower_slope) = lines
    return (upper_height - lower_height) / (lower_slope - upper_slope)


def traced_depths(design: Design, distances, heights, moved_mm: dict[str, float], scale: float = 1.0) -> np.ndarray:
    """Depths found by tracing rays from image points that are moved outwards, and the whole image scaled."""
    instrument, lines = build_instrument(design), []
    for name in VIEW_NAMES:
        view = design.views.by_name[name]
        radius = scale * image_radius(design.camera, project(design, name, distances, heights))
        psi = pinhole_angle(design.camera, radius + moved_mm.get(name, 0.0))
        (start_x, start_z), (ahead_x, ahead_z) = exit_lines(instrument, instrument.path(view.path), psi)
        slope = ahead_z / ahead_x
        side = 1.0 if view.gain > 0.0 else -1.0
        lines.append((start_z - slope * start_x, side * slope))
    return depth_of(lines)


@pytest.mark.parametrize("law", LAWS)
def test_the_depth_error_is_that_of_image_points_moved_and_traced(law):
    design = wide_design(law)
    low, high = np.radians(design.working_volume.elevation_deg)
    near, far = design.working_volume.distance_mm
    grids = np.meshgrid(np.linspace(low, high, 7), np.geomspace(1.05 * near, 0.95 * far, 3))
    elevations, distances = (grid.ravel() for grid in grids)
    heights = design.views.middle_mm + distances * np.tan(elevations)
    step = 1e-6

    def derivative(**moved):
        return (traced_depths(design, distances, heights, moved) - traced_depths(
            design, distances, heights, {name: -by for name, by in moved.items()}
        )) / (2.0 * step)  # fmt: skip

    noise = noise_mm_of(design)
    by_noise = noise * np.hypot(derivative(upper=step), derivative(lower=step)) / distances
    pair = stereo_pair_of(design)
    np.testing.assert_allclose(depth_error_map(pair, elevations, distances, noise), by_noise, rtol=1e-6)
    variance = point_covariance(pair, np.tan(elevations), distances, noise)[:, 0, 0]
    np.testing.assert_allclose(np.sqrt(variance), by_noise * distances, rtol=1e-6)

    larger, smaller = (traced_depths(design, distances, heights, {}, 1.0 + sign * 1e-7) for sign in (1.0, -1.0))
    shift = (larger - smaller) / 2e-7 / distances
    whole = depth_error_map(pair, elevations, distances, noise, 1e-3)
    np.testing.assert_allclose(whole, np.hypot(by_noise, 1e-3 * shift), rtol=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_a_monte_carlo_by_traced_rays_finds_the_score(law):
    design = wide_design(law)
    found = depth_error_monte_carlo(design, 20_000, noise_px=design.noise_px / 4.0)
    quarter = design.model_copy(update={"noise_px": design.noise_px / 4.0})
    score = depth_score(quarter)
    assert found.lost == 0
    assert found.rms == pytest.approx(score.depth_error_rms_second_order, abs=4.0 * found.rms_standard_error)
    assert depth_score(design).limit_ratio > 1.0


@pytest.mark.parametrize("law", LAWS)
def test_the_blur_is_the_ellipse_into_which_the_law_stretches_the_disc(law):
    """Bundles through the whole pupil, landed on the sensor by the law itself, against first order."""
    design = wide_design(law)
    camera, expected = design.camera, focus_of_design(design, elevations=3)
    nearness = 1.0 / camera.focus_distance_mm
    for view, light in view_light(design).items():
        first = np.abs(getattr(expected, view).blur_px)
        np.testing.assert_allclose(light.blur_px, first, rtol=0.05, atol=0.5)
        np.testing.assert_allclose(light.blur_deg, np.abs(getattr(expected, view).blur_deg), rtol=0.05, atol=0.03)
        # A pupil ten times as wide drowns aberrations of the mirrors in blur; a focus far off does the rest.
        bundles = trace_bundles(design, view, light.elevations_deg, light.distances_mm)
        landed = sensor_places(camera, bundles.slopes + bundles.places_mm[:, :2] * (nearness + 0.01))
        deviations = 4.0 * landed.std(axis=2)
        along, across = stretches(camera, bundles.psi)
        np.testing.assert_allclose(
            deviations[..., 0] / deviations[..., 1], np.broadcast_to((along / across)[:, None], first.shape), rtol=0.05
        )
        law_along, law_across = image_law_of(camera).stretch(np.tan(bundles.psi / 2.0))
        np.testing.assert_allclose(along / across, law_along / law_across, rtol=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_the_score_reads_zones_and_rims_by_the_law(law):
    design = wide_design(law)
    score = evaluate_design(design)
    for view in VIEW_NAMES:
        psi = np.radians(getattr(judge(design), view).zone_psi_deg)
        zone = np.sort(image_radius(design.camera, psi)) / design.camera.pixel_pitch_mm
        np.testing.assert_allclose(score.zones_px[view], zone, rtol=1e-6)
        inner, outer = score.rims_px[view]
        assert inner < zone[0] < zone[1] < outer


def test_a_law_that_ends_before_the_image_circle_is_refused_by_the_score():
    camera = {"projection": "equidistant", "distortion": (-1.0,)}
    with pytest.raises(InputError, match=r"^camera\.distortion: the image radius rises up to .* mm only, at 32\.1"):
        evaluate_design(with_camera(wide_design("equidistant"), **camera))
    with pytest.raises(InputError, match=r"^camera\.projection: the image radius rises up to .* at 85 degrees"):
        evaluate_design(with_camera(wide_design("equisolid"), focal_length_mm=1.5))


@pytest.mark.parametrize("law", LAWS)
def test_penumbrae_lie_where_rays_past_a_rim_land(law):
    """From either side of the pupil, in the meridional plane, past the rim of each view's first mirror."""
    design = wide_design(law)
    camera = design.camera
    pupil = np.array([-1.0, 1.0]) * camera.pupil_radius_mm
    for view, rims in zone_rims(design).items():
        mirror = design.mirror(design.views.by_name[view].path[0])
        radius = mirror.outer_radius_mm
        height = mirror.vertex_mm + float(sag(mirror, radius))
        slopes = (radius - pupil) / height + pupil / camera.focus_distance_mm
        landed = sensor_places(camera, np.stack([slopes, np.zeros(2)], axis=-1))[:, 0] / camera.pixel_pitch_mm
        chief = image_radius(camera, np.arctan2(radius, height)) / camera.pixel_pitch_mm
        assert rims.outer.radius_px == pytest.approx(float(chief), rel=1e-9)
        assert rims.outer.width_px == pytest.approx(abs(np.diff(landed)[0]), rel=0.01, abs=0.01)
