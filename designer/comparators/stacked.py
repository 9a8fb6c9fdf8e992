"""Two omnidirectional cameras on one axis, one above the other, each with a hyperboloid of its own.

The idea is that of Gluckman, Nayar and Thoresz (DARPA Image Understanding Workshop 1998), whose cameras have parabolic
mirrors behind telecentric lenses; hyperboloids do the same behind the requirement's own lens. Each view has the whole
image of its camera. That takes two cameras, whose scales are known independently of each other, and room between the
mirrors for a camera, or for nothing if the upper camera looks down from above: both ways are tried.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from designer.comparators.asked import Asked
from designer.comparators.coaxial import (
    Coaxial,
    PlacedView,
    all_of,
    camera_rims,
    cut_to,
    error_of,
    spares_of_size,
    spares_of_view,
    view_by,
    zones_of,
)
from designer.comparators.errors import Rig
from designer.comparators.head import (
    Face,
    Head,
    cylinder,
    gain_for,
    heights_of,
    hyperboloid,
    raised,
    turned_over,
)
from designer.comparators.search import Measured, Space
from designer.comparators.sight import CoaxialView
from designer.comparators.zones import distance_between, passes_above, passes_below, rims_of
from designer.design import Camera, Mirror, ViewName
from designer.trace.arrays import Array

SMALLEST_ANGLE = 0.02
SEAM_MM = 1e-6
BODY_LENGTHS = 2.0
"""A camera between the mirrors is taken to be as long as its body is wide: no requirement says its length."""


@dataclass(frozen=True, slots=True)
class _Unit:
    """One camera with its hyperboloid, in its own frame."""

    camera: Camera
    face: Face
    viewpoint: float


def spaces(asked: Asked) -> Iterator[Space[Coaxial]]:
    """The spaces to search: the upper camera upright, and looking down.

    Variables are, of each camera, the angle at the pinhole of the ray of middle elevation, the distance from pinhole to
    viewpoint, and the lens; and the baseline.
    """
    unit = [
        (SMALLEST_ANGLE, asked.widest),
        (asked.requirement.camera.nearest_mirror_mm, asked.greatest_height),
        *asked.lens_bounds,
    ]
    for is_inverted in (False, True):
        yield Space([*unit, *unit, asked.baselines], partial(_measure, asked, is_inverted))


def put_together(asked: Asked, is_inverted: bool, values: Array) -> Coaxial | None:
    """Two cameras one above the other; None if a mirror does not reach as far as its zone."""
    half = (len(values) - 1) // 2
    lower, upper = _unit(asked, values[:half], 1.0), _unit(asked, values[half:-1], -1.0 if is_inverted else 1.0)
    if lower is None or upper is None:
        return None
    baseline = float(values[-1])
    height = lower.viewpoint + baseline + (upper.viewpoint if is_inverted else -upper.viewpoint)
    views: dict[ViewName, CoaxialView] = {
        "lower": view_by(lower.camera, lower.face),
        "upper": view_by(upper.camera, upper.face, height, is_inverted),
    }
    rig = Rig(views["lower"], views["upper"], lower.viewpoint + baseline / 2.0, has_one_camera=False)
    zones = zones_of(asked, views, rig.middle_mm)
    try:
        mirrors = {
            "lower": cut_to(asked, "lower", lower.face, zones["lower"]),
            "upper": cut_to(asked, "upper", upper.face, zones["upper"]),
        }
    except ValueError:
        return None
    # What stands in the other camera's view: the mirror, and above the lower mirror the other camera.
    camera = _camera_as_solids(upper.camera)
    if is_inverted:
        seen_from_below = [turned_over(solid, height) for solid in (mirrors["upper"], *camera)]
        seen_from_above = [turned_over(mirrors["lower"], height)]
        top = height - upper.camera.lens_front_mm
    else:
        seen_from_below = [raised(solid, height) for solid in (mirrors["upper"], *camera)]
        seen_from_above = [raised(mirrors["lower"], -height)]
        top = height + heights_of([mirrors["upper"]])[1]
    radii = [mirror.outer_radius_mm for mirror in mirrors.values()]
    return Coaxial(
        heads=(
            Head(lower.camera, (mirrors["lower"], *seen_from_below)),
            Head(upper.camera, (mirrors["upper"], *seen_from_above)),
        ),
        views={
            "lower": PlacedView(0, "lower", views["lower"], zones["lower"]),
            "upper": PlacedView(1, "upper", views["upper"], zones["upper"]),
        },
        rig=rig,
        baseline_mm=baseline,
        height_mm=top - min(lower.camera.lens_front_mm, heights_of([mirrors["lower"]])[0]),
        diameter_mm=2.0 * max(*radii, *([] if is_inverted else [upper.camera.body_radius_mm])),
    )


def _unit(asked: Asked, values: Array, up: float) -> _Unit | None:
    psi, viewpoint, *of_lens = (float(value) for value in values)
    gain = gain_for(psi, up * asked.middle_slope)
    if not 0.0 < gain < 1.0:
        return None
    return _Unit(asked.camera(of_lens), hyperboloid(gain, viewpoint), viewpoint)


def _measure(asked: Asked, is_inverted: bool, values: Array) -> Measured[Coaxial] | None:
    built = put_together(asked, is_inverted, values)
    if built is None:
        return None
    keep = asked.requirement.manufacture.clearance_mm
    spares: list[float] = []
    half = (len(values) - 1) // 2
    parts: dict[ViewName, tuple[Array, float]] = {
        "lower": (values[:half], 1.0),
        "upper": (values[half:-1], -1.0 if is_inverted else 1.0),
    }
    for name, (part, up) in parts.items():
        placed, unit = built.views[name], _unit(asked, part, up)
        assert unit is not None
        own, *others = built.heads[placed.head].mirrors
        spares += spares_of_view(asked, unit.camera, unit.face, placed.zone, own)
        is_above = name == "lower" or is_inverted
        passes = passes_below if is_above else passes_above
        spares += [
            passes_above(placed.zone, camera_rims(unit.camera)) - keep,
            passes(placed.zone, rims_of(others)) - keep,
            *(distance_between(own, other) - keep for other in others),
            # The other unit stands wholly beyond the own mirror: what is nearest would not tell one beside it.
            *(_order_of(own, other, is_above) - keep for other in others),
        ]
    spares += spares_of_size(asked, built)
    return Measured(built, error_of(asked, built.rig), built.height_mm, built.diameter_mm, all_of(spares))


def _order_of(own: Mirror, other: Mirror, is_above: bool) -> float:
    """How much higher (or lower) than the own mirror's vertex another solid begins."""
    low, high = heights_of([other])
    return low - own.vertex_mm if is_above else own.vertex_mm - high


def _camera_as_solids(camera: Camera) -> tuple[Mirror, Mirror]:
    seat = camera.lens_seat_mm
    return (
        cylinder("other lens", camera.lens_radius_mm, seat + SEAM_MM, camera.lens_front_mm),
        cylinder("other camera", camera.body_radius_mm, seat - BODY_LENGTHS * camera.body_radius_mm, seat),
    )
