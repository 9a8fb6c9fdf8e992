"""Modulation transfer of lens and pixel at the scale of the matcher: defocus and diffraction together, exactly.

A thin lens out of focus has a pupil with a quadratic phase. Its transfer at a spatial frequency nu is the pupil's
autocorrelation (H. H. Hopkins, Proc. R. Soc. A 231, 1955): with s = lambda f nu / p, the share of the frequency at
which diffraction ends, and the diameter D of the geometric blur,

    (4 / pi) integral over theta from 0 to arccos(s) of sin(theta)^2 cos(pi D nu (cos(theta) - s))

In focus that is the diffraction-limited transfer, and for s -> 0 that of an evenly lit disc, 2 J1(x) / x with
x = pi D nu. (Their product is up to 0.2 too low where both count.) It is negative where bright and dark have changed
places. A square pixel multiplies it by sin(pi nu a) / (pi nu a).

Frequencies in cycles per mm on the sensor, along the radius; lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design, ViewName
from designer.evaluate.focus import ViewFocus, focus_of_design
from designer.evaluate.noise import MatcherPerformance
from designer.optics.focus import FocusedLens, blur_in_scene, light_path_of_design
from designer.optics.view import half_angle_tangent

Array = NDArray[np.float64]

GREEN_MM = 550e-6
"""Wavelength of green light, in the middle of the visible spectrum."""
FINEST_ROWS = 2.0
"""Rows of the panorama in a period of the finest pattern that it holds."""
# Enough for blurs of some forty periods.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)


@dataclass(frozen=True, slots=True)
class ViewModulation:
    """Modulation of two patterns at elevations (n,) in degrees and the nearest and farthest distance, (n, 2).

    ``of_window`` has one period in the matcher's window, ``of_rows`` one in two rows of its panorama. Negative where
    bright and dark have changed places.
    """

    elevations_deg: Array
    of_window: Array
    of_rows: Array


def lens_transfer(
    frequency: ArrayLike, blur_diameter: ArrayLike, lens: FocusedLens, wavelength: float = GREEN_MM
) -> Array:
    """Transfer of the lens at the image's centre for a geometric blur of that diameter, whose sign does not matter."""
    nu, diameter = np.broadcast_arrays(np.asarray(frequency, dtype=float), np.asarray(blur_diameter, dtype=float))
    share = np.minimum(np.abs(nu) * wavelength * lens.principal_distance / lens.pupil_diameter, 1.0)[..., None]
    half = np.arccos(share) / 2.0
    angle = half * (1.0 + _NODES)
    phase = np.pi * (diameter * nu)[..., None] * (np.cos(angle) - share)
    return np.asarray(np.sum(_WEIGHTS * half * np.sin(angle) ** 2 * np.cos(phase), axis=-1) * 4.0 / np.pi)


def pixel_transfer(frequency: ArrayLike, pixel_pitch: float) -> Array:
    """Transfer of a square pixel, evenly sensitive, for a pattern along one of its sides."""
    return np.asarray(np.sinc(np.asarray(frequency, dtype=float) * pixel_pitch))


def modulation_of_design(
    design: Design, matching: MatcherPerformance | None = None, elevations: int = 121
) -> Mapping[ViewName, ViewModulation]:
    """Modulation of both views of a design as focused and stopped down, for patterns of the matcher's scale.

    The periods are angles of elevation in the scene: that of the window is its side, ``matching.window`` pixels of
    360 degrees / ``matching.columns``.
    """
    matcher = matching or MatcherPerformance()
    focus, pitch = focus_of_design(design, elevations), design.camera.pixel_pitch_mm
    row = 2.0 * np.pi / matcher.columns
    of_views: dict[ViewName, ViewFocus] = {"upper": focus.upper, "lower": focus.lower}
    views: dict[ViewName, ViewModulation] = {}
    for name, view in of_views.items():
        slope = np.tan(np.radians(view.elevations_deg))[:, None]
        path = light_path_of_design(design, name)
        # Lens and blur in the perspective image, which the lens's law then stretches, and the frequency with it.
        mm_per_radian = 1.0 / blur_in_scene(path, slope, focus.lens, 1.0)
        along, _ = focus.lens.law.stretch(path.gain * half_angle_tangent(slope, path.sense))
        patterns = []
        for period in (matcher.window * row, FINEST_ROWS * row):
            frequency = 1.0 / (period * mm_per_radian)
            of_lens = lens_transfer(frequency, focus.lens.blur(view.reciprocal_depths), focus.lens)
            patterns.append(of_lens * pixel_transfer(frequency / along, pitch))
        views[name] = ViewModulation(view.elevations_deg, *patterns)
    return views
