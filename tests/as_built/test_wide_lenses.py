"""Built sensors behind lenses that are not r = f tan(psi): held to the judge's own reckoning of the lens."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.merits import first_order_errors, grid_of, ideal_px
from designer.as_built.model import measure, perturbable
from designer.as_built.parameters import as_built_record, parameters_of
from designer.as_built.projection import linearise, project, targets_of
from designer.design import VIEW_NAMES
from designer.evaluate.depth import depth_shift_per_scale, stereo_pair_of
from designer.imaging.render.dots import project_points
from designer.imaging.render.sensor import sensor_of
from designer.trace.image_law import stretches
from designer.trace.pencils import pencil_images
from designer.trace.sequential import trace_sequential
from support.departures import random_departures
from support.wide_designs import LAWS, wide_design


@pytest.mark.parametrize("law", LAWS)
def test_images_are_where_the_renderer_has_them(law):
    """Both without departures and with them: from the pixel through the posed mirrors, out to the point."""
    design = wide_design(law)
    grid = grid_of(design)
    centre = np.array(design.camera.principal_point_px)
    values = random_departures(design, 2)
    for view in VIEW_NAMES:
        plain = project(design, view, grid.targets[view], np.zeros_like(values)).pixels[:, 0]
        np.testing.assert_allclose(plain, ideal_px(design, grid.targets[view]), atol=1e-8)
        np.testing.assert_allclose(plain.T + centre, project_points(design, view, grid.points_mm), atol=1e-5)
        sensor = sensor_of(design.model_copy(update={"as_built": as_built_record(design, values[0])}))
        u, v = project(design, view, grid.targets[view], values).pixels[:, 0] + centre[:, None]
        path = sensor.instrument.path(getattr(design.views, view).path)
        trace = trace_sequential(sensor.instrument, path, sensor.directions(u, v, None, None), apertures=False)
        left = sensor.leaving(trace.point, trace.direction)
        start, ahead = left.point, left.direction
        missed = np.linalg.norm(np.cross(grid.points_mm - start, ahead), axis=1)
        assert np.max(missed / np.linalg.norm(grid.points_mm - start, axis=1)) < 1e-9


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_are_those_of_central_differences(law):
    design = wide_design(law)
    parameters = parameters_of(design)
    about = random_departures(design, 3)[0] * 0.3
    for view in VIEW_NAMES:
        targets = grid_of(design).targets[view]
        exact = linearise(design, view, targets, about).pixels
        for index, parameter in enumerate(parameters):
            step = 1e-3
            moved = np.tile(about, (4, 1))
            moved[:, index] += step * np.array([-2.0, -1.0, 1.0, 2.0])
            far_below, below, above, far_above = project(design, view, targets, moved).pixels.transpose(1, 0, 2)
            different = (far_below - 8.0 * below + 8.0 * above - far_above) / (12.0 * step)
            size = np.abs(exact[index]).max()
            assert np.abs(different - exact[index]).max() < 1e-5 * size + 1e-6, parameter.name


@pytest.mark.parametrize("law", LAWS)
def test_an_error_of_scale_biases_depth_as_the_closed_form_says(law):
    design = wide_design(law)
    model = perturbable(design, "none")
    share = 1e-6
    place = next(i for i, p in enumerate(model.parameters) if p.key == "principal_distance_departure_mm")
    values = np.zeros((1, len(model.parameters)))
    values[0, place] = share * design.camera.focal_length_mm
    slope = (model.grid.points_mm[:, 2] - design.views.middle_mm) / model.grid.distance_mm
    expected = share * depth_shift_per_scale(stereo_pair_of(design), slope, model.grid.distance_mm)
    size = np.sqrt(expected**2 @ model.grid.weights)
    assert measure(model, values).before.depth_bias[0] == pytest.approx(size, rel=1e-4)
    changes = {view: model.linear[view].pixels[place][None] * values[0, place] for view in VIEW_NAMES}
    _, bias = first_order_errors(design, model.grid, changes)
    np.testing.assert_allclose(bias[0], expected, rtol=1e-6, atol=1e-6 * size)


@pytest.mark.parametrize("law", LAWS)
def test_blur_is_that_of_traced_pencils_stretched_by_the_lens(law):
    design = wide_design(law)
    camera = design.camera
    nothing = np.zeros((1, len(parameters_of(design))))
    for view in VIEW_NAMES:
        record = getattr(design.views, view)
        elevation, distance = np.mean(record.elevation_deg), np.sqrt(np.prod(design.working_volume.distance_mm))
        point = np.array([[distance, 0.0, record.viewpoint_mm + distance * np.tan(np.radians(elevation))]])
        blur = project(design, view, targets_of(design, view, point), nothing).blur_px
        images = pencil_images(design, view, [elevation], [distance])
        off = float(images.tangential[0, 0] / np.cos(images.psi[0]) - 1.0 / camera.focus_distance_mm)
        longest = float(np.max(stretches(camera, images.psi)))
        expected = 2.0 * camera.pupil_radius_mm * camera.focal_length_mm / camera.pixel_pitch_mm * abs(off) * longest
        assert blur[0, 0] == pytest.approx(expected, rel=1e-4)
