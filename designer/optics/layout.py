"""The layout of a whole system in the meridional plane: mirrors, solids, and the legs of light between them.

A view's path is followed backwards, from the pinhole over its mirrors to the world. Each leg holds all the light of
one view between two successive surfaces, as the region between the rays of its zone's inner and outer end, widened on
either side by the half-width of the light that the entrance pupil takes in. R is signed: the world side of every ray
is at R > 0, so a leg of negative gain starts at R < 0 and crosses the axis at a focus, where it is split in two: every
leg is convex up to the bulge of the mirrors that end it.

Everything takes floats, NumPy arrays or CasADi symbols; lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from designer.design import ViewName
from designer.optics.backend import Scalar, maximum, sqrt, where
from designer.optics.conic import FocalConic, Surface
from designer.optics.overall_size import OverallSize, Substrate, overall_size

Point = tuple[Scalar, Scalar]
"""(R, z) in the meridional plane, R signed."""

# The camera body reaches down without end; no mirror of any envelope stands below this much of it.
BODY_DEPTH_MM = 10_000.0


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the mirrors have to live with: their substrate, the lens barrel and the camera body, all in mm."""

    substrate_thickness: Scalar
    edge_margin: Scalar
    lens_radius: Scalar
    lens_front: Scalar
    lens_length: Scalar
    body_radius: Scalar
    reach_radius: Scalar
    """Beyond this distance from the axis there is nothing left to hit."""


@dataclass(frozen=True, slots=True)
class Reflection:
    """One mirror on a view's path.

    ``direction`` is +1 if the mirror faces down (direct, secondary), -1 if up (primary). ``half_tangents`` belong to
    the zone's two ends at the conic's focus; ``crossing_height`` is where the light then crosses the axis, None if
    it does not. ``face_widths`` are the half-widths of the light along R on the face at the two ends, and
    ``crossing_width`` the larger of those across the ray where it crosses the axis: zero for chief rays alone.
    """

    mirror: str
    direction: int
    conic: FocalConic
    half_tangents: tuple[Scalar, Scalar]
    crossing_height: Scalar | None
    face_widths: tuple[Scalar, Scalar] = (0.0, 0.0)
    crossing_width: Scalar = 0.0


@dataclass(frozen=True, slots=True)
class OpticalPath:
    """A view from the pinhole to the world; index 0 is the zone's inner end, index 1 its outer end.

    ``slopes`` are tan(phi) of the two ends at the effective viewpoint. ``pupil_radius`` is the half-width of the
    light at the pinhole, ``world_widths`` are those of the two ends beyond the last mirror, across the ray.
    """

    view: ViewName
    viewpoint: Scalar
    slopes: tuple[Scalar, Scalar]
    reflections: tuple[Reflection, ...]
    pupil_radius: Scalar = 0.0
    world_widths: tuple[Scalar, Scalar] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Solid:
    """A ring-shaped solid on one side of the axis: a surface from inner to outer radius, and ``depth`` behind it.

    ``side`` is +1 or -1: the sign of R. ``depth`` is signed along z. A cylinder on the axis has a flat surface from
    minus to plus its radius.
    """

    name: str
    side: int
    surface: Surface
    inner_radius: Scalar
    outer_radius: Scalar
    depth: Scalar


@dataclass(frozen=True, slots=True)
class LegEnd:
    """One end of a leg: the points of the zone's two end rays, on a mirror (with the side of the axis) or not."""

    points: tuple[Point, Point]
    mirror: str | None = None
    side: int = 0
    surface: Surface | None = None


@dataclass(frozen=True, slots=True)
class Leg:
    """The light of one view between two successive ends."""

    view: ViewName
    name: str
    start: LegEnd
    end: LegEnd

    @property
    def leaves_pinhole(self) -> bool:
        """Whether the leg starts inside the lens barrel."""
        return self.name.startswith("pinhole")

    def touches(self, solid: Solid) -> bool:
        """Whether the leg starts or ends on that very solid."""
        return any(end.mirror == solid.name and end.side == solid.side for end in (self.start, self.end))


@dataclass(frozen=True, slots=True)
class PlacedMirror:
    """A mirror with its clear aperture; ``direction`` is +1 if it faces down.

    ``used_radii`` are those of the chief rays at the zone's ends.
    """

    name: str
    direction: int
    surface: Surface
    used_radii: tuple[Scalar, Scalar]
    inner_radius: Scalar
    outer_radius: Scalar
    thickness: Scalar

    @property
    def substrate(self) -> Substrate:
        """The mirror with its blank."""
        return Substrate(self.surface, self.inner_radius, self.outer_radius, self.direction * self.thickness)

    @property
    def rim_heights(self) -> tuple[Scalar, Scalar]:
        """Heights of the face at its inner and outer rim."""
        return self.surface.height(self.inner_radius), self.surface.height(self.outer_radius)


@dataclass(frozen=True, slots=True)
class Layout:
    """Mirrors, legs and camera solids of one system."""

    mirrors: tuple[PlacedMirror, ...]
    legs: tuple[Leg, ...]
    camera_solids: tuple[Solid, Solid]

    @property
    def mirror_solids(self) -> tuple[Solid, ...]:
        """Each mirror's substrate on both sides of the axis."""
        return tuple(
            Solid(
                mirror.name,
                side,
                mirror.surface,
                mirror.inner_radius,
                mirror.outer_radius,
                mirror.direction * mirror.thickness,
            )
            for mirror in self.mirrors
            for side in (1, -1)
        )

    def size(self, lens_front: Scalar) -> OverallSize:
        """Overall height and diameter of the head over a lens whose front lies at ``lens_front``."""
        return overall_size([mirror.substrate for mirror in self.mirrors], lens_front)

    @property
    def solids(self) -> tuple[Solid, ...]:
        """Everything that can stop a ray."""
        return (*self.mirror_solids, *self.camera_solids)


