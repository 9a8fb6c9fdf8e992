"""How sharp the images must be."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from designer.evaluate.focus import SHARP_BLUR_DEG
from designer.requirement.part import Part
from designer.requirement.quantity import DesignQuantity, Quantity


class Sharpness(Part):
    """How much blur is allowed: diameters of the blur of a point, at every elevation and distance of the volume."""

    max_blur_deg: Annotated[
        float,
        DesignQuantity(0.01, 90, "degrees", may_be_infinite=True, shown_step=0.1),
        Field(
            title="blur in the scene, at most",
            default=SHARP_BLUR_DEG,
            description="Largest blur as an angle in the scene: finer detail is lost to matching. A design for the "
            "paper's requirement keeps nine tenths of a pinhole's points at 0.5 degrees, and half at 1. Default: 0.5.",
        ),
    ]
    max_blur_px: Annotated[
        float,
        DesignQuantity(0.1, 10_000, "pixels", may_be_infinite=True),
        Field(
            title="blur on the sensor, at most",
            default=math.inf,
            description="Largest blur on the sensor. Default: inf, no limit beside that of the angle.",
        ),
    ]
    least_light_percent: Annotated[
        float,
        Quantity(0, 100, "percent"),
        Field(
            title="light of the pupil, at least",
            default=90.0,
            description="Smallest share of a scene point's light that must clear all edges, at both ends of each "
            "view's range; the ray tracer rejects a design with less. Default: 90.",
        ),
    ]
