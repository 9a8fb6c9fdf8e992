"""Where targets stand, as far as the design without departures can say.

Each view of a design has a viewpoint, so its directions to the corners of a board give two poses (Collins and Bartoli,
Infinitesimal plane-based pose estimation, 2014). The one of all views' poses that explains all views best is refined.
"""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from scipy.optimize import least_squares

from designer.as_built.dual import Array
from designer.calibration.detection import Detected
from designer.calibration.images import UNSEEN_PX, point_images
from designer.calibration.target import Board
from designer.calibration.target_pose import NUMBERS, TargetPose, point_slopes, varied
from designer.design import Design, ViewName
from designer.imaging.stereo.placement import view_image

# Farther off than this, in degrees from the middle of a board, its directions are not seen as a picture.
WIDEST_DEG = 80.0
SOFT_PX = 5.0


def first_pose(
    design: Design, board: Board, seen: Mapping[ViewName, Detected], values: Array
) -> tuple[TargetPose, float] | None:
    """The pose of a target that its corners in the views of one image tell, and the rms px by which it misses them.

    ``values`` (parameters,) are the departures of the sensor, as far as they are known. None if there is no such pose.
    """
    candidates = [pose for view, detected in seen.items() for pose in _poses(design, view, board, detected)]
    refined = [_refined(design, board, seen, pose, values) for pose in candidates]
    return min(refined, key=lambda pair: pair[1], default=None)


def _poses(design: Design, view: ViewName, board: Board, detected: Detected) -> list[TargetPose]:
    image = view_image(design, view)
    slope, azimuth = image.direction_of(*detected.pixels.T)
    ahead = np.column_stack([np.cos(azimuth), np.sin(azimuth), slope])
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    middle = ahead.mean(axis=0) / np.linalg.norm(ahead.mean(axis=0))
    right = np.array([middle[1], -middle[0], 0.0]) / np.hypot(middle[0], middle[1])
    # A camera at the viewpoint that looks at the middle of the board: x right, y down, z ahead.
    camera = np.stack([right, np.cross(middle, right), middle])
    x, y, z = camera @ ahead.T
    if z.min() < np.cos(np.radians(WIDEST_DEG)):
        return []
    corners = board.corners_mm[detected.numbers]
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            corners[:, None], np.column_stack([x / z, y / z])[:, None], np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:  # corners in one line
        return []
    viewpoint = np.array([0.0, 0.0, image.viewpoint_mm])
    return [
        TargetPose(camera.T @ cv2.Rodrigues(turns[each])[0], camera.T @ shifts[each].ravel() + viewpoint)
        for each in range(count)
    ]


def _refined(
    design: Design, board: Board, seen: Mapping[ViewName, Detected], pose: TargetPose, values: Array
) -> tuple[TargetPose, float]:
    corners = {view: board.corners_mm[detected.numbers] for view, detected in seen.items()}

    def residuals(variation: Array) -> Array:
        moved = varied(pose, variation)
        parts = [
            point_images(design, view, moved.points(corners[view]), values).pixels - detected.pixels
            for view, detected in seen.items()
        ]
        return np.nan_to_num(np.concatenate(parts), nan=UNSEEN_PX).ravel()

    def jacobian(variation: Array) -> Array:
        moved = varied(pose, variation)
        parts = [
            point_images(design, view, moved.points(points), values).by_point @ point_slopes(pose, variation, points)
            for view, points in corners.items()
        ]
        return np.nan_to_num(np.concatenate(parts)).reshape(-1, NUMBERS)

    scale = np.array([1.0, 1.0, 1.0, 1000.0, 1000.0, 1000.0])
    # The sensor is not the design, so errors of some pixels are no surprise.
    found = least_squares(
        residuals, np.zeros(NUMBERS), jacobian, x_scale=scale, loss="soft_l1", f_scale=SOFT_PX, max_nfev=30, ftol=1e-4
    )
    return varied(pose, found.x), float(np.sqrt(np.mean(np.minimum(residuals(found.x), UNSEEN_PX) ** 2)))
