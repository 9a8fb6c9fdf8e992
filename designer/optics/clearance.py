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

_AXIAL = ("above", "below", "outwards", "inwards")


def _sides_of(*chords: str) -> tuple[str, ...]:
    return tuple(f"{chord}, {side}" for chord in chords for side in ("left", "right"))


LEG_DIRECTIONS = (
    *_sides_of("inner ray", "outer ray"),
    *_AXIAL,
    *_sides_of("solid's chord", "leg's end", "leg's start"),
)
# Where two rims are nearest to each other, no chord shows the way, but directions this far apart serve to 1 % of the
# distance.
STEP_DEG = 15
_OBLIQUE = {
    f"at {angle} degrees": (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    for angle in range(0, 360, STEP_DEG)
    if angle % 90
}
SOLID_DIRECTIONS = (*_AXIAL, *_sides_of("first chord", "second chord"), *_OBLIQUE)
# A start keeps to the first: an oblique direction serves a design as it is, but does not turn with it.
STARTING_SOLID_DIRECTIONS = len(SOLID_DIRECTIONS) - len(_OBLIQUE)
# The chords that a leg's own directions are normal to; a solid's chord is the last.
LEG_CHORDS = ("inner ray", "outer ray", "leg's end", "leg's start")
LEG_NORMALS = (*LEG_CHORDS, "solid's chord")
SOLID_NORMALS = ("first chord", "second chord")
_AXES = {"above": (0.0, 1.0), "below": (0.0, -1.0), "outwards": (1.0, 0.0), "inwards": (-1.0, 0.0), **_OBLIQUE}

# A chord shorter than this has no direction (a leg that starts at a focus); nothing is apart along it.
SHORTEST_CHORD_MM = 1e-6
NOT_APART_MM = -1e6
SMALLEST = 1e-12
# What a whole primary's hull claims beyond its shell is up to a millimetre, what so many rings of it claim below 0.05.
PIECES = 5


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
        rims = maximum(self._along(direction, self.inner_radius), self._along(direction, self.outer_radius))
        return maximum(rims, self.bulge(direction))

    def bulge(self, direction: tuple[Scalar, Scalar]) -> Scalar:
        """The extent at the point nearest to where the face is normal to n; at the outer rim if it bends backwards."""
        across, along = direction
        leaning = -self.side * across
        bending = along * self.surface.curvature
        bulges = bending < -SMALLEST
        ratio = leaning / where(bulges, bending, -1.0)
        stretch = sqrt(maximum(1.0 + self.surface.conic_term * ratio * ratio, SMALLEST))
        radius = where(
            bulges, minimum(maximum(ratio / stretch, self.inner_radius), self.outer_radius), self.outer_radius
        )
        return self._along(direction, radius)

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
        # The rims of both faces are among the four points.
        largest = maximum(self.start_face.bulge(direction), self.end_face.bulge(direction))
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


def leg_separations(legs: LegRows, solids: SolidRows, pairs: Sequence[tuple[int, int]], weights: Scalar) -> Scalar:
    """Separation of pairs of leg and solid, each along a direction of its own; negative when they overlap.

    Parameters
    ----------
    legs, solids
        All legs and solids of a layout, not yet paired.
    pairs
        Index of leg and solid of each pair.
    weights
        Columns for ``LEG_NORMALS``, one row for each pair, as :func:`normal_weights` gives them.
    """
    of_leg, of_solid = ([pair[side] for pair in pairs] for side in (0, 1))
    # A chord belongs to a leg or to a solid: found before pairing, it is found once.
    chords = _leg_chords(legs)
    normals = [_left_of(chords[name], of_leg) for name in LEG_CHORDS]
    normal = _weighed([*normals, _left_of(solids.face.chord, of_solid)], weights)
    return -solids.take(of_solid).extent((-normal[0], -normal[1])) - legs.take(of_leg).extent(normal)


def solid_separations(solids: SolidRows, pairs: Sequence[tuple[int, int]], weights: Scalar) -> Scalar:
    """The same for pairs of solids; ``weights`` has columns for ``SOLID_NORMALS``."""
    of_first, of_second = ([pair[side] for pair in pairs] for side in (0, 1))
    normal = _weighed([_left_of(solids.face.chord, rows) for rows in (of_first, of_second)], weights)
    return -solids.take(of_second).extent((-normal[0], -normal[1])) - solids.take(of_first).extent(normal)


def separations(
    layout: Layout, pairs: Pairs, solid_directions: int = len(SOLID_DIRECTIONS)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Separation of every pair along every direction, for arrays of designs.

    Parameters
    ----------
    layout, pairs
        Of the same variant.
    solid_directions
        Along how many of ``SOLID_DIRECTIONS`` solids are looked at.

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
    normals = _stacked([_solid_direction(first, second, direction) for direction in range(solid_directions)])
    bodies = -second.extent((-normals[0], -normals[1])) - first.extent(normals)
    return light, bodies


def _stacked(normals: list[tuple[Scalar, Scalar]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals along every direction as arrays of shape (directions, rows, ...)."""
    across, along = (np.broadcast_arrays(*(normal[axis] for normal in normals)) for axis in (0, 1))
    return np.stack(across), np.stack(along)


def normal_weights(directions: Sequence[str], normals: Sequence[str]) -> NDArray[np.float64]:
    """Each direction as 1 or -1 times one of the normals, the axes last: shape (directions, normals + 2)."""
    weights = np.zeros((len(directions), len(normals) + 2))
    for row, direction in enumerate(directions):
        if direction in _AXES:
            weights[row, -2:] = _AXES[direction]
        else:
            name, _, side = direction.rpartition(", ")
            weights[row, normals.index(name)] = 1.0 if side == "left" else -1.0
    return weights


def _leg_direction(legs: LegRows, solids: SolidRows, direction: int) -> tuple[Scalar, Scalar]:
    name = LEG_DIRECTIONS[direction]
    if name in _AXES:
        return _AXES[name]
    chords = _leg_chords(legs) | {"solid's chord": solids.face.chord}
    return _normal(chords[name.rpartition(", ")[0]], left=name.endswith("left"))


def _leg_chords(legs: LegRows) -> dict[str, tuple[Scalar, Scalar]]:
    """The lines between a leg's four points that directions are normal to."""
    start, end = legs.start_points, legs.end_points
    return {
        "inner ray": _between(start[0], end[0]),
        "outer ray": _between(start[1], end[1]),
        "leg's end": _between(end[0], end[1]),
        "leg's start": _between(start[0], start[1]),
    }


def _left_of(chord: tuple[Scalar, Scalar], rows: Sequence[int]) -> tuple[Scalar, Scalar]:
    """The normal to the left of a chord, for the given rows."""
    across, along = _normal(chord, left=True)
    return take(across, rows), take(along, rows)


def _weighed(normals: list[tuple[Scalar, Scalar]], weights: Scalar) -> tuple[Scalar, Scalar]:
    """The sum of normals and of both axes, times the columns of ``weights``."""
    across, along = weights[:, len(normals)], weights[:, len(normals) + 1]
    for column, normal in enumerate(normals):
        across = across + weights[:, column] * normal[0]
        along = along + weights[:, column] * normal[1]
    return across, along


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
