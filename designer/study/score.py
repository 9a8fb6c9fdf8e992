"""What a study says of a design beside its geometry: the score, and what its search adds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from pydantic import JsonValue

from designer.evaluate.limit import LeastLimit
from designer.evaluate.score import Score
from designer.files import as_json


@dataclass(frozen=True, slots=True)
class StudyScore:
    """What a study says of a design: its score, the tightest clearance, both stages, and what the solver said.

    The stages hold every goal by the name of its column. ``margin_limit_ratio`` is the score over the limit with
    margins, None where there is none. ``largest_scaled_violation`` is that of the constraints, ``solver_statuses``
    counts what the solver's runs came to. ``least_limit`` is that over every baseline and principal distance that the
    requirement allows.
    """

    score: Score
    smallest_clearance_mm: float
    smallest_clearance_where: str
    largest_slope_deg: float
    first_stage: Mapping[str, float]
    second_stage: Mapping[str, float]
    least_limit: LeastLimit
    first_stage_limit_ratio: float
    margin_limit_ratio: float | None
    largest_scaled_violation: float
    solver_statuses: Mapping[str, int]

    def as_json(self) -> dict[str, JsonValue]:
        """The score as a design's file holds it; there a principal distance has the name of the camera's key."""
        least, own = self.least_limit, [field.name for field in fields(self) if field.name != "score"]
        return {
            **self.score.as_json(),
            **{name: as_json(getattr(self, name)) for name in own},
            "least_limit": {
                "depth_error_rms": least.depth_error_rms,
                "baseline_mm": least.baseline_mm,
                "focal_length_mm": least.principal_distance_mm,
            },
        }
