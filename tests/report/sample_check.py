"""A check's folder with errors of known size, so that the report's pages can be tested without rendering."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from designer.design import Design
from designer.imaging.endtoend.check_files import fingerprint
from designer.imaging.endtoend.description import definition_of_passing
from designer.imaging.images import write_arrays, write_image

ROWS, COLUMNS = 60, 720
PREDICTED, BIAS = 0.01, 0.002


def write_sample_check(folder: Path, design: Design, *, passed: bool = True) -> None:
    """Distances spread over the working volume, measured with a normal error of ``PREDICTED`` about ``BIAS``."""
    random = np.random.default_rng(5)
    near, far = design.working_volume.distance_mm
    true = np.exp(random.uniform(np.log(near), np.log(far), (ROWS, COLUMNS)))
    measured = true * (1.0 + BIAS + PREDICTED * random.standard_normal(true.shape))
    outcome = (random.random(true.shape) < 0.1).astype(np.uint8) * 3
    measured[outcome > 0] = np.nan
    low, high = design.working_volume.elevation_deg
    elevation = np.linspace(high, low, ROWS)
    folder.mkdir(parents=True)
    for name, shape in (("raw", (120, 160)), ("upper", true.shape), ("lower", true.shape)):
        write_image(folder / f"{name}.png", random.integers(0, 256, shape).astype(np.uint8))
    write_arrays(
        folder / "check.npz",
        {
            "disparity": np.where(outcome > 0, np.nan, 100.0 * near / true),
            "outcome": outcome,
            "distance_mm": measured,
            "true_distance_mm": true,
            "predicted": np.full(true.shape, PREDICTED),
            "both_see": np.ones(true.shape, dtype=bool),
            "azimuth_deg": np.linspace(179.75, -179.75, COLUMNS),
            "elevation_upper_deg": elevation,
            "elevation_lower_deg": elevation,
        },
    )
    band = {
        "distance_mm": [near, far],
        "pixels": true.size,
        "textured": true.size,
        "kept": 0.9,
        "bias": BIAS,
        "bias_bound": 0.01,
        "error_ratio": 1.0 if passed else 2.0,
        "predicted": PREDICTED,
        "judged": True,
        "problems": [] if passed else ["error ratio"],
    }
    nobody = dict.fromkeys(("kept", "bias", "error_ratio", "predicted")) | {"judged": False, "pixels": 3}
    verdict = {
        "configuration": design.configuration,
        "scene": "office",
        "texture": "rich",
        "noise_px": {"median": 0.05, "least": 0.04, "largest": 0.07},
        "bands": [band, band | nobody],
        "definition": definition_of_passing(),
        "passed": passed,
        "design_sha256": fingerprint(design),
    }
    (folder / "check.json").write_text(json.dumps(verdict), encoding="utf-8")
