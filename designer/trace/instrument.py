"""The instrument as a ray meets it: mirror faces, substrates, lens barrel and camera body, each in its place.

Every mirror is written in its own frame, vertex at the origin and optical axis along z, and may be posed anywhere.
In that frame its face is the vertex sheet of c (x^2 + y^2 + k z^2) = 2 z, with c = 1/radius (0 for a plane) and
k = 1 + conic constant; on it 1 - k c z >= 0, and on the other sheet of a hyperboloid (or beyond the equator of an
ellipsoid) 1 - k c z < 0. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.design import Camera, Design, Mirror
from designer.trace.arrays import Array, Indices

BARREL = "lens barrel"
BODY = "camera body"


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
    one_plus_conic: Array
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
class Instrument:
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


def build_instrument(design: Design, poses: Mapping[str, Pose] | None = None) -> Instrument:
    """The surfaces of a design, each mirror in its nominal place or in the pose given for its name.

    Raises
    ------
    KeyError
        A pose names a mirror that the design does not have.
    """
    return assemble_instrument(design.mirrors, design.camera, poses)


def assemble_instrument(
    mirrors: Sequence[Mirror], camera: Camera, poses: Mapping[str, Pose] | None = None
) -> Instrument:
    """The surfaces of some mirrors over a camera; as :func:`build_instrument`, without the rest of a design."""
    names = tuple(mirror.name for mirror in mirrors)
    origins, rotations = _frames(mirrors, names, poses or {})
    thick = [(index, mirror) for index, mirror in enumerate(mirrors) if mirror.thickness_mm != 0.0]
    faces = [_conic_row(index, mirror, 0.0) for index, mirror in enumerate(mirrors)]
    backs = [_conic_row(index, mirror, mirror.back_offset_mm) for index, mirror in thick]
    walls = [wall for index, mirror in thick for wall in _edge_walls(index, mirror)]
    camera_walls, discs = _camera_surfaces(len(mirrors), camera)

    conic_table = np.array(faces + backs, dtype=float).T
    wall_table = np.array([row for row, _ in walls + camera_walls], dtype=float).T
    disc_table = np.array([row for row, _ in discs], dtype=float).T
    return Instrument(
        mirrors=names,
        facing=np.array([1.0 if mirror.faces == "up" else -1.0 for mirror in mirrors]),
        conics=Conics(conic_table[0].astype(np.intp), *conic_table[1:]),
        cylinders=Cylinders(wall_table[0].astype(np.intp), *wall_table[1:]),
        discs=Discs(*disc_table),
        elements=(
            *names,
            *(f"back of {name}" for name in names),
            *(f"back of {mirror.name}" for _, mirror in thick),
            *(label for _, label in walls + camera_walls),
            *(label for _, label in discs),
        ),
        origins=origins,
        rotations=rotations,
        is_aligned=not poses,
    )


def _frames(mirrors: Sequence[Mirror], names: tuple[str, ...], poses: Mapping[str, Pose]) -> tuple[Array, Array]:
    """Origins (m + 1, 3) and rotations (m + 1, 3, 3) of the mirrors' frames and, last, the camera's."""
    origins = np.zeros((len(mirrors) + 1, 3))
    rotations = np.tile(np.eye(3), (len(mirrors) + 1, 1, 1))
    for index, mirror in enumerate(mirrors):
        origins[index, 2] = mirror.vertex_mm
    for name, pose in poses.items():
        if name not in names:
            raise KeyError(f"no mirror {name!r}; the mirrors are {', '.join(names)}")
        origins[names.index(name)] += pose.shift_mm
        rotations[names.index(name)] = pose.rotation
    return origins, rotations


def _conic_row(frame: int, mirror: Mirror, offset: float) -> tuple[float, ...]:
    """A mirror's face, or its back at an offset, as a row of :class:`Conics`."""
    curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
    return frame, curvature, 1.0 + mirror.conic, offset, mirror.inner_radius_mm, mirror.outer_radius_mm


_Wall = tuple[tuple[float, ...], str]
"""A row of :class:`Cylinders` or :class:`Discs`, and its name."""


def _edge_walls(frame: int, mirror: Mirror) -> list[_Wall]:
    """The cylinders between a face's rims and its back's."""
    walls: list[_Wall] = []
    for radius, label in ((mirror.outer_radius_mm, "outer edge"), (mirror.inner_radius_mm, "hole edge")):
        if radius > 0.0:
            height, back = float(sag(mirror, radius)), mirror.back_offset_mm
            row = (frame, radius, min(height, height + back), max(height, height + back))
            walls.append((row, f"{label} of {mirror.name}"))
    return walls


def _camera_surfaces(frame: int, camera: Camera) -> tuple[list[_Wall], list[_Wall]]:
    """Walls, then discs, of lens barrel and camera body."""
    seat = camera.lens_seat_mm
    walls: list[_Wall] = [
        ((frame, camera.lens_radius_mm, seat, camera.lens_front_mm), BARREL),
        ((frame, camera.body_radius_mm, -np.inf, seat), BODY),
    ]
    at_seat = BODY if camera.body_radius_mm >= camera.lens_radius_mm else BARREL
    discs: list[_Wall] = [
        ((camera.lens_front_mm, camera.lens_radius_mm), BARREL),
        ((seat, max(camera.body_radius_mm, camera.lens_radius_mm)), at_seat),
    ]
    return walls, discs
