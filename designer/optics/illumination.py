"""How much light a view has in the image; floats, NumPy arrays or CasADi symbols."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.optics.backend import Scalar


def relative_illumination(
    cosine: Scalar, reflections: int | NDArray[np.intp], mirror_reflectivity: Scalar, stretched_area: Scalar = 1.0
) -> Scalar:
    """Share of the light on the axis that reaches an image point: 1 on the axis, without mirrors.

    The fourth power of the cosine of the angle psi between ray and axis, as a flat pupil and a flat sensor have it (one
    cosine for the pupil seen from aside, three for the solid angle that a pixel sees), and one reflectivity for each
    mirror. A lens that stretches its image against a perspective one spreads the light over the ``stretched_area``,
    the product of its two stretches (:meth:`designer.optics.image_law.ImageLaw.stretch`).
    """
    squared = cosine * cosine
    return mirror_reflectivity**reflections * squared * squared / stretched_area
