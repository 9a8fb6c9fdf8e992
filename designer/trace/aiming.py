"""Rays aimed: from the pinhole through the mirrors at an elevation or at a point, found by tracing alone.

Frame: pinhole at the origin, optical axis +z, millimetres, radians unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from designer.design import Design, ViewName
from designer.housing import Tube
from designer.trace.arrays import Array
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.housing import refract
from designer.trace.image_law import pinhole_angle
from designer.trace.instrument import Instrument, Pose, build_instrument
from designer.trace.sequential import SequentialTrace, trace_sequential

TABLE_SIZE = 1025
AIMING_TABLE_SIZE = 2049
SECANT_STEPS = 8
# Pinhole angles are found to this; a tenth of a pixel is some 1e-5 rad.
ANGLE_TOLERANCE_RAD = 1e-11
ROUNDING_RAD = 1e-14


def pinhole_angles(instrument: Instrument, path: Sequence[int], elevations: ArrayLike, psi_limit: float) -> Array:
    """Angles psi (n,) in radians, in 0..psi_limit, of the pinhole rays that leave a path at given elevations.

    The traced elevation, apertures ignored, is tabulated and inverted by secant steps on traced rays; the first
    crossing counts. NaN for an elevation (radians) that no ray within the limit takes.
    """
    targets = np.atleast_1d(np.asarray(elevations, dtype=float))
    table = np.linspace(0.0, psi_limit, TABLE_SIZE)

    def traced(psi: Array) -> Array:
        trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
        return elevation_angles(trace.direction)

    with np.errstate(all="ignore"):
        excess = traced(table) - targets[:, None]
        crosses = (excess[:, :-1] <= 0.0) != (excess[:, 1:] <= 0.0)
        crosses &= np.isfinite(excess[:, :-1]) & np.isfinite(excess[:, 1:])
        cell = np.argmax(crosses, axis=1)
        rows = np.arange(targets.size)
        found = crosses[rows, cell]
        psi, last = table[cell], table[cell + 1]
        error, last_error = excess[rows, cell], excess[rows, cell + 1]
        for _ in range(6):
            step = error * (last - psi) / (last_error - error)
            last, last_error = psi, error
            step = np.where(np.isfinite(step), step, 0.0)
            # A step below the last digit of psi changes nothing any more.
            if np.all(np.abs(step) <= np.spacing(psi)):
                break
            psi = psi - step
            error = traced(psi) - targets
    return np.where(found, psi, np.nan)


def widest_pinhole_angle(design: Design) -> float:
    """Angle psi in radians of the corner of the image, or of the image circle where that reaches farther.

    The end of the lens's field where neither is in it.
    """
    camera = design.camera
    corner = np.hypot(camera.width_px, camera.height_px) / 2.0 * camera.pixel_pitch_mm
    return float(pinhole_angle(camera, max(corner, camera.image_radius_mm)))


def meridional_rays(
    design: Design,
    view_name: ViewName,
    elevations_deg: ArrayLike,
    length_mm: float,
    poses: Mapping[str, Pose] | None = None,
) -> list[Array]:
    """Polylines (k, 2) of signed distance from the axis and height: pinhole, mirrors, then ``length_mm`` outwards.

    One for each elevation, in order; empty (0, 2) where no ray in the image leaves at that elevation. Apertures and
    blockage are ignored. A tube's inner and outer wall are corners too, where rays pass it between its ends. The ray
    leaves the pinhole towards positive distances. ``view_name`` is "upper" or "lower".
    """
    instrument = build_instrument(design, poses)
    path = instrument.path(design.views.by_name[view_name].path)
    elevations = np.radians(np.atleast_1d(np.asarray(elevations_deg, dtype=float)))
    psi = pinhole_angles(instrument, path, elevations, widest_pinhole_angle(design))
    trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
    end = trace.point + length_mm * trace.direction
    corners = np.stack([np.zeros_like(end), *trace.hits, end], axis=1)[:, :, [0, 2]]
    lines = [line if np.isfinite(line).all() else np.empty((0, 2)) for line in corners]
    return lines if design.tube is None else _through_wall(design.tube, lines, trace, length_mm)


def project(design: Design, view_name: ViewName, distances_mm: ArrayLike, heights_mm: ArrayLike) -> Array:
    """Angles psi (n,) in radians of the pinhole rays that the traced mirrors send to points; NaN where none goes.

    A point is given by its distance from the axis and its height over the pinhole. The ray leaves the pinhole on the
    point's side of the axis, or on the other for a view of negative gain; psi is positive in both cases. Apertures,
    blockage and the ends of a tube are ignored.
    """
    view = design.views.by_name[view_name]
    instrument = build_instrument(design)
    side = 1.0 if view.gain > 0.0 else -1.0
    distances, heights = np.broadcast_arrays(np.asarray(distances_mm, float), np.asarray(heights_mm, float))
    path, widest = instrument.path(view.path), widest_pinhole_angle(design)
    return aim_at_points(instrument, path, side * distances, heights, widest, design.tube)


def exit_lines(
    instrument: Instrument, path: tuple[int, ...], psi: Array, tube: Tube | None = None
) -> tuple[Array, Array]:
    """Exit points and directions, each (2, n): signed distance from the axis, height; behind a tube if there is one."""
    trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
    if tube is None:
        return trace.point.T[[0, 2]], trace.direction.T[[0, 2]]
    through = refract(tube, trace.point, trace.direction)
    return through.at_outer.T[[0, 2]], through.direction.T[[0, 2]]


def _through_wall(tube: Tube, lines: list[Array], trace: SequentialTrace, length_mm: float) -> list[Array]:
    """The polylines with the tube's two walls as corners, where they meet it between its ends."""
    through = refract(tube, trace.point, trace.direction)
    meets = through.meets(tube)
    walls = np.stack([through.at_inner, through.at_outer, through.at_outer + length_mm * through.direction], axis=1)
    return [
        np.concatenate([line[:-1], wall[:, [0, 2]]]) if meet and len(line) else line
        for line, wall, meet in zip(lines, walls, meets, strict=True)
    ]


