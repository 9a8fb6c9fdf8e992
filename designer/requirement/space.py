"""The space of a requirement: what the sensor sees, and what it may take up."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from designer.requirement.part import METRES, RADIANS, Part
from designer.requirement.quantity import DesignQuantity, refuse


class WorkingVolume(Part):
    """Where depth is wanted: a range of elevations over a range of distances."""

    elevation_deg: Annotated[
        tuple[float, float],
        DesignQuantity(-89, 89, "degrees", shape="range"),
        Field(
            title="elevation, from the middle",
            description="Lowest and highest elevation, seen from the middle of the baseline; up is positive.",
        ),
    ]
    distance_mm: Annotated[
        tuple[float, float],
        DesignQuantity(1e-3, 1e7, "mm", shape="range"),
        Field(
            title="distance from the axis",
            description="Nearest and farthest horizontal distance from the optical axis.",
        ),
    ]

    @model_validator(mode="after")
    def _is_degrees(self) -> Self:
        low, high = self.elevation_deg
        if high - low < 1:
            refuse(f"must span at least 1 degree; {RADIANS}", "elevation_deg", [low, high])
        return self


class Envelope(Part):
    """The space that the mirrors may take up."""

    height_mm: Annotated[
        float,
        DesignQuantity(1, 1e5, "mm", if_smaller=METRES),
        Field(
            title="height, at most",
            description="Greatest height: from the lower of lens front and lowest mirror substrate to the top of "
            "the highest substrate.",
        ),
    ]
    diameter_mm: Annotated[
        float,
        DesignQuantity(1, 1e5, "mm", if_smaller=METRES),
        Field(title="diameter, at most", description="Greatest diameter over everything, substrates included."),
    ]
    mirror_diameter_mm: Annotated[
        float,
        DesignQuantity(1, 1e5, "mm", if_smaller=METRES),
        Field(
            title="each mirror's diameter, at most",
            default_factory=lambda data: data.get("diameter_mm", math.nan),
            description="Largest mirror diameter that can be bought or made. Default: the envelope's diameter, the "
            "only other limit.",
        ),
    ]

    @model_validator(mode="after")
    def _holds_its_mirrors(self) -> Self:
        if self.mirror_diameter_mm > self.diameter_mm:
            refuse(
                f"must be at most envelope.diameter_mm ({self.diameter_mm:g})",
                "mirror_diameter_mm",
                self.mirror_diameter_mm,
            )
        return self
