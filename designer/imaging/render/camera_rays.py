"""Places on the image and in the pupil, and the rays of the camera through them.

Image frame: u right with X, v down with Y, pixel centres at whole coordinates. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design
from designer.files import InputError
from designer.imaging.render.lens import Pupil
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.image_law import (
    image_radius,
    is_perspective,
    largest_radius_mm,
    pinhole_angle,
    plane_slopes,
    stretches,
)
from designer.trace.instrument import Instrument

Array = NDArray[np.float64]


MOST_PIXELS = 250_000_000
"""More than any sensor for visible light has; a check takes some 150 bytes for each."""


def refuse_too_large(width_px: int, height_px: int) -> None:
    """Raise InputError if an image of this size cannot be rendered."""
    if width_px * height_px > MOST_PIXELS:
        raise InputError(
            f"a camera of {width_px} x {height_px} pixels is too large to render: at most {MOST_PIXELS / 1e6:g} "
            "megapixels are allowed"
        )


def sample_places(
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    samples: int,
    pupil: Pupil | None,
    random: np.random.Generator,
) -> tuple[Array, Array, Array | None]:
    """Places (u, v) on the image and, over a pupil, starting points (n, 3): samples^2 for each pixel, in a row."""
    cells = (np.arange(samples) + 0.5) / samples
    across, down = (grid.ravel() for grid in np.meshgrid(cells, cells))
    shape = (len(rows), samples**2)
    if pupil is None:
        u, v = columns[:, None] + across - 0.5, rows[:, None] + down - 0.5
        return u.ravel(), v.ravel(), None
    u = columns[:, None] + across + (random.random(shape) - 0.5) / samples - 0.5
    v = rows[:, None] + down + (random.random(shape) - 0.5) / samples - 0.5
    # Rings of equal area and equal sectors, turned at random so that place in pixel and place in pupil do not go
    # together.
    area = across + (random.random(shape) - 0.5) / samples
    sector = down + (random.random(shape) - 0.5) / samples + random.random((len(rows), 1))
    radius = pupil.radius_mm * np.sqrt(area)
    angle = 2.0 * np.pi * sector
    starts = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(shape)], axis=-1)
    return u.ravel(), v.ravel(), starts.reshape(-1, 3)


def on_sensor(camera: Camera, u: Array, v: Array) -> tuple[Array, Array]:
    """Places on the sensor in mm from its centre, right and down, of image places in pixels."""
    u0, v0 = camera.principal_point_px
    return (u - u0) * camera.pixel_pitch_mm, (v - v0) * camera.pixel_pitch_mm


def ray_directions(camera: Camera, u: Array, v: Array, starts: Array | None, pupil: Pupil | None) -> Array:
    """Unit directions (n, 3) of the rays through image places; over a pupil, towards the point in focus."""
    x, y = on_sensor(camera, u, v)
    depth = camera.focal_length_mm
    if not is_perspective(camera):
        (x, y), depth = plane_slopes(camera, x, y), 1.0
    ahead = np.stack([x, y, np.full(x.shape, depth)], axis=-1)
    if starts is not None and pupil is not None:
        ahead /= depth
        # Divided by the focus distance, so that a focus at infinity needs no case of its own.
        ahead -= starts / pupil.focus_distance_mm
    return np.asarray(ahead / np.linalg.norm(ahead, axis=1)[:, None])


def is_in_field(camera: Camera, u: Array, v: Array) -> NDArray[np.bool_]:
    """Whether the lens lights pixels: in the image circle if it is known, and where its law still images anything."""
    u0, v0 = camera.principal_point_px
    circle = np.inf if camera.image_circle_radius_px is None else camera.image_circle_radius_px
    return np.asarray(np.hypot(u - u0, v - v0) <= min(circle, largest_radius_mm(camera) / camera.pixel_pitch_mm))


def stretched_area(camera: Camera, radii: Array) -> Array | float:
    """The area over which the lens spreads light at image radii (n,) in mm, against that of a perspective lens."""
    if is_perspective(camera):
        return 1.0
    along, across = stretches(camera, pinhole_angle(camera, radii))
    return along * across


def angular_spacing(design: Design, instrument: Instrument) -> Callable[[Array], Array]:
    """The angle in radians between the exit rays of neighbouring pixels, as a function of image radius in mm.

    It is the geometric mean of the spacings along and across the radius, from one traced meridian.
    """
    camera = design.camera
    pitch = camera.pixel_pitch_mm
    edge = float(image_radius(camera, widest_pinhole_angle(design)))
    radii = np.arange(pitch / 2.0, edge + pitch, pitch)
    trace = trace_first_hits(instrument, pinhole_directions(pinhole_angle(camera, radii)))
    elevations = elevation_angles(trace.exit_direction)
    along = np.abs(np.diff(elevations, append=elevations[-1:]))
    same_way = (trace.sequence[1:] == trace.sequence[:-1]).all(axis=1) & (trace.status[1:] == trace.status[:-1])
    across = np.cos(elevations) * pitch / radii
    known = np.append(same_way, False) & (trace.status == Status.ESCAPED)
    if not known.any():
        return lambda radius: np.full(np.shape(radius), pitch / camera.focal_length_mm)
    spacing = np.sqrt(along * across)[known]
    return lambda radius: np.interp(radius, radii[known], spacing)
