"""What a drawing says of a mirror's face beyond the design record: its clear aperture, and which digits matter.

Lengths in mm. A face is seen here as its light meets it: distances along the axis count from the vertex, positive
into the substrate, so that a positive radius belongs to a convex mirror, whichever way the mirror faces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from designer.design import Design, Mirror
from designer.evaluate.fabrication import mirror_shape, surface_of

SAG_MATTERS_MM = 1e-6
"""One nanometre: what no workshop holds and no instrument of this kind sees."""
NEARLY_MM = 0.01
"""A face that departs less than this from a sphere or a plane is worth a note: lathes and gauges reach it."""


@dataclass(frozen=True, slots=True)
class FaceDimensions:
    """Dimensions of one face.

    Attributes
    ----------
    clear_radii_mm
        Inner and outer radius of the clear aperture: the rims less the edge margin. The rims themselves where the
        record does not say how wide the margin is; from the axis where there is no hole.
    has_margin
        Whether the clear aperture is smaller than the face.
    radius_mm
        Vertex radius, positive for a convex mirror; None for a plane.
    decimals
        Decimals of radius and conic constant that matter: rounded there, together they move the sag by at most 1 nm.
    nearly
        ``"sphere"`` or ``"plane"`` if the face departs from one by less than 10 micrometres; else empty.
    """

    clear_radii_mm: tuple[float, float]
    has_margin: bool
    radius_mm: float | None
    decimals: tuple[int, int]
    nearly: str


def face_dimensions(design: Design, name: str) -> FaceDimensions:
    """Dimensions of one mirror's face, by the mirror's name."""
    mirror = design.mirror(name)
    inner, outer = mirror.inner_radius_mm, mirror.outer_radius_mm
    margin = design.edge_margin_mm or 0.0
    clear = (inner + margin if inner > 0.0 else 0.0, outer - margin)
    has_margin = margin > 0.0 and clear[0] < clear[1]
    return FaceDimensions(
        clear_radii_mm=clear if has_margin else (inner, outer),
        has_margin=has_margin,
        radius_mm=None if mirror.radius_mm is None else into_substrate(mirror) * mirror.radius_mm,
        decimals=decimals_that_matter(mirror),
        nearly=_nearly(design, mirror),
    )


def into_substrate(mirror: Mirror) -> float:
    """+1 for a mirror whose substrate lies above its face, -1 for one whose substrate lies below."""
    return 1.0 if mirror.faces == "down" else -1.0


def depth_mm(mirror: Mirror, radius_mm: float) -> float:
    """Distance of a face behind its vertex's plane, along the axis into the substrate."""
    return into_substrate(mirror) * (float(surface_of(mirror).height(radius_mm)) - mirror.vertex_mm)


def decimals_that_matter(mirror: Mirror) -> tuple[int, int]:
    """Decimals to which vertex radius (in mm) and conic constant must be kept for a nanometre of sag.

    With w^2 = 1 - (1 + K) r^2 / R^2 the sag z changes by -z / (R w) for each mm of R and by z^2 / (2 R w) for each
    unit of K; both are largest at the outer rim. Half a unit of the last decimal of each may move z by half of it.
    """
    if mirror.radius_mm is None:
        return 0, 0
    radius, rim = mirror.radius_mm, mirror.outer_radius_mm
    root = math.sqrt(max(1.0 - (1.0 + mirror.conic) * (rim / radius) ** 2, 1e-12))
    sag = (rim / radius) * rim / (1.0 + root)
    changes = (abs(sag / (radius * root)), abs(sag**2 / (2.0 * radius * root)))
    by_radius, by_conic = (
        max(0, math.ceil(math.log10(change / SAG_MATTERS_MM))) if change > 0.0 else 0 for change in changes
    )
    return by_radius, by_conic


def _nearly(design: Design, mirror: Mirror) -> str:
    """What a face may be taken for, if the difference is allowed."""
    if mirror.radius_mm is None:
        return ""
    shape = mirror_shape(design, mirror.name)
    if shape.sag_mm < NEARLY_MM:
        return "plane"
    return "sphere" if shape.sphere_departure_mm < NEARLY_MM else ""
