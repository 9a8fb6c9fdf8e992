"""Where a raw image shows the inner corners of a target, in each view: first in a panorama, then better.

A raw image is too distorted for markers to be read, so each view is unwrapped by the design's own tables. The corners
found there lie within a pixel; :mod:`designer.calibration.corners` does the rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.as_built.dual import Array
from designer.calibration.target import Board
from designer.design import VIEW_NAMES, Design, ViewName
from designer.imaging.images import Image
from designer.imaging.stereo.placement import ViewImage, view_image

# Samples of a panorama for each pixel of the raw image, where that is finest.
SAMPLES_PER_PIXEL = 1.5
MOST_COLUMNS = 12_000
# Views often show a little more than was asked of them.
BEYOND_DEG = 2.0
FEWEST_CORNERS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Detected:
    """Corners of a board in one view: their ``numbers`` (n,) and raw image places ``pixels`` (n, 2)."""

    numbers: NDArray[np.intp]
    pixels: Array


def detect(design: Design, raw: Image, board: Board) -> Mapping[ViewName, Detected]:
    """The corners of a board that each view of a grey raw image shows; views with fewer than 6 are left out."""
    found = {}
    for view in VIEW_NAMES:
        detected = _in_view(view_image(design, view), raw, board)
        if len(detected.numbers) >= FEWEST_CORNERS:
            found[view] = detected
    return found


def _in_view(image: ViewImage, raw: Image, board: Board) -> Detected:
    """The corners in the panorama of one view, once with its seam behind and once with it ahead: the better of both."""
    both = [_in_panorama(image, raw, board, seam) for seam in (np.pi, 0.0)]
    return max(both, key=lambda found: len(found.numbers))


def _in_panorama(image: ViewImage, raw: Image, board: Board, seam: float) -> Detected:
    slopes, azimuths = _panorama(image, seam)
    u, v = image.pixel_of(slopes[:, None], azimuths[None, :])
    panorama = cv2.remap(raw, u.astype(np.float32), v.astype(np.float32), cv2.INTER_CUBIC)
    corners, numbers, _, _ = _detector(board).detectBoard(panorama)
    if corners is None or numbers is None or not len(corners):
        return Detected(np.empty(0, np.intp), np.empty((0, 2)))
    column, row = np.asarray(corners, dtype=float).reshape(-1, 2).T
    elevation = np.interp(row, np.arange(len(slopes)), np.arctan(slopes))
    azimuth = azimuths[0] + column * (azimuths[1] - azimuths[0])
    pixels = np.column_stack(image.pixel_of(np.tan(elevation), azimuth))
    return Detected(np.asarray(numbers).ravel().astype(np.intp), pixels)


def _panorama(image: ViewImage, seam: float) -> tuple[Array, Array]:
    """Slopes of rows, from the highest, and azimuths of columns, from a seam down, no coarser than the raw image."""
    low, high = (float(end) for end in np.arctan(image.slopes))
    low, high = max(low - np.radians(BEYOND_DEG), -1.5), min(high + np.radians(BEYOND_DEG), 1.5)
    elevations = np.linspace(low, high, 50)
    finest = max(
        float(np.abs(image.radius_px(np.tan(elevations))).max()),
        float(np.abs(image.radius_per_elevation_px(np.tan(elevations))).max()),
    )
    columns = int(min(MOST_COLUMNS, np.ceil(2.0 * np.pi * finest * SAMPLES_PER_PIXEL)))
    step = 2.0 * np.pi / columns
    rows = max(2, int(np.ceil((high - low) / step)))
    return np.asarray(np.tan(high - step * np.arange(rows))), np.asarray(seam - step * np.arange(columns))


@lru_cache(maxsize=4)
def _detector(board: Board) -> cv2.aruco.CharucoDetector:
    markers = cv2.aruco.DetectorParameters()
    # Small and blurred markers; a threshold for each window, from a few modules to a few markers wide.
    markers.adaptiveThreshWinSizeMax = 53
    markers.minMarkerPerimeterRate = 0.005
    return cv2.aruco.CharucoDetector(board.charuco, detectorParams=markers)
