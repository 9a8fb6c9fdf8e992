"""Instruments that need not make a stereo system, and rotations to pose their mirrors by."""

from __future__ import annotations

from typing import Any

import numpy as np

from designer.design import Design
from designer.trace.instrument import Instrument, build_instrument
from support.closed_forms import CAMERA


def instrument_of(*mirrors: dict[str, Any], **camera: float) -> Instrument:
    """The instrument of mirrors that need not make a stereo system."""
    view = {"path": [mirrors[0]["name"]], "viewpoint_mm": 1.0, "gain": 0.1, "sense": "direct"}
    views = {"upper": {**view, "elevation_deg": [-1, 1], "zone": "outer"}}
    views["lower"] = {**views["upper"], "viewpoint_mm": 0.0, "zone": "inner"}
    design = Design.model_validate(
        {
            "configuration": "none",
            "camera": {**CAMERA, **camera},
            "mirrors": list(mirrors),
            "views": views,
            "baseline_mm": 1.0,
            "height_mm": 1.0,
            "diameter_mm": 1.0,
            "working_volume": {"elevation_deg": [-1, 1], "distance_mm": [1, 2]},
            "noise_px": 0.1,
        }
    )
    return build_instrument(design)


def rotation_matrix(random: np.random.Generator, largest: float) -> np.ndarray:
    """Rodrigues' formula for a random axis and an angle up to the largest."""
    axis = random.standard_normal(3)
    axis /= np.linalg.norm(axis)
    angle = random.uniform(-largest, largest)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
