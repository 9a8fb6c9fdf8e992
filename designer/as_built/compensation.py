"""What a calibration of the image takes out of a built sensor's errors, and what alignment takes out before.

Calibration gives each view a centre, a scale and a turn of its own, those that bring its image places nearest to where
the design expects them (least squares over the working volume, as targets all around the sensor would show). Alignment
moves one mirror along the axis for the least depth bias that calibration leaves, as targets at known distances would.
"""

from __future__ import annotations

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.merits import Grid, ideal_px
from designer.design import Design, ViewName

CALIBRATED = ("centre to the right (px)", "centre downwards (px)", "scale", "turn (rad)")
"""What calibration finds for each view, in the order of :func:`calibration_columns`."""


def calibration_columns(places_px: Array) -> Array:
    """How image places (2, n) move, (4, 2, n), per pixel of either centre, relative scale, and radian of turn."""
    across, down = places_px
    one, zero = np.ones_like(across), np.zeros_like(across)
    return np.array([[one, zero], [zero, one], [across, down], [-down, across]])


def calibrated(design: Design, grid: Grid, view: ViewName, pixels: Array) -> tuple[Array, Array]:
    """Image places (2, T, n) after the best calibration of a view, and what it found (4, T)."""
    expected = ideal_px(design, grid.targets[view])
    columns, finder = _calibration(grid, expected)
    off = (pixels - expected[:, None]).transpose(1, 0, 2).reshape(pixels.shape[1], -1)
    found = off @ finder
    taken_out = (found @ columns).reshape(len(found), 2, -1).transpose(1, 0, 2)
    return pixels - taken_out, found.T


def without_calibrated(design: Design, grid: Grid, view: ViewName, changes: Array) -> Array:
    """What calibration leaves of small changes of image places (k, 2, n)."""
    columns, finder = _calibration(grid, ideal_px(design, grid.targets[view]))
    flat = changes.reshape(len(changes), -1)
    return np.asarray((flat - flat @ finder @ columns).reshape(changes.shape))


def best_alignment(grid: Grid, bias: Array, along: Array) -> Array:
    """How far (T,) to move along one parameter so that the least depth bias (T, n) is left, to first order.

    ``along`` (n,) is the derivative of the bias by that parameter. Both are of calibrated images.
    """
    reach = grid.weights @ along**2
    return np.zeros(len(bias)) if reach == 0.0 else -(bias @ (grid.weights * along)) / reach


def _calibration(grid: Grid, places_px: Array) -> tuple[Array, Array]:
    """The columns (4, 2n), and the matrix (2n, 4) that finds their best weighted combination for displacements."""
    columns = calibration_columns(places_px).reshape(4, -1)
    root = np.sqrt(np.tile(grid.weights, 2))
    return columns, np.asarray(root[:, None] * np.linalg.pinv(columns * root))
