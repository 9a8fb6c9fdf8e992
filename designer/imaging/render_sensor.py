"""From radiance to the numbers that a sensor writes: shot noise, read noise, quantisation; and the files."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from designer.files import InputError, write_atomically
from designer.imaging.render import GroundTruth
from designer.imaging.textures import Floats

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor that radiance 1 just fills.

    ``read_noise_electrons`` is the standard deviation of the noise in the dark. ``full_well_electrons`` sets the shot
    noise: a pixel of radiance L collects L times as many electrons, and their number varies by its square root.
    """

    full_well_electrons: float = 10_000.0
    read_noise_electrons: float = 8.0
    has_shot_noise: bool = True


def expose(image: Floats, sensor: Sensor | None = None, bits: Literal[8, 16] = 8, seed: int = 0) -> Pixels:
    """The raw image (h, w) of a radiance image, in ``bits`` bits; without noise if no sensor is given."""
    signal = image.astype(np.float64)
    if sensor is not None:
        random = np.random.default_rng([seed, 0x5E45])
        electrons = signal * sensor.full_well_electrons
        variance = sensor.read_noise_electrons**2 + (electrons if sensor.has_shot_noise else 0.0)
        # Thousands of electrons: the Poisson distribution is Gaussian to the eye of an 8-bit converter.
        signal = (electrons + np.sqrt(variance) * random.standard_normal(signal.shape)) / sensor.full_well_electrons
    full_scale = 2**bits - 1
    levels = np.clip(np.rint(signal * full_scale), 0, full_scale)
    return np.asarray(levels, dtype=np.uint8) if bits == 8 else np.asarray(levels, dtype=np.uint16)


def write_png(path: Path, image: Pixels) -> None:
    """Write an image (h, w) of 8 or 16 bits as PNG, whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written there.
    """
    import cv2

    _, encoded = cv2.imencode(".png", image)
    _write(path, encoded.tobytes())


def write_truth(path: Path, truth: GroundTruth) -> None:
    """Write a ground truth as .npz: ``view``, ``point_mm``, ``distance_mm`` and ``surface``, each of image shape.

    Raises
    ------
    InputError
        The file cannot be written there.
    """
    stream = io.BytesIO()
    np.savez_compressed(
        stream, view=truth.view, point_mm=truth.point_mm, distance_mm=truth.distance_mm, surface=truth.surface
    )
    _write(path, stream.getvalue())


def _write(path: Path, content: bytes) -> None:
    try:
        write_atomically(path, content)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
