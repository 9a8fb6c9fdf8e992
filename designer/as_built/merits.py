"""What a built sensor does to depth: its image places read through the tables of the design.

A stereo program knows the design and not the sensor, so it takes the image of a point for that of another direction
(docs/theory.md, section 11). What comes of it, over a grid of the working volume and all azimuths: the two views of a
point fall on different columns of their panoramas, its depth is biased, the rays of a view have no common point, and
the blur changes. Lengths in mm, angles in radians; T built systems, n points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.image import designed_places, direction_at, radius_and_slope
from designer.as_built.projection import Projection, Targets, targets_of
from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.depth import volume_of

# Enough to hold errors to 1 percent, and what calibration leaves of them to 2, for biases up to a tenth.
ELEVATIONS, DISTANCES, AZIMUTHS = 3, 3, 6
PANORAMA_COLUMNS = 1800
"""Columns of a panorama unless a user asks for others; a row is as high as a column is wide."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Points of a design's working volume: ``points_mm`` (n, 3), their ``weights`` (n,), which add up to 1.

    ``distance_mm`` and ``azimuth`` (n,) are theirs; ``targets`` are the points as both views see them, and ``slopes``
    (n,) the tan(elevation) at which each view should.
    """

    points_mm: Array
    weights: Array
    distance_mm: Array
    azimuth: Array
    targets: dict[ViewName, Targets]
    slopes: dict[ViewName, Array]


@dataclass(frozen=True, slots=True)
class Merits:
    """Merits of T built systems, arrays (T,), root mean squares over the working volume and all azimuths.

    ``epipolar_px`` are the columns, of a panorama of 1800, by which the two views of a point are apart; ``depth_bias``
    the share by which depths are wrong; ``viewpoint_spread_mm`` the distance by which the rays of a view pass the point
    that they come nearest to; ``blur_px`` the diameter of the blur: both of the view where it is larger. NaN for a
    system that does not show all points; the bias is infinite where the rays diverge.
    """

    epipolar_px: Array
    depth_bias: Array
    viewpoint_spread_mm: Array
    blur_px: Array


def grid_of(design: Design, elevations: int = ELEVATIONS, distances: int = DISTANCES, azimuths: int = AZIMUTHS) -> Grid:
    """Gauss-Legendre nodes in elevation, from the middle of the baseline, and in log distance; even azimuths."""
    volume = volume_of(design)
    elevation, by_elevation = _nodes(*volume.elevations, elevations)
    near, far = volume.distances
    log_distance, by_distance = _nodes(float(np.log(near)), float(np.log(far)), distances)
    azimuth = 2.0 * np.pi * np.arange(azimuths) / azimuths
    phi, distance, theta = (
        part.ravel() for part in np.meshgrid(elevation, np.exp(log_distance), azimuth, indexing="ij")
    )
    weights = (by_elevation[:, None, None] * by_distance[:, None] * np.full(azimuths, 1.0 / azimuths)).ravel()
    height = design.views.middle_mm + distance * np.tan(phi)
    points = np.stack([distance * np.cos(theta), distance * np.sin(theta), height], axis=-1)
    slopes = {name: (height - view.viewpoint_mm) / distance for name, view in design.views.by_name.items()}
    targets = {name: targets_of(design, name, points) for name in VIEW_NAMES}
    return Grid(points, weights, distance, theta, targets, slopes)


def ideal_px(design: Design, targets: Targets) -> Array:
    """Where the design's own tables expect points (2, n), px from the principal point."""
    return designed_places(design.camera, targets.slopes) / design.camera.pixel_pitch_mm


def directions_of(design: Design, view: ViewName, pixels: Array) -> tuple[Array, Array]:
    """tan(elevation) and azimuth that the design's tables read at image places (2, ...) from the principal point."""
    return direction_at(design.camera, design.views.by_name[view], pixels * design.camera.pixel_pitch_mm)


def displacement_px(design: Design, grid: Grid, view: ViewName, pixels: Array) -> tuple[Array, Array]:
    """Rows and columns (T, n) of a panorama by which image places (2, T, n) are off: down and to the right.

    Columns run against the azimuth, rows downwards in equal steps of elevation.
    """
    slope, azimuth = directions_of(design, view, pixels)
    per_radian = PANORAMA_COLUMNS / (2.0 * np.pi)
    rows = (np.arctan(grid.slopes[view]) - np.arctan(slope)) * per_radian
    return rows, _wrapped(grid.azimuth - azimuth) * per_radian