def lay_out(paths: tuple[OpticalPath, ...], sides: dict[str, int], surroundings: Surroundings) -> Layout:
    """Place mirrors, legs and solids for the given paths.

    Parameters
    ----------
    paths
        The two views.
    sides
        For each mirror the sign of R where the path meets it; fixed by the signs of the gains.
    surroundings
        Substrate, margins and camera.
    """
    mirrors = [
        _place_mirror(reflection, sides[reflection.mirror], surroundings)
        for path in paths
        for reflection in path.reflections
    ]
    surfaces = {mirror.name: mirror.surface for mirror in mirrors}
    legs = [leg for path in paths for leg in _legs_of(path, sides, surfaces, surroundings.reach_radius)]
    return Layout(tuple(mirrors), tuple(legs), _camera_solids(surroundings))


def _place_mirror(reflection: Reflection, side: int, surroundings: Surroundings) -> PlacedMirror:
    used = tuple(side * reflection.conic.point(tangent)[0] for tangent in reflection.half_tangents)
    return PlacedMirror(
        name=reflection.mirror,
        direction=reflection.direction,
        surface=reflection.conic.surface,
        used_radii=(used[0], used[1]),
        inner_radius=maximum(used[0] - reflection.face_widths[0] - surroundings.edge_margin, 0.0),
        outer_radius=used[1] + reflection.face_widths[1] + surroundings.edge_margin,
        thickness=surroundings.substrate_thickness,
    )


@dataclass(frozen=True, slots=True)
class _Station:
    """Where the light of a view is between two legs: the pinhole, a mirror, a crossing of the axis, or far out.

    ``chief`` are the points of the two end rays. ``end`` is what both legs have there; at a crossing it is None, since
    there the edges of the light of half-width ``width`` lie beside the crossing as seen from each leg's other end.
    """

    name: str
    chief: tuple[Point, Point]
    end: LegEnd | None = None
    width: Scalar = 0.0


def _legs_of(path: OpticalPath, sides: dict[str, int], surfaces: dict[str, Surface], reach_radius: Scalar) -> list[Leg]:
    stations = [_pinhole(path, sides)]
    for reflection in path.reflections:
        mirror = reflection.mirror
        stations.append(_on_mirror(reflection, sides[mirror], surfaces[mirror]))
        if reflection.crossing_height is not None:
            crossing = (0.0, reflection.crossing_height)
            name = f"focus after {mirror}"
            stations.append(_Station(name, (crossing, crossing), width=reflection.crossing_width))
    stations.append(_far_out(path, reach_radius))
    return [
        Leg(path.view, f"{start.name} -> {end.name}", _end_of_leg(start, end), _end_of_leg(end, start))
        for start, end in pairwise(stations)
    ]


def _pinhole(path: OpticalPath, sides: dict[str, int]) -> _Station:
    half_width = sides[path.reflections[0].mirror] * path.pupil_radius
    edges = ((-half_width, 0.0), (half_width, 0.0))
    return _Station("pinhole", ((0.0, 0.0), (0.0, 0.0)), LegEnd(edges))


def _on_mirror(reflection: Reflection, side: int, surface: Surface) -> _Station:
    inner, outer = (reflection.conic.point(tangent) for tangent in reflection.half_tangents)
    radii = (inner[0] - side * reflection.face_widths[0], outer[0] + side * reflection.face_widths[1])
    edges = ((radii[0], surface.height(radii[0])), (radii[1], surface.height(radii[1])))
    return _Station(reflection.mirror, (inner, outer), LegEnd(edges, reflection.mirror, side, surface))


def _far_out(path: OpticalPath, reach_radius: Scalar) -> _Station:
    """The reach radius, with each edge of the light on the side away from the other end's ray."""
    first, second = path.slopes
    chief = [(reach_radius, path.viewpoint + reach_radius * slope) for slope in (first, second)]
    edges = []
    for (radius, height), slope, other, width in zip(
        chief, (first, second), (second, first), path.world_widths, strict=True
    ):
        upwards = where(slope > other, 1.0, -1.0)
        edges.append((radius, height + upwards * width * sqrt(1.0 + slope * slope)))
    return _Station("world", (chief[0], chief[1]), LegEnd((edges[0], edges[1])))


def _end_of_leg(station: _Station, opposite: _Station) -> LegEnd:
    """What a leg has at one of its ends, seen from its opposite end."""
    if station.end is not None:
        return station.end
    edges = []
    for (at_r, at_z), (from_r, from_z), (other_r, other_z) in zip(
        station.chief, opposite.chief, reversed(opposite.chief), strict=True
    ):
        ahead_r, ahead_z = from_r - at_r, from_z - at_z
        length = sqrt(ahead_r * ahead_r + ahead_z * ahead_z)
        # The normal of this end's ray that points away from the other end's.
        is_beside = ahead_z * (other_r - at_r) - ahead_r * (other_z - at_z) > 0.0
        shift = where(is_beside, -1.0, 1.0) * station.width / length
        edges.append((at_r + shift * ahead_z, at_z - shift * ahead_r))
    return LegEnd((edges[0], edges[1]))


def _camera_solids(surroundings: Surroundings) -> tuple[Solid, Solid]:
    flange = surroundings.lens_front - surroundings.lens_length
    return (
        _cylinder("lens", surroundings.lens_radius, surroundings.lens_front, surroundings.lens_length),
        _cylinder("body", surroundings.body_radius, flange, BODY_DEPTH_MM),
    )


def _cylinder(name: str, radius: Scalar, top: Scalar, depth: Scalar) -> Solid:
    return Solid(name, 1, Surface(top, 0.0, 0.0), -radius, radius, -depth)
