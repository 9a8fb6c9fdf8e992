"""What a requirement asks of a comparator with one of its lenses, and the variables of that lens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.comparators.head import camera_with
from designer.design import Camera
from designer.evaluate.depth import Volume
from designer.evaluate.predicted_noise import Conditions
from designer.optimise.limit import conditions_of, volume_of
from designer.optimise.required_numbers import specification_of
from designer.requirement import Lens, Requirement
from designer.trace.image_law import pinhole_angle

Bounds = tuple[float, float]
SMALLEST_BASELINE = 0.02
"""The baseline may be smaller than what is asked for, down to this share, where that is all an envelope can hold."""
FREE_SIZES = 4.0


@dataclass(frozen=True, slots=True)
class Asked:
    """A requirement with one of its lenses, as the optimiser of the 44 knows it; mm and radians.

    ``baselines`` are the least and the greatest baseline.
    """

    requirement: Requirement
    lens: Lens
    conditions: Conditions
    volume: Volume
    baselines: Bounds

    @classmethod
    def of(cls, requirement: Requirement, lens: Lens) -> Asked:
        """What a requirement asks with one of its lenses."""
        specification = specification_of(requirement, lens)
        greatest = requirement.baseline_range_mm[1]
        return cls(
            requirement,
            lens,
            conditions_of(specification),
            volume_of(specification),
            (SMALLEST_BASELINE * greatest, greatest),
        )

    def without_envelope(self) -> Asked:
        """The same in an envelope as large as need be, with the baseline that is asked for."""
        envelope = self.requirement.envelope
        larger = envelope.model_copy(
            update={
                "height_mm": FREE_SIZES * envelope.height_mm,
                "diameter_mm": FREE_SIZES * envelope.diameter_mm,
            }
        )
        freed = self.requirement.model_copy(update={"envelope": larger})
        return replace(self, requirement=freed, baselines=self.requirement.baseline_range_mm)

    @property
    def scale_uncertainty(self) -> float:
        """Relative standard uncertainty of the scale of an image."""
        return self.requirement.scale_uncertainty_percent / 100.0

    @property
    def middle_slope(self) -> float:
        """tan(elevation) in the middle of the working volume."""
        low, high = self.volume.elevations
        return float(np.tan((low + high) / 2.0))

    @property
    def lens_bounds(self) -> list[Bounds]:
        """Bounds of focal length, reciprocal focus distance and f-number, which :meth:`camera` takes."""
        lens = self.lens
        return [lens.focal_lengths_mm, lens.reciprocal_focus_per_mm, lens.f_numbers]

    def camera(self, values: Sequence[float]) -> Camera:
        """The camera with its lens set to (focal length, reciprocal focus distance, f-number)."""
        focal_length, reciprocal_focus, f_number = (float(value) for value in values)
        return camera_with(self.requirement, self.lens, focal_length, reciprocal_focus, f_number)

    @property
    def widest(self) -> float:
        """The widest angle at the pinhole that the image circle holds, at any setting of the lens."""
        shortest = self.camera([self.lens.focal_lengths_mm[0], *self._at_infinity])
        return float(pinhole_angle(shortest, shortest.image_radius_mm))

    @property
    def _at_infinity(self) -> tuple[float, float]:
        return self.lens.reciprocal_focus_per_mm[0], self.lens.f_numbers[1]

    @property
    def greatest_height(self) -> float:
        """The height over the pinhole at which the envelope ends."""
        return self.requirement.envelope.height_mm + self.lens.front_mm
