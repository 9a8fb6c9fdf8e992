"""A transparent tube about the axis: what its wall does to rays, and to the depth that two of them give.

In the meridional plane a wall of thickness w and refractive index n is a plane-parallel plate. A ray of slope
m = tan(elevation) leaves it with its slope, shifted as if its viewpoint stood at the distance

    delta = w (1 - 1 / n'),    n' = sqrt(n^2 (1 + m^2) - m^2)

from the axis towards the scene (docs/theory.md, section 14). A ray that passes the axis at a distance keeps its slope
too, since the component of n times its direction along the axis is conserved at both cylinders. Its horizontal
projection is refracted as in a plane, at two circles, by the same n': the wall is a weak diverging lens.

Takes floats, NumPy arrays or CasADi symbols; lengths in mm, angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

from designer.design import Design
from designer.optics.backend import Scalar, arctan, sqrt

# Each step leaves less than a tenth of the error, wherever a point lies farther out than a few walls.
SLOPE_STEPS = 14


@dataclass(frozen=True, slots=True)
class Wall:
    """Thickness in mm and refractive index of a tube's wall."""

    thickness: Scalar
    refractive_index: Scalar


def wall_of(design: Design) -> Wall | None:
    """The wall of a design's tube; None for a design without one."""
    return None if design.tube is None else Wall(design.tube.wall_mm, design.tube.refractive_index)


def index_in_projection(slope: Scalar, refractive_index: Scalar) -> Scalar:
    """The refractive index n' that a ray of a slope meets in its horizontal projection: n itself where m = 0."""
    squared = slope * slope
    return sqrt(refractive_index * refractive_index * (1.0 + squared) - squared)


def shift_along_radius(slope: Scalar, wall: Wall) -> Scalar:
    """How far a ray is shifted along the radius, away from the axis: delta above, mm."""
    return wall.thickness * (1.0 - 1.0 / index_in_projection(slope, wall.refractive_index))


def shift_along_axis(slope: Scalar, wall: Wall) -> Scalar:
    """How far up a ray is shifted along the axis, mm: -m delta, so that a ray that rises leaves lower."""
    return -slope * shift_along_radius(slope, wall)


def slope_towards(rise: Scalar, distance: Scalar, wall: Wall) -> Scalar:
    """The slope of the ray that a viewpoint sends through the wall to a point.

    ``rise`` is the point's height above the viewpoint, ``distance`` its distance from the axis, well beyond the wall.
    """
    slope = rise / distance
    for _ in range(SLOPE_STEPS):
        slope = rise / (distance - shift_along_radius(slope, wall))
    return slope


def apparent_distances(slope: Scalar, distance: Scalar, inner_radius: Scalar, wall: Wall) -> tuple[Scalar, Scalar]:
    """Distances from the axis at which the light of a point at ``distance`` seems to start, seen through the wall.

    First for rays of the meridional plane, which the wall as a plate brings nearer by d(m delta)/dm, then for those
    beside it, for which it is a diverging lens of the power delta / (r_i r_o).
    """
    index = index_in_projection(slope, wall.refractive_index)
    nearer = wall.thickness * (1.0 - wall.refractive_index * wall.refractive_index / (index * index * index))
    power = shift_along_radius(slope, wall) / (inner_radius * (inner_radius + wall.thickness))
    return distance - nearer, distance / (1.0 + distance * power)


def distance_of(slope_lower: Scalar, slope_upper: Scalar, baseline: Scalar, wall: Wall | None = None) -> Scalar:
    """Distance from the axis, mm, at which two rays of one meridional plane meet outside the wall.

    D = (b + delta_l m_l - delta_u m_u) / (m_l - m_u): the lower viewpoint's ray has the slope m_l, the upper one's,
    ``baseline`` above it, m_u.
    """
    if wall is None:
        return baseline / (slope_lower - slope_upper)
    shifts = slope_lower * shift_along_radius(slope_lower, wall) - slope_upper * shift_along_radius(slope_upper, wall)
    return (baseline + shifts) / (slope_lower - slope_upper)


def uncorrected_bias(slope_lower: Scalar, slope_upper: Scalar, wall: Wall) -> Scalar:
    """By how much the distance comes out wrong, mm, where the wall is not counted; negative: too near."""
    shifts = slope_lower * shift_along_radius(slope_lower, wall) - slope_upper * shift_along_radius(slope_upper, wall)
    return -shifts / (slope_lower - slope_upper)


def turn_in_projection(offset: Scalar, slope: Scalar, inner_radius: Scalar, wall: Wall) -> Scalar:
    """Angle in radians by which the horizontal projection of a ray is turned away from the axis.

    ``offset`` is the distance, mm, at which the projection passes the axis. Near the axis the angle is the offset times
    delta / (r_i r_o): a diverging lens of that power, of sagittal rays alone.
    """
    index = index_in_projection(slope, wall.refractive_index)
    outer_radius = inner_radius + wall.thickness

    def angle(sine: Scalar) -> Scalar:
        return arctan(sine / sqrt(1.0 - sine * sine))

    at_inner = angle(offset / inner_radius) - angle(offset / (index * inner_radius))
    at_outer = angle(offset / outer_radius) - angle(offset / (index * outer_radius))
    return at_inner - at_outer


def transmitted(slope: Scalar, refractive_index: Scalar) -> Scalar:
    """Share of unpolarised light that passes the wall in a meridional plane, all reflections within it counted.

    Fresnel's equations at two surfaces, (1 - R) / (1 + R) for each polarisation: no coating, no absorption, and
    reflections that do not interfere (M. Born and E. Wolf, Principles of Optics, section 1.5).
    """
    cosine = 1.0 / sqrt(1.0 + slope * slope)
    # n cos(angle in the wall).
    inside = cosine * index_in_projection(slope, refractive_index)
    across = (cosine - inside) / (cosine + inside)
    squared_index = refractive_index * refractive_index
    along = (squared_index * cosine - inside) / (squared_index * cosine + inside)
    shares = [(1.0 - amplitude * amplitude) / (1.0 + amplitude * amplitude) for amplitude in (across, along)]
    return (shares[0] + shares[1]) / 2.0
