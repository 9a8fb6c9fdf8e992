"""What drawings are made with: noise that repeats without a seam, fibres of wood, print and letters."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Random = np.random.Generator

LETTERS = np.array(list("ABCDEFGHIKLMNOPRSTUVWXYZ"))


def texels_about(random: Random, side: int, reach: int) -> NDArray[np.intp]:
    """Texels about one at random, ``reach`` to either side, carried on round the edge."""
    return np.asarray(np.arange(-reach, reach + 1) + random.integers(side)) % side


def speckle(random: Random, shape: tuple[int, int], width: float) -> Array:
    """Noise of standard deviation 1, smoothed over ``width`` texels, that repeats without a seam."""
    return blotches(random, shape, width) if width > 1 else random.standard_normal(shape)


def blotches(random: Random, shape: tuple[int, int], width: float) -> Array:
    """Smooth shades of standard deviation 1 about ``width`` texels wide, that repeat without a seam."""
    spectrum = np.fft.rfft2(random.standard_normal(shape))
    down, across = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :]
    smooth = np.fft.irfft2(spectrum * np.exp(-((np.hypot(down, across) * width * 2.0) ** 2)), shape)
    smooth -= smooth.mean()
    return np.asarray(smooth / smooth.std())


def fibres(random: Random, shape: tuple[int, int]) -> Array:
    """Wood: fine fibres along the rows and wavering rings across them, between -1 and 1."""
    rows, columns = np.indices(shape)
    waver = 4.0 * np.sin(columns * 2 * np.pi / shape[1] + random.uniform(0, 6)) + 2.0 * np.sin(
        columns * 4 * np.pi / shape[1] + random.uniform(0, 6)
    )
    rings = np.sin((rows + waver) * 2 * np.pi / max(6.0, shape[0] / 20.0))
    lines = random.standard_normal((shape[0], 1)) + 0.4 * random.standard_normal(shape)
    return np.asarray(np.tanh(0.6 * rings + 0.5 * lines))


def print_lines(
    random: Random, image: Array, low: tuple[int, int], high: tuple[int, int], spacing: int, ink: float = 0.2
) -> None:
    """Lines of words between two corners (column, row)."""
    for row in range(low[1], high[1] - spacing // 2, spacing):
        column, end = low[0], low[0] + int((high[0] - low[0]) * random.uniform(0.5, 1.0))
        while column < end:
            word = min(int(random.integers(3, 16)), end - column)
            image[row : row + max(1, spacing // 2), column : column + word] = ink
            column += word + 3


def word(random: Random, length: int) -> str:
    """Capital letters at random."""
    return "".join(random.choice(LETTERS, length))


def write(
    image: Array, text: str, place: tuple[int, int], height: int, ink: float, thickness: int | None = None
) -> None:
    """Text upright in an image whose first row is the lowest; ``place`` is its lower left corner (column, row)."""
    thickness = thickness or max(1, height // 9)
    scale = cv2.getFontScaleFromHeight(cv2.FONT_HERSHEY_SIMPLEX, height, thickness)
    mask = np.zeros(image.shape, dtype=np.uint8)
    base = (place[0], image.shape[0] - 1 - place[1])
    cv2.putText(mask, text, base, cv2.FONT_HERSHEY_SIMPLEX, scale, 255, thickness, cv2.LINE_AA)
    image += mask[::-1] / 255.0 * (ink - image)


def frame(image: Array, width: int, tone: float) -> None:
    """Draw an edge of that width in texels all round."""
    image[:width] = image[-width:] = tone
    image[:, :width] = image[:, -width:] = tone
