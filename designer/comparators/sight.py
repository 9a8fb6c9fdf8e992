"""How a view images scene points, by traced rays alone: no single viewpoint, gain or conic focus is taken for granted.

A coaxial view is round about the optical axis: a camera, and mirrors on its axis. It may stand anywhere on the common
axis of a rig, and upside down. Lengths in mm, angles in radians; heights of a rig are measured upwards from its first
pinhole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from designer.design import Camera
from designer.trace.aiming import aim_at_points, exit_lines
from designer.trace.arrays import Array
from designer.trace.image_law import image_radius, pinhole_angle, stretches
from designer.trace.instrument import Instrument
from designer.trace.pencils import chief_rays_at, images_about

# Symmetric differences at this step and at half of it, extrapolated, leave about 1e-12 of a derivative.
STEP_RAD = 1e-4


@dataclass(frozen=True, slots=True)
class Sight:
    """Scene points (n,) as one view images them.

    ``psi`` are their angles at the pinhole; ``slope`` the rise of the rays that image them, per horizontal distance;
    ``place`` their image places along the direction of the match, mm from the principal point. ``along`` is what a
    displacement upwards at the point's distance measures there, ``across`` one sideways, mm on the sensor per mm; of
    either sign. ``disc_along`` and ``disc_across`` are diameters of the blur in mm on the sensor, of either sign.
    NaN where no ray goes.
    """

    psi: Array
    slope: Array
    place: Array
    along: Array
    across: Array
    disc_along: Array
    disc_across: Array


class SceneView(Protocol):
    """Anything that images scene points: at horizontal distances from the rig's axis, heights and one azimuth."""

    @property
    def camera(self) -> Camera:
        """The camera of the view."""

    @property
    def reflections(self) -> int:
        """Mirrors on the way."""

    def sight(self, distances: Array, heights: Array, azimuth: float) -> Sight:
        """How points (n,) are imaged."""


@dataclass(frozen=True, slots=True)
class CoaxialView:
    """A camera on the axis whose light meets the mirrors of a path; round, so that azimuths do not matter.

    ``pinhole_mm`` is the height of its pinhole in the rig, and ``is_inverted`` says that it looks down. ``side`` is -1
    where the light crosses the axis, so that the image lies across from the scene (a negative gain).
    """

    camera: Camera
    instrument: Instrument
    path: tuple[int, ...]
    pinhole_mm: float = 0.0
    is_inverted: bool = False
    side: float = 1.0

    @property
    def reflections(self) -> int:
        """Mirrors on the way."""
        return len(self.path)

    def own_heights(self, heights: Array) -> Array:
        """Heights of the rig in the frame of this camera, its pinhole at 0 and its axis upwards."""
        return np.asarray((heights - self.pinhole_mm) * self._up)

    @property
    def _up(self) -> float:
        return -1.0 if self.is_inverted else 1.0

    def sight(self, distances: Array, heights: Array, azimuth: float = 0.0) -> Sight:
        """How points (n,) are imaged; apertures and blockage are ignored."""
        own, positions = self.own_heights(heights), self.side * distances
        psi = aim_at_points(self.instrument, self.path, positions, own, widest_angle(self.camera))

        def heights_at(angles: Array) -> Array:
            start, ahead = exit_lines(self.instrument, self.path, angles.ravel())
            (start_r, start_z), (ahead_r, ahead_z) = (part.reshape(2, *angles.shape) for part in (start, ahead))
            return np.asarray(start_z + (positions - start_r) * ahead_z / ahead_r)

        with np.errstate(all="ignore"):
            radius = image_radius(self.camera, psi)
            along = derivative(lambda angles: image_radius(self.camera, angles), psi) / derivative(heights_at, psi)
            _, (ahead_r, ahead_z) = exit_lines(self.instrument, self.path, psi)
            disc_along, disc_across = self.discs(psi, distances)
        return Sight(
            psi=psi,
            slope=np.asarray(self._up * self.side * ahead_z / ahead_r),
            place=radius,
            along=np.asarray(self._up * along),
            across=np.asarray(radius / distances),
            disc_along=disc_along,
            disc_across=disc_across,
        )

    def discs(self, psi: Array, distances: Array) -> tuple[Array, Array]:
        """Blur discs along the radius and across it, (n,), of points on the rays psi (n,) at distances (n,)."""
        chief = chief_rays_at(self.instrument, self.path, psi)
        # Each ray needs its own distance only; few distances differ.
        known, which = np.unique(distances, return_inverse=True)
        images = images_about(self.instrument, self.path, chief, known)
        rays = np.arange(len(psi))
        along, across = stretches(self.camera, psi)
        return (
            blur_disc(self.camera, psi, images.tangential[rays, which]) * along,
            blur_disc(self.camera, psi, images.sagittal[rays, which]) * across,
        )


def blur_disc(camera: Camera, psi: Array, reciprocal_image: Array) -> Array:
    """Signed diameter p f (1/u - 1/z_V) of the blur of images at 1/V in 1/mm along pinhole rays, in mm on the sensor.

    As a perspective lens has it.
    """
    reciprocal_focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    pupil = 2.0 * camera.pupil_radius_mm
    return np.asarray(pupil * camera.focal_length_mm * (reciprocal_focus - reciprocal_image / np.cos(psi)))


def derivative(value_at: Callable[[Array], Array], angles: Array) -> Array:
    """d(value)/d(angle) at angles (n,), of a function that is called once, with all the angles it needs (4, n)."""
    steps = STEP_RAD * np.array([[1.0], [-1.0], [0.5], [-0.5]])
    ahead, behind, half_ahead, half_behind = value_at(angles + steps)
    wide, narrow = (ahead - behind) / (2.0 * STEP_RAD), (half_ahead - half_behind) / STEP_RAD
    return np.asarray((4.0 * narrow - wide) / 3.0)


def widest_angle(camera: Camera) -> float:
    """The angle at the pinhole of the edge of the image circle, and a little more for what a search probes beyond."""
    return min(1.3 * float(pinhole_angle(camera, camera.image_radius_mm)), float(np.radians(84.0)))
