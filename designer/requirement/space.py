"""The space of a requirement: what the sensor sees, what it may take up, and what the workshop needs."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from designer.requirement.part import METRES, RADIANS, Part
from designer.requirement.quantity import Quantity, refuse


class WorkingVolume(Part):
    """Where depth is wanted: a range of elevations over a range of distances."""

    elevation_deg: Annotated[
        tuple[float, float],
        Quantity(-89, 89, "degrees", shape="range"),
        Field(
            title="elevation, from the middle",
            description="Lowest and highest elevation, measured at the middle of the baseline; up is positive.",
        ),
    ]
    distance_mm: Annotated[
        tuple[float, float],
        Quantity(1e-3, 1e7, "mm", shape="range"),
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
    """The space the mirrors may take."""

    height_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
        Field(
            title="height, at most",
            description="Greatest height: from the lower of lens front and lowest mirror substrate to the top of "
            "the highest substrate.",
        ),
    ]
    diameter_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
        Field(title="diameter, at most", description="Greatest diameter over everything, substrates included."),
    ]
    mirror_diameter_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
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


class Manufacture(Part):
    """What the workshop needs."""

    substrate_thickness_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(
            title="substrate thickness",
            default=2.0,
            description="Thickness of every mirror along z. Default: 2, common for turned aluminium.",
        ),
    ]
    edge_margin_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(
            title="edge margin",
            default=0.5,
            description="Radial width by which a mirror's face reaches beyond its used zone, at the outer and at the "
            "inner edge. The used zone covers the full width of the light. Default: 0.5, since the last tenths of a "
            "millimetre at an edge are usually lost in diamond turning and polishing.",
        ),
    ]
    clearance_mm: Annotated[
        float,
        Quantity(0.001, 1000, "mm"),
        Field(
            title="clearance",
            default=0.5,
            description="Smallest distance between any light path, at its full width through the whole entrance pupil, "
            "and any edge, and between any two solids. It cannot be 0, because light that touches an edge is blocked. "
            "Default: 0.5, several times the usual assembly tolerance.",
        ),
    ]
    zone_gap_px: Annotated[
        float,
        Quantity(0, 10_000, "pixels"),
        Field(
            title="gap between the zones",
            default=4.0,
            description="Radial gap in the image between the zones of the two views. Default: 4, wider than the blur "
            "of a lens in focus.",
        ),
    ]
    smallest_mirror_radius_mm: Annotated[
        float,
        Quantity(0, 1e4, "mm"),
        Field(
            title="mirror radius, at least",
            default=4.0,
            description="Smallest outer radius of a mirror's face. Default: 4; smaller mirrors are hard to turn and "
            "mount.",
        ),
    ]
    largest_slope_deg: Annotated[
        float,
        Quantity(5, 89, "degrees", if_smaller=RADIANS),
        Field(
            title="surface slope, at most",
            default=70.0,
            description="Largest slope of a mirror's face relative to the horizontal. Default: 70; few machines can "
            "turn and few instruments can measure steeper faces.",
        ),
    ]
