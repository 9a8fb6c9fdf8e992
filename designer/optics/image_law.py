"""How a lens images angles: the law from psi at the entrance pupil to the image radius (docs/theory.md, section 10).

    perspective     r = f x (1 + k1 x^2 + k2 x^4 + k3 x^6),             x = tan(psi)
    equidistant     r = f psi (1 + k1 psi^2 + k2 psi^4 + k3 psi^6 + k4 psi^8)
    equisolid       r = 2 f sin(psi/2)
    stereographic   r = 2 f tan(psi/2)

f is the principal distance, the scale of the image at its centre. With coefficients the first is OpenCV's pinhole model
(radial part) and the second OpenCV's fisheye model. A lens that is not perspective is taken as a thin lens whose image
is stretched afterwards: the plane in focus stays a plane, and the blur of a point, round in the perspective image, is
stretched along the radius and across it by different amounts.

Everything is written in T = tan(psi/2), which the gain law gives, and is odd or even in T, so that views of negative
gain need no case of their own. Functions take floats, NumPy arrays or CasADi symbols, except for those that invert a
law with coefficients or look for its end, which take floats and arrays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Projection
from designer.optics.backend import Scalar, absolute, arctan, maximum, sqrt, tan

Array = NDArray[np.float64]

WIDEST_ANGLE = math.radians(85.0)
"""Beyond this angle no law is used: the thin lens's flat pupil is seen edge-on at 90 degrees."""
# A law is used where its radius still rises this much farther out in tan(psi/2): optimisers look beyond an edge.
_SPARE = 1.03
# Angles at which the end and the extremes of a law are looked for, and steps of Newton's method from a cell of them.
_SAMPLES = 4097
_NEWTON_STEPS = 4
# Added to T where 0 / 0 would stand for a limit; lost in rounding elsewhere.
_NOTHING = 1e-150


@dataclass(frozen=True, slots=True)
class ImageLaw:
    """A projection and its coefficients; the perspective lens without any is ``PERSPECTIVE``."""

    projection: Projection = "perspective"
    coefficients: tuple[float, ...] = ()

    @property
    def is_perspective(self) -> bool:
        """Whether r = f tan(psi)."""
        return self.projection == "perspective" and not any(self.coefficients)

    @property
    def widest(self) -> float:
        """Largest angle psi (rad) that is used: a little before the image radius stops rising, or ``WIDEST_ANGLE``."""
        return WIDEST_ANGLE if self.is_perspective else _end_of(self)

    def ratio(self, half_tangent: Scalar) -> Scalar:
        """Image radius over principal distance, r / f, at T = tan(psi/2)."""
        if self.projection == "equisolid":
            return 2.0 * half_tangent / sqrt(1.0 + half_tangent * half_tangent)
        if self.projection == "stereographic":
            return 2.0 * half_tangent
        undistorted = self._undistorted(half_tangent)
        return undistorted * self._polynomial(undistorted * undistorted, False) if self.coefficients else undistorted

    def ratio_slope(self, half_tangent: Scalar) -> Scalar:
        """d(r / f) / dpsi per radian at T = tan(psi/2)."""
        squared = half_tangent * half_tangent
        if self.projection == "equisolid":
            return 1.0 / sqrt(1.0 + squared)
        if self.projection == "stereographic":
            return 1.0 + squared
        secant = (1.0 + squared) / (1.0 - squared)
        steepness = secant * secant if self.projection == "perspective" else 1.0
        undistorted = self._undistorted(half_tangent)
        return steepness * self._polynomial(undistorted * undistorted, True)

    def half_tangent(self, ratio: Scalar) -> Scalar:
        """T = tan(psi/2) of the ray that is imaged at r / f; keeps the sign of r.

        Beyond ``widest`` it stays there. A law with coefficients is inverted for floats and arrays only.
        """
        if self.is_perspective:
            return ratio / (1.0 + sqrt(1.0 + ratio * ratio))
        return _inverted(self, ratio)

    def stretch(self, half_tangent: Scalar) -> tuple[Scalar, Scalar]:
        """How far the image is stretched against a perspective one, along the radius and across it; 1 at the centre."""
        if self.is_perspective:
            return 1.0, 1.0
        shifted = half_tangent + _NOTHING
        squared = shifted * shifted
        cosine = (1.0 - squared) / (1.0 + squared)
        across = self.ratio(shifted) * (1.0 - squared) / (2.0 * shifted)
        return self.ratio_slope(half_tangent) * cosine * cosine, across

    def largest_stretch(self, half_tangent: Scalar) -> Scalar:
        """The larger of the two stretches: what the larger diameter of a blur is stretched by."""
        if self.is_perspective:
            return 1.0
        along, across = self.stretch(half_tangent)
        return maximum(absolute(along), absolute(across))

    def scale_share(self, half_tangent: Scalar) -> Scalar:
        """What a relative error of the image's scale is worth in psi, over sin(psi): r / (dr/dpsi sin(psi)).

        cos(psi) for a perspective lens, 1 for a stereographic one, psi / sin(psi) for an equidistant one.
        """
        shifted = half_tangent + _NOTHING
        squared = shifted * shifted
        if self.is_perspective:
            return (1.0 - squared) / (1.0 + squared)
        return self.ratio(shifted) * (1.0 + squared) / (self.ratio_slope(half_tangent) * 2.0 * shifted)

    def _undistorted(self, half_tangent: Scalar) -> Scalar:
        """What the coefficients' polynomial is one of: tan(psi) or psi."""
        if self.projection == "perspective":
            return 2.0 * half_tangent / (1.0 - half_tangent * half_tangent)
        return 2.0 * arctan(half_tangent)

    def _polynomial(self, squared: Scalar, is_derivative: bool) -> Scalar:
        """1 + k1 s + k2 s^2 ..., or what it becomes when x (1 + k1 x^2 ...) is differentiated by x, s = x^2."""
        value = 0.0 * squared
        for place in range(len(self.coefficients), 0, -1):
            weight = 2 * place + 1 if is_derivative else 1
            value = (value + weight * self.coefficients[place - 1]) * squared
        return 1.0 + value


