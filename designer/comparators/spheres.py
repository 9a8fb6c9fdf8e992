"""One camera under two spheres on its axis.

The idea is Nayar's sphereo (Proc. SPIE 1005, 245, 1989): two spheres side by side before one camera. Side by side they
hide each other and leave no baseline along the line through both, so that a panorama needs them one above the other, as
the lobes of Southwell, Basu, Fiala and Reyda (ICPR 1996) are. A sphere has no foci: each view is a caustic.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from designer.comparators.asked import Asked
from designer.comparators.coaxial import (
    Coaxial,
    all_of,
    camera_rims,
    error_of,
    one_camera,
    spare_between_zones,
    spares_of_size,
    spares_of_view,
)
from designer.comparators.head import Face, sphere
from designer.comparators.search import Measured, Space
from designer.comparators.zones import (
    distance_between,
    passes_above,
    passes_below,
    passes_inside,
    passes_outside,
    rims_of,
)
from designer.configurations import TOPOLOGIES, Topology
from designer.design import ViewName
from designer.trace.arrays import Array

SMALLEST_ANGLE = 0.02


def spaces(asked: Asked) -> Iterator[Space[Coaxial]]:
    """The spaces to search: one for each topology.

    Variables are the angles at the pinhole of the rays of middle elevation in both views, the height at which the lower
    one crosses the axis, the baseline between both crossings, and the lens.
    """
    angles = (SMALLEST_ANGLE, asked.widest)
    heights = (asked.requirement.camera.nearest_mirror_mm, asked.greatest_height)
    bounds = [angles, angles, heights, asked.baselines, *asked.lens_bounds]
    for topology in TOPOLOGIES:
        yield Space(bounds, partial(_measure, asked, topology))


def _measure(asked: Asked, topology: Topology, values: Array) -> Measured[Coaxial] | None:
    psi_lower, psi_upper, viewpoint, baseline, *of_lens = (float(value) for value in values)
    viewpoints = (viewpoint, viewpoint + baseline)
    faces: dict[ViewName, Face] = {
        "lower": sphere(psi_lower, asked.middle_slope, viewpoints[0]),
        "upper": sphere(psi_upper, asked.middle_slope, viewpoints[1]),
    }
    camera = asked.camera(of_lens)
    built = one_camera(asked, camera, faces, viewpoints)
    if built is None:
        return None
    lower, upper = built.heads[0].mirrors
    zones = {name: placed.zone for name, placed in built.views.items()}
    if topology == "upper_outer":
        inner, outer, passes = zones["lower"], zones["upper"], passes_outside(zones["upper"], 0, lower)
    else:
        inner, outer, passes = zones["upper"], zones["lower"], passes_inside(zones["upper"], -1, lower)
    free = [
        passes,
        distance_between(lower, upper),
        passes_below(zones["lower"], rims_of([upper])),
        passes_above(zones["upper"], rims_of([lower])),
        *(passes_above(zone, camera_rims(camera)) for zone in zones.values()),
    ]
    spares = [
        *spares_of_view(asked, camera, faces["lower"], zones["lower"], lower),
        *spares_of_view(asked, camera, faces["upper"], zones["upper"], upper),
        spare_between_zones(asked, camera, inner, outer),
        *(distance - asked.requirement.manufacture.clearance_mm for distance in free),
        upper.vertex_mm - lower.vertex_mm,
        *spares_of_size(asked, built),
    ]
    return Measured(built, error_of(asked, built.rig), built.height_mm, built.diameter_mm, all_of(spares))
