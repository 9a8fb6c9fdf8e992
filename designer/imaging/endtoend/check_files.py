"""A check's folder: what an end-to-end check saw and measured, for the report and for anyone else.

``raw.png`` (what the camera recorded), ``upper.png`` and ``lower.png`` (panoramas), ``check.npz`` (maps of the upper
panorama, (rows, columns)) and ``check.json`` (the verdict), written last.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from designer.design import Design
from designer.files import make_folder, write_atomically
from designer.imaging.endtoend.check import EndToEndCheck
from designer.imaging.endtoend.description import CheckSummary, summarise_check
from designer.imaging.images import write_arrays, write_image

VERDICT = "check.json"


class CheckFile(CheckSummary):
    """What ``check.json`` holds: the check's numbers, whose design it was, and what became of the pixels (shares).

    ``kept_of_pinhole`` is the number of points as a share of those found through a pinhole, None if there are none.
    """

    kept_of_pinhole: float | None
    design_sha256: str
    outcomes: dict[str, float]


def write_check(check: EndToEndCheck, folder: Path) -> CheckFile:
    """Write the folder of a check through a lens but for the verdict, which is returned.

    It waits for the check through a pinhole, of which only how many points it found counts.
    """
    make_folder(folder)
    (folder / VERDICT).unlink(missing_ok=True)
    write_image(folder / "raw.png", check.raw)
    write_image(folder / "upper.png", check.upper)
    write_image(folder / "lower.png", check.lower)
    grid = check.rig.grid
    rows = np.arange(grid.rows)
    write_arrays(
        folder / "check.npz",
        {
            "disparity": check.matches.disparities.T.astype(np.float16),
            "outcome": check.matches.outcomes.T,
            "distance_mm": check.matches.distances_mm.T.astype(np.float32),
            "true_distance_mm": check.true_distance_mm.T.astype(np.float32),
            "predicted": check.predicted.T.astype(np.float16),
            "both_see": check.both_see.T,
            "azimuth_deg": np.degrees(grid.azimuth(np.arange(grid.columns))),
            "elevation_upper_deg": np.degrees(np.arctan(grid.slope("upper", rows))),
            "elevation_lower_deg": np.degrees(np.arctan(grid.slope("lower", rows))),
        },
    )
    return {
        **summarise_check(check),
        "kept_of_pinhole": None,
        "design_sha256": fingerprint(check.rig.design),
        "outcomes": check.matches.fractions,
    }


def write_verdict(verdict: CheckFile, kept_of_pinhole: float | None, folder: Path) -> None:
    """Complete the folder of a check."""
    content = verdict | {"kept_of_pinhole": kept_of_pinhole}
    write_atomically(folder / VERDICT, json.dumps(content, indent=2, allow_nan=False) + "\n")


def fingerprint(design: Design) -> str:
    """A hash of a design's content, which tells whether a check belongs to it."""
    record = design.model_dump(mode="json", by_alias=True)
    if not record["scale_uncertainty"]:
        # Designs of before it was counted keep the hash by which their checks know them.
        del record["scale_uncertainty"]
    content = json.dumps(record, sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()
