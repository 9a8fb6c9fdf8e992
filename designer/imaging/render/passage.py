"""Which way the light of each image place takes through the instrument, and fast tracing by that knowledge.

Everything is round about the axis, so what a ray meets depends on its image radius and on its place in the pupil
relative to the meridian alone. Where rays all over the pupil take the same way, at an image radius and at its
neighbours, every ray between does: it is traced along that way only, or not at all if it ends on a black part. The
others, near the edges of zones, are followed to the first surface they meet whatever it is. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Camera, Design
from designer.imaging.render.camera_rays import Array, ray_directions
from designer.imaging.render.lens import Pupil
from designer.trace.aiming import widest_pinhole_angle
from designer.trace.arrays import Indices
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.image_law import image_radius
from designer.trace.instrument import Instrument
from designer.trace.sequential import trace_sequential

# Backs and edges of mirrors, barrel and body are black, but not without light.
BLACK_PARTS_RADIANCE = 0.02

UNKNOWN = -1
# Places over half the pupil (the other half is its reflection in the meridian), on rings at shares of its radius.
FEWEST_RINGS, PROBES_ON_RIM = 600, 25
PROBE_RINGS = (0.0, 0.25, 0.5, 0.75, 1.0)
# Shift in the pupil by which a pencil's rays differ.
PENCIL_MM = 1e-3


@dataclass(frozen=True, slots=True)
class Way:
    """Mirrors met, in order, and whether the light then leaves for the world or ends on a black part."""

    mirrors: tuple[int, ...]
    leaves: bool


@dataclass(frozen=True, slots=True)
class Passage:
    """The ways of light against image radius.

    ``way_of_ring`` (k,) is the index in ``ways`` of the way that all light takes between the image radii of k and
    k + 1 steps, UNKNOWN where it takes several. ``pencils`` (ways, 4, k) say how far apart rays lie, t behind
    the last mirror, that start at neighbouring places of the pupil for the image radius of k steps:
    (p0 + p1 t) in the meridian and (p2 + p3 t) across it, per distance in the pupil.
    """

    step_mm: float
    ways: tuple[Way, ...]
    way_of_ring: Indices
    pencils: Array


@dataclass(frozen=True, slots=True)
class PupilTrace:
    """Rays (n,) behind the instrument; points and directions (n, 3) hold only where ``leaves`` is true.

    ``way`` is the index of the way taken, UNKNOWN for rare ones.
    """

    exit_point: Array
    exit_direction: Array
    leaves: NDArray[np.bool_]
    reflections: Indices
    way: Indices


def find_passage(design: Design, instrument: Instrument, pupil: Pupil) -> Passage:
    """Trace bundles over the pupil, for every pixel of image radius or more finely."""
    camera = design.camera
    edge = float(image_radius(camera, widest_pinhole_angle(design)))
    step = min(camera.pixel_pitch_mm, edge / FEWEST_RINGS)
    # The outermost pixels' rays may start a little beyond the edge.
    radii = np.arange(np.ceil((edge + camera.pixel_pitch_mm) / step) + 3.0) * step
    probes = _probes(pupil.radius_mm)
    starts = np.tile(probes, (len(radii), 1))
    trace = trace_first_hits(instrument, _ahead(camera, np.repeat(radii, len(probes)), starts, pupil), starts)
    keys = np.column_stack([trace.status == Status.ESCAPED, trace.sequence])
    found, number = np.unique(keys, axis=0, return_inverse=True)
    ways = tuple(Way(tuple(int(face) for face in key[1:] if face >= 0), bool(key[0])) for key in found)
    number = number.reshape(len(radii), len(probes))
    ring = np.where((number == number[:, :1]).all(axis=1), number[:, 0], UNKNOWN)
    # A ray between two rings is known if those and the next ones out and in agree.
    padded = np.concatenate([ring[1:2], ring])
    around = np.stack([padded[shift : len(ring) - 2 + shift] for shift in range(4)])
    way_of_ring = np.where((around == around[0]).all(axis=0), around[0], UNKNOWN)
    pencils = np.stack([_pencils(camera, instrument, way, radii, pupil) for way in ways])
    return Passage(step, ways, way_of_ring, pencils)


def trace_pupil(passage: Passage, instrument: Instrument, radii: Array, directions: Array, starts: Array) -> PupilTrace:
    """Follow rays from places (n, 3) in the pupil along directions (n, 3), for image radii (n,)."""
    ring = np.minimum((radii / passage.step_mm).astype(np.intp), len(passage.way_of_ring) - 1)
    way = passage.way_of_ring[ring]
    points, ahead = np.empty_like(starts), np.empty_like(directions)
    leaves = np.zeros(len(way), dtype=bool)
    reflections = np.zeros(len(way), dtype=np.intp)
    for index, taken in enumerate(passage.ways):
        rays = np.flatnonzero(way == index)
        reflections[rays] = len(taken.mirrors)
        if not taken.leaves or not rays.size:
            continue
        points[rays], ahead[rays] = _follow(instrument, taken, directions[rays], starts[rays])
        leaves[rays] = np.isfinite(ahead[rays, 2])
        way[rays[~leaves[rays]]] = UNKNOWN
    rays = np.flatnonzero(way == UNKNOWN)
    if rays.size:
        trace = trace_first_hits(instrument, directions[rays], starts[rays])
        points[rays], ahead[rays] = trace.exit_point, trace.exit_direction
        leaves[rays] = trace.status == Status.ESCAPED
        reflections[rays] = (trace.sequence >= 0).sum(axis=1)
        for index, taken in enumerate(passage.ways):
            expected = np.full(trace.sequence.shape[1], -1)
            expected[: len(taken.mirrors)] = taken.mirrors
            same = (trace.sequence == expected).all(axis=1) & (leaves[rays] == taken.leaves)
            way[rays[same]] = index
    return PupilTrace(points, ahead, leaves, reflections, way)


def pencil_terms(passage: Passage, trace: PupilTrace, radii: Array) -> Array:
    """The four terms (4, n) of the pencils of rays at image radii (n,); zero on ways that are not known."""
    terms = np.zeros((4, len(radii)))
    place = radii / passage.step_mm
    table = np.arange(passage.pencils.shape[2], dtype=float)
    for index in range(len(passage.ways)):
        rays = np.flatnonzero(trace.way == index)
        for row, values in zip(terms, passage.pencils[index], strict=True):
            row[rays] = np.interp(place[rays], table, values)
    return terms


def _probes(radius: float) -> Array:
    """Places (m, 3) in half the pupil, on its rim and on rings inside."""
    places = []
    for share in PROBE_RINGS:
        angle = np.linspace(0.0, np.pi, max(1, round(share * PROBES_ON_RIM)))
        reach = share * radius
        places.append(np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(angle.size)], axis=-1))
    return np.concatenate(places)


def _ahead(camera: Camera, radii: Array, starts: Array, pupil: Pupil) -> Array:
    """Directions (n, 3) of rays from places in the pupil that image at radii (n,) along +u."""
    u0, v0 = camera.principal_point_px
    u = u0 + radii / camera.pixel_pitch_mm
    return ray_directions(camera, u, np.full(u.shape, v0), starts, pupil)


def _follow(instrument: Instrument, way: Way, directions: Array, starts: Array) -> tuple[Array, Array]:
    """Exit points and directions (n, 3) of rays along a way, apertures ignored; NaN where a mirror is missed."""
    if not way.mirrors:
        return starts, directions
    trace = trace_sequential(instrument, way.mirrors, directions, starts, apertures=False)
    return trace.point, trace.direction


def _pencils(camera: Camera, instrument: Instrument, way: Way, radii: Array, pupil: Pupil) -> Array:
    """The four terms (4, k) of a way's pencils at image radii (k,)."""
    if not way.leaves:
        return np.zeros((4, len(radii)))
    exits = []
    for x, y in ((0.0, 0.0), (PENCIL_MM, 0.0), (0.0, PENCIL_MM)):
        starts = np.tile([x, y, 0.0], (len(radii), 1))
        exits.append(_follow(instrument, way, _ahead(camera, radii, starts, pupil), starts))
    (point, ahead), meridional, sagittal = exits
    aside = np.stack([-ahead[:, 2], np.zeros(len(radii)), ahead[:, 0]], axis=-1)
    terms = [np.einsum("ni,ni->n", aside, moved - still) for moved, still in zip(meridional, exits[0], strict=True)]
    terms += [(moved - still)[:, 1] for moved, still in zip(sagittal, (point, ahead), strict=True)]
    filled = np.array(terms) / PENCIL_MM
    known = np.isfinite(filled).all(axis=0)
    if not known.any():
        return np.zeros_like(filled)
    return np.stack([np.interp(radii, radii[known], row[known]) for row in filled])
