"""Where a target stands: a turn and a place, and how its points move with both.

A pose takes points of the target's frame (x right, y down, z into the board, mm) to the design's frame:
``turn @ point + place``. It is varied by a rotation vector w in front of a fixed turn, exp(w) turn, whose derivative is
the left Jacobian of the rotation group (Barfoot, State Estimation for Robotics, 2017, section 7.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array

NUMBERS = 6
"""Numbers of a pose's variation: a rotation vector in radians, then a shift in mm."""
# Below this angle the series of the coefficients are exact in double precision.
SMALL_ANGLE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class TargetPose:
    """Turn (3, 3) and place (3,) in mm of one target in the design's frame."""

    turn: Array
    place_mm: Array

    def points(self, points_mm: Array) -> Array:
        """Points (n, 3) of the target in the design's frame."""
        return np.asarray(points_mm @ self.turn.T + self.place_mm)


def facing_pose(
    size_mm: tuple[float, float],
    azimuth_deg: float,
    distance_mm: float,
    height_mm: float,
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> TargetPose:
    """The pose of a board of a width and height, whose middle stands at a distance from the axis and a height z.

    It faces the axis, and is turned about its middle by a rotation vector in its own frame (right, down, ahead).
    """
    azimuth = np.radians(azimuth_deg)
    outwards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    turn = np.column_stack([right, [0.0, 0.0, -1.0], outwards]) @ rotation_of(np.radians(turn_deg))
    middle = outwards * distance_mm + [0.0, 0.0, height_mm]
    return TargetPose(turn, middle - turn @ [size_mm[0] / 2.0, size_mm[1] / 2.0, 0.0])


def varied(pose: TargetPose, variation: Array) -> TargetPose:
    """The pose turned by a rotation vector in front of its turn, and shifted: ``variation`` (6,)."""
    return TargetPose(rotation_of(variation[:3]) @ pose.turn, pose.place_mm + variation[3:])


def point_slopes(pose: TargetPose, variation: Array, points_mm: Array) -> Array:
    """Derivatives (n, 3, 6) of a target's points (n, 3) in the design's frame by the numbers of a variation."""
    turned = points_mm @ (rotation_of(variation[:3]) @ pose.turn).T
    left = _left_jacobian(variation[:3])
    by_turn = np.stack([np.cross(left[:, axis], turned) for axis in range(3)], axis=-1)
    return np.concatenate([by_turn, np.broadcast_to(np.eye(3), (len(points_mm), 3, 3))], axis=-1)


def rotation_of(vector: Array) -> Array:
    """The rotation matrix (3, 3) of a rotation vector in radians (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    across = _cross_matrix(vector)
    if angle < SMALL_ANGLE:
        return np.asarray(np.eye(3) + across * (1.0 - angle**2 / 6.0) + across @ across * (0.5 - angle**2 / 24.0))
    sine, versine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    return np.asarray(np.eye(3) + sine * across + versine * across @ across)


def _left_jacobian(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    across = _cross_matrix(vector)
    if angle < SMALL_ANGLE:
        first, second = 0.5 - angle**2 / 24.0, 1.0 / 6.0 - angle**2 / 120.0
    else:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * across + second * across @ across)


def _cross_matrix(vector: Array) -> Array:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
