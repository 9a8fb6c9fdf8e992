"""Where a built sensor images the points of targets, and how that changes with the sensor and with each point.

The ray through a point P leaves the last mirror at x along d, and misses P by g(slopes, P) = 0. A point that moves
takes the slopes with it, d slopes / dP = -(dg/d slopes)^-1 dg/dP, as departures do (docs/theory.md, section 11).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from designer.as_built.dual import Array, variables
from designer.as_built.image import built_places
from designer.as_built.parameters import parameters_of, systems_of
from designer.as_built.projection import aim, derivatives_at, project, targets_of
from designer.design import Design, ViewName

UNSEEN_PX = 1000.0
"""By how much a point counts as missed that a trial sensor does not show."""


@dataclass(frozen=True, slots=True, eq=False)
class PointImages:
    """Images of n points in one view of one sensor.

    ``pixels`` (n, 2) are pixel coordinates (u, v), NaN where the mirrors do not show a point; ``by_departure`` (n, 2,
    parameters) and ``by_point`` (n, 2, 3), in px per unit and px per mm, their derivatives. ``slopes`` (2, n) are those
    of the rays at the pinhole.
    """

    pixels: Array
    by_departure: Array
    by_point: Array
    slopes: Array


def pixels_of(design: Design, view: ViewName, points_mm: Array, values: Array) -> Array:
    """Pixel coordinates (n, 2) of points (n, 3) in a sensor of departures (parameters,), image shift last."""
    found = project(design, view, targets_of(design, view, points_mm), values[None, :-2])
    return _in_image(design, found.pixels[:, 0], values)


def point_images(
    design: Design, view: ViewName, points_mm: Array, values: Array, slopes: Array | None = None
) -> PointImages:
    """Images of points (n, 3) and their derivatives, in a sensor of departures (parameters,), image shift last.

    ``slopes`` (2, n) of an earlier search nearby shorten this one; NaN where there are none.
    """
    count = len(points_mm)
    targets = targets_of(design, view, points_mm)
    if slopes is not None:
        targets = replace(targets, slopes=np.where(np.isnan(slopes), targets.slopes, slopes))
    sensor = systems_of(design, list(values[:-2, None, None]))
    light = aim(sensor.camera, sensor.along(design.views.by_name[view].path), targets, targets.slopes[:, None])
    found = np.stack(built_places(sensor.camera, (light.slopes[0], light.slopes[1])))[:, 0]
    pixels = _in_image(design, found / design.camera.pixel_pitch_mm, values)
    shown = np.flatnonzero(np.isfinite(light.slopes[:, 0]).all(axis=0))
    by_departure, by_point = np.full((count, 2, len(values)), np.nan), np.full((count, 2, 3), np.nan)
    if shown.size:
        seen = replace(targets, points_mm=targets.points_mm[:, shown], basis=targets.basis[:, :, shown])
        slopes_shown = light.slopes[:, :, shown]
        linear = derivatives_at(design, view, seen, values[:-2], slopes_shown)
        by_departure[shown, :, :-2] = linear.pixels.transpose(2, 1, 0)
        by_departure[shown, :, -2:] = np.eye(2)
        offset = seen.points_mm - light.start[:, 0, shown]
        first, second, ahead = (np.einsum("in,in->n", axis, offset) for axis in seen.basis)
        # The miss has P in -(e_i . (P - x)) / (e_3 . (P - x)); where it is zero, the turn of the axes does not count.
        by_place = np.stack(
            [-seen.basis[i] / ahead + across * seen.basis[2] / ahead**2 for i, across in enumerate((first, second))]
        )
        by_slope = linear.by_slope[:, :, 0].transpose(2, 1, 0)
        turned = -np.linalg.solve(by_slope, by_place.transpose(2, 0, 1))
        by_point[shown] = _places_by_slope(design, values, slopes_shown[:, 0]).transpose(2, 1, 0) @ turned
    return PointImages(pixels, by_departure, by_point, light.slopes[:, 0])


def _places_by_slope(design: Design, values: Array, slopes: Array) -> Array:
    """How image places in px change with the two slopes: (slope, 2, n)."""
    camera = systems_of(design, list(values[: len(parameters_of(design)), None])).camera
    x, y = variables([slopes[0], slopes[1]])
    return np.stack([place.slopes for place in built_places(camera, (x, y))], axis=1) / design.camera.pixel_pitch_mm


def _in_image(design: Design, places_px: Array, values: Array) -> Array:
    return np.asarray(places_px.T + np.array(design.camera.principal_point_px) + values[-2:])
