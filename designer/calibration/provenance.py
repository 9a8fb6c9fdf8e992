"""What a calibrated design file says of itself: departures with their uncertainty, residuals, inputs."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
from pydantic import JsonValue

from designer.calibration.calibrate import CalibratedSensor
from designer.calibration.findings import depth_uncertainty, residuals_by_region, residuals_by_view, still_open
from designer.calibration.target import Target
from designer.design import Design
from designer.files import as_json
from designer.own_files import described_inputs, described_run

OF_95_PERCENT = 1.959963984540054
KEY = "calibration"


def calibrated_design(found: CalibratedSensor, target: Target, inputs: Mapping[str, Path]) -> Design:
    """The design with its ``as_built`` table, and a table ``calibration`` of how that was found."""
    return found.design.model_copy(update={KEY: _record(found, target, inputs)})


def _record(found: CalibratedSensor, target: Target, inputs: Mapping[str, Path]) -> dict[str, JsonValue]:
    unknowns, adjusted = found.unknowns, found.adjusted
    free = np.flatnonzero(unknowns.free)
    return {
        "departures": [
            {
                "part": unknowns.parameters[place].part,
                "key": unknowns.parameters[place].key,
                "value": float(adjusted.values[place]),
                "standard_deviation": float(found.sigma[place]),
                "before": float(unknowns.prior_sigma[place]),
            }
            for place in free
        ],
        "covariance": [[float(value) for value in row] for row in adjusted.covariance[np.ix_(free, free)]],
        "poorly_determined": list(still_open(unknowns, found.sigma)),
        "noise_px": {str(view): noise for view, noise in adjusted.noise_px.items()},
        "residual_px": {str(view): rms for view, rms in residuals_by_view(found.sightings, adjusted).items()},
        "depth_uncertainty": depth_uncertainty(found.design.model_copy(update={"as_built": None}), adjusted),
        "residuals": as_json(residuals_by_region(found.design, found.sightings, adjusted)),
        "target": target.model_dump(),
        "images_used": [place + 1 for place in found.images],
        "provenance": {
            **described_run({"numpy": np.__version__, "scipy": version("scipy"), "opencv": cv2.__version__}),
            "inputs": described_inputs(inputs),
        },
    }
