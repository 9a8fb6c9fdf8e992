"""Rays through built systems, against the tracer that judges: another code, held to the same surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.merits import grid_of
from designer.as_built.parameters import as_built_record, parameters_of, systems_of, values_of
from designer.as_built.projection import project
from designer.as_built.tracing import follow_rays, leave_camera
from designer.design import VIEW_NAMES
from designer.trace.built import build_as_built
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.departures import random_departures
from support.studied_designs import SHARP_NAMES, sharp_design


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_without_departures_rays_are_those_of_the_tracer(name: str):
    design = sharp_design(name)
    instrument = build_instrument(design)
    systems = systems_of(design, list(np.zeros((len(parameters_of(design)), 1, 1))))
    grid = grid_of(design)
    for view in VIEW_NAMES:
        slopes = grid.targets[view].slopes
        point, ahead = follow_rays(
            systems.along(getattr(design.views, view).path), *leave_camera(systems.camera, tuple(slopes), (0.0, 0.0))
        )
        directions = pinhole_directions(np.arctan(np.hypot(*slopes)), np.arctan2(slopes[1], slopes[0]))
        path = instrument.path(getattr(design.views, view).path)
        judged = trace_sequential(instrument, path, directions, apertures=False)
        assert np.isfinite(judged.direction).all()
        np.testing.assert_allclose(np.stack(point)[:, 0].T, judged.point, atol=2e-12)
        np.testing.assert_allclose(np.stack(ahead)[:, 0].T, judged.direction, atol=2e-14)


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_a_departed_system_images_points_where_the_tracer_sees_them(name: str):
    """The other way round: from the pixel that was found through the posed instrument, out to the point."""
    design = sharp_design(name)
    values = random_departures(design, 1)
    built = build_as_built(design.model_copy(update={"as_built": as_built_record(design, values[0])}))
    np.testing.assert_array_equal(values_of(design, as_built_record(design, values[0])), values[0])
    camera, departed = design.camera, as_built_record(design, values[0]).camera
    grid = grid_of(design)
    for view in VIEW_NAMES:
        projection = project(design, view, grid.targets[view], values)
        assert np.isfinite(projection.pixels).all()
        ahead = undistorted(
            projection.pixels[:, 0].T * camera.pixel_pitch_mm,
            camera.focal_length_mm + departed.principal_distance_departure_mm,
            departed.radial_distortion,
        )
        path = built.instrument.path(getattr(design.views, view).path)
        trace = trace_sequential(built.instrument, path, ahead, apertures=False)
        start, onwards = built.points_in_world(trace.point), built.directions_in_world(trace.direction)
        missed = np.linalg.norm(np.cross(grid.points_mm - start, onwards), axis=1)
        assert np.max(missed / np.linalg.norm(grid.points_mm - start, axis=1)) < 1e-11


def undistorted(places_mm: np.ndarray, principal_distance: float, distortion: float) -> np.ndarray:
    """Unit directions of image places: the root of t + k t^3 = r/f nearest to it, a cubic solved for each place."""
    radius = np.linalg.norm(places_mm, axis=1) / principal_distance
    roots = [np.roots([distortion, 0.0, 1.0, -r]) for r in radius]
    real = [root[np.argmin(np.abs(root - r))].real for root, r in zip(roots, radius, strict=True)]
    slopes = places_mm / principal_distance * (np.array(real) / radius)[:, None]
    ahead = np.column_stack([slopes, np.ones(len(slopes))])
    return ahead / np.linalg.norm(ahead, axis=1)[:, None]


def test_a_mirror_that_is_missed_leaves_no_ray():
    design = sharp_design(SHARP_NAMES[13])
    values = np.zeros((1, len(parameters_of(design))))
    tilt = next(i for i, p in enumerate(parameters_of(design)) if (p.part, p.key) == ("upper", "tilt_x_deg"))
    values[0, tilt] = 150.0
    projection = project(design, "upper", grid_of(design).targets["upper"], values)
    assert np.isnan(projection.pixels).all()
