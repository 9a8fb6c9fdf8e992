"""What an error of the image's scale does to the depth of a point (docs/theory.md, section 5).

Principal distance, focus setting, temperature and pixel pitch set the scale of an image. Where it is larger by a
relative error epsilon than the design says, every image radius r = f tan(psi) is, and a view that is read by the design
shows a point at the slope

    m + epsilon r / (dr/dm) = m +- epsilon cos(psi) sqrt(1 + m^2)

with + for a direct view and - for a folded one. (A lens of another law than r = f tan(psi) has
r / (dr/dpsi sin(psi)) in the place of cos(psi).) Both views err by the same epsilon, so the two shifts of the disparity
nearly cancel if both are direct, and add up if one is folded. All functions take floats, NumPy arrays or CasADi
symbols.
"""

from __future__ import annotations

from designer.design import Sense
from designer.optics.backend import Scalar, sqrt
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.optics.view import half_angle_tangent


def slope_shift_per_scale(slope: Scalar, gain: Scalar, sense: Sense, law: ImageLaw = PERSPECTIVE) -> Scalar:
    """Change of m = tan(phi) per relative error of the image's scale: r / (dr/dm) = +- cos(psi) sqrt(1 + m^2).

    It does not depend on the principal distance, nor on the sign of the gain. Another law than the perspective one has
    its own share in the place of cos(psi).
    """
    sign = 1.0 if sense == "direct" else -1.0
    if not law.is_perspective:
        return sign * sqrt(1.0 + slope * slope) * law.scale_share(gain * half_angle_tangent(slope, sense))
    squared = (gain * half_angle_tangent(slope, sense)) ** 2
    return sign * sqrt(1.0 + slope * slope) * (1.0 - squared) / (1.0 + squared)


def relative_depth_shift_per_scale(
    elevation_tangent_lower: Scalar,
    elevation_tangent_upper: Scalar,
    gain_lower: Scalar,
    sense_lower: Sense,
    gain_upper: Scalar,
    sense_upper: Sense,
    law: ImageLaw = PERSPECTIVE,
) -> Scalar:
    """(dD / D) / epsilon to first order: the relative error of a point's depth per relative error of the image's scale.

    Parameters
    ----------
    elevation_tangent_lower, elevation_tangent_upper
        tan(phi) at the lower and at the upper viewpoint, as the design has it without an error.
    gain_lower, sense_lower, gain_upper, sense_upper
        The gain kappa and the sense of each view.
    law
        That of the lens.
    """
    shift_lower = slope_shift_per_scale(elevation_tangent_lower, gain_lower, sense_lower, law)
    shift_upper = slope_shift_per_scale(elevation_tangent_upper, gain_upper, sense_upper, law)
    # D = b / (m_l - m_u).
    return (shift_upper - shift_lower) / (elevation_tangent_lower - elevation_tangent_upper)
