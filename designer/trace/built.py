"""A built sensor as the tracer meets it, in the frame of its own camera: pinhole at the origin, optical axis +z.

The camera stays where rays start, and the mirrors are posed about it; what leaves the instrument is taken back to the
design's frame, in which the world stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.departures import AsBuilt
from designer.design import Design, built_mirror
from designer.trace.arrays import Array
from designer.trace.instrument import Instrument, Pose, assemble_instrument


@dataclass(frozen=True, slots=True)
class BuiltInstrument:
    """The surfaces in the camera's frame, and the camera's pose in the design's: x = pinhole + rotation x_camera."""

    instrument: Instrument
    pinhole_mm: Array
    rotation: Array

    def points_in_world(self, points: Array) -> Array:
        """Points (n, 3) of the camera's frame in the design's."""
        return np.asarray(points @ self.rotation.T + self.pinhole_mm)

    def directions_in_world(self, directions: Array) -> Array:
        """Directions (n, 3) of the camera's frame in the design's."""
        return np.asarray(directions @ self.rotation.T)


def build_as_built(design: Design) -> BuiltInstrument:
    """The surfaces of the sensor that the design's ``as_built`` table describes."""
    built = design.as_built or AsBuilt()
    camera = built.camera
    pinhole = np.array([camera.shift_x_mm, camera.shift_y_mm, camera.axial_shift_mm])
    turn = tilted(camera.tilt_x_deg, camera.tilt_y_deg)
    mirrors, poses = [], {}
    for mirror in design.mirrors:
        departure = built.mirrors.get(mirror.name)
        vertex = np.array([0.0, 0.0, mirror.vertex_mm])
        place, tilt = vertex, np.eye(3)
        if departure is not None:
            place = vertex + np.array([departure.decentre_x_mm, departure.decentre_y_mm, departure.axial_shift_mm])
            tilt = tilted(departure.tilt_x_deg, departure.tilt_y_deg)
        mirrors.append(mirror if departure is None else built_mirror(mirror, departure))
        poses[mirror.name] = Pose(turn.T @ tilt, turn.T @ (place - pinhole) - vertex)
    return BuiltInstrument(assemble_instrument(mirrors, design.camera, poses), pinhole, turn)


def tilted(tilt_x_deg: float, tilt_y_deg: float) -> Array:
    """The matrix (3, 3) of a turn about x, then about y."""
    (cos_x, cos_y), (sin_x, sin_y) = (wave(np.radians([tilt_x_deg, tilt_y_deg])) for wave in (np.cos, np.sin))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos_x, -sin_x], [0.0, sin_x, cos_x]])
    about_y = np.array([[cos_y, 0.0, sin_y], [0.0, 1.0, 0.0], [-sin_y, 0.0, cos_y]])
    return np.asarray(about_y @ about_x)
