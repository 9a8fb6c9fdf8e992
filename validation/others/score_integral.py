"""The depth error's definition integrated by SciPy: python -m validation.others.score_integral.

A folded lower view of gain 0.046 and a direct upper one of gain 0.11, 100 mm apart, f = 12 mm, noise 0.00044 mm,
elevations -16 to 16 degrees uniform, distances 1 to 5 m uniform in their logarithm.
"""

import numpy as np
import scipy
from scipy.integrate import dblquad

BASELINE, F, NOISE = 100.0, 12.0, 0.00044


def radius(slope: float, gain: float, sign: float) -> float:
    """Image radius f tan(psi), by angles: tan(psi / 2) = gain tan(45 deg +- phi / 2)."""
    return F * np.tan(2.0 * np.arctan(gain * np.tan(np.pi / 4.0 + sign * np.arctan(slope) / 2.0)))


def slope_noise(slope: float, gain: float, sign: float) -> float:
    step = 1e-3
    r = [radius(slope + k * step, gain, sign) for k in (-2, -1, 1, 2)]
    return NOISE / ((r[0] - 8.0 * r[1] + 8.0 * r[2] - r[3]) / (12.0 * step))


def squared(log_distance: float, elevation: float) -> float:
    distance = np.exp(log_distance)
    middle = np.tan(elevation)
    lower, upper = middle + BASELINE / (2.0 * distance), middle - BASELINE / (2.0 * distance)
    noise = np.hypot(slope_noise(lower, 0.046, -1.0), slope_noise(upper, 0.11, 1.0))
    return (distance / BASELINE * noise) ** 2


limits = np.radians([-16.0, 16.0]), np.log([1000.0, 5000.0])
total, _ = dblquad(squared, *limits[0], *limits[1], epsabs=1e-16, epsrel=1e-12)
print("SciPy", scipy.__version__)
print(f"score {np.sqrt(total / np.ptp(limits[0]) / np.ptp(limits[1])):.12f}")
