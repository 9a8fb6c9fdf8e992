"""The instrument as a ray meets it: mirror faces, substrates, lens barrel and camera body, each in its place.

Every mirror is written in its own frame, vertex at the origin and optical axis along z, and may be posed anywhere.
In that frame its face is the vertex sheet of c (x^2 + y^2 + k z^2) = 2 z, with c = 1/radius (0 for a plane) and
k = 1 + conic constant; on it 1 - k c z >= 0, and on the other sheet of a hyperboloid (or beyond the equator of an
ellipsoid) 1 - k c z < 0. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, Mirror
from designer.trace.conics import Array as Array

Indices = NDArray[np.intp]
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
    return Instrument(
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
