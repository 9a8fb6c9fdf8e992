"""Views of unequal brightness, evened out by what is known of the light.

A folded view loses light at two mirrors, a direct one at one, and both towards the rim of the lens. The loss depends
on the view and the elevation alone, so each row of a panorama is brightened by one factor; the row that has most light
keeps its brightness. What fills the scale in a darker row is cut off: expose so that white stays below full scale.
"""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import VIEW_NAMES, Design, ViewName
from designer.imaging.images import Image
from designer.imaging.stereo.panorama import PanoramaGrid
from designer.imaging.stereo.placement import ViewImage
from designer.optics.illumination import relative_illumination
from designer.optics.view import half_angle_tangent, image_radius

Floats = NDArray[np.float64]

# Rows that look steeper than the views were asked to may see past the rim of the lens; they are not brightened further.
LARGEST_FACTOR = 16.0


def brightening(
    design: Design, grid: PanoramaGrid, images: Mapping[ViewName, ViewImage], mirror_reflectivity: float
) -> dict[ViewName, Floats]:
    """Factors (rows,), 1 or more, for the rows of both panoramas, by what mirrors and the rim of the lens take away."""
    light = {}
    for name in VIEW_NAMES:
        image = images[name]
        slope = grid.slope(name, np.arange(grid.rows))
        distance = image.principal_distance_px
        tangent = image_radius(slope, image.gain, distance, image.sense) / distance
        cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
        along, across = image.law.stretch(image.gain * half_angle_tangent(slope, image.sense))
        reflections = len(design.views.by_name[name].path)
        light[name] = relative_illumination(cosine, reflections, mirror_reflectivity, np.abs(along * across))
    most = max(float(share.max()) for share in light.values())
    return {name: np.minimum(most / share, LARGEST_FACTOR) for name, share in light.items()}


def brightened(lines: Image, factors: Floats) -> Image:
    """Scan lines (columns, rows[, channels]) with each row times its factor."""
    shaped = factors.astype(np.float32).reshape(1, -1, *(1,) * (lines.ndim - 2))
    return np.asarray(cv2.multiply(lines, np.broadcast_to(shaped, lines.shape).copy(), dtype=cv2.CV_8U), dtype=np.uint8)
