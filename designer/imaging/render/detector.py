"""From radiance to the numbers that a camera's detector writes: shot noise, read noise, quantisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.textures import Floats

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Exposure:
    """How bright the scene is: the electrons that radiance 1 gives in the middle of the image at a stated f-number.

    Illumination, exposure time, pixel area and quantum efficiency stand behind this number. Mirrors count as lossless
    in it: their losses are the lens's (:class:`designer.imaging.render.lens.RenderedLens`).
    """

    white_electrons: float
    f_number: float

    def electrons_at(self, f_number: float) -> float:
        """Electrons that radiance 1 gives at another f-number, which falls with its square.

        Use :func:`designer.imaging.render.lens.working_f_number`, which also counts what focusing near by costs.
        """
        return self.white_electrons * (self.f_number / f_number) ** 2


@dataclass(frozen=True, slots=True)
class Detector:
    """A detector that radiance 1 just fills, unless ``white_electrons`` says how far it does.

    ``read_noise_electrons`` is the standard deviation of the noise in the dark. A pixel of radiance L collects L times
    ``white_electrons`` (``full_well_electrons`` if not given), and their number varies by its square root. The
    converter's full scale is the full well, where pixels saturate.
    """

    full_well_electrons: float = 10_000.0
    read_noise_electrons: float = 8.0
    has_shot_noise: bool = True
    white_electrons: float | None = None


def expose(image: Floats, detector: Detector | None = None, bits: Literal[8, 16] = 8, seed: int = 0) -> Pixels:
    """The raw image (h, w) of a radiance image, in ``bits`` bits; without noise if no detector is given."""
    signal = image.astype(np.float64)
    if detector is not None:
        random = np.random.default_rng([seed, 0x5E45])
        full_well = detector.full_well_electrons
        electrons = signal * (full_well if detector.white_electrons is None else detector.white_electrons)
        variance = detector.read_noise_electrons**2 + (electrons if detector.has_shot_noise else 0.0)
        # Thousands of electrons: the Poisson distribution is Gaussian to the eye of an 8-bit converter.
        signal = (electrons + np.sqrt(variance) * random.standard_normal(signal.shape)) / full_well
    full_scale = 2**bits - 1
    levels = np.clip(np.rint(signal * full_scale), 0, full_scale)
    return np.asarray(levels, dtype=np.uint8) if bits == 8 else np.asarray(levels, dtype=np.uint16)
