"""Sums of plane waves in compiled loops; needs Numba (the extra ``compiled``).

As in :func:`designer.imaging.render.textures.texture_values`, to whose results a test holds these. Samples in which an
octave is still seen are gathered in blocks that stay in the processor's cache; the loop over a block has no branches,
so that the compiler takes several samples at a time.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Places = NDArray[np.float64]

BLOCK = 512
# sin(2 pi u) for |u| <= 1/4, divided by u, in powers of u^2: interpolated in the Chebyshev points, error 4e-8.
_SINE = tuple(
    np.float32(term)
    for term in np.polynomial.Chebyshev.interpolate(
        lambda squared: 2.0 * np.pi * np.sinc(2.0 * np.sqrt(squared)), 5, domain=[0.0, 1.0 / 16.0]
    )
    .convert(kind=np.polynomial.Polynomial)
    .coef
)
# Sums may be taken in another order, which single precision bears; infinities and NaN stay as they are.
_compile = numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, cache=True, nogil=True)


@_compile
def add_octave(
    coordinates: Places,
    faded: Floats,
    least_left: float,
    turns: Floats,
    phases: Floats,
    amplitude: float,
    total: Floats,
) -> None:
    """Add the waves of an octave to ``total`` (n,) at coordinates (3, n) in mm, where more is left than the least.

    ``faded`` (n,) is what is left of the waves' contrast, ``turns`` (3, m) the waves and ``phases`` (m,) their phases,
    both as parts of a full turn: per mm, and from 0 to 1.
    """
    s0, s1, s2, s3, s4, s5 = _SINE
    quarter, half = np.float32(0.25), np.float32(0.5)
    x, y, z = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    sums = np.empty(BLOCK, np.float32)
    where = np.empty(BLOCK, np.intp)
    height = np.float32(amplitude)
    sample, samples = 0, total.size
    while sample < samples:
        count = 0
        while count < BLOCK and sample < samples:
            if faded[sample] > least_left:
                x[count] = coordinates[0, sample]
                y[count] = coordinates[1, sample]
                z[count] = coordinates[2, sample]
                where[count] = sample
                count += 1
            sample += 1
        for place in range(count):
            sums[place] = 0.0
        for wave in range(phases.size):
            along_x, along_y, along_z, phase = turns[0, wave], turns[1, wave], turns[2, wave], phases[wave]
            for place in range(count):
                turn = x[place] * along_x + y[place] * along_y + z[place] * along_z + phase
                turn -= np.floor(turn + half)
                # cos(2 pi t) = sin(2 pi (1/4 - |t|))
                rest = quarter - np.abs(turn)
                squared = rest * rest
                sine = s0 + squared * (s1 + squared * (s2 + squared * (s3 + squared * (s4 + squared * s5))))
                sums[place] += rest * sine
        for place in range(count):
            total[where[place]] += height * faded[where[place]] * sums[place]
