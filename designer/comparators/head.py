"""What comparators are built of: cameras as the requirement has them, convex conic faces that look down, solids.

A head is one camera with everything that its light could meet, all of it round about the camera's axis; a second
camera in its view is a solid like any other. Frame of a head: its pinhole at the origin, its optical axis up. Lengths
in mm, angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.design import Camera, Mirror
from designer.optics.conic import FocalConic
from designer.optics.kinds import kind_of_conic
from designer.optics.thin_lens import principal_distance
from designer.optics.view import half_angle_tangent
from designer.requirement import Lens, Requirement
from designer.trace.arrays import Array
from designer.trace.outline import face_outline

# Focused farther than this, a lens is focused at infinity.
AT_INFINITY_PER_MM = 1e-9


@dataclass(frozen=True, slots=True)
class Head:
    """One camera and the mirrors, or solids written as mirrors, about its axis."""

    camera: Camera
    mirrors: tuple[Mirror, ...]


@dataclass(frozen=True, slots=True)
class Face:
    """A face that looks down: height of its vertex, radius of curvature (positive: convex), conic constant."""

    vertex: float
    radius: float
    conic: float

    def mirror(self, name: str, inner: float, outer: float, thickness: float) -> Mirror:
        """The face between two radii, with its substrate.

        Raises
        ------
        ValueError
            The face does not reach so far.
        """
        return Mirror(
            name=name,
            kind=kind_of_conic(self.conic).word,
            vertex_mm=self.vertex,
            radius_mm=self.radius,
            conic=self.conic,
            inner_radius_mm=inner,
            outer_radius_mm=outer,
            thickness_mm=thickness,
            faces="down",
        )

    def height(self, radius: float) -> float:
        """Height at a distance from the axis."""
        curvature = 1.0 / self.radius
        return self.vertex + curvature * radius**2 / (
            1.0 + math.sqrt(max(1.0 - (1.0 + self.conic) * (curvature * radius) ** 2, 0.0))
        )

    def slope(self, radius: float) -> float:
        """Angle of the face against the horizontal at a distance from the axis; 90 degrees beyond an equator."""
        run = self.radius**2 - (1.0 + self.conic) * radius**2
        return math.atan2(radius, math.sqrt(run)) if run > 0.0 else math.pi / 2.0


def hyperboloid(gain: float, viewpoint: float) -> Face:
    """The convex hyperboloid with foci at the pinhole and at a viewpoint, of gain 0 < kappa < 1."""
    surface = FocalConic(0.0, viewpoint / (1.0 + gain), 1.0 / gain).surface
    return Face(float(surface.vertex_height), 1.0 / float(surface.curvature), -(((1.0 + gain) / (1.0 - gain)) ** 2))


def gain_for(psi: float, slope: float) -> float:
    """The gain with which a direct mirror images the slope tan(phi) at the angle psi."""
    return math.tan(psi / 2.0) / float(half_angle_tangent(slope, "direct"))


def sphere(psi: float, slope: float, viewpoint: float) -> Face:
    """The convex sphere that images the slope tan(phi) at the angle psi, along a line that crosses the axis there.

    The mirror's normal halves the angle between the two rays, so its slope there is (phi + 90 deg - psi) / 2.
    """
    height = viewpoint / (1.0 - math.tan(psi) * slope)
    across = height * math.tan(psi)
    incline = (math.atan(slope) + math.pi / 2.0 - psi) / 2.0
    radius = across / math.sin(incline)
    return Face(height - radius * (1.0 - math.cos(incline)), radius, 0.0)


def camera_with(
    requirement: Requirement, lens: Lens, focal_length: float, reciprocal_focus: float, f_number: float
) -> Camera:
    """The requirement's camera with one of its lenses, focused and stopped down."""
    camera = requirement.camera
    is_finite = reciprocal_focus > AT_INFINITY_PER_MM
    focus = 1.0 / reciprocal_focus if is_finite else math.inf
    return Camera(
        focal_length_mm=float(principal_distance(focal_length, focus)),
        pixel_pitch_mm=camera.pixel_pitch_mm,
        width_px=camera.width_px,
        height_px=camera.height_px,
        f_number=f_number,
        lens_radius_mm=lens.radius_mm,
        lens_front_mm=lens.front_mm,
        lens_length_mm=lens.length_mm,
        body_radius_mm=camera.body_radius_mm,
        image_circle_radius_px=camera.image_circle_radius_px,
        focus_distance_mm=focus if is_finite else None,
        projection=lens.projection,
        distortion=lens.distortion,
    )


def cylinder(name: str, radius: float, low: float, high: float) -> Mirror:
    """A solid cylinder about the axis, written as a plane mirror of its length."""
    return Mirror(
        name=name,
        kind="plane",
        vertex_mm=low,
        radius_mm=None,
        conic=0.0,
        inner_radius_mm=0.0,
        outer_radius_mm=radius,
        thickness_mm=high - low,
        faces="down",
    )


def turned_over(mirror: Mirror, pinhole: float) -> Mirror:
    """A mirror of a camera that looks down from a height, as seen from a camera below that looks up."""
    return mirror.model_copy(
        update={
            "vertex_mm": pinhole - mirror.vertex_mm,
            "radius_mm": None if mirror.radius_mm is None else -mirror.radius_mm,
            "faces": "up" if mirror.faces == "down" else "down",
        }
    )


def raised(mirror: Mirror, by: float) -> Mirror:
    """A mirror at another height."""
    return mirror.model_copy(update={"vertex_mm": mirror.vertex_mm + by})


def outline(mirror: Mirror, count: int = 24) -> Array:
    """Points (2 count, 2) of face and back in section, (R, z), on one side of the axis."""
    front = face_outline(mirror, count)
    return np.concatenate([front, front + np.array([0.0, mirror.back_offset_mm])])


def heights_of(mirrors: Sequence[Mirror]) -> tuple[float, float]:
    """The lowest and the highest point of some mirrors with their substrates."""
    heights = np.concatenate([outline(mirror)[:, 1] for mirror in mirrors])
    return float(heights.min()), float(heights.max())
