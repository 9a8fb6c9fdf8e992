"""Where viewpoints and vertices can lie at all: what bounds of variables follow from.

A mirror's face lies in the envelope, but what the optimiser places need not. A ray of slope m that leaves a face at
height z and distance R from the axis (signed, the world at R > 0) belongs to the viewpoint z - m R, so steep views from
wide mirrors have viewpoints far above or below them. A mirror uses a ring of its conic, whose vertex may lie far below
or above that ring.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.configurations import MirrorKind
from designer.design import PerView, ViewName
from designer.optics.backend import tan
from designer.optics.view import elevation_tangents_of_views
from designer.optimise.required_numbers import Specification
from designer.optimise.system import zone_tangents
from designer.optimise.variants import Variant

Interval = tuple[float, float]

# What depends on the baseline is looked at for so many of them, since it need not be largest at either end.
SAMPLED_BASELINES = 17
# Starts may overfill the image circle by a little.
WIDEST_START = 1.05


def sampled(baselines: Interval) -> list[float]:
    """Baselines over a range, ends included; one if it is given."""
    return [float(baseline) for baseline in np.unique(np.linspace(*baselines, SAMPLED_BASELINES))]


def slopes_at(specification: Specification, baseline: float) -> PerView[Interval]:
    """Lowest and highest tan(phi) that each view must cover at a baseline."""
    low, high = specification.elevations
    return elevation_tangents_of_views((tan(low), tan(high)), specification.distances, baseline)


def lower_viewpoints(
    variant: Variant, specification: Specification, baselines: Interval, fixed: Mapping[str, float]
) -> Interval:
    """Least and greatest height of a lower viewpoint whose two views can leave mirrors in the envelope, mm.

    The interval is empty (its ends in the wrong order) if there is no such height. ``fixed`` are parameters by names
    such as ``upper.viewpoint_mm``.
    """
    lower = _viewpoints(variant, specification, baselines, "lower")
    upper = _viewpoints(variant, specification, baselines, "upper")
    shortest, longest = baselines
    low, high = max(lower[0], upper[0] - longest), min(lower[1], upper[1] - shortest)
    if "lower.viewpoint_mm" in fixed:
        return fixed["lower.viewpoint_mm"], fixed["lower.viewpoint_mm"]
    if "upper.viewpoint_mm" in fixed:
        return fixed["upper.viewpoint_mm"] - longest, fixed["upper.viewpoint_mm"] - shortest
    return low, high


def _viewpoints(variant: Variant, specification: Specification, baselines: Interval, view: ViewName) -> Interval:
    """Heights from which the rays at both ends of a view's range can leave a face in the envelope."""
    front, envelope = specification.lens_front, specification.asked.envelope
    faces = (front - envelope.height_mm, front + envelope.height_mm)
    widest = min(envelope.mirror_diameter_mm, envelope.diameter_mm) / 2.0
    # Light that crosses the axis at the viewpoint leaves the mirror on the far side.
    side = -1.0 if variant.crosses_at_viewpoint(view) else 1.0
    low, high = -float("inf"), float("inf")
    for end in (0, 1):
        shifts = [0.0, *(-side * slopes_at(specification, baseline)[view][end] * widest for baseline in baselines)]
        low, high = max(low, faces[0] + min(shifts)), min(high, faces[1] + max(shifts))
    return low, high


def secondary_vertices(
    variant: Variant, specification: Specification, baselines: Interval, shortest_principal_distance: float
) -> Interval:
    """Least and greatest height of a secondary's vertex if its used ring lies in the envelope, mm.

    The ring's height is v (1 - t^2) / (1 - mu t^2), with |mu| t^2 < 1 at its outer end (docs/theory.md, section 2): the
    narrower the ring, the farther its vertex can lie from it. A face of mu >= 1 has its vertex below the ring, another
    one above it by no more than the image circle is wide behind the shortest lens.
    """
    narrowest = max(
        (inner / outer) ** 2
        for inner, outer in (
            zone_tangents(variant, "lower", slopes_at(specification, baseline)["lower"]) for baseline in baselines
        )
    )
    least = specification.asked.camera.nearest_mirror_mm * (1.0 - narrowest)
    most = specification.lens_front + specification.asked.envelope.height_mm
    if variant.configuration.mirror_kinds.get("secondary") is MirrorKind.ELLIPSOID:
        most *= 1.0 + narrowest
    if variant.fold is not None and min(variant.fold.inverse_gains) < 1.0:
        rim = float(specification.law.half_tangent(specification.image_radius / shortest_principal_distance))
        most /= 1.0 - min(narrowest * (WIDEST_START * rim) ** 2, 0.9)
    return least, most
