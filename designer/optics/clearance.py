"""Clearances: signed separations between light and solids, and between solids, in the meridional plane.

A leg and a solid, both convex up to the bulge of a conic, are apart by at least s if along some direction n the
solid's nearest point lies s beyond the leg's farthest one. The directions worth trying are finite in number: normal
to either end ray of the leg, along or across the axis, and normal to the chords of the faces involved; for two
solids, which may be nearest at their rims, a few oblique ones too. For one direction the separation is smooth in the
design, so an optimiser keeps the direction that serves at its start, and the choice is checked again at its result.

Pairs are stacked into rows: NumPy evaluates all pairs and designs at once, and CasADi builds the same expressions
as column vectors. Shapes: (rows, ...) for arrays, (rows, 1) for symbols. All lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from designer.optics.backend import Scalar, maximum, minimum, sqrt, stack, take, where
from designer.optics.conic import Surface
from designer.optics.layout import Layout, Leg, LegEnd, Solid

LEG_DIRECTIONS = (
    "inner ray, left",
    "inner ray, right",
    "outer ray, left",
    "outer ray, right",
    "above",
    "below",
    "outwards",
    "inwards",
    "solid's chord, left",
    "solid's chord, right",
    "leg's end, left",
    "leg's end, right",
    "leg's start, left",
    "leg's start, right",
)
# Where two rims are nearest to each other, no chord shows the way, but directions this far apart serve to 1 % of the
# distance.
STEP_DEG = 15
_OBLIQUE = {
    f"at {angle} degrees": (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    for angle in range(0, 360, STEP_DEG)
    if angle % 90
}
SOLID_DIRECTIONS = (
    "above",
    "below",
    "outwards",
    "inwards",
    "first chord, left",
    "first chord, right",
    "second chord, left",
    "second chord, right",
    *_OBLIQUE,
)
# A start keeps to the first: an oblique direction serves a design as it is, but does not turn with it.
STARTING_SOLID_DIRECTIONS = len(SOLID_DIRECTIONS) - len(_OBLIQUE)
_AXES = {"above": (0.0, 1.0), "below": (0.0, -1.0), "outwards": (1.0, 0.0), "inwards": (-1.0, 0.0), **_OBLIQUE}

# A chord shorter than this has no direction (a leg that starts at a focus); nothing is apart along it.
SHORTEST_CHORD_MM = 1e-6
NOT_APART_MM = -1e6
SMALLEST = 1e-12
# What a whole primary's hull claims beyond its shell is up to a millimetre, what so many rings of it claim below 0.05.
PIECES = 4


@dataclass(frozen=True, slots=True)
class FaceRows:
    """Faces from inner to outer radius, on the side of the axis given by +1 or -1."""

    surface: Surface
    inner_radius: Scalar
    outer_radius: Scalar
    side: Scalar

    def take(self, rows: Sequence[int]) -> FaceRows:
        """The given rows, in that order."""
        surface = Surface(
            take(self.surface.vertex_height, rows),
            take(self.surface.curvature, rows),
            take(self.surface.conic_term, rows),
        )
        return FaceRows(surface, take(self.inner_radius, rows), take(self.outer_radius, rows), take(self.side, rows))

    def extent(self, direction: tuple[Scalar, Scalar]) -> Scalar:
        """Largest n . p over the points p of the face: at a rim, or where the face is normal to n."""
        across, along = direction
        leaning = -self.side * across
        bending = along * self.surface.curvature
        bulges = bending < -SMALLEST
        ratio = leaning / where(bulges, bending, -1.0)
        stretch = sqrt(maximum(1.0 + self.surface.conic_term * ratio * ratio, SMALLEST))
        radius = where(
            bulges, minimum(maximum(ratio / stretch, self.inner_radius), self.outer_radius), self.outer_radius
        )
        return maximum(
            maximum(self._along(direction, self.inner_radius), self._along(direction, self.outer_radius)),
            self._along(direction, radius),
        )

    def _along(self, direction: tuple[Scalar, Scalar], radius: Scalar) -> Scalar:
        return direction[0] * self.side * radius + direction[1] * self.surface.height(radius)

    @property
    def chord(self) -> tuple[Scalar, Scalar]:
        """Vector from the inner to the outer rim."""
        rise = self.surface.height(self.outer_radius) - self.surface.height(self.inner_radius)
        return self.side * (self.outer_radius - self.inner_radius), rise


@dataclass(frozen=True, slots=True)
class SolidRows:
    """Solids: a face, and the same face shifted by ``depth`` along z."""

    face: FaceRows
    depth: Scalar

    def take(self, rows: Sequence[int]) -> SolidRows:
        """The given rows, in that order."""
        return SolidRows(self.face.take(rows), take(self.depth, rows))

    def extent(self, direction: tuple[Scalar, Scalar]) -> Scalar:
        """Largest n . p over the points p of the solid."""
        return self.face.extent(direction) + maximum(direction[1] * self.depth, 0.0)


@dataclass(frozen=True, slots=True)
class LegRows:
    """Legs: the four points where their end rays start and end, and the faces they start and end on."""

    start_points: tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]
    end_points: tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]
    start_face: FaceRows
    end_face: FaceRows

    def take(self, rows: Sequence[int]) -> LegRows:
        """The given rows, in that order."""
        start, end = (
            tuple((take(across, rows), take(along, rows)) for across, along in points)
            for points in (self.start_points, self.end_points)
        )
        return LegRows((start[0], start[1]), (end[0], end[1]), self.start_face.take(rows), self.end_face.take(rows))

    def extent(self, direction: tuple[Scalar, Scalar]) -> Scalar:
        """Largest n . p over the points p of the leg."""
        largest = maximum(self.start_face.extent(direction), self.end_face.extent(direction))
        for point in (*self.start_points, *self.end_points):
            largest = maximum(largest, _dot(direction, point))
        return largest


@dataclass(frozen=True, slots=True)
class Pairs:
    """Which leg must clear which solid, and which solids must not touch, by index.

    The same for every design of a configuration and variant. ``solids`` are those of a layout, then the pieces of its
    primary (:func:`with_pieces`), which stand for it where it must not touch the camera.
    """

    legs: tuple[Leg, ...]
    solids: tuple[Solid, ...]
    leg_solid: tuple[tuple[int, int], ...]
    solid_solid: tuple[tuple[int, int], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What each row is about, in words."""
        light = tuple(
            f"{self.legs[leg].view} view, {self.legs[leg].name} against {_solid_name(self.solids[solid])}"
            for leg, solid in self.leg_solid
        )
        bodies = tuple(
            f"{_solid_name(self.solids[first])} against {_solid_name(self.solids[second])}"
            for first, second in self.solid_solid
        )
        return light + bodies