def errors_of(design: Design, grid: Grid, pixels: Mapping[ViewName, Array]) -> tuple[Array, Array]:
    """Epipolar errors in px and depth biases, both (T, n), of image places (2, T, n) that the design's tables read.

    The bias is infinite where the rays diverge: there is no depth.
    """
    with np.errstate(all="ignore"):
        (upper, azimuth_upper), (lower, azimuth_lower) = (
            directions_of(design, name, pixels[name]) for name in VIEW_NAMES
        )
        epipolar = _wrapped(azimuth_upper - azimuth_lower) * (PANORAMA_COLUMNS / (2.0 * np.pi))
        bias = design.baseline_mm / (lower - upper) / grid.distance_mm - 1.0
        return epipolar, np.where(lower > upper, bias, np.where(np.isnan(lower - upper), np.nan, np.inf))


def merits_of(
    design: Design, grid: Grid, pixels: Mapping[ViewName, Array], projections: Mapping[ViewName, Projection]
) -> Merits:
    """The merits of systems whose image places (2, T, n) are read as they are, or as a calibration has put them.

    ``projections`` hold what no calibration of the image changes: rays and blur.
    """
    epipolar, bias = errors_of(design, grid, pixels)
    with np.errstate(all="ignore"):
        blur = np.maximum(*(projections[name].blur_px ** 2 @ grid.weights for name in VIEW_NAMES))
        return Merits(
            epipolar_px=np.sqrt(epipolar**2 @ grid.weights),
            depth_bias=np.sqrt(bias**2 @ grid.weights),
            viewpoint_spread_mm=np.maximum(*(viewpoint_of(projections[name])[1] for name in VIEW_NAMES)),
            blur_px=np.sqrt(blur),
        )


def first_order_errors(design: Design, grid: Grid, changes: Mapping[ViewName, Array]) -> tuple[Array, Array]:
    """Epipolar errors in px and depth biases, both (k, n), to first order in small changes of image places (k, 2, n).

    With r the signed image radius, e the unit vector of the azimuth and e' that across it, an image that moves by u is
    read dm = (e.u) / (dr/dm) steeper and at an azimuth larger by (e'.u) / r; dD/D = -(D/b) (dm_lower - dm_upper).
    """
    camera = design.camera
    along = np.stack([np.cos(grid.azimuth), np.sin(grid.azimuth)])
    across = np.stack([-along[1], along[0]])
    steeper: dict[ViewName, Array] = {}
    turned: dict[ViewName, Array] = {}
    for name, record in design.views.by_name.items():
        slope, moved = grid.slopes[name], changes[name] * camera.pixel_pitch_mm
        radius, per_slope = radius_and_slope(camera, record, slope)
        steeper[name] = np.sum(along * moved, axis=1) / per_slope
        turned[name] = np.sum(across * moved, axis=1) / radius
    epipolar = (turned["upper"] - turned["lower"]) * (PANORAMA_COLUMNS / (2.0 * np.pi))
    return epipolar, grid.distance_mm / design.baseline_mm * (steeper["upper"] - steeper["lower"])


def viewpoint_of(projection: Projection) -> tuple[Array, Array]:
    """The point (3, T) that a view's rays pass nearest to, and their root mean square distance (T,) from it."""
    start, ahead = projection.start, projection.ahead
    # Of a vector, the part across a ray is (1 - d d^T) x: least squares over all rays.
    across = start - ahead * np.sum(start * ahead, axis=0)
    number = start.shape[2]
    normal = number * np.eye(3) - np.einsum("itn,jtn->tij", ahead, ahead)
    known = np.isfinite(normal).all(axis=(1, 2))
    point = np.full((len(normal), 3), np.nan)
    point[known] = np.linalg.solve(normal[known], across.sum(axis=2).T[known][..., None])[..., 0]
    offset = point.T[:, :, None] - start
    missed = offset - ahead * np.sum(offset * ahead, axis=0)
    return point.T, np.sqrt(np.sum(missed**2, axis=0).mean(axis=1))


def _nodes(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes on an interval, and weights that add up to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (low + high) / 2.0 + (high - low) / 2.0 * nodes, weights / 2.0


def _wrapped(angle: Array) -> Array:
    """The angle between -pi and pi."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
