"""The raw image that the camera of a design records of a world, ray by ray, and the truth behind each pixel.

Rays start at the pinhole (or all over the entrance pupil), pass the mirrors by the tracer, which stops them at the
first surface they meet whatever it is, and end in the world. Image frame: u right with X, v down with Y, pixel
centres at whole coordinates. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design
from designer.imaging.render.scenes.world import Array, Hits, World, first_surfaces, radiance
from designer.imaging.render.textures import Floats
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.first_hit import FirstHitTrace, Status, compare_with_path, trace_first_hits
from designer.trace.instrument import Instrument, build_instrument

NO_VIEW, LOWER_VIEW, UPPER_VIEW = 0, 1, 2

# Backs and edges of mirrors, barrel and body are black, but not without light.
BLACK_PARTS_RADIANCE = 0.02
RAYS_PER_BLOCK = 16384


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """What the central ray of each pixel meets; arrays of image shape (h, w).

    ``view`` is LOWER_VIEW or UPPER_VIEW where the ray took that view's mirrors and no other, else NO_VIEW.
    ``point_mm`` (h, w, 3) is the place it meets, NaN if none, whatever its way; ``distance_mm`` that place's
    horizontal distance from the axis; ``surface`` the index of the shape in the world, -1 if none.
    """

    view: NDArray[np.int8]
    point_mm: Floats
    distance_mm: Floats
    surface: NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class Pupil:
    """A thin lens: radius of its pupil and distance at which it is in focus (infinite: far away), in mm."""

    radius_mm: float
    focus_distance_mm: float


def pupil_of(camera: Camera) -> Pupil:
    """The entrance pupil: nominal focal length / f-number wide, in focus at the camera's ``focus_distance_mm``.

    A camera file without ``focus_distance_mm`` is focused at infinity.
    """
    return Pupil(camera.pupil_radius_mm, camera.focus_distance_mm or np.inf)


def render(design: Design, world: World, *, samples: int = 2, aperture: bool = False, seed: int = 0) -> Floats:
    """The image (h, w) that the camera records of one world; the parameters are those of :func:`render_all`."""
    return render_all(design, (world,), samples=samples, aperture=aperture, seed=seed)[0]


def render_all(
    design: Design, worlds: Sequence[World], *, samples: int = 2, aperture: bool = False, seed: int = 0
) -> list[Floats]:
    """The images (h, w) that the camera records of worlds, radiance 0 to 1, without sensor noise; traced once.

    Parameters
    ----------
    samples
        Rays along each side of a pixel: ``samples`` squared rays for each pixel, on a regular grid.
    aperture
        Start the rays all over the entrance pupil, instead of at the pinhole: real defocus. Needs more samples.
    seed
        Of the places in pixel and pupil; a pinhole render uses none.
    """
    camera = design.camera
    instrument = build_instrument(design)
    spacing = angular_spacing(design, instrument)
    images = [np.zeros((camera.height_px, camera.width_px), dtype=np.float32) for _ in worlds]
    pupil = pupil_of(camera) if aperture else None
    for block, (rows, columns) in enumerate(_pixel_blocks(camera, samples**2)):
        random = np.random.default_rng([seed, block])
        u, v, starts = sample_places(rows, columns, samples, pupil, random)
        ahead = ray_directions(camera, u, v, starts, pupil)
        trace = trace_first_hits(instrument, ahead, starts)
        turn = spacing(np.hypot(*on_sensor(camera, u, v))) / samples
        for mirror_u, mirror_v in _REFLECTIONS:
            target = _reflected(camera, rows, columns, mirror_u, mirror_v)
            for image, world in zip(images, worlds, strict=True):
                seen = _seen(world, trace, turn, mirror_u, mirror_v)
                image[target] = seen.reshape(-1, samples**2).mean(axis=1)
    return images


def ground_truth(design: Design, world: World) -> GroundTruth:
    """What the central ray of each pixel meets in the world."""
    camera = design.camera
    shape = (camera.height_px, camera.width_px)
    instrument = build_instrument(design)
    view = np.full(shape, NO_VIEW, dtype=np.int8)
    point = np.full((*shape, 3), np.nan, dtype=np.float32)
    surface = np.full(shape, -1, dtype=np.int16)
    paths = ((LOWER_VIEW, design.views.lower.path), (UPPER_VIEW, design.views.upper.path))
    for rows, columns in _pixel_blocks(camera, 1):
        ahead = ray_directions(camera, columns.astype(float), rows.astype(float), None, None)
        trace = trace_first_hits(instrument, ahead)
        taken = np.full(len(rows), NO_VIEW, dtype=np.int8)
        for number, path in paths:
            taken[compare_with_path(trace, instrument.path(path)).status == Status.OK] = number
        for mirror_u, mirror_v in _REFLECTIONS:
            target = _reflected(camera, rows, columns, mirror_u, mirror_v)
            hits, free = _met(world, trace, mirror_u, mirror_v)
            view[target] = taken
            point[target[0][free], target[1][free]] = hits.points.T
            surface[target[0][free], target[1][free]] = hits.surface
    distance = np.hypot(point[..., 0], point[..., 1])
    return GroundTruth(view, point, distance, surface)


def angular_spacing(design: Design, instrument: Instrument) -> Callable[[Array], Array]:
    """The angle in radians between the exit rays of neighbouring pixels, as a function of image radius in mm.

    It is the geometric mean of the spacings along and across the radius, from one traced meridian.
    """
    camera = design.camera
    pitch = camera.pixel_pitch_mm
    edge = camera.focal_length_mm * np.tan(widest_pinhole_angle(design))
    radii = np.arange(pitch / 2.0, edge + pitch, pitch)
    trace = trace_first_hits(instrument, pinhole_directions(np.arctan2(radii, camera.focal_length_mm)))
    elevations = elevation_angles(trace.exit_direction)
    along = np.abs(np.diff(elevations, append=elevations[-1:]))
    same_way = (trace.sequence[1:] == trace.sequence[:-1]).all(axis=1) & (trace.status[1:] == trace.status[:-1])
    across = np.cos(elevations) * pitch / radii
    known = np.append(same_way, False) & (trace.status == Status.ESCAPED)
    if not known.any():
        return lambda radius: np.full(np.shape(radius), pitch / camera.focal_length_mm)
    spacing = np.sqrt(along * across)[known]
    return lambda radius: np.interp(radius, radii[known], spacing)


# The mirrors and the camera are round and centred on the image, so a trace in one quadrant of the image holds in
# the other three, reflected.
_REFLECTIONS = ((False, False), (True, False), (False, True), (True, True))


def _pixel_blocks(camera: Camera, rays_per_pixel: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Rows and columns of the pixels of one image quadrant that the lens lights, in blocks."""
    rows, columns = np.mgrid[0 : (camera.height_px + 1) // 2, 0 : (camera.width_px + 1) // 2]
    rows, columns = rows.ravel(), columns.ravel()
    if camera.image_circle_radius_px is not None:
        u0, v0 = camera.principal_point_px
        lit = np.hypot(columns - u0, rows - v0) <= camera.image_circle_radius_px
        rows, columns = rows[lit], columns[lit]
    step = max(1, RAYS_PER_BLOCK // rays_per_pixel)
    for low in range(0, len(rows), step):
        yield rows[low : low + step], columns[low : low + step]


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
    ahead = np.stack([x, y, np.full(x.shape, camera.focal_length_mm)], axis=-1)
    if starts is not None and pupil is not None:
        ahead /= camera.focal_length_mm
        # Divided by the focus distance, so that a focus at infinity needs no case of its own.
        ahead -= starts / pupil.focus_distance_mm
    return np.asarray(ahead / np.linalg.norm(ahead, axis=1)[:, None])


def _reflected(
    camera: Camera, rows: NDArray[np.intp], columns: NDArray[np.intp], mirror_u: bool, mirror_v: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return (
        camera.height_px - 1 - rows if mirror_v else rows,
        camera.width_px - 1 - columns if mirror_u else columns,
    )


def _met(world: World, trace: FirstHitTrace, mirror_u: bool, mirror_v: bool) -> tuple[Hits, NDArray[np.intp]]:
    """The world's surfaces on the rays that leave the sensor, and the indices of those rays."""
    free = np.flatnonzero(trace.status == Status.ESCAPED)
    signs = np.array([-1.0 if mirror_u else 1.0, -1.0 if mirror_v else 1.0, 1.0])[:, None]
    return first_surfaces(world, trace.exit_point[free].T * signs, trace.exit_direction[free].T * signs), free


def _seen(world: World, trace: FirstHitTrace, spacing: Array, mirror_u: bool, mirror_v: bool) -> Floats:
    """Radiance (n,) along traced rays: of the world, or of the black part that stopped the ray."""
    seen = np.full(trace.status.shape, BLACK_PARTS_RADIANCE, dtype=np.float32)
    hits, free = _met(world, trace, mirror_u, mirror_v)
    spread = np.where(np.isfinite(hits.distance), hits.distance, 0.0) * spacing[free]
    seen[free] = radiance(world, hits, spread)
    return seen
