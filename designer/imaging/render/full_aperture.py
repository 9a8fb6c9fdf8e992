"""Images through the whole pupil: defocus, vignetting by the edges of mirrors, and what the lens does to light.

A pixel's light comes from a disc of the pupil through a square of the sensor. Each of its few rays stands for a cell
of the two, and sees the texture through a Gaussian with the second moments of that cell where it meets the world. Rays
start at the centres of their cells, so that all cells together have the second moments of square and disc, and blur a
texture as a thousand rays would. What has no texture of its own, the outlines of shapes and the edges of mirrors, is
seen from the centres alone: with n rays its blur is narrower by 1 / (2 n). Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design
from designer.imaging.render.camera_rays import Array, angular_spacing, is_in_field, on_sensor, stretched_area
from designer.imaging.render.lens import Pupil, RenderedLens, diffract, pupil_of
from designer.imaging.render.passage import (
    BLACK_PARTS_RADIANCE,
    UNKNOWN,
    Passage,
    find_passage,
    pencil_terms,
    trace_pupil,
)
from designer.imaging.render.scenes.world import SceneRays, World, first_surfaces_on, radiance
from designer.imaging.render.sensor import Sensor, sensor_of
from designer.imaging.render.textures import Floats
from designer.imaging.render.threads import for_each
from designer.trace.instrument import build_instrument

Pixels = NDArray[np.intp]

RAYS_PER_BLOCK = 16384
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
# Steps of an even sequence in two dimensions (M. Roberts, The unreasonable effectiveness of quasirandom sequences,
# 2018): neighbouring pixels turn their places in the pupil by angles that lie far apart.
TURN_ACROSS, TURN_DOWN = 0.7548776662466927, 0.5698402909980532
PAIRINGS_TRIED = 2000


@dataclass(frozen=True, slots=True)
class Symmetry:
    """A reflection of the image: x and y exchanged or not, then each reversed or not."""

    swaps: bool
    reverses_u: bool
    reverses_v: bool

    def of(self, vectors: Array) -> Array:
        """Reflected vectors (2 or 3, n)."""
        result = np.empty_like(vectors)
        first, second = (1, 0) if self.swaps else (0, 1)
        np.multiply(vectors[first], -1.0 if self.reverses_u else 1.0, out=result[0])
        np.multiply(vectors[second], -1.0 if self.reverses_v else 1.0, out=result[1])
        result[2:] = vectors[2:]
        return result


QUADRANTS = tuple(Symmetry(False, *reversed_) for reversed_ in product((False, True), repeat=2))
IDENTITY = QUADRANTS[0]
OCTANTS = tuple(Symmetry(*choice) for choice in product((False, True), repeat=3))


@dataclass(frozen=True, slots=True)
class PixelBlock:
    """Pixels (n,) of one part of the image, and the reflections that make the other parts of it."""

    rows: Pixels
    columns: Pixels
    symmetries: tuple[Symmetry, ...]


@dataclass(frozen=True, slots=True)
class Optics:
    """What all rays of a design share: its surfaces, its pupil, and what is known of the light's ways."""

    sensor: Sensor
    pupil: Pupil
    passage: Passage
    spacing: Callable[[Array], Array]

    @classmethod
    def of(cls, design: Design) -> Optics:
        """Trace what is needed of a design before any pixel."""
        sensor, nominal = sensor_of(design), build_instrument(design)
        passage = find_passage(design, nominal, pupil_of(design.camera))
        if sensor.built is not None:
            # What is known of the design's rings of the image says nothing sure of a built sensor's.
            passage = replace(passage, way_of_ring=np.full_like(passage.way_of_ring, UNKNOWN))
        return cls(sensor, pupil_of(sensor.camera), passage, angular_spacing(design, nominal))


