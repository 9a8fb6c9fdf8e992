"""One view as four numbers: viewpoint height, sense, gain and principal distance (docs/theory.md, section 4).

A lens that is not r = f tan(psi) adds its law (:mod:`designer.optics.image_law`); without one, it is perspective.

A direct view obeys tan(psi/2) = kappa tan(pi/4 + phi/2), a folded one tan(psi/2) = kappa tan(pi/4 - phi/2), where
psi is the angle of a ray at the pinhole from +z and phi the elevation at the effective viewpoint. With m = tan(phi)
the half-angle tangent is sqrt(1 + m^2) +- m, so nothing here needs an inverse trigonometric function.
All functions take floats, NumPy arrays or CasADi symbols; lengths in mm, angles in radians.
"""

from __future__ import annotations

from designer.design import PerView, Sense
from designer.optics.backend import Scalar, sqrt
from designer.optics.image_law import PERSPECTIVE, ImageLaw


def half_angle_tangent(elevation_tangent: Scalar, sense: Sense) -> Scalar:
    """Positive t = tan(pi/4 +- phi/2) from m = tan(phi): + for a direct view, - for a folded one."""
    sign = 1.0 if sense == "direct" else -1.0
    return sqrt(1.0 + elevation_tangent * elevation_tangent) + sign * elevation_tangent


def elevation_tangent(half_angle_tangent: Scalar, sense: Sense) -> Scalar:
    """Slope m = tan(phi) from t = tan(pi/4 +- phi/2); inverse of :func:`half_angle_tangent`."""
    sign = 1.0 if sense == "direct" else -1.0
    return sign * (half_angle_tangent - 1.0 / half_angle_tangent) / 2.0


def image_radius(
    elevation_tangent: Scalar, gain: Scalar, principal_distance: Scalar, sense: Sense, law: ImageLaw = PERSPECTIVE
) -> Scalar:
    """Signed image radius in mm, f tan(psi) unless the law is another, of a direction with slope m = tan(phi).

    Negative for a view of negative gain: the image lies on the other side of the axis.
    """
    half_tangent = gain * half_angle_tangent(elevation_tangent, sense)
    if law.is_perspective:
        return principal_distance * 2.0 * half_tangent / (1.0 - half_tangent * half_tangent)
    return principal_distance * law.ratio(half_tangent)


def image_radius_slope(
    elevation_tangent: Scalar, gain: Scalar, principal_distance: Scalar, sense: Sense, law: ImageLaw = PERSPECTIVE
) -> Scalar:
    """Signed dr/dphi in mm per radian: dr/dpsi kappa (1 + t^2) / (1 + kappa^2 t^2), negative when folded.

    dr/dpsi is f sec^2(psi) unless the law is another.
    """
    sign = 1.0 if sense == "direct" else -1.0
    tangent = half_angle_tangent(elevation_tangent, sense)
    squared = (gain * tangent) ** 2
    if law.is_perspective:
        return sign * principal_distance * gain * (1.0 + tangent**2) * (1.0 + squared) / (1.0 - squared) ** 2
    steepness = principal_distance * law.ratio_slope(gain * tangent)
    return sign * steepness * gain * (1.0 + tangent**2) / (1.0 + squared)


def image_half_tangent(image_radius: Scalar, principal_distance: Scalar, law: ImageLaw = PERSPECTIVE) -> Scalar:
    """tan(psi/2) of the ray through image radius r, f tan(psi) unless the law is another; keeps the sign of r."""
    ratio = image_radius / principal_distance
    return ratio / (1.0 + sqrt(1.0 + ratio * ratio)) if law.is_perspective else law.half_tangent(ratio)


def elevation_tangents_of_views(
    elevation_tangents: tuple[Scalar, Scalar], distances: tuple[Scalar, Scalar], baseline: Scalar
) -> PerView[tuple[Scalar, Scalar]]:
    """The ranges of tan(phi) that the two viewpoints need to see a working volume (docs/theory.md, section 5).

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
    (low, high) of each view.
    """
    low, high = elevation_tangents
    near, far = distances
    half = baseline / 2.0
    return PerView(
        upper=(low - half / near, high - half / far),
        lower=(low + half / far, high + half / near),
    )
