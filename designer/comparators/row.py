"""A row of results: what one idea comes to for a requirement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ComparatorStatus = Literal["feasible", "too_large", "infeasible", "failed"]
"""``too_large``: nothing fits into the envelope, and the numbers are those of the smallest that does all else."""


@dataclass(frozen=True, slots=True)
class ComparatorRow:
    """One row of ``comparators.csv``: an idea other than the 44, designed for the same requirement.

    ``depth_error_rms`` is the study's score from traced rays, ``depth_error_worst`` the largest in the working volume.
    ``azimuth_deg`` is what it sees around. ``single_viewpoint_error_mm`` is the diameter of the larger caustic of both
    views. ``focal_length_mm`` is the one engraved on the lens; a lens focused at infinity has no focus distance.
    ``prescription`` are the mirrors in words. Numbers are None where nothing was found; ``reason`` says why.
    """

    comparator: str
    title: str
    status: ComparatorStatus
    reason: str
    cameras: int
    azimuth_deg: float | None = None
    depth_error_rms: float | None = None
    depth_error_worst: float | None = None
    baseline_mm: float | None = None
    height_mm: float | None = None
    diameter_mm: float | None = None
    largest_blur_px: float | None = None
    largest_blur_deg: float | None = None
    single_viewpoint_error_mm: float | None = None
    focal_length_mm: float | None = None
    f_number: float | None = None
    focus_distance_mm: float | None = None
    prescription: str = ""

    @property
    def has_numbers(self) -> bool:
        """Whether there is a design to show."""
        return self.depth_error_rms is not None
