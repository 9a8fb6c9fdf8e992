"""What a ray can meet: mirror faces, substrates, lens barrel and camera body, and where a ray meets them.

Every mirror is written in its own frame, vertex at the origin and optical axis along z, and may be posed anywhere.
In that frame its face is the vertex sheet of c (x^2 + y^2 + k z^2) = 2 z, with c = 1/radius (0 for a plane) and
k = 1 + conic constant; on it 1 - k c z >= 0, and on the other sheet of a hyperboloid (or beyond the equator of an
ellipsoid) 1 - k c z < 0. Lengths in mm. Rays are held as three rows (x, y, z) of n columns. In an aligned scene, where
everything is round about the axis, rays from the axis stay in their meridional planes: they are held as two rows
(r, z), with r the signed distance from the axis, and their start as the one row z. Every function here takes either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, Mirror
from designer.verify.conics import Array as Array
from designer.verify.conics import Rays, Rows, along, dot, ends, mirrored, quadratic, reflecting_root

Indices = NDArray[np.intp]

BARREL = "lens barrel"
BODY = "camera body"
# A ray that starts on a face is kept from meeting, at its very start, the walls that end in the same rim.
NEAREST_HIT_MM = 1e-9


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a mirror sits instead of its nominal place: turned about its vertex, then shifted.

    ``rotation`` is a 3 x 3 rotation matrix and ``shift_mm`` a displacement (3,), both in the world frame:
    x = vertex + shift + rotation (x_nominal - vertex).
    """

    rotation: Array
    shift_mm: Array


@dataclass(frozen=True, slots=True)
class Conics:
    """Annular pieces of conics of revolution, one per entry; all arrays (m,)."""

    frame: Indices
    curvature: Array
    squeeze: Array
    offset: Array
    inner: Array
    outer: Array


@dataclass(frozen=True, slots=True)
class Cylinders:
    """Walls about the axis of a frame, from ``low`` to ``high``; all arrays (m,)."""

    frame: Indices
    radius: Array
    low: Array
    high: Array


@dataclass(frozen=True, slots=True)
class Discs:
    """Flat discs across the axis of the camera; arrays (m,)."""

    height: Array
    outer: Array


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a ray can meet.

    ``conics`` holds the m mirror faces first, in the order of ``mirrors``, then the backs of the substrates.
    ``elements`` names each row of :func:`first_hits`: m reflecting faces, the same m faces from behind, the backs,
    the walls (camera walls last) and the camera's discs. ``facing`` is +1 for a face that looks up and -1 for one
    that looks down. Frame m belongs to the camera.
    """

    mirrors: tuple[str, ...]
    facing: Array
    conics: Conics
    cylinders: Cylinders
    discs: Discs
    elements: tuple[str, ...]
    origins: Array
    rotations: Array
    is_aligned: bool

    def path(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Indices of mirrors by name. Raises ValueError for a name that is not there."""
        return tuple(self.mirrors.index(name) for name in names)


def sag(mirror: Mirror, radius: Array | float) -> Array:
    """Height in mm of a mirror's face above its vertex at a distance from the axis; NaN beyond an equator."""
    radius = np.asarray(radius, dtype=float)
    if mirror.radius_mm is None:
        return np.zeros_like(radius)
    curvature = 1.0 / mirror.radius_mm
    with np.errstate(invalid="ignore", over="ignore"):
        slope_root = np.sqrt(1.0 - (1.0 + mirror.conic) * (curvature * radius) ** 2)
        return np.asarray(curvature * radius**2 / (1.0 + slope_root))