def pair_up(layout: Layout) -> Pairs:
    """Every pair of leg and solid, and of solids, that could meet.

    Left out: a leg and the mirror it starts or ends on, on that side of the axis; the first leg and the camera, inside
    which it starts; and the mirror image of a pair of solids. A primary keeps clear of the camera piece by piece.
    """
    solids, count = with_pieces(layout), len(layout.solids)
    camera = {solid.name for solid in layout.camera_solids}
    leg_solid = tuple(
        (i, j)
        for i, leg in enumerate(layout.legs)
        for j, solid in enumerate(layout.solids)
        if not leg.touches(solid) and not (leg.leaves_pinhole and solid.name in camera)
    )
    pieces: dict[str, list[int]] = {}
    for place in range(count, len(solids)):
        pieces.setdefault(solids[place].name, []).append(place)
    solid_solid = tuple(
        (part, j)
        for i, j in combinations(range(count), 2)
        if solids[i].side == solids[j].side == 1 and not {solids[i].name, solids[j].name} <= camera
        for part in (pieces.get(solids[i].name, [i]) if solids[j].name in camera else [i])
    )
    return Pairs(layout.legs, solids, leg_solid, solid_solid)


def with_pieces(layout: Layout) -> tuple[Solid, ...]:
    """The solids of a layout, then each mirror that faces up in ``PIECES`` rings, at R > 0.

    A convex primary is a dome, and the lens may stand in its hollow, which its convex hull fills. Towards its inner rim
    it bends most, so that the rings are narrower there.
    """
    pieces = []
    for solid in layout.mirror_solids:
        faces_up = any(mirror.name == solid.name and mirror.direction < 0 for mirror in layout.mirrors)
        if not faces_up or solid.side < 0:
            continue
        width = solid.outer_radius - solid.inner_radius
        edges = [solid.inner_radius + width * (place / PIECES) ** 2 for place in range(PIECES + 1)]
        pieces += [replace(solid, inner_radius=inner, outer_radius=outer) for inner, outer in pairwise(edges)]
    return (*layout.solids, *pieces)


def leg_rows(legs: Sequence[Leg]) -> LegRows:
    """Stack legs, one row each."""
    start, end = (
        tuple(
            (
                stack([getattr(leg, attribute).points[ray][0] for leg in legs]),
                stack([getattr(leg, attribute).points[ray][1] for leg in legs]),
            )
            for ray in (0, 1)
        )
        for attribute in ("start", "end")
    )
    return LegRows(
        (start[0], start[1]),
        (end[0], end[1]),
        _face_rows([_face_of(leg.start) for leg in legs]),
        _face_rows([_face_of(leg.end) for leg in legs]),
    )


def solid_rows(solids: Sequence[Solid]) -> SolidRows:
    """Stack solids, one row each."""
    faces = [(solid.surface, solid.inner_radius, solid.outer_radius, solid.side) for solid in solids]
    return SolidRows(_face_rows(faces), stack([solid.depth for solid in solids]))


