"""Where rays meet the surfaces of an instrument, and how its mirrors reflect them.

Rays are held as three rows (x, y, z) of n columns. In an aligned instrument, where everything is round about the axis,
rays from the axis stay in their meridional planes: they are held as two rows (r, z), with r the signed distance from
the axis, and their start as the one row z. Every function here takes either. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.trace.arrays import Array, Indices, Rows
from designer.trace.conics import Rays, dot_product, leading_term, mirrored, points_along, quadratic, reflecting_root
from designer.trace.instrument import Conics, Cylinders, Instrument

# A ray that starts on a face is kept from meeting, at its very start, the walls that end in the same rim.
NEAREST_HIT_MM = 1e-9


def first_hits(
    instrument: Instrument, points: Rows, directions: Rows, left: Indices, *, camera: bool
) -> tuple[Array, Indices]:
    """Distance to the first surface on each ray, and the row of that surface in ``instrument.elements``.

    Parameters
    ----------
    points, directions
        Rows (n,), world frame; directions are unit vectors.
    left
        Shape (n,): the mirror whose face the ray has just left, or -1.
    camera
        Whether lens barrel and body are there (they are not for a ray that still is inside the lens).

    Returns
    -------
    Distances (n,), infinite where the ray meets nothing, and rows (n,), -1 there.
    """
    count = len(instrument.mirrors)
    conics = instrument.conics
    rays = _in_frames(instrument, conics.frame, points, directions)
    rays = replace(rays, height=rays.height - conics.offset[:, None])
    plus, minus = _conic_roots(conics, rays, left)
    plus = _within_conic(conics, plus, rays)
    minus = _within_conic(conics, minus, rays)
    looks_up = instrument.facing[:, None] > 0.0
    fronts = np.where(looks_up, plus[:count], minus[:count])
    rears = np.where(looks_up, minus[:count], plus[:count])
    distances = [fronts, rears, np.minimum(plus[count:], minus[count:])]

    walls = instrument.cylinders
    kept = slice(None) if camera else slice(0, len(walls.radius) - 2)
    if camera or len(walls.radius) > 2:
        distances.append(_cylinder_hits(walls, kept, _in_frames(instrument, walls.frame[kept], points, directions)))
    if camera:
        to_disc = (instrument.discs.height[:, None] - points[-1]) / directions[-1]
        *across, _ = points_along(Rays(points[:-1], points[-1], directions[:-1], directions[-1]), to_disc)
        met = (to_disc > NEAREST_HIT_MM) & (dot_product(across, across) <= instrument.discs.outer[:, None] ** 2)
        distances.append(np.where(met, to_disc, np.inf))

    stacked = np.concatenate(distances)
    row = np.argmin(stacked, axis=0)
    nearest = stacked[row, np.arange(row.size)]
    return nearest, np.where(np.isfinite(nearest), row, -1)


def reflect(instrument: Instrument, faces: Indices, points: Array, directions: Array) -> Array:
    """Directions (2 or 3, n) after reflection at points (2 or 3, n) of the faces (n,): d - 2 (d.n) n."""
    curvature = instrument.conics.curvature[faces]
    one_plus_conic = instrument.conics.one_plus_conic[faces]
    if instrument.is_aligned:
        rows = [*points[:-1], points[-1] - instrument.origins[faces, 2]]
        return np.stack(mirrored(curvature, one_plus_conic, rows, directions))
    turns = instrument.rotations[faces]
    local = _turned(turns, points - instrument.origins[faces].T, back=True)
    return _turned(turns, np.stack(mirrored(curvature, one_plus_conic, local, _turned(turns, directions, back=True))))


def meet_face(
    instrument: Instrument, face: int, points: Rows, directions: Rows, *, aperture: bool
) -> tuple[list[Array], list[Array]]:
    """Points on one mirror's face, met from its reflecting side, and the directions after it: rows of shape (n,).

    Both are NaN where the ray misses the face. A straight line meets the reflecting side of a conic's vertex sheet
    at most once, where the derivative of the conic's equation along the ray has the sign of the side: one root is
    enough.
    """
    conics = instrument.conics
    curvature, one_plus_conic = conics.curvature[face], conics.one_plus_conic[face]
    rays = _in_frame(instrument, face, points, directions)
    distance = reflecting_root(curvature, one_plus_conic, instrument.facing[face], rays)
    landed = points_along(rays, distance)
    met = distance > NEAREST_HIT_MM
    met &= curvature * one_plus_conic * landed[-1] <= 1.0
    if aperture:
        across = dot_product(landed[:-1], landed[:-1])
        met &= across >= conics.inner[face] ** 2
        met &= across <= conics.outer[face] ** 2
    reflected = (
        [*rays.direction_across, -rays.direction_along]
        if curvature == 0.0
        else mirrored(curvature, one_plus_conic, landed, [*rays.direction_across, rays.direction_along])
    )
    if not met.all():
        landed, reflected = ([np.where(met, row, np.nan) for row in rows] for rows in (landed, reflected))
    return _out_of_frame(instrument, face, landed, reflected)


def _conic_roots(conics: Conics, rays: Rays, left: Indices) -> tuple[Array, Array]:
    """Distances (m, n) at which rays cross the conics upwards out of and down into the region above them.

    The first root has a s - b = +sqrt(b^2 - a v), the second the negative. Neither subtracts like quantities.
    """
    shape = conics.curvature[:, None], conics.one_plus_conic[:, None]
    slope, value, discriminant = quadratic(*shape, rays)
    started = np.flatnonzero(left >= 0)
    # A point on the surface has value 0 exactly: its root at the start vanishes and the other one is kept.
    value[left[started], started] = 0.0
    root = np.sqrt(discriminant)
    stable = slope + np.copysign(root, slope)
    near, far = value / stable, stable / leading_term(*shape, rays)
    rising = np.signbit(slope)
    return np.where(rising, near, far), np.where(rising, far, near)


def _within_conic(conics: Conics, distance: Array, rays: Rays) -> Array:
    """The distance where it is forward, on the vertex sheet and inside the aperture; infinite elsewhere."""
    *landed, height = points_along(rays, distance)
    across = dot_product(landed, landed)
    met = (
        (distance > NEAREST_HIT_MM)
        & (across >= (conics.inner**2)[:, None])
        & (across <= (conics.outer**2)[:, None])
        & ((conics.one_plus_conic * conics.curvature)[:, None] * height <= 1.0)
    )
    return np.where(met, distance, np.inf)


def _cylinder_hits(walls: Cylinders, kept: slice, rays: Rays) -> Array:
    """Distances (m, n) to cylindrical walls, infinite where a wall is not met."""
    across, lateral = rays.across, rays.direction_across
    radius = walls.radius[kept][:, None]
    lateral_squared = dot_product(lateral, lateral)
    discriminant = lateral_squared * radius**2
    if len(across) == 2:
        discriminant -= (across[0] * lateral[1] - across[1] * lateral[0]) ** 2
    outwards = dot_product(across, lateral) if len(across) else np.zeros(1)
    from_axis = np.sqrt(dot_product(across, across)) if len(across) else np.zeros(1)
    stable = -(outwards + np.copysign(np.sqrt(discriminant), outwards))
    value = (from_axis - radius) * (from_axis + radius)
    low, high = walls.low[kept][:, None], walls.high[kept][:, None]
    best = np.full(discriminant.shape, np.inf)
    for distance in (stable / lateral_squared, value / stable):
        height = rays.height + distance * rays.direction_along
        met = (distance > NEAREST_HIT_MM) & (height >= low) & (height <= high)
        best = np.where(met & (distance < best), distance, best)
    return best


def _in_frames(instrument: Instrument, frames: Indices, points: Rows, directions: Rows) -> Rays:
    """Rays in frames, each coordinate broadcastable to (frames, n)."""
    if instrument.is_aligned:
        return Rays(points[:-1], points[-1] - instrument.origins[frames, 2][:, None], directions[:-1], directions[-1])
    back = instrument.rotations[frames].transpose(0, 2, 1)
    x, y, z = (back @ (np.asarray(points) - instrument.origins[frames][:, :, None])).transpose(1, 0, 2)
    dx, dy, dz = (back @ np.asarray(directions)).transpose(1, 0, 2)
    return Rays((x, y), z, (dx, dy), dz)


def _in_frame(instrument: Instrument, frame: int, points: Rows, directions: Rows) -> Rays:
    """Rays in one frame."""
    if instrument.is_aligned:
        return Rays(points[:-1], points[-1] - instrument.origins[frame, 2], directions[:-1], directions[-1])
    turn = instrument.rotations[frame]
    x, y, z = _turned(turn, np.asarray(points) - instrument.origins[frame][:, None], back=True)
    dx, dy, dz = _turned(turn, np.asarray(directions), back=True)
    return Rays((x, y), z, (dx, dy), dz)


def _out_of_frame(
    instrument: Instrument, frame: int, points: list[Array], directions: list[Array]
) -> tuple[list[Array], list[Array]]:
    """Points and directions of one frame in the world's."""
    if instrument.is_aligned:
        return [*points[:-1], points[-1] + instrument.origins[frame, 2]], directions
    turn = instrument.rotations[frame]
    world = _turned(turn, np.stack(points)) + instrument.origins[frame][:, None]
    return list(world), list(_turned(turn, np.stack(directions)))


def _turned(rotations: Array, vectors: Array, *, back: bool = False) -> Array:
    """Vectors (3, n) turned by one rotation (3, 3) or by one each (n, 3, 3), or turned back."""
    indices = (
        ("ji,jn->in" if back else "ij,jn->in") if rotations.ndim == 2 else ("nji,jn->in" if back else "nij,jn->in")
    )
    return np.asarray(np.einsum(indices, rotations, vectors))
