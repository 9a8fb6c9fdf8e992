"""What each pixel of a rendered image truly shows, as a file."""

from __future__ import annotations

from pathlib import Path

from designer.imaging.images import write_arrays
from designer.imaging.render.raytracing import GroundTruth


def write_truth(path: Path, truth: GroundTruth) -> None:
    """Write a ground truth as .npz: ``view``, ``point_mm``, ``distance_mm`` and ``surface``, each of image shape."""
    fields = ("view", "point_mm", "distance_mm", "surface")
    write_arrays(path, {name: getattr(truth, name) for name in fields})
