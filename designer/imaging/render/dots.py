"""Small bright dots in a black world, rendered finely: where light really lands, to a hundredth of a pixel.

And the spot into which the lens and the mirrors spread the light of one point, from a bundle of rays that starts at
the point's side of the problem: each ray is aimed, through the mirrors, from a place in the pupil at the point. The
two share the tracer, and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.as_built.parameters import values_of
from designer.as_built.projection import project as project_built
from designer.as_built.projection import targets_of
from designer.design import VIEW_NAMES, Design, ViewName
from designer.imaging.render.camera_rays import angular_spacing, on_sensor, sample_places
from designer.imaging.render.lens import Pupil, pupil_of
from designer.imaging.render.scenes.shapes import Sphere
from designer.imaging.render.sensor import sensor_of
from designer.imaging.render.textures import Floats
from designer.trace.aiming import project
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits
from designer.trace.housing import leave_housing
from designer.trace.image_law import image_radius, plane_slopes, sensor_places
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential

Array = NDArray[np.float64]

DOT_RADIUS_PX = 1.5
# Pixels rendered about a dot, beyond its own radius.
WINDOW_MARGIN_PX = 4
AIMING_STEPS = 12
AIMING_STEP_RAD = 1e-6


@dataclass(frozen=True, slots=True)
class Spot:
    """Where the light of one point lands: ``centre_px`` (u, v), and root mean square distance from it."""

    centre_px: tuple[float, float]
    rms_radius_px: float


def render_dots(
    design: Design,
    points_mm: ArrayLike,
    *,
    views: Sequence[ViewName] = VIEW_NAMES,
    radius_px: float = DOT_RADIUS_PX,
    samples: int = 12,
    aperture: bool = False,
    window_px: int | None = None,
    seed: int = 0,
) -> Floats:
    """The image (h, w) of small bright balls at points (m, 3) in mm, each about as wide in every view.

    Only windows about the places where the traced mirrors should show the points are rendered. Every ray there meets
    whatever comes first, and counts if it took all the mirrors of the view. Radiance 1 fills a pixel; overlapping
    dots add up.

    Parameters
    ----------
    views
        The views whose light to record.
    radius_px
        Radius of a ball's sharp image.
    samples
        Rays along each side of a pixel.
    aperture
        Rays all over the pupil, so that the dots are as sharp as the focus makes them.
    window_px
        Half the width of a window; what a sharp dot needs if not given, and more is needed out of focus.
    """
    sensor = sensor_of(design)
    camera, instrument = sensor.camera, sensor.instrument
    spacing = angular_spacing(design, build_instrument(design))
    pupil = pupil_of(camera) if aperture else None
    image = np.zeros((camera.height_px, camera.width_px), dtype=np.float32)
    half = int(np.ceil(radius_px)) + WINDOW_MARGIN_PX if window_px is None else window_px
    points = np.asarray(points_mm, dtype=float).reshape(-1, 3)
    random = np.random.default_rng([seed, 0xD075])
    for name in views:
        path = instrument.path(design.views.by_name[name].path)
        for point, (u, v) in zip(points, project_points(design, name, points), strict=True):
            if not np.isfinite([u, v]).all():
                continue
            rows, columns = np.mgrid[round(v) - half : round(v) + half + 1, round(u) - half : round(u) + half + 1]
            on_image = (rows >= 0) & (rows < camera.height_px) & (columns >= 0) & (columns < camera.width_px)
            rows, columns = rows[on_image], columns[on_image]
            across, down, starts = sample_places(rows, columns, samples, pupil, random)
            trace = trace_first_hits(instrument, sensor.directions(across, down, starts, pupil), starts)
            free = compare_with_path(trace, path).status == Status.OK
            angle = float(spacing(np.hypot(*on_sensor(camera, np.array(u), np.array(v)))))
            middle = design.views.by_name[name].viewpoint_mm
            radius = radius_px * angle * float(np.linalg.norm(point - (0.0, 0.0, middle)))
            ball = Sphere((float(point[0]), float(point[1]), float(point[2])), radius)
            lit = np.zeros(free.shape, dtype=np.float32)
            left = sensor.leaving(trace.exit_point[free], trace.exit_direction[free])
            lit[free] = left.is_free & np.isfinite(ball.distances(left.point.T, left.direction.T))
            image[rows, columns] += lit.reshape(-1, samples**2).mean(axis=1)
    return image


def project_points(design: Design, view_name: ViewName, points_mm: Array) -> Array:
    """Pixels (m, 2) as (u, v) where the traced mirrors show points (m, 3), apertures ignored; NaN where they cannot."""
    camera, view = design.camera, design.views.by_name[view_name]
    if design.as_built is not None:
        found = project_built(design, view_name, targets_of(design, view_name, points_mm), values_of(design)[None])
        return np.asarray(camera.principal_point_px + found.pixels[:, 0].T)
    x, y, z = points_mm.T
    distance = np.hypot(x, y)
    radius_px = image_radius(camera, project(design, view_name, distance, z)) / camera.pixel_pitch_mm
    # A view of negative gain shows a point on the other side of the axis.
    towards = np.sign(view.gain) * np.stack([x, y], axis=-1) / distance[:, None]
    return np.asarray(camera.principal_point_px + radius_px[:, None] * towards)


def traced_spot(
    design: Design, view_name: ViewName, point_mm: ArrayLike, *, rings: int = 6, pupil: Pupil | None = None
) -> Spot:
    """The spot of light that a view makes of a point (3,), through the whole pupil, apertures of mirrors ignored.

    Each ray is aimed from a place in the pupil, through the mirrors, at the point; the thin lens images the place
    where it crosses the focus plane.

    Raises
    ------
    ValueError
        The view cannot show the point.
    """
    camera = design.camera
    pupil = pupil or pupil_of(camera)
    point = np.asarray(point_mm, dtype=float)
    centre = project_points(design, view_name, point[None])[0]
    places = _pupil_places(pupil.radius_mm, rings)
    x, y = on_sensor(camera, centre[0], centre[1])
    slopes = np.tile(np.stack(plane_slopes(camera, x, y)), (len(places), 1))
    slopes = _aimed_slopes(design, view_name, places, slopes, point)
    if not np.isfinite(slopes).all():
        raise ValueError(f"the {view_name} view cannot show the point {point.tolist()}")
    landed = sensor_places(camera, slopes + places[:, :2] / pupil.focus_distance_mm) / camera.pixel_pitch_mm
    mean = landed.mean(axis=0)
    rms = float(np.sqrt(np.sum((landed - mean) ** 2, axis=1).mean()))
    u0, v0 = camera.principal_point_px
    return Spot((float(mean[0] + u0), float(mean[1] + v0)), rms)


def _pupil_places(radius: float, rings: int) -> Array:
    """Points (n, 3) that fill a disc evenly: ring k of equal width holds 2k + 1 times as many as the first."""
    places = []
    for ring in range(rings):
        count = 6 * (2 * ring + 1)
        angle = 2.0 * np.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        # The radius whose square is the mean over the ring, so that second moments are exact.
        reach = radius * np.sqrt((ring**2 + (ring + 1) ** 2) / 2.0) / rings
        places.append(np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(count)], axis=-1))
    return np.concatenate(places)


def _aimed_slopes(design: Design, view_name: ViewName, places: Array, slopes: Array, point: Array) -> Array:
    """Slopes (n, 2) dx/dz, dy/dz of rays from places (n, 3) that pass the mirrors to a point, by Newton's method."""
    instrument = build_instrument(design)
    path = instrument.path(design.views.by_name[view_name].path)

    def miss(trial: Array) -> Array:
        """How far (n, 3) the exit rays pass from the point, per distance to it."""
        ahead = np.column_stack([trial, np.ones(len(trial))])
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        trace = trace_sequential(instrument, path, ahead, places, apertures=False)
        left = leave_housing(design.tube, trace.point, trace.direction)
        offset = point - left.point
        along = np.einsum("ni,ni->n", offset, left.direction)
        return np.asarray((offset - along[:, None] * left.direction) / along[:, None])

    steps = AIMING_STEP_RAD * np.eye(2)
    for _ in range(AIMING_STEPS):
        error = miss(slopes)
        jacobian = np.stack([(miss(slopes + step) - error) / AIMING_STEP_RAD for step in steps], axis=-1)
        if not np.isfinite(jacobian).all():
            return np.full_like(slopes, np.nan)
        # Three components of a miss that has only two: least squares, by the normal equations.
        normal = np.einsum("nik,nil->nkl", jacobian, jacobian)
        slopes = slopes - np.linalg.solve(normal, np.einsum("nik,ni->nk", jacobian, error)[..., None])[..., 0]
    return np.where((np.linalg.norm(miss(slopes), axis=1) < 1e-8)[:, None], slopes, np.nan)
