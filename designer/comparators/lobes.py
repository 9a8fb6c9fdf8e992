"""One camera under one mirror of two hyperbolic lobes, turned in one piece.

The idea is that of Cabral, de Souza and Hunold (ICPR 2004). Both lobes have a focus in the pinhole, so that both views
have single viewpoints, and meet in a circle. There the inner lobe sends its highest ray out and the outer lobe its
lowest: both viewpoints lie on the axis behind that circle, and with its radius R0 and the two slopes the baseline is

    b = R0 (m_inner - m_outer)

so that it cannot be chosen freely: it is about as long as the mirror is wide times the tangent of the elevations.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

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
from designer.comparators.head import Face, gain_for, hyperboloid
from designer.comparators.search import Measured, Space
from designer.comparators.zones import passes_above, passes_below, rims_of
from designer.design import ViewName
from designer.optics.conic import FocalConic
from designer.trace.arrays import Array

SMALLEST_ANGLE = 0.02


def spaces(asked: Asked) -> Iterator[Space[Coaxial]]:
    """The space to search.

    Variables are the angles at the pinhole of the rays of middle elevation in both lobes, that of the circle in which
    the lobes meet, the viewpoint of the inner lobe, and the lens.
    """
    angles = (SMALLEST_ANGLE, asked.widest)
    heights = (asked.requirement.camera.nearest_mirror_mm, asked.greatest_height)
    yield Space([angles, angles, angles, heights, *asked.lens_bounds], partial(_measure, asked))


def viewpoint_through(gain: float, psi: float, radius: float) -> float:
    """The viewpoint of the hyperboloid of a gain that the ray at the angle psi meets at a distance from the axis."""
    half_tangent = np.tan(psi / 2.0)
    reached, _ = FocalConic(0.0, 1.0, 1.0 / gain).point(half_tangent)
    return float(radius / reached * (1.0 + gain))


def _measure(asked: Asked, values: Array) -> Measured[Coaxial] | None:
    psi_inner, psi_outer, psi_border, viewpoint, *of_lens = (float(value) for value in values)
    gains = [gain_for(psi, asked.middle_slope) for psi in (psi_inner, psi_outer)]
    if not 0.0 < gains[0] < gains[1] < 1.0:
        return None
    inner = FocalConic(0.0, viewpoint / (1.0 + gains[0]), 1.0 / gains[0])
    border = float(inner.point(np.tan(psi_border / 2.0))[0])
    viewpoints = (viewpoint, viewpoint_through(gains[1], psi_border, border))
    faces: dict[ViewName, Face] = {
        "lower": hyperboloid(gains[0], viewpoints[0]),
        "upper": hyperboloid(gains[1], viewpoints[1]),
    }
    if not border > 0.0 or not viewpoints[0] < viewpoints[1]:
        return None
    camera = asked.camera(of_lens)
    built = one_camera(asked, camera, faces, viewpoints, border)
    if built is None:
        return None
    lower, upper = built.heads[0].mirrors
    zones = {name: placed.zone for name, placed in built.views.items()}
    keep, margin = asked.requirement.manufacture.clearance_mm, asked.requirement.manufacture.edge_margin_mm
    # The outer lobe beyond the light of the circle itself, which the inner lobe's highest rays pass.
    rims = rims_of([upper])
    spares = [
        *spares_of_view(asked, camera, faces["lower"], zones["lower"], lower),
        *spares_of_view(asked, camera, faces["upper"], zones["upper"], upper),
        spare_between_zones(asked, camera, zones["lower"], zones["upper"]),
        # Both zones keep an edge margin from the circle in which the lobes meet.
        border - margin - zones["lower"].reach(faces["lower"])[1],
        zones["upper"].reach(faces["upper"])[0] - margin - border,
        passes_below(zones["lower"], rims[rims[:, 0] > border + margin]) - keep,
        *(passes_above(zone, camera_rims(camera)) - keep for zone in zones.values()),
        asked.baselines[1] - built.baseline_mm,
        *spares_of_size(asked, built),
    ]
    return Measured(built, error_of(asked, built.rig), built.height_mm, built.diameter_mm, all_of(spares))
