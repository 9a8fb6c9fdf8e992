"""What a requirement allows but its author may not expect, as sentences."""

from __future__ import annotations

import math

from designer.requirement.camera import Camera
from designer.requirement.model import Requirement


def notes_on(requirement: Requirement) -> list[str]:
    """Sentences about a valid requirement that a person should read before its results."""
    camera = requirement.camera
    lost = lost_azimuths(camera)
    if not lost:
        return []
    shorter = min(camera.width_px, camera.height_px) / 2
    return [
        f"camera.image_circle_radius_px = {camera.image_circle_radius_px:g} is greater than half the shorter image "
        f"side ({shorter:g} px): at the rim of the image circle {100 * lost:.2g} % of all azimuths lie beyond the "
        "sensor"
    ]


def lost_azimuths(camera: Camera) -> float:
    """The share of azimuths that the sensor does not hold at the rim of the image circle."""
    radius = camera.image_circle_radius_px
    sides = (camera.width_px, camera.height_px)
    return 2.0 / math.pi * sum(math.acos(min(1.0, side / 2.0 / radius)) for side in sides)
