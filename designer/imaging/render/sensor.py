"""What a render traces: the camera and the surfaces of a design, or of the sensor that was built to it.

A built sensor (``as_built`` in the design file) is traced in the frame of its own camera; its rays are taken to the
design's frame, where the scene stands. It is round about no axis, so that every part of its image is traced, and so is
that of a sensor between struts. A tube refracts what leaves; what its walls reflect or absorb is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import Camera, Design
from designer.housing import Struts, Tube
from designer.imaging.render.camera_rays import Array, on_sensor, ray_directions
from designer.imaging.render.lens import Pupil
from designer.trace.built import BuiltInstrument, build_as_built
from designer.trace.housing import Left, leave_housing
from designer.trace.instrument import Instrument, build_instrument

UNDISTORTING_STEPS = 8


@dataclass(frozen=True, slots=True)
class Sensor:
    """A camera, its instrument and its housing; ``built`` is None for a sensor that is as designed."""

    camera: Camera
    instrument: Instrument
    built: BuiltInstrument | None
    radial_distortion: float
    image_shift_px: tuple[float, float] = (0.0, 0.0)
    housing: Tube | Struts | None = None

    @property
    def is_round(self) -> bool:
        """Whether a quadrant of the image, reflected, makes the others."""
        return self.built is None and not isinstance(self.housing, Struts)

    def directions(self, u: Array, v: Array, starts: Array | None, pupil: Pupil | None) -> Array:
        """Unit directions (n, 3), in the camera's frame, of the rays through image places in px."""
        u, v = u - self.image_shift_px[0], v - self.image_shift_px[1]
        if self.radial_distortion:
            u, v = self._undistorted(u, v)
        return ray_directions(self.camera, u, v, starts, pupil)

    def leaving(self, points: Array, directions: Array) -> Left:
        """Rays (n, 3) of the camera's frame, behind the last mirror, as they leave the housing in the design's."""
        if self.built is not None:
            points, directions = self.built.points_in_world(points), self.built.directions_in_world(directions)
        return leave_housing(self.housing, points, directions)

    def _undistorted(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Where a lens without distortion images the same rays: tan(psi) from t + k t^3 = r/f, by Newton's method."""
        u0, v0 = self.camera.principal_point_px
        radius = np.hypot(*on_sensor(self.camera, u, v)) / self.camera.focal_length_mm
        tangent = radius
        for _ in range(UNDISTORTING_STEPS):
            excess = tangent + self.radial_distortion * tangent**3 - radius
            tangent = tangent - excess / (1.0 + 3.0 * self.radial_distortion * tangent**2)
        scale = np.where(radius > 0.0, tangent / np.where(radius > 0.0, radius, 1.0), 1.0)
        return u0 + (u - u0) * scale, v0 + (v - v0) * scale


def sensor_of(design: Design) -> Sensor:
    """The sensor of a design: as it was built, if the design says how."""
    if design.as_built is None:
        return Sensor(design.camera, build_instrument(design), None, 0.0, housing=design.housing)
    built = build_as_built(design)
    departure = design.as_built.camera
    return Sensor(
        _with_principal_distance(design.camera, departure.principal_distance_departure_mm),
        built.instrument,
        built,
        departure.radial_distortion,
        (departure.image_shift_x_px, departure.image_shift_y_px),
        design.housing,
    )


def _with_principal_distance(camera: Camera, longer_mm: float) -> Camera:
    """The same glass with its image plane farther away, and so focused nearer."""
    if not longer_mm:
        return camera
    length = camera.focal_length_mm + longer_mm
    nearness = 1.0 / camera.focal_length_mm - 1.0 / length
    nearness += 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    # Beyond infinity a lens is sharp nowhere; a distance of a kilometre is as good.
    focus = 1.0 / max(nearness, 1e-6)
    return camera.model_copy(update={"focal_length_mm": length, "focus_distance_mm": focus})
