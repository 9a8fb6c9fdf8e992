"""The half-profile of a mirror as one exact curve, for CAD and for solids.

An arc of a conic is exactly a rational Bezier curve of degree 2: its middle control point is where the tangents at its
ends meet, and the weight of that point says which conic through these it is. With Q(p, p') = c (r r' + (1 + K) z z') -
z - z', z measured from the vertex, whose zero at p = p' is the conic, that point P1 has Q(P0, P1) = Q(P2, P1) = 0, and
the points P0 + 2 w t P1 + t^2 P2 lie on the conic if w^2 = -Q(P0, P2) / (2 Q(P1, P1)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from designer.design import Mirror
from designer.files import InputError
from designer.trace.instrument import sag

Point = tuple[float, float]

# What is shorter than a CAD kernel's tolerance is no edge to it; what is larger loses it in rounding.
LEAST_MM, LARGEST_MM = 1e-4, 1e6


@dataclass(frozen=True, slots=True)
class ConicArc:
    """A rational Bezier curve of degree 2: three control points (r, z) in mm, the middle one of weight ``weight``."""

    points: tuple[Point, Point, Point]
    weight: float


def profile_arc(mirror: Mirror) -> ConicArc:
    """The half-profile of a face from its inner to its outer rim; a plane's is straight, of weight 1.

    Raises
    ------
    InputError
        Rounding leaves no curve between the rims.
    """
    inner, outer = mirror.inner_radius_mm, mirror.outer_radius_mm
    if mirror.radius_mm is None:
        middle = (inner + outer) / 2.0
        return ConicArc(((inner, mirror.vertex_mm), (middle, mirror.vertex_mm), (outer, mirror.vertex_mm)), weight=1.0)
    curvature = 1.0 / mirror.radius_mm
    squared = curvature * (1.0 + mirror.conic)
    low, high = float(sag(mirror, inner)), float(sag(mirror, outer))
    with np.errstate(all="ignore"):
        tangents = np.array([[curvature * inner, squared * low - 1.0], [curvature * outer, squared * high - 1.0]])
        try:
            middle, height = np.linalg.solve(tangents, [low, high])
        except np.linalg.LinAlgError:
            middle = height = math.nan
        across = curvature * inner * outer + squared * low * high - low - high
        own = curvature * middle**2 + squared * height**2 - 2.0 * height
        weight = float(np.sqrt(-across / (2.0 * own)))
    if not (math.isfinite(weight) and weight > 0.0 and inner <= middle <= outer):
        raise InputError(f"mirror {mirror.name}: its profile is too flat or too steep to be drawn as a conic")
    ends = ((inner, mirror.vertex_mm + low), (outer, mirror.vertex_mm + high))
    return ConicArc((ends[0], (float(middle), mirror.vertex_mm + float(height)), ends[1]), weight)


def split(arc: ConicArc) -> tuple[ConicArc, ConicArc]:
    """The two halves of an arc, which meet at its shoulder: the point whose tangent is parallel to the chord."""
    (start, middle, end), w = arc.points, arc.weight
    left, right = _between(start, middle, w), _between(end, middle, w)
    shoulder = _between(left, right, 1.0)
    weight = math.sqrt((1.0 + w) / 2.0)
    return ConicArc((start, left, shoulder), weight), ConicArc((shoulder, right, end), weight)


def height_over_chord_mm(arc: ConicArc) -> float:
    """The largest distance of an arc from its chord: that of its shoulder."""
    (r0, z0), (r1, z1), (r2, z2) = arc.points
    across = (r2 - r0) * (z1 - z0) - (z2 - z0) * (r1 - r0)
    return abs(across) / math.hypot(r2 - r0, z2 - z0) * arc.weight / (1.0 + arc.weight)


def _between(first: Point, second: Point, weight: float) -> Point:
    """The mean of two points, the second of them with a weight."""
    return (first[0] + weight * second[0]) / (1.0 + weight), (first[1] + weight * second[1]) / (1.0 + weight)


def check_solid(mirror: Mirror) -> None:
    """Refuse a mirror that is no solid which a CAD program can hold.

    Raises
    ------
    InputError
        It has no thickness, or is too small or too large.
    """
    if mirror.thickness_mm == 0.0:
        raise InputError(f"mirror {mirror.name}: has no thickness, so it is no solid")
    widths = [mirror.thickness_mm, mirror.outer_radius_mm - mirror.inner_radius_mm]
    if mirror.inner_radius_mm > 0.0:
        widths.append(mirror.inner_radius_mm)
    largest = max(mirror.outer_radius_mm, abs(mirror.vertex_mm), mirror.thickness_mm)
    if min(widths) < LEAST_MM or largest > LARGEST_MM:
        raise InputError(
            f"mirror {mirror.name}: no solid that CAD can hold; thickness, width and hole must be at least "
            f"{LEAST_MM:g} mm, and nothing larger than {LARGEST_MM:g} mm"
        )
