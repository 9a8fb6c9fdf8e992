"""The judge's own reckoning of where a lens images its rays: OpenCV's for its models, and undone by its inverse."""

import cv2
import numpy as np
import pytest

from designer.design import Camera
from designer.optics.image_law import image_law_of
from designer.trace.image_law import (
    image_radius,
    largest_radius_mm,
    pinhole_angle,
    plane_slopes,
    sensor_places,
    stretches,
)
from support.closed_forms import folded_hypl_hy

LAWS = (
    ("perspective", ()),
    ("perspective", (-0.1, 0.02)),
    ("perspective", (0.15, 0.03, 0.002)),
    ("equidistant", ()),
    ("equidistant", (-0.05, 0.01, -0.002, 0.0003)),
    ("equisolid", ()),
    ("stereographic", ()),
)
WIDE = np.linspace(0.0, 1.2, 300)


def camera_with(projection: str, distortion: tuple[float, ...]) -> Camera:
    changes = {"projection": projection, "distortion": distortion, "focal_length_mm": 3.0}
    return folded_hypl_hy().camera.model_copy(update=changes)


@pytest.mark.parametrize(("projection", "distortion"), LAWS[:5])
def test_image_radii_are_those_of_opencv(projection, distortion):
    camera = camera_with(projection, distortion)
    points = np.stack([np.zeros_like(WIDE), -np.sin(WIDE), np.cos(WIDE)], axis=-1)
    matrix, none = np.diag([3.0, 3.0, 1.0]), np.zeros(3)
    k = [*distortion, 0.0, 0.0, 0.0, 0.0]
    if projection == "perspective":
        found, _ = cv2.projectPoints(points, none, none, matrix, np.array([k[0], k[1], 0.0, 0.0, k[2]]))
    else:
        found, _ = cv2.fisheye.projectPoints(points[None], none, none, matrix, np.array(k[:4]))
    np.testing.assert_allclose(image_radius(camera, WIDE), -found.reshape(-1, 2)[:, 1], rtol=1e-12)


@pytest.mark.parametrize(("projection", "distortion"), LAWS)
def test_it_agrees_with_the_closed_form_that_it_judges(projection, distortion):
    camera = camera_with(projection, distortion)
    law = image_law_of(camera)
    psi = np.linspace(0.0, 0.99 * law.widest, 500)
    radii = image_radius(camera, psi)
    np.testing.assert_allclose(radii, 3.0 * law.ratio(np.tan(psi / 2.0)), rtol=1e-12)
    np.testing.assert_allclose(np.tan(pinhole_angle(camera, radii) / 2.0), law.half_tangent(radii / 3.0), atol=1e-12)
    for ours, theirs in zip(stretches(camera, psi[1:]), law.stretch(np.tan(psi[1:] / 2.0)), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-7)


@pytest.mark.parametrize(("projection", "distortion"), LAWS)
def test_places_on_the_sensor_and_slopes_undo_each_other(projection, distortion):
    camera, random = camera_with(projection, distortion), np.random.default_rng(0)
    slopes = random.uniform(-1.0, 1.0, (400, 2))
    slopes[0] = 0.0
    places = sensor_places(camera, slopes)
    np.testing.assert_allclose(np.stack(plane_slopes(camera, *places.T), axis=-1), slopes, atol=1e-12)
    # Along the radius, and as far as the law says.
    np.testing.assert_allclose(np.arctan2(*places[1:].T), np.arctan2(*slopes[1:].T), atol=1e-12)
    np.testing.assert_allclose(np.hypot(*places.T), image_radius(camera, np.arctan(np.hypot(*slopes.T))), atol=1e-12)


def test_nothing_is_imaged_beyond_the_end_of_a_law():
    # x - 0.2 x^3 is largest at x^2 = 1 / 0.6.
    camera = camera_with("perspective", (-0.2,))
    end = np.sqrt(1.0 / 0.6)
    assert largest_radius_mm(camera) == pytest.approx(3.0 * (end - 0.2 * end**3), rel=1e-6)
    assert np.tan(pinhole_angle(camera, 10.0)) == pytest.approx(end, rel=1e-3)
    assert largest_radius_mm(camera_with("perspective", (0.0,))) == np.inf
