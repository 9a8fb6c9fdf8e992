"""Random requirements, most of them unusual: steep views, long baselines in flat boxes, near fields, fixed viewpoints.

Written as an engineer might ask: none is known to be possible.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from designer.requirement import Requirement


def random_requirement(random: np.random.Generator) -> Requirement:
    """A requirement with 0.1 px of noise and one lens; a third of them fix a viewpoint or a gain."""
    near = float(np.exp(random.uniform(np.log(120.0), np.log(5000.0))))
    baseline = float(np.exp(random.uniform(np.log(20.0), np.log(250.0))))
    height = float(np.exp(random.uniform(np.log(50.0), np.log(450.0))))
    diameter = float(np.exp(random.uniform(np.log(50.0), np.log(300.0))))
    near = max(near, 0.6 * diameter)
    middle = float(random.choice([0.0, random.uniform(-65.0, 65.0)], p=[0.3, 0.7]))
    span = float(random.uniform(3.0, min(40.0, 2.0 * (80.0 - abs(middle)))))
    focal_length = float(np.exp(random.uniform(np.log(3.0), np.log(16.0))))
    radius = float(random.uniform(4.0, 12.0))
    asked: dict[str, Any] = {
        "name": "random",
        "baseline_mm": baseline if random.random() < 0.8 else [0.6 * baseline, 1.6 * baseline],
        "noise_px": 0.1,
        "scale_uncertainty_percent": 0,
        "working_volume": {
            "elevation_deg": [middle - span / 2.0, middle + span / 2.0],
            "distance_mm": [near, near * float(random.uniform(1.3, 5.0))],
        },
        "envelope": {"height_mm": height, "diameter_mm": diameter},
        "camera": {
            "width_px": 2048,
            "height_px": 1536,
            "pixel_pitch_mm": 0.00345,
            "body_radius_mm": radius + float(random.uniform(0.0, 10.0)),
            "nearest_mirror_mm": float(random.uniform(5.0, 25.0)),
            "lens": {
                "focal_length_mm": focal_length,
                "nearest_focus_mm": 100,
                "f_number": float(random.choice([4.0, 8.0, 128.0])),
                "radius_mm": radius,
                "front_mm": float(random.uniform(0.0, 8.0)),
                "length_mm": float(random.uniform(8.0, 25.0)),
            },
        },
        "sharpness": {"max_blur_deg": float(random.choice([0.5, math.inf], p=[0.3, 0.7]))},
        "manufacture": {
            "substrate_thickness_mm": float(random.uniform(0.5, 3.0)),
            "largest_slope_deg": float(random.uniform(65.0, 85.0)),
            "smallest_mirror_radius_mm": float(random.choice([0.0, 5.0])),
        },
        "objective": {
            "minimise": str(random.choice(["depth_error", "height"], p=[0.7, 0.3])),
            "then": "diameter",
            "within_percent": 1.0,
        },
    }
    if random.random() < 0.33:
        view = str(random.choice(["lower", "upper"]))
        low, high = (-0.5, 1.5) if view == "lower" else (0.2, 2.0)
        asked["fixed"] = {"view": {view: {"viewpoint_mm": height * float(random.uniform(low, high))}}}
    return Requirement.model_validate(asked)
