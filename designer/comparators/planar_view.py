"""A view of a perspective camera through one tilted plane mirror: traced, and as large as the rays need.

Frame of the camera: pinhole at the origin, optical axis +z; the mirrors turn the view towards +x. In the frame of the
rig the axis of the working volume is the z axis, and the camera may lean. Lengths in mm, angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.comparators.sight import Sight, blur_disc
from designer.design import Camera, Mirror
from designer.trace.arrays import Array
from designer.trace.image_law import plane_slopes, sensor_places
from designer.trace.instrument import Instrument, Pose, assemble_instrument
from designer.trace.sequential import trace_sequential

STEP_MM = 1e-4


@dataclass(frozen=True, slots=True)
class Flat:
    """A plane mirror through (0, 0, height) that rises towards +x at an angle; it faces down and towards +x."""

    height: float
    incline: float

    @property
    def rotation(self) -> Array:
        """From the mirror's own frame, its normal along z, to the camera's: columns are the axes."""
        cosine, sine = np.cos(self.incline), np.sin(self.incline)
        return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])

    def own(self, points: Array) -> Array:
        """Points (..., 3) in the mirror's own frame: along its rise, across it, and behind its face."""
        return np.asarray((points - np.array([0.0, 0.0, self.height])) @ self.rotation)

    def seen(self, points: Array) -> Array:
        """The mirror images (..., 3) of points, where the camera seems to see them."""
        normal = self.rotation[:, 2]
        return np.asarray(points - 2.0 * (self.own(points)[..., 2])[..., None] * normal)

    def instrument(self, camera: Camera) -> Instrument:
        """The bare face over the camera, of no size: rays meet its plane where apertures are ignored."""
        face = Mirror(
            name="flat",
            kind="plane",
            vertex_mm=self.height,
            radius_mm=None,
            conic=0.0,
            inner_radius_mm=0.0,
            outer_radius_mm=1e-3,
            thickness_mm=0.0,
            faces="down",
        )
        return assemble_instrument([face], camera, {"flat": Pose(self.rotation, np.zeros(3))})


@dataclass(frozen=True, slots=True)
class PlanarView:
    """A camera before one flat.

    The point x = ``axis`` of its frame stands in the origin of the rig, and there it leans back by ``tilt``: a ray
    along its +x rises by so much.
    """

    camera: Camera
    flat: Flat
    instrument: Instrument
    axis: float
    tilt: float

    @property
    def reflections(self) -> int:
        """Mirrors on the way."""
        return 1

    @property
    def viewpoint(self) -> Array:
        """Where the camera seems to stand, (x, z) in the frame of the rig."""
        return self.in_rig(self.flat.seen(np.zeros(3)))[[0, 2]]

    @property
    def _turn(self) -> Array:
        """From the camera's frame to the rig's: columns are the camera's axes."""
        cosine, sine = np.cos(self.tilt), np.sin(self.tilt)
        return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])

    def in_rig(self, points: Array) -> Array:
        """Points (..., 3) of the camera's frame in the frame of the rig."""
        return np.asarray((points - np.array([self.axis, 0.0, 0.0])) @ self._turn.T)

    def points(self, distances: Array, heights: Array, azimuth: float) -> Array:
        """Scene points (n, 3) in the camera's frame."""
        in_rig = np.stack([distances * np.cos(azimuth), distances * np.sin(azimuth), heights], axis=-1)
        return np.asarray(in_rig @ self._turn + np.array([self.axis, 0.0, 0.0]))

    def traced(self, places: Array) -> tuple[Array, Array, Array]:
        """Directions at the pinhole, points on the mirror, directions behind it, (n, 3), of image places (n, 2)."""
        x, y = plane_slopes(self.camera, places[:, 0], places[:, 1])
        ahead = np.stack([x, y, np.ones_like(x)], axis=-1)
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        trace = trace_sequential(self.instrument, (0,), ahead, np.zeros_like(ahead), apertures=False)
        return ahead, trace.point, trace.direction

    def places(self, points: Array) -> Array:
        """Image places (n, 2) in mm of scene points (n, 3); NaN behind the camera."""
        seen = self.flat.seen(points)
        with np.errstate(all="ignore"):
            slopes = np.where(seen[:, 2:] > 0.0, seen[:, :2] / seen[:, 2:], np.nan)
        return sensor_places(self.camera, slopes)

    def sight(self, distances: Array, heights: Array, azimuth: float) -> Sight:
        """How points (n,) are imaged; the sizes of mirrors and blockage are ignored."""
        targets = self.points(distances, heights, azimuth)
        places = self.places(targets)
        # Directions of the rig, in the camera's frame.
        outwards, sideways, upwards = (
            np.array(direction) @ self._turn
            for direction in (
                [np.cos(azimuth), np.sin(azimuth), 0.0],
                [-np.sin(azimuth), np.cos(azimuth), 0.0],
                [0.0, 0.0, 1.0],
            )
        )

        # Height and sideways place at which rays beside the points' own pass their distance.
        steps = STEP_MM * np.array([[[1.0, 0.0]], [[-1.0, 0.0]], [[0.0, 1.0]], [[0.0, -1.0]]])
        _, start, ahead = (part.reshape(4, -1, 3) for part in self.traced((places + steps).reshape(-1, 2)))
        reach = (targets - start) @ outwards / (ahead @ outwards)
        end = start + reach[..., None] * ahead
        passed = np.stack([end @ upwards, end @ sideways], axis=-1)
        rates = np.stack([passed[0] - passed[1], passed[2] - passed[3]], axis=-1) / (2.0 * STEP_MM)
        ahead, start, leaving = self.traced(places)
        length = np.linalg.norm(start, axis=1) + np.linalg.norm(targets - start, axis=1)
        psi = np.arccos(ahead[:, 2])
        # A plane leaves light stigmatic: the image lies as far as the light has come.
        disc = blur_disc(self.camera, psi, 1.0 / length)
        determinant = rates[:, 0, 0] * rates[:, 1, 1] - rates[:, 0, 1] * rates[:, 1, 0]
        return Sight(
            psi=psi,
            slope=np.asarray(leaving @ upwards / (leaving @ outwards)),
            place=places[:, 0],
            along=np.asarray(rates[:, 1, 1] / determinant),
            across=np.asarray(rates[:, 0, 0] / determinant),
            disc_along=disc,
            disc_across=disc,
        )
