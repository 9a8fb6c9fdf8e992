"""A world: shapes with tones and one texture, the first surface on each ray, and what it looks like.

Frame: the design's, millimetres; rays are (3, n). Radiance is between 0 and 1 and the same in all directions, as a
matt surface has it under light from everywhere, so that both views of a point record the same brightness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.scenes.materials import Finishes, brightness
from designer.imaging.render.scenes.shapes import Coloured, Shape
from designer.imaging.render.textures import Floats, Texture, texture_values

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# Surfaces that face the lamp are this much brighter than those that face away.
LAMP = np.array([0.30, 0.42, 0.86])
LAMP_SHARE = 0.18
# Surfaces seen more edge-on than this blur no further.
GRAZING_COSINE = 1e-3


@dataclass(frozen=True, slots=True)
class World:
    """Shapes and how they look.

    ``tones`` (s,) are the mean radiances of the shapes; ``offsets`` (s, 3) in mm shift the texture for each shape, so
    that neighbours differ. ``turns`` (s, 3, 3) are orthogonal matrices that turn it for each shape: the texture
    coordinates of a place p, in the design's frame, are ``turns[s] @ p + offsets[s]``; without them nothing is turned.
    ``finishes`` are what shapes are made of, in place of tones and texture. ``background`` is the radiance where a
    ray meets nothing.
    """

    name: str
    shapes: tuple[Shape, ...]
    tones: Array
    offsets: Array
    texture: Texture
    background: float = 0.0
    turns: Array | None = None
    finishes: Finishes | None = None


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


def first_surfaces(world: World, points: Array, directions: Array) -> Hits:
    """The first surface of a world on each ray (3, n); directions are unit vectors."""
    count = points.shape[1]
    distance = np.full(count, np.inf)
    surface = np.full(count, -1, dtype=np.intp)
    # Rays start near the axis and most pass by most shapes: sorted by azimuth, those that may not are found at once.
    azimuth = np.arctan2(directions[1], directions[0])
    order = np.argsort(azimuth)
    azimuth, starts, ahead = azimuth[order], points[:, order], directions[:, order]
    farthest_start = float(np.hypot(points[0], points[1]).max(initial=0.0))
    sorted_distance, sorted_surface = distance.copy(), surface.copy()
    for index, shape in enumerate(world.shapes):
        for rays in _towards(azimuth, farthest_start, *shape.bounding_disc()):
            reached = shape.distances(starts[:, rays], ahead[:, rays])
            nearer = reached < sorted_distance[rays]
            sorted_distance[rays][nearer] = reached[nearer]
            sorted_surface[rays][nearer] = index
    distance[order], surface[order] = sorted_distance, sorted_surface
    places = points + np.where(surface >= 0, distance, np.nan) * directions
    turned = places if world.turns is None else np.einsum("nij,jn->in", world.turns[surface], places)
    return Hits(distance, surface, places, turned + world.offsets[surface].T, directions)


def _towards(azimuth: Array, farthest_start: float, centre: Array, radius: float) -> list[slice]:
    """Which rays of sorted azimuths (n,) may meet a disc in the horizontal plane: runs of those that head there.

    A ray that starts at most ``farthest_start`` from the axis meets the disc only if its azimuth differs from that of
    the centre by no more than asin((radius + farthest start) / distance of the centre).
    """
    away = float(np.hypot(*centre))
    reach = radius + farthest_start
    if reach >= away:
        return [slice(0, azimuth.size)]
    # A little wider, for rounding.
    half = np.arcsin(reach / away) + 1e-6
    middle = np.arctan2(centre[1], centre[0])
    turns = (-2.0 * np.pi, 0.0, 2.0 * np.pi)
    limits = [np.searchsorted(azimuth, (middle - half + turn, middle + half + turn)) for turn in turns]
    return [slice(int(low), int(high)) for low, high in limits if high > low]


def radiance(world: World, hits: Hits, spread: Array) -> Floats:
    """Radiance (n,) of surfaces.

    ``spread`` (n,) is the distance in mm between neighbouring samples across the rays where they meet the world; on
    a surface that a ray meets slantwise they lie farther apart, and the geometric mean of the two counts.
    """
    result = np.full(hits.distance.shape, world.background, dtype=np.float32)
    met = np.flatnonzero(hits.surface >= 0)
    if not met.size:
        return result
    surface = hits.surface[met]
    footprint = spread[met]
    seen = world.tones[surface]
    has_own = np.zeros(met.size, dtype=bool)
    # Sorted by shape, so that the rays of each are neighbours.
    order = np.argsort(surface, kind="stable")
    indices, starts = np.unique(surface[order], return_index=True)
    for index, here in zip(indices, np.split(order, starts[1:]), strict=True):
        shape, places, ahead = world.shapes[index], hits.points[:, met[here]], hits.directions[:, met[here]]
        normals = shape.normals(places, ahead)
        facing = np.abs(np.einsum("in,in->n", normals, ahead))
        footprint[here] /= np.sqrt(np.maximum(facing, GRAZING_COSINE))
        if isinstance(shape, Coloured):
            seen[here], has_own[here] = shape.albedo(places, ahead), True
        elif world.finishes is not None:
            seen[here] = brightness(world.finishes, index, shape, places, normals, ahead, footprint[here])
            has_own[here] = True
        seen[here] *= 1.0 - LAMP_SHARE + LAMP_SHARE * (LAMP @ normals)
    if has_own.all():
        result[met] = seen
    else:
        pattern = texture_values(world.texture, hits.coordinates[:, met], footprint)
        result[met] = seen * np.where(has_own, 1.0, 1.0 + pattern)
    return np.clip(result, 0.0, 1.0, out=result)