PERSPECTIVE = ImageLaw()
"""r = f tan(psi)."""


def image_law_of(camera: Camera) -> ImageLaw:
    """The law of a design's camera."""
    return ImageLaw(camera.projection, camera.distortion)


@dataclass(frozen=True, slots=True)
class MostFavourableLaw(ImageLaw):
    """A law that nowhere images more coarsely than a lens does at that angle or at any smaller one.

    For bounds: d(r / f) / dpsi times sin(psi) is the largest, and the scale's share the smallest, of all angles up to
    psi (floats and arrays). Image radii are the lens's own.
    """

    @property
    def _own(self) -> ImageLaw:
        return ImageLaw(self.projection, self.coefficients)

    def ratio_slope(self, half_tangent: Scalar) -> Scalar:
        """The largest d(r / f) / dpsi sin(psi) up to psi, over sin(psi)."""
        size = np.abs(half_tangent) + _NOTHING
        angles, most, _ = _extremes_of(self._own)
        angle = 2.0 * np.arctan(size)
        below = np.searchsorted(angles, angle, side="right") - 1
        return np.maximum(most[below] / np.sin(angle), self._own.ratio_slope(size))

    def stretch(self, half_tangent: Scalar) -> tuple[Scalar, Scalar]:
        """The lens's own."""
        return self._own.stretch(half_tangent)

    def scale_share(self, half_tangent: Scalar) -> Scalar:
        """The smallest share up to psi."""
        size = np.abs(half_tangent)
        angles, _, least = _extremes_of(self._own)
        below = np.searchsorted(angles, 2.0 * np.arctan(size), side="right") - 1
        return np.minimum(least[below], self._own.scale_share(size))


def most_favourable(law: ImageLaw) -> ImageLaw:
    """The law itself if it is perspective, where larger angles are the better throughout; else the bound to it."""
    return law if law.is_perspective else MostFavourableLaw(law.projection, law.coefficients)


@lru_cache(maxsize=64)
def _end_of(law: ImageLaw) -> float:
    """The angle up to which a law is used: where the radius stops rising, by samples and then by halving their step."""
    angles = np.linspace(0.0, WIDEST_ANGLE, _SAMPLES)
    falls = np.flatnonzero(~(law.ratio_slope(np.tan(angles / 2.0)) > 0.0))
    if not falls.size:
        return WIDEST_ANGLE
    low, high = float(angles[max(falls[0] - 1, 0)]), float(angles[falls[0]])
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if law.ratio_slope(math.tan(middle / 2.0)) > 0.0 else (low, middle)
    return 2.0 * math.atan(math.tan(low / 2.0) / _SPARE)


@lru_cache(maxsize=64)
def _table_of(law: ImageLaw) -> tuple[Array, Array]:
    """Angles up to the end of a law, and r / f there."""
    angles = np.linspace(0.0, law.widest, _SAMPLES)
    return angles, np.asarray(law.ratio(np.tan(angles / 2.0)), dtype=float)


@lru_cache(maxsize=64)
def _extremes_of(law: ImageLaw) -> tuple[Array, Array, Array]:
    """Angles, and the largest d(r / f) / dpsi sin(psi) and the smallest share of the scale up to each of them."""
    angles, _ = _table_of(law)
    tangents = np.tan(angles / 2.0)
    gain = law.ratio_slope(tangents) * np.sin(angles)
    return angles, np.maximum.accumulate(gain), np.minimum.accumulate(law.scale_share(tangents))


def _inverted(law: ImageLaw, ratio: Scalar) -> Scalar:
    """T from r / f: in closed form, or by Newton's method from a table, and no farther than the law's end."""
    size = np.minimum(np.abs(np.asarray(ratio, dtype=float)), _table_of(law)[1][-1])
    if law.projection == "equisolid":
        tangent = np.tan(np.arcsin(size / 2.0))
    elif law.projection == "stereographic":
        tangent = size / 2.0
    elif law.projection == "equidistant" and not any(law.coefficients):
        tangent = np.tan(size / 2.0)
    else:
        angles, ratios = _table_of(law)
        angle = np.interp(size, ratios, angles)
        for _ in range(_NEWTON_STEPS):
            tangent = np.tan(angle / 2.0)
            step = (law.ratio(tangent) - size) / np.maximum(law.ratio_slope(tangent), 1e-12)
            angle = np.clip(angle - step, 0.0, law.widest)
        tangent = np.tan(angle / 2.0)
    signed = np.copysign(tangent, ratio)
    return float(signed) if np.ndim(signed) == 0 else signed


def pinhole_tangent(half_tangent: Scalar) -> Scalar:
    """tan(psi) from T = tan(psi/2)."""
    return 2.0 * half_tangent / (1.0 - half_tangent * half_tangent)


def widest_half_tangent(law: ImageLaw) -> float:
    """tan(psi/2) at the end of a law."""
    return float(tan(law.widest / 2.0))
