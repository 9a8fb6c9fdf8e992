"""Targets around a sensor, and what an exact or a noisy camera makes of their points."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from designer.as_built.parameters import CAMERA, parameters_of
from designer.calibration.bundle import Sighting
from designer.calibration.images import pixels_of
from designer.calibration.target import MODULES, Target, modules_of
from designer.calibration.target_pose import TargetPose, facing_pose
from designer.design import VIEW_NAMES, Design
from designer.trace.built import tilted


def board_points(columns: int, rows: int, square_mm: float) -> np.ndarray:
    """Inner corners (n, 3) of a board about its middle: x right, y down, z into the board."""
    across, down = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)]) * square_mm


def poses_around(design: Design, count: int, distance_mm: float, seed: int) -> list[TargetPose]:
    """Boards all round at distances about one, leaning this way and that."""
    random = np.random.default_rng(seed)
    return [
        facing_pose(
            (0.0, 0.0),
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


def drawn_image(
    design: Design, values: np.ndarray, target: Target, pose: TargetPose, seed: int = 0, blur_px: float = 0.8
) -> np.ndarray:
    """What a sensor of departures (parameters,), image shift last, records of a target in front of grey noise.

    No rays are traced from pixels: places of the print are imaged, and pixels are looked up between them.
    """
    random = np.random.default_rng(seed)
    camera = design.camera
    image = np.full((camera.height_px, camera.width_px), 90.0)
    modules = np.pad(modules_of(target), MODULES, constant_values=1)
    texels = cv2.GaussianBlur(np.kron(modules, np.ones((8, 8))), (0, 0), 1.0)
    margin = target.square_mm
    places = [np.arange(-margin, side + margin + 1e-6, target.square_mm / 3.0) for side in target.size_mm]
    across, down = (part.ravel() for part in np.meshgrid(*places))
    points = pose.points(np.column_stack([across, down, np.zeros_like(across)]))
    for view, record in design.views.by_name.items():
        elevation = np.degrees(np.arctan2(points[:, 2] - record.viewpoint_mm, np.hypot(points[:, 0], points[:, 1])))
        low, high = record.elevation_deg
        pixels = pixels_of(design, view, points, values)
        shown = np.isfinite(pixels).all(axis=1) & (elevation > low - 1.0) & (elevation < high + 1.0)
        covered = np.zeros(image.shape, np.uint8)
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(pixels[shown]).astype(np.int32)), 1)
        v, u = np.nonzero(covered)
        board = _smooth_map(pixels[shown], np.column_stack([across, down])[shown], np.column_stack([u, v]))
        x, y = ((part + margin) / target.square_mm * 8 * MODULES - 0.5 for part in board.T)
        grey = map_coordinates(texels, [y, x], order=1, mode="nearest")
        image[v, u] = 30.0 + 170.0 * grey
    image = cv2.GaussianBlur(image, (0, 0), blur_px) + 1.5 * random.standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _smooth_map(places: np.ndarray, shown: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values (n, 2) at wanted places of a smooth map that is known at some: a polynomial of degree 9."""
    middle, half = (places.max(axis=0) + places.min(axis=0)) / 2.0, np.ptp(places, axis=0) / 2.0
    orders = [(i, j) for i in range(10) for j in range(10 - i)]

    def terms(at: np.ndarray) -> np.ndarray:
        x, y = ((at - middle) / half).T
        first, second = (np.polynomial.chebyshev.chebvander(part, 9) for part in (x, y))
        return np.stack([first[:, i] * second[:, j] for i, j in orders], axis=-1)

    factors, *_ = np.linalg.lstsq(terms(places), shown, rcond=None)
    assert np.abs(terms(places) @ factors - shown).max() < 0.02
    return terms(wanted) @ factors
