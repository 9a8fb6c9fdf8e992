"""A design cut along its axis as polylines: faces, substrates, lens and body, rays. What every cross-section draws.

Points are rows (R, z): signed distance from the axis and height over the pinhole, mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design, Mirror, ViewName
from designer.trace.aiming import meridional_rays
from designer.trace.instrument import sag

Polyline = NDArray[np.float64]
"""Points (n, 2)."""

SIDES = (-1.0, 1.0)
"""The two half-planes of a section."""
VIEW_SIDES: dict[ViewName, float] = {"upper": 1.0, "lower": -1.0}
"""Where a cross-section shows the leaving rays of each view: the upper one's on the right, the lower one's left."""


@dataclass(frozen=True, slots=True)
class CylinderSection:
    """A cylinder about the axis in section."""

    radius: float
    low: float
    high: float

    @property
    def outline(self) -> Polyline:
        """Closed polyline (5, 2)."""
        return np.array(
            [
                [-self.radius, self.low],
                [-self.radius, self.high],
                [self.radius, self.high],
                [self.radius, self.low],
                [-self.radius, self.low],
            ]
        )


def face_height(mirror: Mirror, radius: float) -> float:
    """Height of a mirror's face at a distance from the axis, over the pinhole."""
    return mirror.vertex_mm + float(sag(mirror, radius))


def face_outline(mirror: Mirror, samples: int, side: float = 1.0) -> Polyline:
    """A mirror's face from its inner to its outer rim, on one side of the axis."""
    radii = np.linspace(mirror.inner_radius_mm, mirror.outer_radius_mm, samples)
    return np.column_stack([side * radii, mirror.vertex_mm + sag(mirror, radii)])


def substrate(mirror: Mirror, samples: int, side: float = 1.0) -> Polyline:
    """A mirror's face and its back as one closed polyline, on one side of the axis."""
    front = face_outline(mirror, samples, side)
    back = front + np.array([0.0, mirror.back_offset_mm])
    return np.vstack([front, back[::-1], front[:1]])


def lens_box(camera: Camera, lowest: float = -np.inf) -> CylinderSection:
    """The lens barrel, cut off below a height."""
    return CylinderSection(camera.lens_radius_mm, max(camera.lens_seat_mm, lowest), camera.lens_front_mm)


def body_box(camera: Camera, lowest: float) -> CylinderSection:
    """The camera body, which reaches down without end, cut off below a height."""
    return CylinderSection(camera.body_radius_mm, lowest, camera.lens_seat_mm)


def housing_sections(design: Design) -> list[Polyline]:
    """The walls of a tube as closed polylines on both sides, or the struts as if one stood on either side."""
    housing = design.housing
    if housing is None:
        return []
    inner, outer, low, high = housing.inner_radius_mm, housing.outer_radius_mm, housing.low_mm, housing.high_mm
    corners = np.array([[inner, low], [outer, low], [outer, high], [inner, high], [inner, low]])
    return [corners * (side, 1.0) for side in SIDES]


def leaving_rays(design: Design, view: ViewName, count: int, length_mm: float) -> list[Polyline]:
    """Traced rays over the elevations asked of a view, lowest first, each turned to leave on the view's side.

    Fewer than ``count`` where no ray in the image leaves at some elevation.
    """
    low, high = design.views.by_name[view].elevation_deg
    rays = meridional_rays(design, view, np.linspace(low, high, count), length_mm)
    return [_leaving(ray, VIEW_SIDES[view]) for ray in rays if len(ray)]


def _leaving(ray: Polyline, side: float) -> Polyline:
    towards = np.sign(ray[-1, 0]) or 1.0
    turned: Polyline = ray * (side * towards, 1.0)
    return turned
