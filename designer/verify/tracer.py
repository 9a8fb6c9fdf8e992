"""Tracing rays from the pinhole: first hit against everything, or along an intended path of mirrors.

Frame: pinhole at the origin, optical axis +z, millimetres, radians unless a name says otherwise. Batches are arrays
(n, 3) of origins and unit directions. Nothing is stored on surfaces: a trace is what a function returns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design
from designer.verify.conics import Array, Rows
from designer.verify.surfaces import Indices, Pose, Scene, build_scene, first_hits, meet_face, reflect

__all__ = [
    "FirstHitTrace",
    "PathReport",
    "Pose",
    "Scene",
    "SequentialTrace",
    "Status",
    "build_scene",
    "compare_with_path",
    "elevation_angles",
    "meridional_rays",
    "pinhole_angles",
    "pinhole_directions",
    "trace_first_hits",
    "trace_sequential",
]

# Rays per block: the working arrays of a block stay in the processor's cache.
BLOCK = 16384
TABLE_SIZE = 1025
# Light caught between mirrors is followed no further.
MOST_MIRRORS = 6


class Status(IntEnum):
    """What became of a ray."""

    OK = 0
    """It met the intended mirrors, each first, and left."""
    MISSED = 1
    """It left without meeting the mirror that it should have met."""
    BLOCKED = 2
    """Something else stood in the way."""
    ESCAPED = 3
    """It left, and no path was asked of it."""


@dataclass(frozen=True, slots=True)
class FirstHitTrace:
    """Rays followed from surface to surface until they leave or are blocked.

    ``status`` (n,) holds ESCAPED or BLOCKED. ``sequence`` (n, k) holds the indices of the mirrors met, -1 after the
    last; ``hits`` (n, k, 3) the points, NaN after the last. ``element`` (n,) is the row of ``scene.elements`` that
    blocked the ray, or -1, ``blocked_at`` (n, 3) the point where, NaN if it left, and ``leg`` (n,) the number of
    mirrors met before. ``exit_point`` and ``exit_direction`` (n, 3) are start and direction of the last leg.
    """

    status: NDArray[np.int8]
    leg: Indices
    element: Indices
    blocked_at: Array
    sequence: Indices
    hits: Array
    exit_point: Array
    exit_direction: Array


@dataclass(frozen=True, slots=True)
class PathReport:
    """First-hit rays compared with an intended path; arrays (n,).

    ``leg`` is the leg on which the ray ended (0: from the pinhole to the first mirror). ``element`` is the row of
    ``scene.elements`` of what blocked a BLOCKED ray, and the mirror that a MISSED ray should have met; -1 if OK.
    """

    status: NDArray[np.int8]
    leg: Indices
    element: Indices


@dataclass(frozen=True, slots=True)
class SequentialTrace:
    """Rays traced along one path, whatever else may stand in the way.

    ``hits`` holds an array (n, 3) for each mirror of the path, ``direction`` (n, 3) the exit directions; both are
    NaN from the first miss on. ``missed`` (n,) is the place in the path of the first mirror missed, or -1.
    """

    hits: tuple[Array, ...]
    direction: Array
    missed: Indices

    @property
    def point(self) -> Array:
        """Where the exit rays start: the points (n, 3) on the last mirror."""
        return self.hits[-1]


def pinhole_directions(psi: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
    """Unit directions (n, 3) at angles psi from +z and azimuths atan2(y, x), in radians."""
    psi, azimuth = np.broadcast_arrays(np.asarray(psi, dtype=float), np.asarray(azimuth, dtype=float))
    sine = np.sin(psi)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(psi)], axis=-1)


def trace_first_hits(
    scene: Scene,
    directions: ArrayLike,
    origins: ArrayLike | None = None,
    *,
    starts_in_lens: bool = True,
    most_mirrors: int = MOST_MIRRORS,
) -> FirstHitTrace:
    """Follow rays to the first surface they meet, mirror by mirror.

    Parameters
    ----------
    directions
        Unit vectors (n, 3), world frame.
    origins
        Points (n, 3) in mm; the pinhole if not given.
    starts_in_lens
        Whether the first leg starts inside the lens, and so passes lens barrel and camera body.
    most_mirrors
        A ray that has met this many mirrors counts as blocked by the last.
    """
    given = np.asarray(directions, dtype=float).reshape(-1, 3)
    start = None if origins is None else np.broadcast_to(np.asarray(origins, dtype=float), given.shape)

    blocks = [
        _trace_block(scene, _Bundle.of(scene, given, start, block), starts_in_lens, most_mirrors)
        for block in _blocks(len(given))
    ]
    if len(blocks) == 1:
        return blocks[0]
    return FirstHitTrace(
        *(np.concatenate([getattr(block, name) for block in blocks]) for name in FirstHitTrace.__slots__)
    )


@dataclass(frozen=True, slots=True)
class _Bundle:
    """A block of rays as the surfaces take them.

    ``heading`` are 3 or 2 rows (n,) of unit directions and ``start`` (3, n) their starts, or (1, 1) the height from
    which all of them start on the axis. Then ``azimuth`` (2, n) are the horizontal unit vectors along which r counts.
    """

    start: Array
    heading: Rows
    azimuth: Array | None

    @classmethod
    def of(cls, scene: Scene, directions: Array, origins: Array | None, block: slice) -> _Bundle:
        """The rays of one block of directions and origins (n, 3); from the pinhole if there are no origins."""
        heading = np.ascontiguousarray(directions[block].T)
        if origins is not None:
            return cls(np.ascontiguousarray(origins[block].T), heading, None)
        if not scene.is_aligned:
            return cls(np.zeros_like(heading), heading, None)
        across = np.sqrt(heading[0] * heading[0] + heading[1] * heading[1])
        # A ray along the axis stays there, whatever its azimuth.
        azimuth = heading[:2] / np.maximum(across, np.finfo(float).tiny)
        return cls(np.zeros((1, 1)), [across, heading[2]], azimuth)

    def in_world(self, rows: Rows, out: Array | None = None) -> Array:
        """World coordinates (3, n) of points or vectors in rows (3 or 2, n)."""
        world = np.empty((3, self.heading[0].size)) if out is None else out
        if self.azimuth is None:
            world[:] = rows
        else:
            np.multiply(self.azimuth, rows[0], out=world[:2])
            world[2] = rows[1]
        return world


def _blocks(number: int) -> list[slice]:
    return [slice(low, low + BLOCK) for low in range(0, max(number, 1), BLOCK)]


def _trace_block(scene: Scene, bundle: _Bundle, starts_in_lens: bool, most_mirrors: int) -> FirstHitTrace:
    direction = np.array(bundle.heading)
    rows, number = direction.shape
    point = np.zeros((rows, number))
    point[-len(bundle.start) :] = bundle.start
    status = np.full(number, Status.ESCAPED, dtype=np.int8)
    leg = np.zeros(number, dtype=np.intp)
    element = np.full(number, -1, dtype=np.intp)
    blocked_at = np.full((rows, number), np.nan)
    sequence = np.full((number, most_mirrors), -1, dtype=np.intp)
    hits = np.full((most_mirrors, rows, number), np.nan)
    left = np.full(number, -1, dtype=np.intp)
    going = np.arange(number)
    with np.errstate(all="ignore"):
        for met in range(most_mirrors + 1):
            if not going.size:
                break
            here, ahead = (point[:, going] if met else bundle.start), direction[:, going]
            inside_lens = starts_in_lens and met == 0
            distance, row = first_hits(scene, here, ahead, left[going], camera=not inside_lens)
            leg[going] = met
            is_face = (row >= 0) & (row < len(scene.mirrors)) & (met < most_mirrors)
            stopped = (row >= 0) & ~is_face
            reached = distance * ahead
            reached[-len(here) :] += here
            status[going[stopped]] = Status.BLOCKED
            element[going[stopped]] = row[stopped]
            blocked_at[:, going[stopped]] = reached[:, stopped]
            rays, faces, landed = going[is_face], row[is_face], reached[:, is_face]
            point[:, rays] = landed
            direction[:, rays] = reflect(scene, faces, landed, ahead[:, is_face])
            left[rays] = faces
            if met < most_mirrors:
                sequence[rays, met] = faces
                hits[met][:, rays] = landed
            going = rays
    return FirstHitTrace(
        status,
        leg,
        element,
        bundle.in_world(blocked_at).T,
        sequence,
        np.stack([bundle.in_world(hit).T for hit in hits], axis=1),
        bundle.in_world(point).T,
        bundle.in_world(direction).T,
    )


def compare_with_path(trace: FirstHitTrace, path: Sequence[int]) -> PathReport:
    """Say of each ray whether it met the mirrors of a path (indices, in order), each first, and then left."""
    number, recorded = trace.sequence.shape
    status = np.full(number, Status.OK, dtype=np.int8)
    leg = np.full(number, len(path), dtype=np.intp)
    element = np.full(number, -1, dtype=np.intp)
    undecided = np.ones(number, dtype=bool)
    for place, expected in enumerate((*path, -1)):
        if place >= recorded:
            break
        met = trace.sequence[:, place]
        ends = undecided & (met != expected) if expected >= 0 else undecided & ((met >= 0) | (trace.element >= 0))
        blocker = np.where(met >= 0, met, trace.element)
        blocked = ends & (blocker >= 0)
        missed = ends & (blocker < 0)
        status[blocked], status[missed] = Status.BLOCKED, Status.MISSED
        element[blocked], element[missed] = blocker[blocked], expected
        leg[ends] = place
        undecided &= ~ends
    return PathReport(status, leg, element)


def trace_sequential(
    scene: Scene,
    path: Sequence[int],
    directions: ArrayLike,
    origins: ArrayLike | None = None,
    *,
    apertures: bool = True,
) -> SequentialTrace:
    """Trace rays along a path of mirrors (indices), ignoring blockage; with or without their apertures.

    Each mirror is met on its reflecting side and on its vertex sheet only. ``directions`` are unit vectors (n, 3),
    ``origins`` points (n, 3) in mm, the pinhole if not given.
    """
    given = np.asarray(directions, dtype=float).reshape(-1, 3)
    start = None if origins is None else np.broadcast_to(np.asarray(origins, dtype=float), given.shape)
    number = len(given)
    # In one array: memory for one of this size is kept and used again, where smaller ones go back to the system.
    results = np.empty((len(path) + 1, 3, number))
    missed = np.full(number, -1, dtype=np.intp)
    with np.errstate(all="ignore"):
        for block in _blocks(number):
            bundle = _Bundle.of(scene, given, start, block)
            point: Rows = bundle.start
            direction: Rows = bundle.heading
            for place, face in enumerate(path):
                point, direction = meet_face(scene, face, point, direction, aperture=apertures)
                lost = np.isnan(point[-1])
                if lost.any():
                    missed[block][lost & (missed[block] < 0)] = place
                bundle.in_world(point, out=results[place, :, block])
            bundle.in_world(direction, out=results[-1, :, block])
    *hits, exits = results.transpose(0, 2, 1)
    return SequentialTrace(tuple(hits), exits, missed)


def elevation_angles(directions: Array) -> Array:
    """Elevation in radians, from the horizontal plane, up positive, of directions (n, 3)."""
    return np.asarray(np.arctan2(directions[:, 2], np.hypot(directions[:, 0], directions[:, 1])))


def pinhole_angles(scene: Scene, path: Sequence[int], elevations: ArrayLike, psi_limit: float) -> Array:
    """Angles psi (n,) in radians, in 0..psi_limit, of the pinhole rays that leave a path at given elevations.

    The traced elevation, apertures ignored, is tabulated and inverted by secant steps on traced rays; the first
    crossing counts. NaN for an elevation (radians) that no ray within the limit takes.
    """
    targets = np.atleast_1d(np.asarray(elevations, dtype=float))
    table = np.linspace(0.0, psi_limit, TABLE_SIZE)

    def traced(psi: Array) -> Array:
        trace = trace_sequential(scene, path, pinhole_directions(psi), apertures=False)
        return elevation_angles(trace.direction)

    with np.errstate(all="ignore"):
        excess = traced(table) - targets[:, None]
        crosses = (excess[:, :-1] <= 0.0) != (excess[:, 1:] <= 0.0)
        crosses &= np.isfinite(excess[:, :-1]) & np.isfinite(excess[:, 1:])
        cell = np.argmax(crosses, axis=1)
        rows = np.arange(targets.size)
        found = crosses[rows, cell]
        psi, last = table[cell], table[cell + 1]
        error, last_error = excess[rows, cell], excess[rows, cell + 1]
        for _ in range(6):
            step = error * (last - psi) / (last_error - error)
            last, last_error = psi, error
            step = np.where(np.isfinite(step), step, 0.0)
            # A step below the last digit of psi changes nothing any more.
            if np.all(np.abs(step) <= np.spacing(psi)):
                break
            psi = psi - step
            error = traced(psi) - targets
    return np.where(found, psi, np.nan)


def widest_pinhole_angle(design: Design) -> float:
    """Angle psi in radians of the corner of the image, or of the image circle where that reaches farther."""
    camera = design.camera
    corner = np.hypot(camera.width_px, camera.height_px) / 2.0 * camera.pixel_pitch_mm
    return float(np.arctan2(max(corner, camera.image_radius_mm), camera.focal_length_mm))


def meridional_rays(
    design: Design,
    view_name: str,
    elevations_deg: ArrayLike,
    length_mm: float,
    poses: Mapping[str, Pose] | None = None,
) -> list[Array]:
    """Polylines (k, 2) of signed distance from the axis and height: pinhole, mirrors, then ``length_mm`` outwards.

    One for each elevation, in order; empty (0, 2) where no ray in the image leaves at that elevation. Apertures and
    blockage are ignored. The ray leaves the pinhole towards positive distances. ``view_name`` is "upper" or "lower".
    """
    scene = build_scene(design, poses)
    path = scene.path(getattr(design.views, view_name).path)
    elevations = np.radians(np.atleast_1d(np.asarray(elevations_deg, dtype=float)))
    psi = pinhole_angles(scene, path, elevations, widest_pinhole_angle(design))
    trace = trace_sequential(scene, path, pinhole_directions(psi), apertures=False)
    end = trace.point + length_mm * trace.direction
    corners = np.stack([np.zeros_like(end), *trace.hits, end], axis=1)[:, :, [0, 2]]
    return [line if np.isfinite(line).all() else np.empty((0, 2)) for line in corners]
