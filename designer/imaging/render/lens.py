"""What a lens does to light besides forming an image: its pupil, how much light passes, and diffraction.

Diffraction multiplies the image's spectrum by the optical transfer function of an ideal round pupil (J. W. Goodman,
Introduction to Fourier Optics, section 6.3), which is zero from the spatial frequency p / (lambda f) on and whose spot
of light has its first dark ring 2.44 lambda f / p across: p the pupil's diameter, f the principal distance. Lengths
in mm unless a name says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from designer.design import Camera
from designer.imaging.render.textures import Floats
from designer.optics.illumination import relative_illumination
from designer.trace.image_law import is_perspective

Array = NDArray[np.float64]

NANOMETRES = 1e-6
# Dark pixels about the image, so that diffracted light does not come in again on the other side.
PADDING_PX = 32


@dataclass(frozen=True, slots=True)
class RenderedLens:
    """How light passes glass and mirrors; the pupil's size and the focus distance are the camera's.

    ``wavelength_nm`` is that of diffraction, None for none. ``mirror_reflectivity`` counts once for each reflection:
    0.88 is bare aluminium in the visible. With ``has_natural_vignetting`` the light falls with the fourth power of
    the cosine of the angle between ray and optical axis (:func:`designer.optics.illumination.relative_illumination`).
    """

    wavelength_nm: float | None = 550.0
    mirror_reflectivity: float = 0.88
    has_natural_vignetting: bool = True

    def transmission(
        self, directions: Array, reflections: NDArray[np.intp], stretched_area: Array | float = 1.0
    ) -> Floats:
        """Share (n,) of the light that passes: rays (n, 3) as unit vectors at the pupil, and how often reflected.

        It is 1 for light along the optical axis that meets no mirror. ``stretched_area`` is that of
        :func:`designer.imaging.render.camera_rays.stretched_area`.
        """
        cosine = directions[:, 2] if self.has_natural_vignetting else np.ones(len(directions))
        area = stretched_area if self.has_natural_vignetting else 1.0
        return np.asarray(relative_illumination(cosine, reflections, self.mirror_reflectivity, area), dtype=np.float32)


# Rays along each side of a pixel that leave less noise than a full well of 10,000 electrons has through shot noise; a
# pinhole has no pupil to fill (``benchmarks/rendering.py``).
PINHOLE_SAMPLES, LENS_SAMPLES = 2, 3


def default_samples(lens: RenderedLens | None) -> int:
    """Rays along each side of a pixel that are enough, through the pupil of a lens or, without one, a pinhole."""
    return PINHOLE_SAMPLES if lens is None else LENS_SAMPLES


LOSSLESS = RenderedLens(wavelength_nm=None, mirror_reflectivity=1.0, has_natural_vignetting=False)
"""A lens of which only pupil and focus count."""


@dataclass(frozen=True, slots=True)
class Pupil:
    """A thin lens: radius of its pupil and distance at which it is in focus (infinite: far away), in mm."""

    radius_mm: float
    focus_distance_mm: float


def pupil_of(camera: Camera) -> Pupil:
    """The entrance pupil: nominal focal length / f-number wide, in focus at the camera's ``focus_distance_mm``.

    A camera file without ``focus_distance_mm`` is focused at infinity.
    """
    return Pupil(camera.pupil_radius_mm, camera.focus_distance_mm or np.inf)


def describe_lens(camera: Camera) -> str:
    """The lens in words: its engraved focal length, f-number, and focus distance from the entrance pupil."""
    nominal = 2.0 * camera.pupil_radius_mm * camera.f_number
    focus = f"{camera.focus_distance_mm:.4g} mm" if camera.focus_distance_mm else "infinity"
    law = "" if is_perspective(camera) else f" ({camera.projection}{', distorted' if any(camera.distortion) else ''})"
    return f"a lens of {nominal:.4g} mm{law}, f/{camera.f_number:.3g}, focused at {focus}"


def working_f_number(camera: Camera) -> float:
    """Principal distance / pupil diameter: larger than the engraved f-number when the lens is focused near by."""
    return camera.focal_length_mm / (2.0 * camera.pupil_radius_mm)


def diffraction_transfer(frequency_per_mm: ArrayLike, camera: Camera, wavelength_nm: float) -> Array:
    """Contrast that diffraction leaves of a spatial frequency on the sensor, in cycles per mm, in perfect focus."""
    cut_off = 1.0 / (wavelength_nm * NANOMETRES * working_f_number(camera))
    share = np.minimum(np.abs(np.asarray(frequency_per_mm, dtype=float)) / cut_off, 1.0)
    return np.asarray(2.0 / np.pi * (np.arccos(share) - share * np.sqrt(1.0 - share**2)))


def diffract(image: Floats, camera: Camera, wavelength_nm: float) -> Floats:
    """An image (h, w) after diffraction; the surroundings of the image are dark.

    Its transfer multiplies that of the defocus, which is exact where either of them leaves nearly full contrast. The
    spot is that of the image's centre: towards the rim it grows by one cosine across the radius and three along it.
    """
    height, width = image.shape
    shape = [fft.next_fast_len(size + PADDING_PX, real=True) for size in (height, width)]
    down = fft.fftfreq(shape[0], camera.pixel_pitch_mm)[:, None]
    across = fft.rfftfreq(shape[1], camera.pixel_pitch_mm)
    transfer = diffraction_transfer(np.hypot(down, across), camera, wavelength_nm).astype(np.float32)
    spectrum = fft.rfft2(image.astype(np.float32), s=shape)
    spectrum *= transfer
    blurred = fft.irfft2(spectrum, s=shape)[:height, :width]
    # The transfer is that of a spot that is nowhere negative; only its sampling leaves negative traces.
    return np.asarray(np.maximum(blurred, 0.0), dtype=np.float32)
