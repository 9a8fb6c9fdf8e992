"""Comparators that are round about one axis: what is put together, and what every one of them must keep to.

Lengths in mm, angles in radians unless a name says otherwise. A spare is what is left of a bound, negative where it is
broken: in mm, pixels, or tenths of a degree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.comparators.asked import Asked
from designer.comparators.errors import Rig, depth_error_rms
from designer.comparators.head import Face, Head, heights_of
from designer.comparators.sight import CoaxialView
from designer.comparators.zones import Zone, zone_of
from designer.design import Camera, Mirror, ViewName
from designer.trace.arrays import Array
from designer.trace.instrument import assemble_instrument

# Bounds are kept with this to spare, so that the tracer, which knows no tolerance, finds them kept.
SPARE = 1e-4
TENTHS_OF_A_DEGREE = 10.0
# What the solver takes for no bound, in degrees or pixels.
UNBOUNDED = 1e3
# Only for the surfaces that rays are aimed by: apertures follow from where they go.
_SMALL_MM = 1e-3


@dataclass(frozen=True, slots=True)
class PlacedView:
    """One view of a comparator: which of its heads, which mirror there, how it sees and the zone that it needs."""

    head: int
    mirror: str
    view: CoaxialView
    zone: Zone


@dataclass(frozen=True, slots=True)
class Coaxial:
    """A comparator about one axis: heads in their own frames, views, and the size of the whole."""

    heads: tuple[Head, ...]
    views: Mapping[ViewName, PlacedView]
    rig: Rig
    baseline_mm: float
    height_mm: float
    diameter_mm: float

    @property
    def largest_blur_px(self) -> float:
        """Largest diameter of the blur on the sensor."""
        return max(float(np.max(each.zone.blur_mm)) / each.view.camera.pixel_pitch_mm for each in self.views.values())

    @property
    def largest_blur_deg(self) -> float:
        """Largest blur in the scene."""
        return float(np.degrees(max(np.max(each.zone.blur_rad) for each in self.views.values())))

    @property
    def single_viewpoint_error_mm(self) -> float:
        """Diameter of the larger caustic."""
        return max(each.zone.single_viewpoint_error_mm for each in self.views.values())


def view_by(camera: Camera, face: Face, pinhole: float = 0.0, is_inverted: bool = False) -> CoaxialView:
    """The view of a camera through one face, which is as large as it needs to be."""
    mirror = face.mirror("face", 0.0, _SMALL_MM, 0.0)
    return CoaxialView(camera, assemble_instrument([mirror], camera), (0,), pinhole, is_inverted)


def cut_to(asked: Asked, name: str, face: Face, zone: Zone) -> Mirror:
    """The mirror whose face reaches an edge margin beyond the light of a zone.

    Raises
    ------
    ValueError
        The face does not reach so far.
    """
    inner, outer = zone.reach(face)
    margin = asked.requirement.manufacture.edge_margin_mm
    return face.mirror(
        name, max(inner - margin, 0.0), outer + margin, asked.requirement.manufacture.substrate_thickness_mm
    )


def error_of(asked: Asked, rig: Rig) -> float:
    """The depth error as the study scores it."""
    return depth_error_rms(rig, asked.volume, asked.conditions, asked.scale_uncertainty)


def zones_of(asked: Asked, views: Mapping[ViewName, CoaxialView], middle: float) -> dict[ViewName, Zone]:
    """The zones that views need of the working volume, seen from the middle of the baseline."""
    return {name: zone_of(view, asked.volume, middle) for name, view in views.items()}


def spares_of_view(asked: Asked, camera: Camera, face: Face, zone: Zone, mirror: Mirror) -> list[float]:
    """What one view has to spare of the mirror's size, slope and distance, of the blur, and of the image circle."""
    sharpness, largest_slope = asked.requirement.sharpness, asked.requirement.manufacture.largest_slope_deg
    pixel = camera.pixel_pitch_mm
    return [
        asked.requirement.envelope.mirror_diameter_mm / 2.0 - mirror.outer_radius_mm,
        mirror.outer_radius_mm - asked.requirement.manufacture.smallest_mirror_radius_mm,
        (largest_slope - float(np.degrees(face.slope(mirror.outer_radius_mm)))) * TENTHS_OF_A_DEGREE,
        float(np.min(zone.hits[:, 1])) - asked.requirement.camera.nearest_mirror_mm,
        (min(sharpness.max_blur_deg, UNBOUNDED) - float(np.degrees(np.max(zone.blur_rad)))) * TENTHS_OF_A_DEGREE,
        min(sharpness.max_blur_px, UNBOUNDED) - float(np.max(zone.blur_mm)) / pixel,
        (camera.image_radius_mm - float(zone.radius_mm[-1])) / pixel,
        # The light of the whole pupil must leave the barrel.
        camera.lens_radius_mm - camera.pupil_radius_mm - camera.lens_front_mm * float(np.tan(zone.psi[-1])),
    ]


def spare_between_zones(asked: Asked, camera: Camera, inner: Zone, outer: Zone) -> float:
    """What is left of the gap between two zones and half of both blurs, in pixels."""
    blurs = (float(np.max(inner.blur_mm[-1])) + float(np.max(outer.blur_mm[0]))) / 2.0
    gap = float(outer.radius_mm[0] - inner.radius_mm[-1])
    return (gap - blurs) / camera.pixel_pitch_mm - asked.requirement.manufacture.zone_gap_px


def camera_rims(camera: Camera) -> Array:
    """The outer edges (2, 2) of lens barrel and camera body in section, in the frame of the head."""
    return np.array([[camera.lens_radius_mm, camera.lens_front_mm], [camera.body_radius_mm, camera.lens_seat_mm]])


def all_of(spares: Sequence[float]) -> Array:
    """The spares as an array, each with a little kept back."""
    return np.array(spares) - SPARE


def one_camera(
    asked: Asked,
    camera: Camera,
    faces: Mapping[ViewName, Face],
    viewpoints: tuple[float, float],
    border: float | None = None,
) -> Coaxial | None:
    """Two mirrors over one camera, each cut to its zone; None if a face does not reach so far.

    Parameters
    ----------
    viewpoints
        Heights of the lower and of the upper viewpoint.
    border
        The radius at which the lower mirror ends and the upper one begins, if both are of one piece.
    """
    views = {name: view_by(camera, face) for name, face in faces.items()}
    rig = Rig(views["lower"], views["upper"], sum(viewpoints) / 2.0)
    zones = zones_of(asked, views, rig.middle_mm)
    try:
        lower = cut_to(asked, "lower", faces["lower"], zones["lower"])
        upper = cut_to(asked, "upper", faces["upper"], zones["upper"])
        if border is not None:
            lower = lower.model_copy(update={"outer_radius_mm": border})
            upper = upper.model_copy(update={"inner_radius_mm": border})
    except ValueError:
        return None
    mirrors = (lower, upper)
    bottom, top = heights_of(mirrors)
    return Coaxial(
        heads=(Head(camera, mirrors),),
        views={name: PlacedView(0, name, view, zones[name]) for name, view in views.items()},
        rig=rig,
        baseline_mm=viewpoints[1] - viewpoints[0],
        height_mm=top - min(bottom, camera.lens_front_mm),
        diameter_mm=2.0 * max(mirror.outer_radius_mm for mirror in mirrors),
    )


def spares_of_size(asked: Asked, built: Coaxial) -> list[float]:
    """What is left of the envelope."""
    return [
        asked.requirement.envelope.height_mm - built.height_mm,
        asked.requirement.envelope.diameter_mm - built.diameter_mm,
    ]
