"""Merits of built systems, each against a computation that shares nothing with it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from designer.as_built.compensation import calibrated, left_by_calibration
from designer.as_built.merits import (
    PANORAMA_COLUMNS,
    displacement_px,
    first_order_errors,
    grid_of,
    ideal_px,
    merits_of,
    viewpoint_of,
)
from designer.as_built.parameters import parameters_of
from designer.as_built.projection import linearise, project, targets_of
from designer.design import VIEW_NAMES, Design
from designer.evaluate.depth import depth_shift_per_scale, stereo_pair_of
from designer.imaging.stereo.panorama import DEFAULT_COLUMNS, panorama_grid, view_images
from designer.trace.pencils import pencil_images
from support.departures import random_departures
from support.studied_designs import SHARP_NAMES, sharp_design

FAMILIES = [SHARP_NAMES[place] for place in (0, 1, 4, 8, 10, 13)]


def departures(design: Design, **values: float) -> np.ndarray:
    """One row of departures: keys are part and key joined by two underscores."""
    names = [f"{parameter.part}__{parameter.key}" for parameter in parameters_of(design)]
    row = np.zeros((1, len(names)))
    for name, value in values.items():
        row[0, names.index(name)] = value
    return row


def projections(design, grid, values):
    return {view: project(design, view, grid.targets[view], values) for view in VIEW_NAMES}


def measured(design, grid, values, calibrate=False):
    found = projections(design, grid, values)
    pixels = {view: found[view].pixels for view in VIEW_NAMES}
    pixels = calibrated(design, grid, pixels, "views" if calibrate else "none")
    return merits_of(design, grid, pixels, found)


@pytest.mark.parametrize("name", FAMILIES)
def test_a_sensor_as_designed_has_no_errors(name):
    design = sharp_design(name)
    merits = measured(design, grid_of(design), np.zeros((1, len(parameters_of(design)))))
    assert merits.epipolar_px < 1e-10
    assert merits.depth_bias < 1e-9
    assert merits.viewpoint_spread_mm < 1e-9


@pytest.mark.parametrize("name", FAMILIES)
def test_a_shifted_sensor_sees_what_the_design_would_see_of_a_shifted_scene(name):
    design = sharp_design(name)
    shift = np.array([0.3, -0.2, 0.5])
    moved = departures(
        design,
        **{
            f"{part}__{key}": value
            for part in [mirror.name for mirror in design.mirrors]
            for key, value in zip(("decentre_x_mm", "decentre_y_mm", "axial_shift_mm"), shift, strict=True)
        },
        **dict(zip(("camera__shift_x_mm", "camera__shift_y_mm", "camera__axial_shift_mm"), shift, strict=True)),
    )
    grid = grid_of(design)
    for view in VIEW_NAMES:
        seen = project(design, view, grid.targets[view], moved).pixels[:, 0]
        expected = ideal_px(design, targets_of(design, view, grid.points_mm - shift))
        np.testing.assert_allclose(seen, expected, atol=1e-9)


@pytest.mark.parametrize("name", FAMILIES)
def test_an_error_of_scale_biases_depth_as_the_closed_form_says(name):
    design = sharp_design(name)
    grid = grid_of(design)
    share = 1e-6
    values = departures(design, camera__principal_distance_departure_mm=share * design.camera.focal_length_mm)
    slope = (grid.points_mm[:, 2] - design.views.middle_mm) / grid.distance_mm
    expected = share * depth_shift_per_scale(stereo_pair_of(design), slope, grid.distance_mm)
    merits = measured(design, grid, values)
    assert merits.depth_bias == pytest.approx(np.sqrt(expected**2 @ grid.weights), rel=1e-4)
    assert measured(design, grid, values, calibrate=True).depth_bias < 1e-10


@pytest.mark.parametrize("name", FAMILIES)
def test_blur_is_that_of_traced_pencils(name):
    design = sharp_design(name)
    camera = design.camera
    for view in VIEW_NAMES:
        record = getattr(design.views, view)
        elevation, distance = np.mean(record.elevation_deg), np.sqrt(np.prod(design.working_volume.distance_mm))
        point = np.array([[distance, 0.0, record.viewpoint_mm + distance * np.tan(np.radians(elevation))]])
        nothing = np.zeros((1, len(parameters_of(design))))
        blur = project(design, view, targets_of(design, view, point), nothing).blur_px
        images = pencil_images(design, view, [elevation], [distance])
        depth = images.tangential / np.cos(images.psi)[:, None]
        expected = 2.0 * camera.pupil_radius_mm * camera.focal_length_mm / camera.pixel_pitch_mm
        assert blur[0, 0] == pytest.approx(
            float(expected * abs(depth[0, 0] - 1.0 / camera.focus_distance_mm)), rel=1e-5
        )


@pytest.mark.parametrize("name", FAMILIES)
def test_no_point_is_nearer_to_the_rays_than_the_viewpoint(name):
    design = sharp_design(name)
    grid = grid_of(design)
    projection = project(design, "lower", grid.targets["lower"], random_departures(design, 3))
    point, spread = viewpoint_of(projection)
    start, ahead = projection.start[:, 0].T, projection.ahead[:, 0].T

    def squared(where):
        return np.mean(np.sum(np.cross(where - start, ahead) ** 2, axis=1))

    best = minimize(squared, [0.0, 0.0, design.views.lower.viewpoint_mm], method="Nelder-Mead", tol=1e-14)
    np.testing.assert_allclose(point[:, 0], best.x, atol=1e-4)
    assert spread[0] == pytest.approx(np.sqrt(best.fun), rel=1e-6)


@pytest.mark.parametrize("name", FAMILIES)
def test_rows_and_columns_are_those_of_the_panoramas(name):
    design = sharp_design(name)
    grid, panorama, images = grid_of(design), panorama_grid(design), view_images(design)
    assert panorama.columns == PANORAMA_COLUMNS == DEFAULT_COLUMNS
    u0, v0 = design.camera.principal_point_px
    for view in VIEW_NAMES:
        pixels = project(design, view, grid.targets[view], random_departures(design, 4) * 0.3).pixels
        rows, columns = displacement_px(design, grid, view, pixels)
        slope, azimuth = images[view].direction_of(pixels[0, 0] + u0, pixels[1, 0] + v0)
        np.testing.assert_allclose(
            rows[0], panorama.row(view, slope) - panorama.row(view, grid.slopes[view]), atol=1e-8
        )
        across = panorama.column(azimuth) - panorama.column(grid.azimuth)
        across = np.remainder(across + PANORAMA_COLUMNS / 2.0, PANORAMA_COLUMNS) - PANORAMA_COLUMNS / 2.0
        np.testing.assert_allclose(columns[0], across, atol=1e-8)


@pytest.mark.parametrize("name", FAMILIES)
def test_the_grid_holds_the_errors_to_one_percent(name):
    design = sharp_design(name)
    values = random_departures(design, 5, 20) * 0.05
    coarse = grid_of(design)
    fine = grid_of(design, 8, 8, 12)
    for calibrate in (False, True):
        few, many = (measured(design, grid, values, calibrate) for grid in (coarse, fine))
        mild = many.depth_bias < 0.1
        assert mild.sum() > 10
        for key in ("epipolar_px", "depth_bias"):
            held = 0.02 if calibrate else 0.01
            np.testing.assert_allclose(getattr(few, key)[mild], getattr(many, key)[mild], rtol=held)


@pytest.mark.parametrize("name", FAMILIES)
def test_first_order_is_what_small_departures_come_to(name):
    design = sharp_design(name)
    grid = grid_of(design)
    values = random_departures(design, 6) * 1e-5
    changes = {
        view: np.einsum("tp,pxn->txn", values, linearise(design, view, grid.targets[view]).pixels)
        for view in VIEW_NAMES
    }
    epipolar, bias = first_order_errors(design, grid, changes)
    merits = measured(design, grid, values)
    assert np.sqrt(epipolar[0] ** 2 @ grid.weights) == pytest.approx(merits.epipolar_px[0], rel=1e-3)
    assert np.sqrt(bias[0] ** 2 @ grid.weights) == pytest.approx(merits.depth_bias[0], rel=1e-3)


@pytest.mark.parametrize("calibration", ["views", "image"])
def test_calibration_finds_a_centre_a_scale_and_a_turn(calibration):
    design = sharp_design(SHARP_NAMES[0])
    grid = grid_of(design)
    amounts = {"upper": (1.5, -0.7, 1e-3, 2e-3), "lower": (-4.2, 0.3, -2e-3, 1e-3)}
    if calibration == "image":
        amounts["lower"] = amounts["upper"]
    off = {}
    for view, (right, down, scale, turn) in amounts.items():
        x, y = ideal_px(design, grid.targets[view])
        off[view] = np.stack([right + scale * x - turn * y, down + scale * y + turn * x])[:, None]
    left, found = left_by_calibration(design, grid, off, calibration)
    for view in VIEW_NAMES:
        np.testing.assert_allclose(left[view], 0.0, atol=1e-10)
        np.testing.assert_allclose(found[view][:, 0], amounts[view], rtol=1e-9)


@pytest.mark.parametrize("name", FAMILIES)
def test_what_calibration_leaves_is_the_least(name):
    """No other centre, scale and turn leaves a smaller weighted sum of squares, and two of them leave less than one."""
    design = sharp_design(name)
    grid = grid_of(design)
    found = projections(design, grid, random_departures(design, 7))
    off = {view: found[view].pixels - ideal_px(design, grid.targets[view])[:, None] for view in VIEW_NAMES}

    def size(part):
        return sum(np.sum(part[view][:, 0] ** 2 @ grid.weights) for view in VIEW_NAMES)

    left = {kind: left_by_calibration(design, grid, off, kind)[0] for kind in ("none", "image", "views")}
    assert size(left["views"]) < size(left["image"]) < size(left["none"]) == size(off)
    for kind in ("image", "views"):
        again, amounts = left_by_calibration(design, grid, left[kind], kind)
        assert size(again) == pytest.approx(size(left[kind]), rel=1e-12)
        assert all(np.abs(amounts[view]).max() < 1e-9 for view in VIEW_NAMES)