def build_scene(design: Design, poses: Mapping[str, Pose] | None = None) -> Scene:
    """The surfaces of a design, each mirror in its nominal place or in the pose given for its name.

    Raises
    ------
    KeyError
        A pose names a mirror that the design does not have.
    """
    poses = dict(poses or {})
    mirrors = design.mirrors
    count = len(mirrors)
    origins = np.zeros((count + 1, 3))
    rotations = np.tile(np.eye(3), (count + 1, 1, 1))
    names = [mirror.name for mirror in mirrors]
    for index, mirror in enumerate(mirrors):
        origins[index, 2] = mirror.vertex_mm
    for name, pose in poses.items():
        if name not in names:
            raise KeyError(f"no mirror {name!r}; the mirrors are {', '.join(names)}")
        origins[names.index(name)] += pose.shift_mm
        rotations[names.index(name)] = pose.rotation

    faces, backs, back_names = [], [], []
    walls: list[tuple[int, float, float, float]] = []
    wall_names: list[str] = []
    for index, mirror in enumerate(mirrors):
        curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
        shape = (curvature, 1.0 + mirror.conic)
        aperture = (mirror.inner_radius_mm, mirror.outer_radius_mm)
        faces.append((index, *shape, 0.0, *aperture))
        if mirror.thickness_mm == 0.0:
            continue
        back = mirror.back_offset_mm
        backs.append((index, *shape, back, *aperture))
        back_names.append(f"back of {mirror.name}")
        for radius, label in ((aperture[1], "outer edge"), (aperture[0], "hole edge")):
            if radius > 0.0:
                height = float(sag(mirror, radius))
                walls.append((index, radius, min(height, height + back), max(height, height + back)))
                wall_names.append(f"{label} of {mirror.name}")

    camera = design.camera
    seat = camera.lens_seat_mm
    walls.append((count, camera.lens_radius_mm, seat, camera.lens_front_mm))
    walls.append((count, camera.body_radius_mm, -np.inf, seat))
    discs = [(camera.lens_front_mm, camera.lens_radius_mm), (seat, max(camera.body_radius_mm, camera.lens_radius_mm))]
    disc_names = [BARREL, BODY if camera.body_radius_mm >= camera.lens_radius_mm else BARREL]

    conic_table = np.array(faces + backs, dtype=float).T
    wall_table = np.array(walls, dtype=float).T
    disc_table = np.array(discs, dtype=float).T
    return Scene(
        mirrors=tuple(names),
        facing=np.array([1.0 if mirror.faces == "up" else -1.0 for mirror in mirrors]),
        conics=Conics(conic_table[0].astype(np.intp), *conic_table[1:]),
        cylinders=Cylinders(wall_table[0].astype(np.intp), *wall_table[1:]),
        discs=Discs(*disc_table),
        elements=(
            *names,
            *(f"back of {name}" for name in names),
            *back_names,
            *wall_names,
            BARREL,
            BODY,
            *disc_names,
        ),
        origins=origins,
        rotations=rotations,
        is_aligned=not poses,
    )


