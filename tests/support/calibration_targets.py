"""Targets around a sensor, and what an exact or a noisy camera makes of their points."""

from __future__ import annotations

import numpy as np

from designer.as_built.parameters import CAMERA, parameters_of
from designer.calibration.bundle import Sighting
from designer.calibration.images import pixels_of
from designer.calibration.target_pose import TargetPose
from designer.design import VIEW_NAMES, Design
from designer.trace.built import tilted


def board_points(columns: int, rows: int, square_mm: float) -> np.ndarray:
    """Inner corners (n, 3) of a board about its middle: x right, y down, z into the board."""
    across, down = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)]) * square_mm


def facing_pose(
    azimuth_deg: float, distance_mm: float, height_mm: float, lean_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> TargetPose:
    """A board that faces the axis, turned by rotation vector ``lean_deg`` in its own frame."""
    from designer.calibration.target_pose import rotation_of

    azimuth = np.radians(azimuth_deg)
    outwards, right = (
        np.array([np.cos(azimuth), np.sin(azimuth), 0.0]),
        np.array([np.sin(azimuth), -np.cos(azimuth), 0]),
    )
    turn = np.column_stack([right, [0.0, 0.0, -1.0], outwards]) @ rotation_of(np.radians(lean_deg))
    return TargetPose(turn, outwards * distance_mm + [0.0, 0.0, height_mm])


def poses_around(design: Design, count: int, distance_mm: float, seed: int) -> list[TargetPose]:
    """Boards all round at distances about one, leaning this way and that."""
    random = np.random.default_rng(seed)
    return [
        facing_pose(
            360.0 * place / count + random.uniform(-5, 5),
            distance_mm * random.uniform(0.8, 1.3),
            design.views.middle_mm + distance_mm * random.uniform(-0.05, 0.05),
            tuple(random.uniform(-30.0, 30.0, 3)),
        )
        for place in range(count)
    ]


def sightings_of(
    design: Design, values: np.ndarray, poses: list[TargetPose], points: np.ndarray, noise_px: float, seed: int
) -> list[Sighting]:
    """What a sensor of departures (parameters,), image shift last, shows of targets, with noise."""
    random = np.random.default_rng(seed)
    found = []
    for target, pose in enumerate(poses):
        for view in VIEW_NAMES:
            pixels = pixels_of(design, view, pose.points(points), values)
            shown = np.isfinite(pixels).all(axis=1)
            noisy = pixels[shown] + noise_px * random.standard_normal((int(shown.sum()), 2))
            found.append(Sighting(target, view, points[shown], noisy))
    return found


def in_camera_frame(design: Design, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Departures (parameters,) of the same sensor in the frame of its own camera, and where that frame stands.

    Returns the departures, and turn (3, 3) and place (3,) that take points of the design's frame to the camera's.
    A mirror is round about its axis, so a turn about that is nothing.
    """
    names = {(p.part, p.key): place for place, p in enumerate(parameters_of(design))}
    moved = values.copy()
    of_camera = [names[CAMERA, key] for key in ("shift_x_mm", "shift_y_mm", "axial_shift_mm")]
    tilts = [names[CAMERA, key] for key in ("tilt_x_deg", "tilt_y_deg")]
    place, turn = values[of_camera], tilted(*values[tilts]).T
    moved[of_camera] = moved[tilts] = 0.0
    for mirror in design.mirrors:
        shift = [names[mirror.name, key] for key in ("decentre_x_mm", "decentre_y_mm", "axial_shift_mm")]
        tilt = [names[mirror.name, key] for key in ("tilt_x_deg", "tilt_y_deg")]
        vertex = np.array([0.0, 0.0, mirror.vertex_mm])
        moved[shift] = turn @ (vertex + values[shift] - place) - vertex
        axis = turn @ tilted(*values[tilt])[:, 2]
        moved[tilt] = np.degrees([-np.arcsin(axis[1]), np.arctan2(axis[0], axis[2])])
    return moved, turn, -turn @ place