def leg_separation(legs: LegRows, solids: SolidRows, direction: int) -> Scalar:
    """Separation of each row's leg and solid along one of ``LEG_DIRECTIONS``; negative when they overlap."""
    normal = _leg_direction(legs, solids, direction)
    # Of an end ray's two normals one has the other ray behind it, and the ray itself is then the leg's extent. Along
    # the other this claims too much room; :func:`separations`, which judges, does not. The whole extent here would
    # cost the solver a third of its time and changes no result.
    farthest = _dot(normal, legs.start_points[direction // 2]) if direction < 4 else legs.extent(normal)
    return -solids.extent((-normal[0], -normal[1])) - farthest


def solid_separation(first: SolidRows, second: SolidRows, direction: int) -> Scalar:
    """Separation of each row's solids along one of ``SOLID_DIRECTIONS``; negative when they overlap."""
    normal = _solid_direction(first, second, direction)
    return -second.extent((-normal[0], -normal[1])) - first.extent(normal)


def separations(layout: Layout, pairs: Pairs) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Separation of every pair along every direction, for arrays of designs.

    Returns
    -------
    Arrays of shape (directions, pairs, ...): legs against solids, then solids against solids. A pair's clearance is
    the largest over the directions.
    """
    legs, solids = leg_rows(layout.legs), solid_rows(with_pieces(layout))
    pair_legs = legs.take([leg for leg, _ in pairs.leg_solid])
    pair_solids = solids.take([solid for _, solid in pairs.leg_solid])
    normals = _stacked([_leg_direction(pair_legs, pair_solids, direction) for direction in range(len(LEG_DIRECTIONS))])
    # The whole leg's extent, also along the normals of its end rays, so that a normal on the wrong side shows.
    spare = -pair_solids.extent((-normals[0], -normals[1])) - pair_legs.extent(normals)
    light = np.where(_dot(normals, normals) > 0.5, spare, NOT_APART_MM)
    first = solids.take([one for one, _ in pairs.solid_solid])
    second = solids.take([other for _, other in pairs.solid_solid])
    normals = _stacked([_solid_direction(first, second, direction) for direction in range(len(SOLID_DIRECTIONS))])
    bodies = -second.extent((-normals[0], -normals[1])) - first.extent(normals)
    return light, bodies


def _stacked(normals: list[tuple[Scalar, Scalar]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals along every direction as arrays of shape (directions, rows, ...)."""
    across, along = (np.broadcast_arrays(*(normal[axis] for normal in normals)) for axis in (0, 1))
    return np.stack(across), np.stack(along)


def _leg_direction(legs: LegRows, solids: SolidRows, direction: int) -> tuple[Scalar, Scalar]:
    name = LEG_DIRECTIONS[direction]
    if name in _AXES:
        return _AXES[name]
    start, end = legs.start_points, legs.end_points
    chord = {
        "inner ray": lambda: _between(start[0], end[0]),
        "outer ray": lambda: _between(start[1], end[1]),
        "solid's chord": lambda: solids.face.chord,
        "leg's end": lambda: _between(end[0], end[1]),
        "leg's start": lambda: _between(start[0], start[1]),
    }[name.rpartition(", ")[0]]()
    return _normal(chord, left=name.endswith("left"))


def _solid_direction(first: SolidRows, second: SolidRows, direction: int) -> tuple[Scalar, Scalar]:
    name = SOLID_DIRECTIONS[direction]
    if name in _AXES:
        return _AXES[name]
    chord = (first if name.startswith("first") else second).face.chord
    return _normal(chord, left=name.endswith("left"))


def _between(first: tuple[Scalar, Scalar], second: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
    return second[0] - first[0], second[1] - first[1]


def _normal(chord: tuple[Scalar, Scalar], left: bool) -> tuple[Scalar, Scalar]:
    sign = 1.0 if left else -1.0
    length = maximum(sqrt(chord[0] * chord[0] + chord[1] * chord[1] + SMALLEST**2), SHORTEST_CHORD_MM)
    return -sign * chord[1] / length, sign * chord[0] / length


def _dot(direction: tuple[Scalar, Scalar], point: tuple[Scalar, Scalar]) -> Scalar:
    return direction[0] * point[0] + direction[1] * point[1]


def _face_of(end: LegEnd) -> tuple[Surface, Scalar, Scalar, int]:
    """The face between a leg's end rays; where there is no mirror, the point of the first ray."""
    if end.surface is None:
        return Surface(end.points[0][1], 0.0, 0.0), end.points[0][0], end.points[0][0], 1
    return end.surface, end.side * end.points[0][0], end.side * end.points[1][0], end.side


def _face_rows(faces: Sequence[tuple[Surface, Scalar, Scalar, int]]) -> FaceRows:
    surface = Surface(
        stack([face[0].vertex_height for face in faces]),
        stack([face[0].curvature for face in faces]),
        stack([face[0].conic_term for face in faces]),
    )
    inner, outer = stack([face[1] for face in faces]), stack([face[2] for face in faces])
    return FaceRows(surface, inner, outer, stack([float(face[3]) for face in faces]))


def _solid_name(solid: Solid) -> str:
    return solid.name if solid.side > 0 else f"{solid.name} across the axis"
