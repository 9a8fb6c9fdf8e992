"""The lens as a thin lens in its entrance pupil: 1 / f0 = 1 / u + 1 / f (docs/theory.md, section 1).

f0 is the nominal focal length, u the distance from the pupil at which the lens is focused, f the principal distance:
how far the image plane lies behind the pinhole, as in r = f tan(psi). All functions take floats, NumPy arrays or
CasADi symbols; lengths in mm. An infinite u is a lens focused at infinity, f = f0.
"""

from __future__ import annotations

from designer.optics.backend import Scalar


def principal_distance(nominal_focal_length: Scalar, focus_distance: Scalar) -> Scalar:
    """Principal distance f = f0 u / (u - f0); the focus distance must exceed the focal length."""
    return nominal_focal_length / (1.0 - nominal_focal_length / focus_distance)


def nominal_focal_length(principal_distance: Scalar, focus_distance: Scalar) -> Scalar:
    """Nominal focal length f0 = f u / (f + u); undoes :func:`principal_distance` but for rounding."""
    return principal_distance / (1.0 + principal_distance / focus_distance)


def pupil_radius(nominal_focal_length: Scalar, f_number: Scalar) -> Scalar:
    """Radius of the entrance pupil: f0 / (2 N)."""
    return nominal_focal_length / (2.0 * f_number)
