"""One view as four numbers: viewpoint height, sense, gain and principal distance (design notes, section 2).

A direct view obeys tan(psi/2) = kappa tan(pi/4 + phi/2), a folded one tan(psi/2) = kappa tan(pi/4 - phi/2), where
psi is the angle of a ray at the pinhole from +z and phi the elevation at the effective viewpoint. With m = tan(phi)
the half-angle tangent is sqrt(1 + m^2) +- m, so nothing here needs an inverse trigonometric function.
All functions take floats, NumPy arrays or CasADi symbols; lengths in mm, angles in radians.
"""

from __future__ import annotations

from designer.design import Sense
from designer.optics.backend import Scalar, sqrt


def half_angle_tangent(elevation_tangent: Scalar, sense: Sense) -> Scalar:
    """Positive t = tan(pi/4 +- phi/2) from m = tan(phi): + for a direct view, - for a folded one."""
    sign = 1.0 if sense == "direct" else -1.0
    return sqrt(1.0 + elevation_tangent * elevation_tangent) + sign * elevation_tangent


def elevation_tangent(half_angle_tangent: Scalar, sense: Sense) -> Scalar:
    """Slope m = tan(phi) from t = tan(pi/4 +- phi/2); inverse of :func:`half_angle_tangent`."""
    sign = 1.0 if sense == "direct" else -1.0
    return sign * (half_angle_tangent - 1.0 / half_angle_tangent) / 2.0


def image_radius(elevation_tangent: Scalar, gain: Scalar, principal_distance: Scalar, sense: Sense) -> Scalar:
    """Signed image radius r = f tan(psi) in mm of a direction with slope m = tan(phi).

    Negative for a view of negative gain: the image lies on the other side of the axis.
    """
    half_tangent = gain * half_angle_tangent(elevation_tangent, sense)
    return principal_distance * 2.0 * half_tangent / (1.0 - half_tangent * half_tangent)


def image_radius_slope(elevation_tangent: Scalar, gain: Scalar, principal_distance: Scalar, sense: Sense) -> Scalar:
    """Signed dr/dphi in mm per radian: f sec^2(psi) kappa (1 + t^2) / (1 + kappa^2 t^2), negative when folded."""
    sign = 1.0 if sense == "direct" else -1.0
    tangent = half_angle_tangent(elevation_tangent, sense)
    squared = (gain * tangent) ** 2
    return sign * principal_distance * gain * (1.0 + tangent**2) * (1.0 + squared) / (1.0 - squared) ** 2


def image_half_tangent(image_radius: Scalar, principal_distance: Scalar) -> Scalar:
    """tan(psi/2) of the ray through image radius r = f tan(psi); keeps the sign of r."""
    ratio = image_radius / principal_distance
    return ratio / (1.0 + sqrt(1.0 + ratio * ratio))


def elevation_tangents_of_views(
    elevation_tangents: tuple[Scalar, Scalar], distances: tuple[Scalar, Scalar], baseline: Scalar
) -> tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]:
    """The ranges of tan(phi) that the two viewpoints need to see a working volume (design notes, section 5).

    The volume's corners decide: the upper viewpoint, b/2 above the middle, sees the bottom of the near wall
    steepest and the top of the far wall highest; the lower viewpoint the reverse.

    Parameters
    ----------
    elevation_tangents
        Lowest and highest tan(elevation), seen from the middle of the baseline.
    distances
        Nearest and farthest horizontal distance from the axis, mm.
    baseline
        Height of the upper viewpoint above the lower one, mm, positive.

    Returns
    -------
    (low, high) of the upper view, then (low, high) of the lower view.
    """
    low, high = elevation_tangents
    near, far = distances
    half = baseline / 2.0
    return (low - half / near, high - half / far), (low + half / far, high + half / near)
