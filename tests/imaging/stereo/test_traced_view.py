"""Tables of a built sensor: the rays behind their pixels are those of the tracer that renders, and they meet points."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.model import with_departures
from designer.as_built.parameters import values_of
from designer.as_built.projection import project, targets_of
from designer.departures import AsBuilt, MirrorDeparture
from designer.design import VIEW_NAMES, Design, PerView
from designer.files import InputError
from designer.imaging.render.sensor import sensor_of
from designer.imaging.stereo.placement import view_image
from designer.imaging.stereo.reconstruction import triangulate
from designer.imaging.stereo.rig import build_rig
from designer.imaging.stereo.traced_view import midpoints, traced_views
from designer.trace.first_hit import trace_first_hits
from support.departures import random_departures
from support.studied_designs import sharp_design

NAMES = ("indoor_robot:folded-HyHy-Hy-upper_outer", "ceiling_watch:direct-HyHy-upper_outer")


def built(name: str, seed: int = 1) -> Design:
    design = with_departures(sharp_design(name), 0.5 * random_departures(sharp_design(name), seed)[0])
    camera = design.as_built.camera.model_copy(update={"image_shift_x_px": 3.5, "image_shift_y_px": -6.25})
    return design.model_copy(update={"as_built": design.as_built.model_copy(update={"camera": camera})})


def directions(design: Design, view: str, count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    low, high = np.radians(getattr(design.views, view).elevation_deg)
    inset = 0.02 * (high - low)
    return np.tan(random.uniform(low + inset, high - inset, count)), random.uniform(-np.pi, np.pi, count)


@pytest.mark.parametrize("name", NAMES)
def test_the_ray_behind_a_pixel_is_that_of_the_renderers_tracer(name: str):
    """From the pixel on, through surfaces with rims, in the frame of the camera: nothing is shared with the tables."""
    design = built(name)
    sensor = sensor_of(design)
    for view, image in traced_views(design).items():
        slope, azimuth = directions(design, view)
        trace = trace_first_hits(sensor.instrument, sensor.directions(*image.pixel_of(slope, azimuth), None, None))
        left = sensor.leaving(trace.exit_point, trace.exit_direction)
        start, ahead = left.point, left.direction
        on_way = np.array([trace.sequence[each][trace.sequence[each] >= 0].size for each in range(len(slope))])
        met = on_way == len(getattr(design.views, view).path)
        assert met.mean() > 0.9
        point, towards = image.ray_of(slope, azimuth)
        towards = towards / np.linalg.norm(towards, axis=1)[:, None]
        offset = point - start
        missed = np.linalg.norm(offset - np.sum(offset * ahead, axis=1)[:, None] * ahead, axis=1)
        # A hundredth of a pixel is some 2e-5 radians.
        assert missed[met].max() < 2e-5 * np.linalg.norm(offset, axis=1).max()
        assert np.linalg.norm(towards - ahead, axis=1)[met].max() < 2e-5


@pytest.mark.parametrize("name", NAMES)
def test_rays_of_a_point_meet_there_where_the_designs_tables_are_wrong(name: str):
    design = built(name)
    near, far = design.working_volume.distance_mm
    random = np.random.default_rng(5)
    distance, azimuth = np.exp(random.uniform(np.log(near), np.log(far), 400)), random.uniform(-np.pi, np.pi, 400)
    low, high = np.tan(np.radians(design.working_volume.elevation_deg))
    height = design.views.middle_mm + distance * random.uniform(low, high, 400)
    points = np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height])
    images, plain, seen = traced_views(design), {}, {}
    camera = design.as_built.camera
    for view in VIEW_NAMES:
        found = project(design, view, targets_of(design, view, points), values_of(design)[None]).pixels[:, 0].T
        pixels = found + design.camera.principal_point_px + np.array([camera.image_shift_x_px, camera.image_shift_y_px])
        seen[view] = images[view].direction_of(*pixels.T)
        plain[view] = view_image(design, view).direction_of(*pixels.T)
    # A matcher looks in one column, so the lower view's azimuth is taken for that of the upper.
    apart = np.abs(np.remainder(seen["upper"][1] - seen["lower"][1] + np.pi, 2.0 * np.pi) - np.pi)
    assert apart.max() < 0.1 * np.radians(0.2)
    met = midpoints(images, PerView(upper=seen["upper"][0], lower=seen["lower"][0]), seen["upper"][1])
    error = np.abs(np.hypot(met[:, 0], met[:, 1]) / distance - 1.0)
    assert error.max() < 2e-3
    slopes = PerView(lower=plain["lower"][0], upper=plain["upper"][0])
    by_design = triangulate(slopes, design.views.lower.viewpoint_mm, design.baseline_mm)
    assert np.median(np.abs(by_design[0] / distance - 1.0)) > 20.0 * np.median(error)


@pytest.mark.parametrize("name", NAMES)
def test_a_sensor_without_departures_has_the_designs_tables(name: str):
    design = sharp_design(name).model_copy(update={"as_built": AsBuilt()})
    images = traced_views(design)
    for view in VIEW_NAMES:
        slope, azimuth = directions(design, view)
        for traced, designed in zip(
            images[view].pixel_of(slope, azimuth), view_image(design, view).pixel_of(slope, azimuth), strict=True
        ):
            assert np.abs(traced - designed).max() < 1e-6
    traced, designed = build_rig(design, as_built=True, equalise=True), build_rig(design, equalise=True)
    assert np.abs(traced.equalisers["upper"].u_px - designed.equalisers["upper"].u_px).max() < 1e-3
    assert (traced.tables["lower"].imaged == designed.tables["lower"].imaged).mean() > 0.999


@pytest.mark.parametrize(
    ("as_built", "reason"),
    [
        (AsBuilt(mirrors={"secondary": MirrorDeparture(tilt_x_deg=20.0)}), "the lower view of this sensor"),
        (AsBuilt(mirrors={"primary": MirrorDeparture(axial_shift_mm=-45.0)}), "penetrate each other"),
    ],
)
def test_a_sensor_with_a_blind_view_or_with_mirrors_that_touch_is_refused(as_built: AsBuilt, reason: str):
    with pytest.raises(InputError, match=reason):
        traced_views(sharp_design(NAMES[0]).model_copy(update={"as_built": as_built}))
