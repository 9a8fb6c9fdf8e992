"""Light with width, by traced rays alone: close pencils about a chief ray, and bundles through the whole pupil.

A pencil says where the virtual image of a scene point lies, tangentially (in the meridional plane) and sagittally
(across it); a bundle says which rays through the pupil a scene point sends, and so where its light lands.

Frame: pinhole (centre of the entrance pupil) at the origin, optical axis +z, millimetres, radians unless a name says
otherwise. Chief rays leave the pinhole towards positive x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from designer.design import Design, ViewName
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.arrays import Array
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import Instrument, build_instrument
from designer.trace.sequential import trace_sequential

# Half-widths of a close pencil: of its directions in radians, and of its starts as a share of the first leg. Symmetric
# differences at this step and at half of it, extrapolated, leave the fourth power of the step: below 1e-10, and so is
# what rounding adds, unless a mirror's radius of curvature is a fraction of a millimetre.
PENCIL_STEP = 1e-5
RINGS = 6
AIMING_STEPS = 12
# An aimed ray passes the scene point at this share of its distance, or less.
AIMING_TOLERANCE = 1e-10
AIMED_TOLERANCE = 1e-8
JACOBIAN_STEP = 1e-6
# Root-mean-square radius of an evenly lit disc, as a share of its diameter.
DISC_RMS_PER_DIAMETER = 1.0 / np.sqrt(8.0)


@dataclass(frozen=True, slots=True)
class ChiefRays:
    """Traced chief rays (n,) of one view: pinhole angle, last point (n, 3) and exit direction (n, 3); NaN if none."""

    psi: Array
    first_leg: Array
    point: Array
    direction: Array

    @property
    def across(self) -> Array:
        """Unit vectors (n, 3) across the exit rays, in the meridional plane."""
        return np.stack([-self.direction[:, 2], np.zeros(len(self.psi)), self.direction[:, 0]], axis=-1)

    def distance_beyond(self, distances_mm: Array) -> Array:
        """Distances (n, k) from the last mirror, along the exit rays, to a distance from the axis; may be infinite."""
        outwards = self.direction[:, 0]
        start = self.point[:, 0] * np.sign(outwards)
        return np.asarray((distances_mm[None, :] - start[:, None]) / np.abs(outwards)[:, None])


@dataclass(frozen=True, slots=True)
class PencilImages:
    """Virtual images of scene points at elevations (n) and distances (k), by close pencils.

    ``psi`` (n,) are the pinhole angles of the chief rays; ``tangential`` and ``sagittal`` (n, k) the reciprocal
    distances 1/V in 1/mm from the pinhole along them, positive ahead of the lens. ``uncertainty`` (n, k) in 1/mm is
    what extrapolation to pencils of no width has changed in either, which is far more than what it has left. NaN where
    no ray leaves at the elevation.
    """

    psi: Array
    tangential: Array
    sagittal: Array
    uncertainty: Array


@dataclass(frozen=True, slots=True)
class Bundles:
    """Rays from places in the pupil to scene points, aimed through the mirrors, their apertures ignored.

    ``points_mm`` (n, k, 3) are the points at elevations (n) and distances (k), ``places_mm`` (p, 3) the places that
    fill the pupil evenly, ``slopes`` (n, k, p, 2) the slopes dx/dz and dy/dz with which the rays leave them; NaN for a
    ray that finds no way. ``psi`` (n,) are the pinhole angles of the chief rays.
    """

    psi: Array
    points_mm: Array
    places_mm: Array
    slopes: Array

    @property
    def directions(self) -> Array:
        """Unit directions (n, k, p, 3) at the pupil."""
        ahead = np.concatenate([self.slopes, np.ones((*self.slopes.shape[:-1], 1))], axis=-1)
        return np.asarray(ahead / np.linalg.norm(ahead, axis=-1, keepdims=True))

    def landed_mm(self, principal_distance_mm: float, reciprocal_focus: float) -> Array:
        """Where the rays land (n, k, p, 2) behind a perspective thin lens: f (slope + place / u), 1/u given."""
        return np.asarray(principal_distance_mm * (self.slopes + self.places_mm[:, :2] * reciprocal_focus))

    def rms_radius_mm(self, principal_distance_mm: float, reciprocal_focus: float) -> Array:
        """Root mean square distance (n, k) of the light from its centre, as above; NaN if any ray is lost."""
        landed = self.landed_mm(principal_distance_mm, reciprocal_focus)
        off = landed - landed.mean(axis=2, keepdims=True)
        return np.asarray(np.sqrt(np.sum(off * off, axis=-1).mean(axis=-1)))


def pencil_images(
    design: Design, view_name: ViewName, elevations_deg: ArrayLike, distances_mm: ArrayLike
) -> PencilImages:
    """Virtual images of scene points, by close pencils of rays traced about each chief ray.

    A scene point is given by elevation in degrees of the chief ray and distance from the axis in mm, which may be
    infinite. Rays start beside the pinhole, or leave it beside the chief ray; how far both pass from the scene point
    tells which rays meet in it, and so where they seem to come from. Apertures and blockage are ignored.
    """
    instrument = build_instrument(design)
    path = instrument.path(design.views.by_name[view_name].path)
    chief = chief_rays(instrument, path, elevations_deg, widest_pinhole_angle(design))
    return images_about(instrument, path, chief, np.atleast_1d(np.asarray(distances_mm, dtype=float)))


def trace_bundles(
    design: Design,
    view_name: ViewName,
    elevations_deg: ArrayLike,
    distances_mm: ArrayLike,
    *,
    rings: int = RINGS,
    pupil_radius_mm: float | None = None,
) -> Bundles:
    """Aim rays from all over the pupil at scene points; the camera's own pupil unless a radius is given.

    A scene point is given as for :func:`pencil_images`, at a finite distance.
    """
    instrument = build_instrument(design)
    path = instrument.path(design.views.by_name[view_name].path)
    chief = chief_rays(instrument, path, elevations_deg, widest_pinhole_angle(design))
    places = pupil_places(design.camera.pupil_radius_mm if pupil_radius_mm is None else pupil_radius_mm, rings)
    return bundles_about(instrument, path, chief, np.atleast_1d(np.asarray(distances_mm, dtype=float)), places)


def bundles_about(
    instrument: Instrument, path: tuple[int, ...], chief: ChiefRays, distances: Array, places: Array
) -> Bundles:
    """As :func:`trace_bundles`, about chief rays (n,), for distances (k,) and the places of :func:`pupil_places`."""
    with np.errstate(all="ignore"):
        reach = chief.distance_beyond(distances)
        points = chief.point[:, None, :] + reach[..., None] * chief.direction[:, None, :]
        images = images_about(instrument, path, chief, distances)
        # Mirrors on the axis: what holds on one side of the meridional plane holds on the other.
        half = _aimed_slopes(instrument, path, chief, points, places[: len(places) // 2], images)
        slopes = np.concatenate([half, half * [1.0, -1.0]], axis=2)
    return Bundles(chief.psi, points, places, slopes)


def chief_rays(instrument: Instrument, path: tuple[int, ...], elevations_deg: ArrayLike, widest: float) -> ChiefRays:
    """The rays from the pinhole, at angles up to ``widest`` in radians, that leave a path at elevations in degrees."""
    elevations = np.radians(np.atleast_1d(np.asarray(elevations_deg, dtype=float)))
    return chief_rays_at(instrument, path, pinhole_angles(instrument, path, elevations, widest))


def chief_rays_at(instrument: Instrument, path: tuple[int, ...], psi: Array) -> ChiefRays:
    """The rays from the pinhole at angles psi (n,) in radians; NaN where one misses a mirror, apertures ignored."""
    trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
    return ChiefRays(psi, np.linalg.norm(trace.hits[0], axis=1), trace.point, trace.direction)


def pupil_places(radius_mm: float, rings: int = RINGS) -> Array:
    """Points (6 rings^2, 3) that fill a disc across the axis evenly, each for the same area.

    The first half has y > 0 and the second half is its mirror image, in the same order. Ring k of equal width, from the
    centre, holds 2k + 1 times as many points as the first, at the radius whose square is the mean over the ring, so
    that second moments are exact.
    """
    half = []
    for ring in range(rings):
        count = 3 * (2 * ring + 1)
        angle = np.pi * (np.arange(count) + 0.5) / count
        reach = radius_mm * np.sqrt((ring**2 + (ring + 1) ** 2) / 2.0) / rings
        half.append(np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(count)], axis=-1))
    upper = np.concatenate(half)
    return np.concatenate([upper, upper * [1.0, -1.0, 1.0]])


def images_about(instrument: Instrument, path: tuple[int, ...], chief: ChiefRays, distances: Array) -> PencilImages:
    """As :func:`pencil_images`, about chief rays (n,), for distances (k,).

    1/V = (dY/da) / (dY/db), with Y where a ray passes the scene point, a its start beside the pinhole, b its angle.
    """
    with np.errstate(all="ignore"):
        return _images_about(instrument, path, chief, distances)


def _images_about(instrument: Instrument, path: tuple[int, ...], chief: ChiefRays, distances: Array) -> PencilImages:
    count = len(chief.psi)
    sine, cosine, none = np.sin(chief.psi), np.cos(chief.psi), np.zeros(count)
    ahead = np.stack([sine, none, cosine], axis=-1)
    # Planes: tangential, sagittal. Kinds: beside the pinhole, beside the direction. Then half-widths and both signs.
    aside = np.stack([np.stack([cosine, none, -sine], axis=-1), np.tile([0.0, 1.0, 0.0], (count, 1))])
    widths = PENCIL_STEP * np.array([1.0, 0.5])
    signed = np.array([1.0, -1.0])[:, None] * widths
    starts = np.zeros((2, 2, 2, 2, count, 3))
    headings = np.broadcast_to(ahead, starts.shape).copy()
    starts[:, 0] = signed[None, :, :, None, None] * (chief.first_leg[:, None] * aside)[:, None, None]
    turn = signed[None, :, :, None, None]
    headings[:, 1] = np.cos(turn) * ahead + np.sin(turn) * aside[:, None, None]
    trace = trace_sequential(instrument, path, headings.reshape(-1, 3), starts.reshape(-1, 3), apertures=False)
    points, directions = trace.point.reshape(starts.shape), trace.direction.reshape(starts.shape)

    across = np.stack([chief.across, np.tile([0.0, 1.0, 0.0], (count, 1))])[:, None, None, None]
    from_chief = points - chief.point
    along = np.sum(directions * chief.direction, axis=-1)
    slope = np.sum(directions * across, axis=-1) / along
    offset = np.sum(from_chief * across, axis=-1) - slope * np.sum(from_chief * chief.direction, axis=-1)
    # Where each ray passes the scene point, per distance to it, which stays finite for a point at infinity.
    passes = offset[..., None] / chief.distance_beyond(distances) + slope[..., None]
    rates = (passes[:, :, 0] - passes[:, :, 1]) / (2.0 * widths[:, None, None])
    best = (4.0 * rates[:, :, 1] - rates[:, :, 0]) / 3.0
    reciprocal = best[:, 0] / best[:, 1] / chief.first_leg[:, None]
    plain = rates[:, 0, 1] / rates[:, 1, 1] / chief.first_leg[:, None]
    uncertainty = np.max(np.abs(reciprocal - plain), axis=0)
    return PencilImages(chief.psi, reciprocal[0], reciprocal[1], uncertainty)


def _aimed_slopes(
    instrument: Instrument,
    path: tuple[int, ...],
    chief: ChiefRays,
    points: Array,
    places: Array,
    images: PencilImages,
) -> Array:
    """Slopes (n, k, p, 2) of rays from places that pass the mirrors to points, by Broyden's method.

    The pencils give the first guess, and the chief ray's neighbours the first Jacobian.
    """
    count, depth, number = *points.shape[:2], len(places)
    shape = (count, depth, number)
    starts = np.broadcast_to(places, (*shape, 3)).reshape(-1, 3)
    targets = np.broadcast_to(points[:, :, None], (*shape, 3)).reshape(-1, 3)
    across = np.broadcast_to(chief.across[:, None, None], (*shape, 3)).reshape(-1, 3)

    def miss(slopes: Array, start: Array, target: Array, plane: Array) -> Array:
        """How far (m, 2) rays pass from their points, in the meridional plane and across, per distance to them."""
        ahead = np.column_stack([slopes, np.ones(len(slopes))])
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        trace = trace_sequential(instrument, path, ahead, start, apertures=False)
        offset = target - trace.point
        along = np.einsum("ni,ni->n", offset, trace.direction)
        aside = offset - along[:, None] * trace.direction
        # A ray that points away from its target does not aim at it.
        away = np.where(along > 0.0, along, np.nan)
        return np.stack([np.einsum("ni,ni->n", aside, plane), aside[:, 1]], axis=-1) / away[:, None]

    straight = np.stack([np.tan(chief.psi), np.zeros(count)], axis=-1)
    trials = np.broadcast_to(straight[:, None], (count, depth, 2)).reshape(-1, 2)
    at_pinhole = np.zeros((count * depth, 3))
    flat_points = points.reshape(-1, 3)
    planes = np.broadcast_to(chief.across[:, None], points.shape).reshape(-1, 3)
    columns = []
    for step in JACOBIAN_STEP * np.eye(2):
        ahead, behind = (miss(trials + sign * step, at_pinhole, flat_points, planes) for sign in (1.0, -1.0))
        columns.append((ahead - behind) / (2.0 * JACOBIAN_STEP))
    inverse = np.linalg.inv(_or_identity(np.stack(columns, axis=-1)))
    inverse = np.broadcast_to(inverse.reshape(count, depth, 1, 2, 2), (*shape, 2, 2)).reshape(-1, 2, 2)

    cosine = np.cos(chief.psi)[:, None]
    reciprocal_depth = np.stack([images.tangential / cosine, images.sagittal / cosine], axis=-1)
    slopes = (straight[:, None, None] - reciprocal_depth[:, :, None] * places[:, :2]).reshape(-1, 2)
    error = miss(slopes, starts, targets, across)
    for _ in range(AIMING_STEPS):
        going = np.flatnonzero(np.max(np.abs(error), axis=1) > AIMING_TOLERANCE)
        if not going.size:
            break
        step = -np.einsum("nij,nj->ni", inverse[going], error[going])
        trial = slopes[going] + step
        found = miss(trial, starts[going], targets[going], across[going])
        change = np.einsum("nij,nj->ni", inverse[going], found - error[going])
        gauge = np.einsum("ni,ni->n", step, change)[:, None, None]
        row = np.einsum("ni,nij->nj", step, inverse[going])
        update = (step - change)[:, :, None] * row[:, None, :] / gauge
        if not inverse.flags.writeable:
            inverse = inverse.copy()
        inverse[going] += np.where(np.isfinite(update), update, 0.0)
        slopes[going], error[going] = trial, found
    aimed = np.max(np.abs(error), axis=1) < AIMED_TOLERANCE
    return np.where(aimed[:, None], slopes, np.nan).reshape(*shape, 2)


def _or_identity(matrices: Array) -> Array:
    """Matrices (m, 2, 2), the identity for one that has no inverse."""
    usable = np.isfinite(matrices).all(axis=(1, 2)) & (np.abs(np.linalg.det(matrices)) > 0.0)
    return np.where(usable[:, None, None], matrices, np.eye(2))
