"""Corners of a target to a fraction of a pixel: the print itself, blurred, is laid over a patch about each corner.

The patch is the raw image resampled in the board's own coordinates, so that it shows the print straight however the
mirrors bend it. Where a sensor that is roughly known images the board says how it bends; the place comes from the raw
image alone. Shift, brightness, contrast and blur of the print are fitted together, by least squares.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.as_built.dual import Array
from designer.calibration.detection import Detected
from designer.calibration.images import pixels_of
from designer.calibration.target import MODULES, Board, Target, modules_of
from designer.calibration.target_pose import TargetPose
from designer.design import Design, ViewName
from designer.imaging.images import Image

# Half the side of a patch, and the step of its samples, in sides of a square.
HALF, STEP = 0.45, 1.0 / 32.0
TEXELS_PER_MODULE = 12
# Standard deviations of the blur that are tried, in sides of a square.
BLURS = (0.012, 0.025, 0.045, 0.07, 0.11)
STEPS = 3
# A corner that moves farther than this, in sides of a square, or fits worse than this correlation, is no corner.
FARTHEST, LEAST_CORRELATION = 0.15, 0.9


def refine_corners(
    design: Design,
    view: ViewName,
    raw: Image,
    target: Target,
    board: Board,
    detected: Detected,
    pose: TargetPose,
    values: Array,
) -> Detected:
    """The corners at better places; those that do not look like the print are left out.

    Parameters
    ----------
    pose, values
        Where the target stands and the departures (parameters,) of the sensor, as far as they are known.
    """
    numbers, pixels = [], []
    for number, place in zip(detected.numbers, detected.pixels, strict=True):
        found = _refined(design, view, raw, target, board.corners_mm[number], place, pose, values)
        if found is not None:
            numbers.append(number)
            pixels.append(found)
    return Detected(np.array(numbers, dtype=np.intp), np.array(pixels).reshape(-1, 2))


def _refined(
    design: Design,
    view: ViewName,
    raw: Image,
    target: Target,
    corner_mm: Array,
    place: Array,
    pose: TargetPose,
    values: Array,
) -> Array | None:
    bend = _bend(design, view, target, corner_mm, pose, values)
    if bend is None:
        return None
    across, down = _grid()
    shown = _terms(across, down) @ bend
    u, v = (shown + place).T
    height, width = raw.shape
    if u.min() < 0 or v.min() < 0 or u.max() > width - 1 or v.max() > height - 1:
        return None
    side = int(np.sqrt(len(across)))
    sampled = cv2.remap(
        raw.astype(np.float32),
        u.reshape(side, side).astype(np.float32),
        v.reshape(side, side).astype(np.float32),
        cv2.INTER_LINEAR,
    )
    shift = _shift(sampled.ravel().astype(float), target, corner_mm)
    return None if shift is None else np.asarray(place + (_terms(*shift[:, None]) @ bend)[0])


def _bend(
    design: Design, view: ViewName, target: Target, corner_mm: Array, pose: TargetPose, values: Array
) -> Array | None:
    """Coefficients (5, 2) of pixels from a corner's in x and y, in squares, up to second order; None if not shown."""
    across, down = (part.ravel() for part in np.meshgrid([-HALF, 0.0, HALF], [-HALF, 0.0, HALF]))
    points = corner_mm + target.square_mm * np.column_stack([across, down, np.zeros(9)])
    pixels = pixels_of(design, view, pose.points(points), values)
    if not np.isfinite(pixels).all():
        return None
    return np.asarray(np.linalg.lstsq(_terms(across, down), pixels - pixels[4], rcond=None)[0])


def _shift(sampled: Array, target: Target, corner_mm: Array) -> Array | None:
    """How far (2,) the print in a patch lies right and down of where it was looked for, in squares."""
    column, row = (int(part) for part in np.rint(corner_mm[:2] / target.square_mm))
    best, least = None, np.inf
    for blur in BLURS:
        found, left = _shift_at(sampled, target, (column, row), blur)
        if left < least:
            best, least = found, left
    unlike = least / max(float(np.var(sampled)), 1e-9)
    if best is None or unlike > 1.0 - LEAST_CORRELATION**2 or np.hypot(*best) > FARTHEST:
        return None
    return best


def _shift_at(sampled: Array, target: Target, square: tuple[int, int], blur: float) -> tuple[Array, float]:
    """The shift (2,) with the print blurred by so much, and the mean squared difference that is left."""
    picture, by_x, by_y = _print(target, blur)
    across, down = _grid()
    shift = np.zeros(2)
    left = np.inf
    for _ in range(STEPS):
        places = (square[0] + across - shift[0], square[1] + down - shift[1])
        shown, right, lower = (_looked_up(image, *places) for image in (picture, by_x, by_y))
        brightness = np.column_stack([shown, np.ones_like(shown)])
        contrast = np.linalg.lstsq(brightness, sampled, rcond=None)[0][0]
        factors = np.column_stack([shown, np.ones_like(shown), -contrast * right, -contrast * lower])
        found = np.linalg.lstsq(factors, sampled, rcond=None)[0]
        shift = shift + found[2:]
        left = float(np.mean((sampled - factors @ found) ** 2))
        if not np.all(np.abs(shift) < 1.0):
            return np.full(2, np.inf), np.inf
    return shift, left


@cache
def _grid() -> tuple[Array, Array]:
    places = np.arange(-HALF, HALF + 1e-9, STEP)
    across, down = np.meshgrid(places, places)
    return across.ravel(), down.ravel()


def _terms(across: Array, down: Array) -> Array:
    return np.column_stack([across, down, across**2, across * down, down**2])


@cache
def _print(target: Target, blur: float) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """The print with a white margin of a square, blurred, and its derivatives by x and y in squares."""
    per_square = MODULES * TEXELS_PER_MODULE
    modules = np.pad(modules_of(target), MODULES, constant_values=1)
    texels = np.kron(modules, np.ones((TEXELS_PER_MODULE, TEXELS_PER_MODULE))).astype(np.float32)
    blurred = cv2.GaussianBlur(texels, (0, 0), blur * per_square, borderType=cv2.BORDER_REPLICATE)
    picture = np.asarray(blurred, dtype=np.float32)
    by_y, by_x = (np.asarray(part, dtype=np.float32) for part in np.gradient(picture, 1.0 / per_square))
    return picture, by_x, by_y


def _looked_up(image: NDArray[np.float32], x: Array, y: Array) -> Array:
    """Values at places in squares from the board's corner."""
    per_square = MODULES * TEXELS_PER_MODULE
    column, row = ((part + 1.0) * per_square - 0.5 for part in (x, y))
    side = int(np.sqrt(x.size))
    looked_up = cv2.remap(
        image,
        column.reshape(side, side).astype(np.float32),
        row.reshape(side, side).astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(looked_up, dtype=float).ravel()
