"""What the workshop needs: thickness, margins, clearances, and the steepest and smallest faces it can make."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from designer.requirement.part import RADIANS, Part
from designer.requirement.quantity import DesignQuantity


class Manufacture(Part):
    """What the workshop needs."""

    substrate_thickness_mm: Annotated[
        float,
        DesignQuantity(0, 1000, "mm"),
        Field(
            title="substrate thickness",
            default=2.0,
            description="Thickness of every mirror along z. Default: 2, common for turned aluminium.",
        ),
    ]
    edge_margin_mm: Annotated[
        float,
        DesignQuantity(0, 1000, "mm"),
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
        DesignQuantity(0.001, 1000, "mm"),
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
        DesignQuantity(0, 10_000, "pixels"),
        Field(
            title="gap between the zones",
            default=4.0,
            description="Radial gap in the image between the zones of the two views. Default: 4, wider than the blur "
            "of a lens in focus.",
        ),
    ]
    smallest_mirror_radius_mm: Annotated[
        float,
        DesignQuantity(0, 1e4, "mm"),
        Field(
            title="mirror radius, at least",
            default=4.0,
            description="Smallest outer radius of a mirror's face. Default: 4; smaller mirrors are hard to turn and "
            "mount.",
        ),
    ]
    largest_slope_deg: Annotated[
        float,
        DesignQuantity(5, 89, "degrees", if_smaller=RADIANS),
        Field(
            title="surface slope, at most",
            default=70.0,
            description="Largest slope of a mirror's face relative to the horizontal. Default: 70; few machines can "
            "turn and few instruments can measure steeper faces.",
        ),
    ]
