"""Pictures on surfaces: grey images that tile a plane, seen through the same Gaussian as the waves of a texture.

A picture is kept at halving resolutions, each a smoothed copy of the one before. A look-up mixes the two copies
between whose smoothing the asked one lies so that the variance of the whole smoothing, that of the interpolation
between texels included, is the asked variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.textures import Array, Floats

# The kernel that smooths before each halving, a binomial of variance 1 texel^2.
HALVING_KERNEL = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
# In texels^2, averaged over places: interpolating linearly smooths like a triangle, of this variance at a texel's
# middle and none at its centre.
INTERPOLATION_VARIANCE = 1.0 / 6.0


@dataclass(frozen=True, slots=True)
class Picture:
    """A periodic grey image from 0 to 1 at halving resolutions, all in one flat array.

    ``starts`` and ``rows``, ``columns`` (levels,) say where each level lies; ``texel_mm`` is the side of a texel of
    the first. Rows go up and columns right.
    """

    texels: Floats
    starts: NDArray[np.intp]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    texel_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height in mm, after which the picture repeats."""
        return float(self.columns[0] * self.texel_mm), float(self.rows[0] * self.texel_mm)


def make_picture(texels: Array, texel_mm: float) -> Picture:
    """A picture of an image (rows, columns) from 0 to 1, its first row the lowest.

    Raises
    ------
    ValueError
        A side is not a power of two.
    """
    if any(side & (side - 1) for side in texels.shape):
        raise ValueError(f"a picture of {texels.shape} texels: sides must be powers of two")
    levels = [np.asarray(texels, dtype=float)]
    while max(levels[-1].shape) > 1:
        coarser = levels[-1]
        for axis in (0, 1):
            if coarser.shape[axis] > 1:
                shifted = np.stack([np.roll(coarser, shift, axis) for shift in range(-2, 3)], axis=-1)
                coarser = (shifted @ HALVING_KERNEL).take(range(0, coarser.shape[axis], 2), axis)
        levels.append(coarser)
    sizes = np.array([level.size for level in levels])
    return Picture(
        np.concatenate([level.ravel() for level in levels]).astype(np.float32),
        np.cumsum(sizes) - sizes,
        np.array([level.shape[0] for level in levels]),
        np.array([level.shape[1] for level in levels]),
        texel_mm,
    )


def picture_values(picture: Picture, across_mm: Array, up_mm: Array, footprint: Array) -> Floats:
    """Values (n,) at places (n,) in mm right and up of the picture's corner; it repeats beyond its sides.

    ``footprint`` (n,) in mm is the distance between neighbouring samples, as of
    :func:`designer.imaging.render.textures.texture_values`: the picture is seen through a Gaussian whose standard
    deviation is half of that.
    """
    across, up = across_mm / picture.texel_mm, up_mm / picture.texel_mm
    # Level k has smoothed by (4^k - 1) / 3 texels^2 before, and interpolating by 4^k / 6 while it is looked up.
    variance = np.square(footprint / (2.0 * picture.texel_mm))
    scaled = np.maximum((variance + 1.0 / 3.0) / (1.0 / 3.0 + INTERPOLATION_VARIANCE), 1.0)
    level = np.minimum((np.log2(scaled) / 2.0).astype(np.intp), len(picture.starts) - 1)
    share = np.minimum((scaled / 4.0**level - 1.0) / 3.0, 1.0).astype(np.float32)
    fine = _interpolated(picture, level, across, up)
    coarse = _interpolated(picture, np.minimum(level + 1, len(picture.starts) - 1), across, up)
    return np.asarray(fine + share * (coarse - fine), dtype=np.float32)


def _interpolated(picture: Picture, level: NDArray[np.intp], across: Array, up: Array) -> Floats:
    # Smoothing keeps texels of even number, so the centres of a level lie at whole multiples of its texel.
    coarser = 0.5**level
    x, y = (across - 0.5) * coarser, (up - 0.5) * coarser
    column, row = np.floor(x), np.floor(y)
    right, above = (x - column).astype(np.float32), (y - row).astype(np.float32)
    # Sides are powers of two, so a remainder is a mask.
    last_column, last_row = picture.columns[level] - 1, picture.rows[level] - 1
    left = column.astype(np.intp)
    below = row.astype(np.intp)
    columns = left & last_column, (left + 1) & last_column
    start, width = picture.starts[level], picture.columns[level]
    bottom, top = start + (below & last_row) * width, start + ((below + 1) & last_row) * width
    texels = picture.texels
    lower = texels[bottom + columns[0]] * (1 - right) + texels[bottom + columns[1]] * right
    upper = texels[top + columns[0]] * (1 - right) + texels[top + columns[1]] * right
    return np.asarray(lower * (1 - above) + upper * above)