def render_full_aperture(
    design: Design, worlds: Sequence[World], samples: int, lens: RenderedLens, seed: int
) -> list[Floats]:
    """The images (h, w) of worlds through the pupil and a lens; ``samples`` squared rays for each pixel."""
    optics = Optics.of(design)
    camera = optics.sensor.camera
    images = [np.zeros((camera.height_px, camera.width_px), dtype=np.float32) for _ in worlds]
    turn = float(np.random.default_rng(seed).random())

    def work(_: int, block: PixelBlock) -> None:
        for rows, columns, radiances in render_block(optics, worlds, block, samples, lens, turn):
            for image, values in zip(images, radiances, strict=True):
                image[rows, columns] = values

    for_each(work, _blocks(camera, samples**2, optics.sensor.is_round))
    if lens.wavelength_nm is None:
        return images
    return [diffract(image, camera, lens.wavelength_nm) for image in images]


def render_block(
    optics: Optics, worlds: Sequence[World], block: PixelBlock, samples: int, lens: RenderedLens, turn: float
) -> Iterator[tuple[Pixels, Pixels, list[Floats]]]:
    """Rows, columns and, for each world, radiances (n,) of the pixels of a block, for each of its reflections.

    Without diffraction, which needs the whole image. ``turn`` is that of :func:`sample_cells`.
    """
    u, v, starts = sample_cells(block.rows, block.columns, samples, optics.pupil, turn)
    sensor = optics.sensor
    ahead = sensor.directions(u, v, starts, optics.pupil)
    radii = np.hypot(*on_sensor(sensor.camera, u, v))
    trace = trace_pupil(optics.passage, sensor.instrument, radii, ahead, starts)
    share = lens.transmission(ahead, trace.reflections, stretched_area(sensor.camera, radii))
    free = np.flatnonzero(trace.leaves)
    left = sensor.leaving(trace.exit_point[free], trace.exit_direction[free])
    free = free[left.is_free]
    pencil = pencil_terms(optics.passage, trace, radii)[:, free]
    footprint = Footprint.of(optics.spacing(radii[free]), pencil, samples, optics.pupil.radius_mm)
    exits = (left.point[left.is_free], left.direction[left.is_free])
    points, directions = (np.ascontiguousarray(vectors.T) for vectors in exits)
    for symmetry in block.symmetries:
        radiances = []
        rays = SceneRays.of(symmetry.of(points), symmetry.of(directions))
        for world in worlds:
            seen = np.full(len(share), BLACK_PARTS_RADIANCE, dtype=np.float32)
            hits = first_surfaces_on(world, rays)
            seen[free] = radiance(world, hits, footprint.at(np.where(hits.surface >= 0, hits.distance, 0.0)))
            seen *= share
            radiances.append(seen.reshape(-1, samples**2).mean(axis=1))
        yield *_target(sensor.camera, block, symmetry), radiances


@dataclass(frozen=True, slots=True)
class Footprint:
    """How wide the cells of rays (n,) are at a distance: ``pixel`` in radians, ``pencil`` (4, n) as in Passage."""

    pixel: Array
    pencil: Array

    @classmethod
    def of(cls, spacing: Array, pencil: Array, samples: int, pupil_radius: float) -> Footprint:
        """From the angles between pixels and the pencils of the pupil; scaled to twice the cells' deviation."""
        # A square of side a has the standard deviation a / sqrt(12) along each axis, and one of the n equal cells of
        # a disc that of a small disc, radius / 2 / sqrt(n).
        return cls(spacing * (2.0 / np.sqrt(12.0) / samples), pencil * (pupil_radius / samples))

    def at(self, distance: Array) -> Array:
        """Widths (n,) in mm: twice the standard deviation of the cells, as textures are filtered."""
        along, along_rise, across, across_rise = self.pencil
        pencil = (along + along_rise * distance) * (across + across_rise * distance)
        return np.asarray(np.sqrt(np.square(self.pixel * distance) + np.abs(pencil)))


