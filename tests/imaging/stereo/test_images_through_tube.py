"""Images through a tube: where points lie in them, in closed form and traced, and which sensors are refused."""

from __future__ import annotations

import numpy as np
import pytest

from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import VIEW_NAMES, PerView
from designer.files import InputError
from designer.imaging.render.dots import project_points, render_dots
from designer.imaging.render.sensor import sensor_of
from designer.imaging.stereo.placement import view_image
from designer.imaging.stereo.reconstruction import triangulate
from designer.imaging.stereo.rig import build_rig
from designer.optics.tube import wall_of
from designer.trace.sequential import trace_sequential
from support.housings import with_tube
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels

NAMES = SHARP_NAMES[2::5]


def points_in(design, count: int = 40) -> np.ndarray:
    random = np.random.default_rng(12)
    distance = random.uniform(*design.working_volume.distance_mm, count)
    slope = np.tan(np.radians(random.uniform(*design.working_volume.elevation_deg, count)))
    azimuth = random.uniform(-np.pi, np.pi, count)
    height = design.views.middle_mm + distance * slope
    return np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height])


@pytest.mark.parametrize("name", NAMES)
def test_points_lie_where_traced_rays_come_from_and_are_found_again(name):
    design = with_tube(sharp_design(name), wall_mm=4.0)
    points = points_in(design)
    distance = np.hypot(points[:, 0], points[:, 1])
    slopes = {}
    for view in VIEW_NAMES:
        image = view_image(design, view)
        predicted = np.stack(image.project(points), axis=-1)
        np.testing.assert_allclose(predicted, project_points(design, view, points), rtol=0.0, atol=1e-6)
        slopes[view], azimuth = image.direction_of(*predicted.T)
        turned = np.remainder(azimuth - np.arctan2(points[:, 1], points[:, 0]) + np.pi, 2.0 * np.pi) - np.pi
        assert np.abs(turned).max() < 1e-9
    found, height = triangulate(PerView(**slopes), design.views.lower.viewpoint_mm, design.baseline_mm, wall_of(design))
    np.testing.assert_allclose(found, distance, rtol=1e-10)
    np.testing.assert_allclose(height, points[:, 2], rtol=0.0, atol=1e-7)


def test_dots_are_rendered_where_the_closed_form_says():
    design = with_tube(with_coarse_pixels(sharp_design(NAMES[0]), 2), wall_mm=4.0)
    plain = design.model_copy(update={"housing": None})
    point = points_in(design, 3)[:1]
    for view in VIEW_NAMES:
        image = render_dots(design, point, views=[view])
        rows, columns = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
        centre = np.array([(columns * image).sum(), (rows * image).sum()]) / image.sum()
        expected = np.ravel(view_image(design, view).project(point))
        assert np.abs(centre - expected).max() < 0.03
        # By much less than the wall moves them.
        assert np.abs(expected - np.ravel(view_image(plain, view).project(point))).max() > 0.3


@pytest.mark.parametrize("name", [SHARP_NAMES[0], SHARP_NAMES[2], SHARP_NAMES[10]])
def test_departures_do_the_same_behind_a_wall(name):
    """Points traced into built sensors with and without a tube, read by the tables of the design."""
    random = np.random.default_rng(2)
    design = sharp_design(name)
    points = points_in(design)
    distance = np.hypot(points[:, 0], points[:, 1])
    mirrors = {
        mirror.name: MirrorDeparture(
            **dict(zip(("decentre_x_mm", "decentre_y_mm", "tilt_x_deg", "tilt_y_deg"), row, strict=True))
        )
        for mirror, row in zip(design.mirrors, random.normal(0.0, 0.03, (3, 4)).tolist(), strict=False)
    }
    biases = []
    for each in (design, with_tube(design)):
        built = each.model_copy(update={"as_built": AsBuilt(mirrors=mirrors)})
        slopes = {
            view: view_image(each, view).direction_of(*traced_pixels(built, view, points).T)[0] for view in VIEW_NAMES
        }
        found, _ = triangulate(slopes["lower"], slopes["upper"], 0.0, each.baseline_mm, wall_of(each))
        biases.append(found / distance - 1.0)
    departed, through_wall = biases
    assert np.sqrt(np.mean(departed**2)) > 1e-3
    assert np.linalg.norm(through_wall - departed) < 0.02 * np.linalg.norm(departed)


def traced_pixels(design, view: str, points: np.ndarray) -> np.ndarray:
    """Pixels (n, 2) whose rays, traced out of a built sensor and its tube, pass points (n, 3), by Newton's method."""
    sensor = sensor_of(design)
    path = sensor.instrument.path(design.views.by_name[view].path)
    pixels = np.stack(view_image(design, view).project(points), axis=-1)

    def miss(places: np.ndarray) -> np.ndarray:
        ahead = sensor.directions(places[:, 0], places[:, 1], None, None)
        trace = trace_sequential(sensor.instrument, path, ahead, apertures=False)
        left = sensor.leaving(trace.point, trace.direction)
        offset = points - left.point
        along = np.einsum("ni,ni->n", offset, left.direction)
        return (offset - along[:, None] * left.direction) / along[:, None]

    for _ in range(10):
        error = miss(pixels)
        jacobian = np.stack([(miss(pixels + step) - error) / 1e-3 for step in 1e-3 * np.eye(2)], axis=-1)
        normal = np.einsum("nik,nil->nkl", jacobian, jacobian)
        pixels = pixels - np.linalg.solve(normal, np.einsum("nik,ni->nk", jacobian, error)[..., None])[..., 0]
    assert np.abs(miss(pixels)).max() < 1e-9
    return pixels


def test_a_built_sensor_in_a_tube_is_refused_in_words():
    built = AsBuilt(camera=CameraDeparture(shift_x_mm=0.01))
    design = with_tube(sharp_design(NAMES[0])).model_copy(update={"as_built": built})
    with pytest.raises(InputError, match="take the table housing"):
        build_rig(design, as_built=True)