def first_hits(scene: Scene, points: Rows, directions: Rows, left: Indices, *, camera: bool) -> tuple[Array, Indices]:
    """Distance to the first surface on each ray, and the row of that surface in ``scene.elements``.

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
    count = len(scene.mirrors)
    conics = scene.conics
    rays = _in_frames(scene, conics.frame, points, directions)
    rays = replace(rays, height=rays.height - conics.offset[:, None])
    plus, minus = _conic_roots(conics, rays, left)
    plus = _within_conic(conics, plus, rays)
    minus = _within_conic(conics, minus, rays)
    looks_up = scene.facing[:, None] > 0.0
    fronts = np.where(looks_up, plus[:count], minus[:count])
    rears = np.where(looks_up, minus[:count], plus[:count])
    distances = [fronts, rears, np.minimum(plus[count:], minus[count:])]

    walls = scene.cylinders
    kept = slice(None) if camera else slice(0, len(walls.radius) - 2)
    if camera or len(walls.radius) > 2:
        distances.append(_cylinder_hits(walls, kept, _in_frames(scene, walls.frame[kept], points, directions)))
    if camera:
        reach = (scene.discs.height[:, None] - points[-1]) / directions[-1]
        *across, _ = ends(Rays(points[:-1], points[-1], directions[:-1], directions[-1]), reach)
        met = (reach > NEAREST_HIT_MM) & (dot(across, across) <= scene.discs.outer[:, None] ** 2)
        distances.append(np.where(met, reach, np.inf))

    stacked = np.concatenate(distances)
    row = np.argmin(stacked, axis=0)
    nearest = stacked[row, np.arange(row.size)]
    return nearest, np.where(np.isfinite(nearest), row, -1)


def reflect(scene: Scene, faces: Indices, points: Array, directions: Array) -> Array:
    """Directions (2 or 3, n) after reflection at points (2 or 3, n) of the faces (n,): d - 2 (d.n) n."""
    curvature = scene.conics.curvature[faces]
    squeeze = scene.conics.squeeze[faces]
    if scene.is_aligned:
        rows = [*points[:-1], points[-1] - scene.origins[faces, 2]]
        return np.stack(mirrored(curvature, squeeze, rows, directions))
    turns = scene.rotations[faces]
    local = _turned(turns, points - scene.origins[faces].T, back=True)
    return _turned(turns, np.stack(mirrored(curvature, squeeze, local, _turned(turns, directions, back=True))))


def meet_face(
    scene: Scene, face: int, points: Rows, directions: Rows, *, aperture: bool
) -> tuple[list[Array], list[Array]]:
    """Points on one mirror's face, met from its reflecting side, and the directions after it: rows of shape (n,).

    Both are NaN where the ray misses the face. A straight line meets the reflecting side of a conic's vertex sheet
    at most once, where the derivative of the conic's equation along the ray has the sign of the side: one root is
    enough.
    """
    conics = scene.conics
    curvature, squeeze = conics.curvature[face], conics.squeeze[face]
    rays = _in_frame(scene, face, points, directions)
    distance = reflecting_root(curvature, squeeze, scene.facing[face], rays)
    landed = ends(rays, distance)
    met = distance > NEAREST_HIT_MM
    met &= curvature * squeeze * landed[-1] <= 1.0
    if aperture:
        across = dot(landed[:-1], landed[:-1])
        met &= across >= conics.inner[face] ** 2
        met &= across <= conics.outer[face] ** 2
    reflected = (
        [*rays.heading, -rays.climb]
        if curvature == 0.0
        else mirrored(curvature, squeeze, landed, [*rays.heading, rays.climb])
    )
    if not met.all():
        landed, reflected = ([np.where(met, row, np.nan) for row in rows] for rows in (landed, reflected))
    return _out_of_frame(scene, face, landed, reflected)


def _conic_roots(conics: Conics, rays: Rays, left: Indices) -> tuple[Array, Array]:
    """Distances (m, n) at which rays cross the conics upwards out of and down into the region above them.

    The first root has a s - b = +sqrt(b^2 - a v), the second the negative. Neither subtracts like quantities.
    """
    shape = conics.curvature[:, None], conics.squeeze[:, None]
    slope, value, discriminant = quadratic(*shape, rays)
    started = np.flatnonzero(left >= 0)
    # A point on the surface has value 0 exactly: its root at the start vanishes and the other one is kept.
    value[left[started], started] = 0.0
    root = np.sqrt(discriminant)
    stable = slope + np.copysign(root, slope)
    near, far = value / stable, stable / along(*shape, rays)
    rising = np.signbit(slope)
    return np.where(rising, near, far), np.where(rising, far, near)


def _within_conic(conics: Conics, distance: Array, rays: Rays) -> Array:
    """The distance where it is forward, on the vertex sheet and inside the aperture; infinite elsewhere."""
    *landed, height = ends(rays, distance)
    across = dot(landed, landed)
    met = (
        (distance > NEAREST_HIT_MM)
        & (across >= (conics.inner**2)[:, None])
        & (across <= (conics.outer**2)[:, None])
        & ((conics.squeeze * conics.curvature)[:, None] * height <= 1.0)
    )
    return np.where(met, distance, np.inf)


def _cylinder_hits(walls: Cylinders, kept: slice, rays: Rays) -> Array:
    """Distances (m, n) to cylindrical walls, infinite where a wall is not met."""
    across, heading = rays.across, rays.heading
    radius = walls.radius[kept][:, None]
    run = dot(heading, heading)
    discriminant = run * radius**2
    if len(across) == 2:
        discriminant -= (across[0] * heading[1] - across[1] * heading[0]) ** 2
    advance = dot(across, heading) if len(across) else np.zeros(1)
    from_axis = np.sqrt(dot(across, across)) if len(across) else np.zeros(1)
    stable = -(advance + np.copysign(np.sqrt(discriminant), advance))
    value = (from_axis - radius) * (from_axis + radius)
    low, high = walls.low[kept][:, None], walls.high[kept][:, None]
    best = np.full(discriminant.shape, np.inf)
    for distance in (stable / run, value / stable):
        height = rays.height + distance * rays.climb
        met = (distance > NEAREST_HIT_MM) & (height >= low) & (height <= high)
        best = np.where(met & (distance < best), distance, best)
    return best


def _in_frames(scene: Scene, frames: Indices, points: Rows, directions: Rows) -> Rays:
    """Rays in frames, each coordinate broadcastable to (frames, n)."""
    if scene.is_aligned:
        return Rays(points[:-1], points[-1] - scene.origins[frames, 2][:, None], directions[:-1], directions[-1])
    back = scene.rotations[frames].transpose(0, 2, 1)
    x, y, z = (back @ (np.asarray(points) - scene.origins[frames][:, :, None])).transpose(1, 0, 2)
    dx, dy, dz = (back @ np.asarray(directions)).transpose(1, 0, 2)
    return Rays((x, y), z, (dx, dy), dz)


def _in_frame(scene: Scene, frame: int, points: Rows, directions: Rows) -> Rays:
    """Rays in one frame."""
    if scene.is_aligned:
        return Rays(points[:-1], points[-1] - scene.origins[frame, 2], directions[:-1], directions[-1])
    turn = scene.rotations[frame]
    x, y, z = _turned(turn, np.asarray(points) - scene.origins[frame][:, None], back=True)
    dx, dy, dz = _turned(turn, np.asarray(directions), back=True)
    return Rays((x, y), z, (dx, dy), dz)


def _out_of_frame(
    scene: Scene, frame: int, points: list[Array], directions: list[Array]
) -> tuple[list[Array], list[Array]]:
    """Points and directions of one frame in the world's."""
    if scene.is_aligned:
        return [*points[:-1], points[-1] + scene.origins[frame, 2]], directions
    turn = scene.rotations[frame]
    world = _turned(turn, np.stack(points)) + scene.origins[frame][:, None]
    return list(world), list(_turned(turn, np.stack(directions)))


def _turned(rotations: Array, vectors: Array, *, back: bool = False) -> Array:
    """Vectors (3, n) turned by one rotation (3, 3) or by one each (n, 3, 3), or turned back."""
    indices = (
        ("ji,jn->in" if back else "ij,jn->in") if rotations.ndim == 2 else ("nji,jn->in" if back else "nij,jn->in")
    )
    return np.asarray(np.einsum(indices, rotations, vectors))
