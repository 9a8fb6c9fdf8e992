"""A world: shapes with tones and one texture, the first surface on each ray, and what it looks like.

Frame: the design's, millimetres; rays are (3, n). Radiance is between 0 and 1 and the same in all directions, as a
matt surface has it under light from everywhere, so that both views of a point record the same brightness.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.compiled import compiled_loops
from designer.imaging.render.scenes.materials import Finishes, brightness
from designer.imaging.render.scenes.shapes import Coloured, Shape
from designer.imaging.render.textures import Floats, Texture, texture_values

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# Surfaces that face the lamp are this much brighter than those that face away.
LAMP = np.array([0.30, 0.42, 0.86])
LAMP_SHARE = 0.18
# Relative: what may meet is taken this much wider.
ROUNDING = 1e-6
# Surfaces seen more edge-on than this blur no further.
GRAZING_COSINE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class BoundingCylinders:
    """What holds each of s shapes: an upright round bar, ``away`` (s,) mm from the axis at ``azimuth`` (s,)."""

    away: Array
    azimuth: Array
    radius: Array
    lowest: Array
    highest: Array


@dataclass(frozen=True, slots=True)
class World:
    """Shapes and how they look.

    ``tones`` (s,) are the mean radiances of the shapes; ``offsets`` (s, 3) in mm shift the texture for each shape, so
    that neighbours differ. ``turns`` (s, 3, 3) are orthogonal matrices that turn it for each shape: the texture
    coordinates of a place p, in the design's frame, are ``turns[s] @ p + offsets[s]``; without them nothing is turned.
    ``finishes`` are what shapes are made of, in place of tones and texture. ``background`` is the radiance where a
    ray meets nothing. ``numbers`` (s,) are the shapes for compiled loops, None for those that have none, ``coloured``
    (s,) those with an albedo of their own, None for the others.
    """

    name: str
    shapes: tuple[Shape, ...]
    tones: Array
    offsets: Array
    texture: Texture
    background: float = 0.0
    turns: Array | None = None
    finishes: Finishes | None = None
    bounds: BoundingCylinders = field(init=False, repr=False, compare=False)
    numbers: tuple[tuple[int, Array] | None, ...] = field(init=False, repr=False, compare=False)
    coloured: tuple[Coloured | None, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bounds", _bounds(self.shapes))
        loops = compiled_loops("scenes.compiled_shapes")
        object.__setattr__(self, "numbers", tuple(loops and loops.as_numbers(shape) for shape in self.shapes))
        # Asked here once, since asking takes as long as shading a hundred rays.
        coloured = (shape if isinstance(shape, Coloured) else None for shape in self.shapes)
        object.__setattr__(self, "coloured", tuple(coloured))


@dataclass(frozen=True, slots=True)
class Hits:
    """First surfaces on n rays.

    ``distance`` (n,) in mm from the ray's start, infinite where it meets nothing; ``surface`` (n,) the index of the
    shape, -1 there; ``points`` (3, n) the places, NaN there; ``coordinates`` (3, n) the texture coordinates in mm;
    ``directions`` (3, n) those of the rays.
    """

    distance: Array
    surface: Indices
    points: Array
    coordinates: Array
    directions: Array


@dataclass(frozen=True, slots=True)
class SceneRays:
    """Rays (3, n) with unit directions, ready to be met by the shapes of any world.

    ``order`` (n,) sorts them by azimuth; the others are in that order: ``azimuth`` (n,), ``starts`` and ``ahead``
    (3, n), ``levels`` (n,) the horizontal parts of the directions, ``slopes`` (n,) the rises over them.
    """

    points: Array
    directions: Array
    order: Indices
    azimuth: Array
    starts: Array
    ahead: Array
    levels: Array
    slopes: Array

    @classmethod
    def of(cls, points: Array, directions: Array) -> SceneRays:
        """From starts and unit directions (3, n)."""
        # Rays start near the axis and most pass by most shapes: sorted by azimuth, those that may not are found at
        # once.
        azimuth = np.arctan2(directions[1], directions[0])
        order = np.argsort(azimuth)
        starts, ahead = (np.stack([row[order] for row in vectors]) for vectors in (points, directions))
        levels = np.hypot(ahead[0], ahead[1])
        with np.errstate(divide="ignore"):
            slopes = ahead[2] / levels
        return cls(points, directions, order, azimuth[order], starts, ahead, levels, slopes)


def first_surfaces(world: World, points: Array, directions: Array) -> Hits:
    """The first surface of a world on each ray (3, n); directions are unit vectors."""
    return first_surfaces_on(world, SceneRays.of(points, directions))


def first_surfaces_on(world: World, rays: SceneRays) -> Hits:
    """The same on rays that other worlds may have met."""
    count, order = rays.order.size, rays.order
    found, found_surface = np.full(count, np.inf), np.full(count, -1, dtype=np.intp)
    loops = compiled_loops("scenes.compiled_shapes")
    for run in _candidates(world.bounds, rays.azimuth, rays.starts):
        numbers, around = world.numbers[run.surface], (rays.starts, rays.ahead, rays.slopes, rays.levels)
        if loops is None or numbers is None:
            _meet_run(world.shapes[run.surface], run, *around, found, found_surface)
        else:
            loops.meet_run(*numbers, *run, *around, found, found_surface)
    distance, surface = np.empty(count), np.empty(count, dtype=np.intp)
    distance[order], surface[order] = found, found_surface
    places = rays.points + np.where(surface >= 0, distance, np.nan) * rays.directions
    turned = places if world.turns is None else np.einsum("nij,jn->in", world.turns[surface], places)
    return Hits(distance, surface, places, turned + world.offsets.T[:, surface], rays.directions)


class _Run(NamedTuple):
    """Rays, from ``first`` to before ``last`` in order of azimuth, that head for a shape.

    A meeting lies at least ``nearest`` mm from the start, horizontally, and a ray that meets the shape rises (over
    horizontal distance) by at least ``lowest`` and at most ``highest``.
    """

    surface: int
    first: int
    last: int
    nearest: float
    lowest: float
    highest: float


def _meet_run(
    shape: Shape,
    run: _Run,
    points: Array,
    directions: Array,
    slopes: Array,
    levels: Array,
    found: Array,
    found_surface: Indices,
) -> None:
    """Enter a shape that is nearer than what was found into ``found`` and ``found_surface`` (n,), for a run of rays.

    ``slopes`` (n,) are the rises of the rays (3, n), ``levels`` (n,) the horizontal parts of their directions.
    """
    rays = slice(run.first, run.last)
    with np.errstate(invalid="ignore"):
        is_hidden = found[rays] * levels[rays] < run.nearest
    chosen = np.flatnonzero((slopes[rays] >= run.lowest) & (slopes[rays] <= run.highest) & ~is_hidden) + run.first
    if not chosen.size:
        return
    reached = shape.distances(points[:, chosen], directions[:, chosen])
    nearer = np.flatnonzero(reached < found[chosen])
    found[chosen[nearer]], found_surface[chosen[nearer]] = reached[nearer], run.surface


def _bounds(shapes: tuple[Shape, ...]) -> BoundingCylinders:
    discs = [shape.bounding_disc() for shape in shapes]
    centres = np.array([centre for centre, _ in discs]).reshape(-1, 2)
    heights = np.array([shape.heights() for shape in shapes]).reshape(-1, 2)
    radii = np.array([radius for _, radius in discs])
    away, azimuth = np.hypot(centres[:, 0], centres[:, 1]), np.arctan2(centres[:, 1], centres[:, 0])
    return BoundingCylinders(away, azimuth, radii, heights[:, 0], heights[:, 1])


def _candidates(bounds: BoundingCylinders, azimuth: Array, starts: Array) -> Iterator[_Run]:
    """For each shape the runs of rays of sorted azimuths (n,) that may meet it.

    A ray that starts at most ``off`` from the axis meets the disc only if its azimuth differs from that of the centre
    by no more than asin((radius + off) / distance of the centre).
    """
    if not azimuth.size:
        return
    off = float(np.hypot(starts[0], starts[1]).max())
    highest_start, lowest_start = starts[2].max(), starts[2].min()
    reach = bounds.radius + off
    nearest, farthest = np.maximum(bounds.away - reach, 0.0), bounds.away + reach
    fall, rise = bounds.lowest - highest_start, bounds.highest - lowest_start
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.where(reach < bounds.away, np.arcsin(np.minimum(reach / bounds.away, 1.0)), np.pi)
        lowest = np.where(fall < 0.0, fall / nearest, fall / farthest)
        highest = np.where(rise > 0.0, rise / nearest, rise / farthest)
    # A little wider, for rounding.
    half += ROUNDING
    lowest, highest = lowest - ROUNDING * (1.0 + np.abs(lowest)), highest + ROUNDING * (1.0 + np.abs(highest))
    nearest = nearest * (1.0 - ROUNDING)
    turns = np.array([-2.0 * np.pi, 0.0, 2.0 * np.pi])[:, None]
    first = np.searchsorted(azimuth, bounds.azimuth - half + turns)
    last = np.searchsorted(azimuth, bounds.azimuth + half + turns, side="right")
    # A shape all around is met once, by all rays.
    all_around = half > np.pi
    first[:, all_around], last[:, all_around] = azimuth.size, azimuth.size
    first[0, all_around] = 0
    index, turn = np.nonzero((last > first).T)
    columns = (index, first[turn, index], last[turn, index], nearest[index], lowest[index], highest[index])
    yield from map(_Run, *(column.tolist() for column in columns))


def radiance(world: World, hits: Hits, spread: Array) -> Floats:
    """Radiance (n,) of surfaces.

    ``spread`` (n,) is the distance in mm between neighbouring samples across the rays where they meet the world; on
    a surface that a ray meets slantwise they lie farther apart, and the geometric mean of the two counts.
    """
    result = np.full(hits.distance.shape, world.background, dtype=np.float32)
    met = np.flatnonzero(hits.surface >= 0)
    if not met.size:
        return result
    # Sorted by shape, so that the rays of each are neighbours; short numbers are sorted by their digits, which is fast.
    short = hits.surface[met].astype(np.min_scalar_type(len(world.shapes)))
    met = met[np.argsort(short, kind="stable")]
    surface, footprint = hits.surface[met], spread[met]
    seen = world.tones[surface]
    has_own = np.zeros(met.size, dtype=bool)
    points, directions = (np.stack([row[met] for row in vectors]) for vectors in (hits.points, hits.directions))
    starts = np.flatnonzero(np.diff(surface, prepend=-1))
    for first, last in pairwise([*starts.tolist(), met.size]):
        index, here = int(surface[first]), slice(first, last)
        shape, places, ahead = world.shapes[index], points[:, here], directions[:, here]
        normals = shape.normals(places, ahead)
        facing = np.abs(np.einsum("in,in->n", normals, ahead))
        footprint[here] /= np.sqrt(np.maximum(facing, GRAZING_COSINE))
        coloured = world.coloured[index]
        if coloured is not None:
            seen[here], has_own[here] = coloured.albedo(places, ahead), True
        elif world.finishes is not None:
            seen[here] = brightness(world.finishes, index, shape, places, normals, ahead, footprint[here])
            has_own[here] = True
        seen[here] *= 1.0 - LAMP_SHARE + LAMP_SHARE * (LAMP @ normals)
    if has_own.all():
        result[met] = seen
    else:
        pattern = texture_values(world.texture, np.stack([row[met] for row in hits.coordinates]), footprint)
        result[met] = seen * np.where(has_own, 1.0, 1.0 + pattern)
    return np.clip(result, 0.0, 1.0, out=result)
