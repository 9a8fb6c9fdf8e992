"""The raw image that the camera of a design records of a world, ray by ray, and the truth behind each pixel.

Rays start at the pinhole (or all over the entrance pupil), pass the mirrors by the tracer, which stops them at the
first surface they meet whatever it is, and end in the world. Image frame: u right with X, v down with Y, pixel
centres at whole coordinates. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design
from designer.imaging.render.camera_rays import (
    angular_spacing,
    is_in_field,
    on_sensor,
    ray_directions,
    refuse_too_large,
    sample_places,
    stretched_area,
)
from designer.imaging.render.full_aperture import render_full_aperture
from designer.imaging.render.lens import LOSSLESS, Pupil, RenderedLens, pupil_of
from designer.imaging.render.passage import BLACK_PARTS_RADIANCE
from designer.imaging.render.scenes.world import Array, SceneRays, World, first_surfaces_on, radiance
from designer.imaging.render.sensor import Sensor, sensor_of
from designer.imaging.render.textures import Floats
from designer.imaging.render.threads import for_each
from designer.trace.first_hit import FirstHitTrace, Status, compare_with_path, trace_first_hits
from designer.trace.instrument import build_instrument

__all__ = [
    "BLACK_PARTS_RADIANCE",
    "LOWER_VIEW",
    "NO_VIEW",
    "UPPER_VIEW",
    "GroundTruth",
    "Pupil",
    "angular_spacing",
    "ground_truth",
    "on_sensor",
    "pupil_of",
    "ray_directions",
    "render",
    "render_all",
    "sample_places",
]

NO_VIEW, LOWER_VIEW, UPPER_VIEW = 0, 1, 2

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


def render(
    design: Design,
    world: World,
    *,
    samples: int = 2,
    aperture: bool = False,
    seed: int = 0,
    lens: RenderedLens | None = None,
) -> Floats:
    """The image (h, w) that the camera records of one world; the parameters are those of :func:`render_all`."""
    return render_all(design, (world,), samples=samples, aperture=aperture, seed=seed, lens=lens)[0]


def render_all(
    design: Design,
    worlds: Sequence[World],
    *,
    samples: int = 2,
    aperture: bool = False,
    seed: int = 0,
    lens: RenderedLens | None = None,
) -> list[Floats]:
    """The images (h, w) that the camera records of worlds, radiance 0 to 1, without sensor noise; traced once.

    Parameters
    ----------
    samples
        Rays along each side of a pixel: ``samples`` squared rays for each pixel. Through the whole aperture 3 leave
        less noise than the shot noise of a full well of 10,000 electrons (``benchmarks/rendering.py``).
    aperture
        Start the rays all over the entrance pupil, instead of at the pinhole: real defocus and vignetting.
    seed
        Of the places in the pupil; a pinhole render uses none.
    lens
        Loss of light at mirrors and towards the rim of the image, and diffraction (through the pupil only). Without
        it no light is lost and nothing is diffracted.

    Raises
    ------
    InputError
        The camera has too many pixels.
    """
    refuse_too_large(design.camera.width_px, design.camera.height_px)
    if aperture:
        return render_full_aperture(design, worlds, samples, lens or LOSSLESS, seed)
    sensor = sensor_of(design)
    camera, instrument = sensor.camera, sensor.instrument
    spacing = angular_spacing(design, build_instrument(design))
    images = [np.zeros((camera.height_px, camera.width_px), dtype=np.float32) for _ in worlds]

    def work(number: int, pixels: tuple[NDArray[np.intp], NDArray[np.intp]]) -> None:
        rows, columns = pixels
        u, v, _ = sample_places(rows, columns, samples, None, np.random.default_rng([seed, number]))
        ahead = sensor.directions(u, v, None, None)
        trace = trace_first_hits(instrument, ahead)
        radii = np.hypot(*on_sensor(camera, u, v))
        reflections = (trace.sequence >= 0).sum(axis=1)
        share = None if lens is None else lens.transmission(ahead, reflections, stretched_area(camera, radii))
        turn = spacing(radii) / samples
        for mirror_u, mirror_v in _reflections(sensor):
            target = _reflected(camera, rows, columns, mirror_u, mirror_v)
            rays, free = _leaving(sensor, trace, mirror_u, mirror_v)
            for image, world in zip(images, worlds, strict=True):
                seen = _seen(world, rays, free, turn)
                if share is not None:
                    seen *= share
                image[target] = seen.reshape(-1, samples**2).mean(axis=1)

    for_each(work, _pixel_blocks(sensor, samples**2))
    return images


def ground_truth(design: Design, world: World) -> GroundTruth:
    """What the central ray of each pixel meets in the world."""
    sensor = sensor_of(design)
    camera, instrument = sensor.camera, sensor.instrument
    shape = (camera.height_px, camera.width_px)
    view = np.full(shape, NO_VIEW, dtype=np.int8)
    point = np.full((*shape, 3), np.nan, dtype=np.float32)
    surface = np.full(shape, -1, dtype=np.int16)
    paths = ((LOWER_VIEW, design.views.lower.path), (UPPER_VIEW, design.views.upper.path))
    for rows, columns in _pixel_blocks(sensor, 1):
        ahead = sensor.directions(columns.astype(float), rows.astype(float), None, None)
        trace = trace_first_hits(instrument, ahead)
        taken = np.full(len(rows), NO_VIEW, dtype=np.int8)
        for number, path in paths:
            taken[compare_with_path(trace, instrument.path(path)).status == Status.OK] = number
        for mirror_u, mirror_v in _reflections(sensor):
            target = _reflected(camera, rows, columns, mirror_u, mirror_v)
            rays, free = _leaving(sensor, trace, mirror_u, mirror_v)
            hits = first_surfaces_on(world, rays)
            view[target] = taken
            point[target[0][free], target[1][free]] = hits.points.T
            surface[target[0][free], target[1][free]] = hits.surface
    distance = np.hypot(point[..., 0], point[..., 1])
    return GroundTruth(view, point, distance, surface)


# The mirrors, the camera and the tube of a design are round and centred on the image, so a trace in one quadrant of the
# image holds in the other three, reflected.
_REFLECTIONS = ((False, False), (True, False), (False, True), (True, True))


def _reflections(sensor: Sensor) -> tuple[tuple[bool, bool], ...]:
    """How parts of the image that are traced are reflected: right for left or not, top for bottom or not."""
    return _REFLECTIONS if sensor.is_round else _REFLECTIONS[:1]


def _pixel_blocks(sensor: Sensor, rays_per_pixel: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Rows and columns of the pixels that the lens lights and that are traced, in blocks."""
    camera, half = sensor.camera, sensor.is_round
    height, width = ((side + 1) // 2 if half else side for side in (camera.height_px, camera.width_px))
    rows, columns = np.mgrid[0:height, 0:width]
    rows, columns = rows.ravel(), columns.ravel()
    lit = is_in_field(camera, columns, rows)
    rows, columns = rows[lit], columns[lit]
    step = max(1, RAYS_PER_BLOCK // rays_per_pixel)
    for low in range(0, len(rows), step):
        yield rows[low : low + step], columns[low : low + step]


def _reflected(
    camera: Camera, rows: NDArray[np.intp], columns: NDArray[np.intp], mirror_u: bool, mirror_v: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return (
        camera.height_px - 1 - rows if mirror_v else rows,
        camera.width_px - 1 - columns if mirror_u else columns,
    )


def _leaving(
    sensor: Sensor, trace: FirstHitTrace, mirror_u: bool, mirror_v: bool
) -> tuple[SceneRays, NDArray[np.intp]]:
    """The rays that leave the sensor for the world, and their indices."""
    free = np.flatnonzero(trace.status == Status.ESCAPED)
    signs = np.array([-1.0 if mirror_u else 1.0, -1.0 if mirror_v else 1.0, 1.0])[:, None]
    left = sensor.leaving(trace.exit_point[free], trace.exit_direction[free])
    exits = (left.point[left.is_free], left.direction[left.is_free])
    points, directions = (np.multiply(vectors.T, signs, order="C") for vectors in exits)
    return SceneRays.of(points, directions), free[left.is_free]


def _seen(world: World, rays: SceneRays, free: NDArray[np.intp], spacing: Array) -> Floats:
    """Radiance (n,) along traced rays: of the world on those that are ``free``, of black parts on the others."""
    seen = np.full(spacing.shape, BLACK_PARTS_RADIANCE, dtype=np.float32)
    hits = first_surfaces_on(world, rays)
    spread = np.where(np.isfinite(hits.distance), hits.distance, 0.0) * spacing[free]
    seen[free] = radiance(world, hits, spread)
    return seen