def aim_at_points(
    instrument: Instrument,
    path: tuple[int, ...],
    positions: Array,
    heights: Array,
    widest: float,
    tube: Tube | None = None,
) -> Array:
    """Pinhole angles (n,) up to ``widest`` whose exit rays pass through points (signed distance from the axis, height).

    Apertures, blockage and the ends of a tube are ignored, and no single viewpoint is needed. NaN where no ray goes.
    """

    def exits(psi: Array) -> tuple[Array, Array]:
        return exit_lines(instrument, path, psi, tube)

    def excess(psi: Array) -> Array:
        """Angle from the exit ray to the line from its start to the point."""
        (start_x, start_z), (ahead_x, ahead_z) = exits(psi)
        offset_x, offset_z = positions - start_x, heights - start_z
        aside = ahead_x * offset_z - ahead_z * offset_x
        return np.asarray(np.arctan2(aside, ahead_x * offset_x + ahead_z * offset_z))

    with np.errstate(all="ignore"):
        psi = _first_guess(exits, positions, heights, widest)
        last = psi * (1.0 + 1e-6) + 1e-9
        error, last_error = excess(psi), excess(last)
        for _ in range(SECANT_STEPS):
            step = error * (last - psi) / (last_error - error)
            # Two errors of rounding alone, while other rays are still on their way, tell no direction.
            step = np.where(np.isfinite(step) & (np.abs(error) > ROUNDING_RAD), step, 0.0)
            last, last_error = psi, error
            psi = psi - step
            error = excess(psi)
            if np.nanmax(np.abs(step), initial=0.0) < ANGLE_TOLERANCE_RAD:
                break
    return np.where(np.abs(error) < 1e-9, psi, np.nan)


def _first_guess(
    exits: Callable[[Array], tuple[Array, Array]], positions: Array, heights: Array, widest: float
) -> Array:
    """Pinhole angles to start from: exit slopes tabulated, and matched as if all exit rays began at one point."""
    table = np.linspace(0.0, widest, AIMING_TABLE_SIZE)
    (start_x, start_z), (ahead_x, ahead_z) = exits(table)
    towards = np.isfinite(ahead_x) & (ahead_x * np.sign(np.median(positions)) > 0.0)
    if np.sum(towards) < 2:
        return np.full(positions.shape, np.nan)
    slope = ahead_z[towards] / np.abs(ahead_x[towards])
    foot = start_z[towards] - ahead_z[towards] / ahead_x[towards] * start_x[towards]
    wanted = (heights - np.median(foot)) / np.abs(positions)
    order = np.argsort(slope)
    return np.asarray(np.interp(wanted, slope[order], table[towards][order]))
