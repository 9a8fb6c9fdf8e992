"""What a calibration of the image takes out of a built sensor's errors, and what alignment takes out before.

Calibration finds a centre, a scale and a turn of the image, for each view its own or the same for both: those that
bring image places nearest to where the design expects them (least squares over the working volume, as targets all
around the sensor would show). Alignment moves one mirror along the axis for the least depth bias that calibration
leaves, as targets at known distances would.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.merits import Grid, ideal_px
from designer.design import VIEW_NAMES, Design, ViewName

Calibration = Literal["views", "image", "none"]
"""Centre, scale and turn of each view, or of the whole image, or nothing."""


def calibration_columns(places_px: Array) -> Array:
    """How image places (2, n) move, (4, 2, n), per pixel of centre, right and down, relative scale, radian of turn."""
    across, down = places_px
    one, zero = np.ones_like(across), np.zeros_like(across)
    return np.array([[one, zero], [zero, one], [across, down], [-down, across]])


def left_by_calibration(
    design: Design, grid: Grid, off: Mapping[ViewName, Array], calibration: Calibration
) -> tuple[dict[ViewName, Array], dict[ViewName, Array]]:
    """What calibration leaves of displacements (2, T, n) of both views, and what it found for each, (4, T).

    The four are centre to the right and downwards in px, relative scale, and turn in radians.
    """
    left, found = dict(off), {view: np.zeros((4, off[view].shape[1])) for view in VIEW_NAMES}
    if calibration == "none":
        return left, found
    for group in (VIEW_NAMES,) if calibration == "image" else tuple((view,) for view in VIEW_NAMES):
        places = np.concatenate([ideal_px(design, grid.targets[view]) for view in group], axis=-1)
        columns = calibration_columns(places).reshape(4, -1)
        root = np.sqrt(np.tile(grid.weights, 2 * len(group)))
        joint = np.concatenate([off[view] for view in group], axis=-1)
        flat = joint.transpose(1, 0, 2).reshape(joint.shape[1], -1)
        amounts = flat @ (root[:, None] * np.linalg.pinv(columns * root))
        rest = (flat - amounts @ columns).reshape(len(flat), 2, -1).transpose(1, 0, 2)
        for view, part in zip(group, np.split(rest, len(group), axis=-1), strict=True):
            left[view], found[view] = part, amounts.T
    return left, found


def calibrated(
    design: Design, grid: Grid, pixels: Mapping[ViewName, Array], calibration: Calibration
) -> dict[ViewName, Array]:
    """Image places (2, T, n) of both views after the best calibration."""
    expected = {view: ideal_px(design, grid.targets[view])[:, None] for view in VIEW_NAMES}
    off = {view: pixels[view] - expected[view] for view in VIEW_NAMES}
    left, _ = left_by_calibration(design, grid, off, calibration)
    return {view: expected[view] + left[view] for view in VIEW_NAMES}


def centres_apart_px(design: Design, grid: Grid, pixels: Mapping[ViewName, Array]) -> Array:
    """Distance (T,) between the image centres that calibration finds for the two views of image places (2, T, n)."""
    off = {view: pixels[view] - ideal_px(design, grid.targets[view])[:, None] for view in VIEW_NAMES}
    _, found = left_by_calibration(design, grid, off, "views")
    return np.asarray(np.hypot(*(found["upper"] - found["lower"])[:2]))


def best_alignment(grid: Grid, bias: Array, along: Array) -> Array:
    """How far (T,) to move along one parameter so that the least depth bias (T, n) is left, to first order.

    ``along`` (n,) is the derivative of the bias by that parameter. Both are of calibrated images.
    """
    reach = grid.weights @ along**2
    return np.zeros(len(bias)) if reach == 0.0 else -(bias @ (grid.weights * along)) / reach
