"""The last fraction of a row: windows that follow the surface instead of facing the sensor.

A square window supposes one disparity for all its pixels. On a slanted surface they differ, and what is found belongs
to wherever in the window the texture happens to be strongest: an error that no calibration on another slant predicts.
Here the lower view is drawn over the upper one along the surface already found, smoothed, whatever its slant, so that
only the error of that surface is left to be seen; least squares over the window (Lucas and Kanade, 1981) measures it.
Pixels that still look different then show something else, beyond the edge of the surface: they weigh little.

Scan-line images have shape (columns + 2 AZIMUTH_PADDING, rows): a row of the array is one azimuth.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.imaging.images import Image
from designer.imaging.stereo.panorama import AZIMUTH_PADDING

Map = NDArray[np.float32]

STEPS = 2
# A pixel whose disparity differs by more rows from the mean around it lies on another surface than its neighbours.
LARGEST_UNEVENNESS = 0.35
# What one step may add, in rows, and how far from the search's own disparity a pixel may go.
LARGEST_STEP, LARGEST_CHANGE = 0.5, 1.0
# What noise, in grey levels, and an error of the surface, in rows, make of two pixels that belong together.
USUAL_NOISE, USUAL_ERROR = 2.0, 0.4
# In a neighbourhood of this side.
NEIGHBOURHOOD = 3
# Squared grey levels per row; below, the window shows nothing.
LEAST_STEEPNESS = 1e-3


def refine_disparities(disparities: Map, upper: Image, lower: Image, window: int) -> Map:
    """Refine disparities by windows that follow the surface.

    Parameters
    ----------
    disparities
        In rows, (columns, rows); not a number where dropped, and there it stays so.
    upper, lower
        Grey scan lines of both views, (columns + 2 AZIMUTH_PADDING, rows).
    window
        Odd side of the window in pixels.
    """
    above, below = upper.astype(np.float32), lower.astype(np.float32)
    refined = disparities
    for _ in range(STEPS):
        surface = _smoothed(refined, window)
        refined = (surface + _remainder(surface, above, below, window))[AZIMUTH_PADDING:-AZIMUTH_PADDING]
        refined[np.isnan(disparities)] = np.nan
    with np.errstate(invalid="ignore"):
        strayed = np.abs(refined - disparities) > LARGEST_CHANGE
    return np.where(strayed, disparities, refined)


def _smoothed(disparities: Map, window: int) -> Map:
    """The mean over the window of what is known, but a pixel's own where that is unlike; padded across the seam."""
    padded = np.concatenate([disparities[-AZIMUTH_PADDING:], disparities, disparities[:AZIMUTH_PADDING]])
    known = np.isfinite(padded)
    padded[~known] = 0.0
    count = _mean(known.astype(np.float32), window)
    mean = _mean(padded, window)
    mean /= np.maximum(count, np.float32(0.5 / window**2))
    uneven = known & (np.abs(mean - padded) > LARGEST_UNEVENNESS)
    mean[uneven] = padded[uneven]
    return mean


def _remainder(surface: Map, upper: Map, lower: Map, window: int) -> Map:
    """By how many rows the disparities of a surface, both padded, are too small."""
    rows = surface.shape[1]
    sources = np.arange(rows, dtype=np.float32) - surface
    drawn = _drawn(lower, sources)
    # The mean steepness of both views: that of one alone, noise and all, would shrink the step.
    steepness: Map = np.asarray(cv2.Sobel(upper + drawn, cv2.CV_32F, 1, 0, ksize=1, scale=0.25), dtype=np.float32)
    steepness[:, [0, -1]] = 0.0
    steepness[(sources < 0.0) | (sources > rows - 1.0)] = 0.0
    drawn -= upper
    squared = steepness * steepness
    usual = np.float32(USUAL_NOISE**2) + np.float32(USUAL_ERROR**2) * _mean(squared, window)
    weight = np.float32(1.0) / (np.float32(1.0) + np.square(_mean(drawn * drawn, NEIGHBOURHOOD) / usual))
    step = _mean(weight * steepness * drawn, window)
    step /= np.maximum(_mean(weight * squared, window), np.float32(LEAST_STEEPNESS))
    return np.clip(step, np.float32(-LARGEST_STEP), np.float32(LARGEST_STEP), out=step)


def _drawn(lines: Map, sources: Map) -> Map:
    """Scan lines sampled at given rows by Catmull and Rom's cubic.

    OpenCV's own cubic does not reproduce straight lines: it shifts patterns by up to a twentieth of a pixel. This one
    is linear interpolation less t (1 - t) / 2 times that of the second differences, t from the sample before.
    """
    number = np.repeat(np.arange(len(lines), dtype=np.float32)[:, None], lines.shape[1], axis=1)
    bends = cv2.Sobel(lines, cv2.CV_32F, 2, 0, ksize=1, borderType=cv2.BORDER_REPLICATE)
    linear, bend = (
        cv2.remap(image, sources, number, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for image in (lines, bends)
    )
    fraction = sources - np.floor(sources)
    return np.asarray(linear - np.float32(0.5) * fraction * (np.float32(1.0) - fraction) * bend, dtype=np.float32)


def _mean(values: Map, window: int) -> Map:
    return np.asarray(cv2.blur(values, (window, window), borderType=cv2.BORDER_REPLICATE), dtype=np.float32)