def sample_cells(rows: Pixels, columns: Pixels, samples: int, pupil: Pupil, turn: float) -> tuple[Array, Array, Array]:
    """Places (u, v) on the image and starts (n, 3) in the pupil: samples^2 for each pixel, in a row.

    The places in the pupil are turned from pixel to pixel; ``turn``, from 0 to 1, turns all of them.
    """
    in_pixel, in_pupil = cell_centres(samples)
    angle = 2.0 * np.pi * np.mod(columns * TURN_ACROSS + rows * TURN_DOWN + turn, 1.0)
    cosine, sine = (pupil.radius_mm * wave(angle)[:, None] for wave in (np.cos, np.sin))
    x = cosine * in_pupil[0] - sine * in_pupil[1]
    y = sine * in_pupil[0] + cosine * in_pupil[1]
    u = (columns[:, None] + in_pixel[0]).ravel()
    v = (rows[:, None] + in_pixel[1]).ravel()
    return u, v, np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)


@lru_cache
def cell_centres(samples: int) -> tuple[Array, Array]:
    """Centres of cells in a pixel (2, samples^2), in pixels from its middle, and in a pupil of radius 1.

    The pixel is cut into equal squares; the places in the pupil lie on a sunflower's spiral, each in a cell of equal
    area, drawn in so that cells and centres together have the second moment of the disc. The two are paired so that
    they are as little correlated as can be found.
    """
    count = samples**2
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    in_pixel = np.stack(np.meshgrid(steps, steps)).reshape(2, count)
    index = np.arange(count)
    spiral = np.sqrt((index + 0.5) / count) * np.stack([np.cos(index * GOLDEN_ANGLE), np.sin(index * GOLDEN_ANGLE)])
    if count > 1:
        spiral -= spiral.mean(axis=1, keepdims=True)
        spiral *= np.sqrt((1.0 - 1.0 / count) / 2.0 / np.square(spiral).sum(axis=0).mean())
    else:
        spiral[:] = 0.0
    random = np.random.default_rng(count)
    orders = [random.permutation(count) for _ in range(PAIRINGS_TRIED)]
    order = min(orders, key=lambda trial: float(np.abs(in_pixel[:, trial] @ spiral.T).max()))
    return in_pixel[:, order], spiral


def _blocks(camera: Camera, rays_per_pixel: int, is_round: bool = True) -> Iterator[PixelBlock]:
    """The pixels that the lens lights: an octant of the image, and what of a quadrant has no octant to reflect.

    Of a sensor that is not round, all of them. Pixels of like azimuth are together: they see the same few
    shapes.
    """
    u0, v0 = camera.principal_point_px
    height, width = (int(v0) + 1, int(u0) + 1) if is_round else (camera.height_px, camera.width_px)
    rows, columns = (grid.ravel() for grid in np.mgrid[0:height, 0:width])
    left, up = u0 - columns, v0 - rows
    lit = is_in_field(camera, columns, rows)
    # Pixel centres fall on pixel centres when x and y are exchanged.
    swaps = (left <= v0) & (up <= u0) & ((u0 - v0) % 1.0 == 0.0)
    step = max(1, RAYS_PER_BLOCK // rays_per_pixel)
    parts = ((lit & swaps & (left >= up), OCTANTS), (lit & ~swaps, QUADRANTS)) if is_round else ((lit, (IDENTITY,)),)
    for chosen, symmetries in parts:
        pixels = np.flatnonzero(chosen)
        pixels = pixels[np.argsort(np.arctan2(up[pixels], left[pixels]), kind="stable")]
        for low in range(0, len(pixels), step):
            block = pixels[low : low + step]
            yield PixelBlock(rows[block], columns[block], symmetries)


def _target(camera: Camera, block: PixelBlock, symmetry: Symmetry) -> tuple[Pixels, Pixels]:
    """Rows and columns of the reflected pixels."""
    u0, v0 = camera.principal_point_px
    x, y = symmetry.of(np.stack([block.columns - u0, block.rows - v0]))
    return np.rint(y + v0).astype(np.intp), np.rint(x + u0).astype(np.intp)
