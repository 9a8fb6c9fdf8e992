"""Close pencils and full bundles of traced rays against the closed form of focus: every kind of mirror."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from designer.design import Design
from designer.optics.focus import (
    chief_ray,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
    reciprocal_image_distance,
)
from designer.trace.aiming import exit_lines
from designer.trace.instrument import build_instrument
from designer.trace.pencils import DISC_RMS_PER_DIAMETER, pencil_images, pupil_places, trace_bundles
from designer.trace.sequential import trace_sequential
from support.closed_forms import convex_ellipsoid_pair, direct_ellipsoid_pair, folded_hypl_hy, paraboloid_pair
from support.drawn_designs import direct_design, direct_designs, folded_design, folded_designs, kind_of
from support.studied_designs import NAMES, studied_design

VIEWS = ("upper", "lower")
# An image farther away than this counts as one at this distance when reciprocals are compared.
FAR_IMAGE_MM = 1e4


def assert_pencils_agree(design: Design, view: str, elevations: np.ndarray, distances: np.ndarray) -> None:
    slope = np.tan(np.radians(elevations))[:, None]
    ray = chief_ray(light_path_of_design(design, view), slope)
    expected = reciprocal_image_distance(ray, reciprocal_along_ray(slope, distances))
    images = pencil_images(design, view, elevations, distances)
    tolerance = 1e-6 * np.maximum(np.abs(expected), 1.0 / FAR_IMAGE_MM)
    assert (np.abs(images.tangential - expected) < tolerance).all()
    assert (np.abs(images.sagittal - expected) < tolerance).all()
    assert (images.uncertainty < tolerance).all()


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", NAMES)
def test_pencils_of_studied_designs_meet_where_the_closed_form_says(name, view):
    design = studied_design(name)
    elevations = np.linspace(*getattr(design.views, view).elevation_deg, 9)
    assert_pencils_agree(design, view, elevations, np.array([*design.working_volume.distance_mm, np.inf]))


@pytest.mark.parametrize(
    "design", [folded_hypl_hy(), convex_ellipsoid_pair(), paraboloid_pair(), direct_ellipsoid_pair()]
)
@pytest.mark.parametrize("view", VIEWS)
def test_pencils_of_designs_from_closed_forms(design, view):
    elevations = np.linspace(*getattr(design.views, view).elevation_deg, 5)
    assert_pencils_agree(design, view, elevations, np.array([*design.working_volume.distance_mm, np.inf]))


def assert_drawn_pencils_agree(design: Design, view: str, distance: float) -> None:
    recorded = getattr(design.views, view)
    elevations = np.linspace(*recorded.elevation_deg, 3)
    # Only where light takes the path that the closed form supposes: the traced chief rays meet the same points.
    instrument = build_instrument(design)
    images = pencil_images(design, view, elevations, [distance])
    assume(np.isfinite(images.psi).all())
    (start_r, start_z), _ = exit_lines(instrument, instrument.path(recorded.path), images.psi)
    radius, height = chief_ray(light_path_of_design(design, view), np.tan(np.radians(elevations))).points[-1]
    side = 1.0 if recorded.gain > 0.0 else -1.0
    assume(np.max(np.abs(side * start_r - radius)) < 1e-6 and np.max(np.abs(start_z - height)) < 1e-6)
    assert_pencils_agree(design, view, elevations, np.array([distance, np.inf]))


@pytest.mark.parametrize(
    ("gain", "ratio", "viewpoint", "elevations", "kinds"),
    [
        (0.2, 5.0, -30.0, (20.0, 35.0), ("convex hyperboloid", "plane")),
        (-0.2, -5.0, -30.0, (20.0, 35.0), ("concave ellipsoid", "plane")),
        (0.14, -0.8, -30.0, (-10.0, 8.0), ("concave ellipsoid", "concave ellipsoid")),
        (0.07, -0.22, 11.0, (-16.0, 16.0), ("concave ellipsoid", "convex ellipsoid")),
    ],
)
def test_pencils_of_pairs_that_are_seldom_drawn(gain, ratio, viewpoint, elevations, kinds):
    design = folded_design(gain, ratio, 90.0, viewpoint, elevations)
    assert tuple(kind_of(design, name) for name in ("secondary", "primary")) == kinds
    assert_pencils_agree(design, "lower", np.linspace(*elevations, 5), np.array([300.0, np.inf]))


@given(design=direct_designs(), distance=st.floats(150.0, 1e4))
@settings(max_examples=60, deadline=None)
def test_pencils_of_any_direct_mirror(design, distance):
    assert_drawn_pencils_agree(design, "upper", distance)


@given(design=folded_designs(), distance=st.floats(150.0, 1e4))
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
def test_pencils_of_any_folded_pair(design, distance):
    assert_drawn_pencils_agree(design, "lower", distance)


def test_a_virtual_image_may_pass_through_infinity():
    design = studied_design("indoor_robot:folded-PaPa-Hy-upper_outer")
    path, distance = light_path_of_design(design, "lower"), 5000.0

    def reciprocal(elevation: float) -> float:
        slope = np.tan(np.radians(elevation))
        return float(reciprocal_image_distance(chief_ray(path, slope), reciprocal_along_ray(slope, distance)))

    crossing = brentq(reciprocal, *design.views.lower.elevation_deg, xtol=1e-12)
    elevations = crossing + np.array([-1.0, 0.0, 1.0])
    images = pencil_images(design, "lower", elevations, [distance])
    for found in (images.tangential[:, 0], images.sagittal[:, 0]):
        assert abs(found[1]) < 1e-6 / FAR_IMAGE_MM
        assert found[0] * found[2] < 0.0
        assert np.abs(found[[0, 2]]).min() > 1e-5
    assert_pencils_agree(design, "lower", elevations, np.array([distance]))


def test_a_plane_mirror_shows_a_point_as_far_behind_it_as_it_is_in_front():
    # Folded between planes alone there is no power: the image lies as far away as the light has to go.
    design = folded_hypl_hy()
    secondary = design.mirror("secondary")
    flat = secondary.model_copy(update={"name": "primary", "vertex_mm": 20.0, "faces": "up"})
    design = design.model_copy(update={"mirrors": (secondary, flat, design.mirror("direct"))})
    psi = np.arctan(0.1)
    images = pencil_images(design, "lower", [90.0 - np.degrees(psi)], [100.0])
    expected = 100.0 / np.sin(psi)
    np.testing.assert_allclose(1.0 / images.tangential, expected, rtol=1e-9)
    np.testing.assert_allclose(1.0 / images.sagittal, expected, rtol=1e-9)


def test_places_fill_the_pupil_evenly():
    places = pupil_places(3.0, 6)
    assert places.shape == (216, 3)
    half = len(places) // 2
    np.testing.assert_array_equal(places[half:], places[:half] * [1.0, -1.0, 1.0])
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=1e-14)
    # Of an evenly filled disc: mean square radius r^2 / 2, and the same in x and y.
    np.testing.assert_allclose((places[:, :2] ** 2).mean(axis=0), 9.0 / 4.0, rtol=1e-12)
    assert np.linalg.norm(places, axis=1).max() < 3.0


@pytest.mark.parametrize("name", NAMES)
def test_bundles_blur_as_the_first_order_says(name):
    design = studied_design(name)
    camera, lens = design.camera, lens_of_camera(design.camera)
    distances = np.array(design.working_volume.distance_mm)
    for view in VIEWS:
        elevations = np.linspace(*getattr(design.views, view).elevation_deg, 3)
        slope = np.tan(np.radians(elevations))[:, None]
        ray = chief_ray(light_path_of_design(design, view), slope)
        depths = reciprocal_image_depth(ray, reciprocal_along_ray(slope, distances))
        bundles = trace_bundles(design, view, elevations, distances)
        blur_px = np.abs(lens.blur(depths)) / camera.pixel_pitch_mm
        rms_px = bundles.rms_radius_mm(camera.focal_length_mm, lens.reciprocal_focus) / camera.pixel_pitch_mm
        first_px = blur_px * DISC_RMS_PER_DIAMETER
        sharp = blur_px <= 2.0
        assert (np.abs(rms_px / first_px - 1.0)[~sharp] < 0.05).all()
        # What is left at the image itself is aberration: no more may show in a small blur, and it is small.
        for i, k in zip(*np.nonzero(sharp), strict=True):
            left_px = bundles.rms_radius_mm(camera.focal_length_mm, depths[i, k])[i, k] / camera.pixel_pitch_mm
            assert abs(rms_px[i, k] - first_px[i, k]) <= left_px < 0.2


def test_aimed_rays_meet_in_the_point():
    design = studied_design("pipe_inspection:folded-HyHy-Hy-upper_outer")
    instrument = build_instrument(design)
    for view in VIEWS:
        recorded = getattr(design.views, view)
        bundles = trace_bundles(design, view, recorded.elevation_deg, (120.0, 250.0), pupil_radius_mm=2.0)
        directions = bundles.directions
        starts = np.broadcast_to(bundles.places_mm, directions.shape)
        path = instrument.path(recorded.path)
        trace = trace_sequential(instrument, path, directions.reshape(-1, 3), starts.reshape(-1, 3), apertures=False)
        to_point = np.broadcast_to(bundles.points_mm[:, :, None], directions.shape).reshape(-1, 3) - trace.point
        assert np.linalg.norm(np.cross(to_point, trace.direction), axis=1).max() < 1e-6
        assert (np.sum(to_point * trace.direction, axis=1) > 0.0).all()


def test_baker_and_nayar_defocus():
    """Int. J. Computer Vision 35 (1999), section 4: c = 1 m, k = 4, mirror point (0.125, 0, 0.125) m, l = 5 m.

    Their c is the whole distance from viewpoint to pinhole, z counts from the viewpoint towards the pinhole, l is
    measured from the viewpoint and the lens has a radius of 5 cm. They plot the area of the blur region; here the
    root-mean-square radius stands for it.
    """
    whole, k = 1000.0, 4.0
    inverse_eccentricity = np.sqrt((k - 2.0) / k)
    gain = (1.0 - inverse_eccentricity) / (1.0 + inverse_eccentricity)
    design = direct_design(gain, whole, (-60.0, -30.0), focal_length_mm=12.0)
    point = chief_ray(light_path_of_design(design, "upper"), -1.0).points[0]
    np.testing.assert_allclose(point, (125.0, whole - 125.0), rtol=1e-12)

    bundles = trace_bundles(design, "upper", [-45.0], [5000.0 * np.sqrt(0.5)], rings=12, pupil_radius_mm=50.0)
    focus = np.linspace(900.0, 1500.0, 601)
    radii = np.array([bundles.rms_radius_mm(1.0, 1.0 / u)[0, 0] for u in focus])
    best = int(np.argmin(radii))
    assert 1050.0 < focus[best] < 1200.0
    # Relative to the light's width: nowhere sharp, and yet sharp enough to be of no concern.
    in_focus = radii[best] / (50.0 / np.sqrt(2.0)) * focus[best]
    assert 1e-4 < in_focus < 0.1
    ray = chief_ray(light_path_of_design(design, "upper"), -1.0)
    assert 1050.0 < 1.0 / reciprocal_image_depth(ray, 1.0 / 5000.0) < 1200.0
