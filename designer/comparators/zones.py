"""The image zone of a coaxial view, the light that fills it, and how far that light keeps from solids.

Frame of a head: pinhole at the origin, axis up. Lengths in mm, angles in radians unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.comparators.head import Face, outline
from designer.comparators.sight import CoaxialView, blur_disc, derivative, widest_angle
from designer.design import Mirror
from designer.evaluate.depth import Volume
from designer.trace.aiming import aim_at_points, exit_lines
from designer.trace.arrays import Array
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.image_law import image_radius, stretches
from designer.trace.pencils import chief_rays_at, images_about
from designer.trace.sequential import trace_sequential

RAYS = 5
# What counts as free where nothing is near.
FAR_MM = 1e3


@dataclass(frozen=True, slots=True)
class Zone:
    """The rays (n,) that a view needs, from the innermost to the outermost in the image.

    ``radius_mm`` are image radii; ``hits`` (n, 2) the points (R, z) of the mirror; ``slope`` the rise of the rays that
    leave it; ``width`` the half-width of the light across them at the mirror, at its widest for any distance.
    ``blur_mm`` and ``blur_rad`` (n, k) are diameters on the sensor, the larger of an ellipse, and in the scene, for the
    nearest and the farthest distance; ``crossing`` are the heights at which the rays cross the axis.
    """

    psi: Array
    radius_mm: Array
    hits: Array
    slope: Array
    width: Array
    pupil_radius: float
    blur_mm: Array
    blur_rad: Array
    crossing: Array

    @property
    def elevations(self) -> Array:
        """Elevations of the rays that leave."""
        return np.asarray(np.arctan(self.slope))

    def reach(self, face: Face) -> tuple[float, float]:
        """Inner and outer radius of the face that the light fills, at its full width."""
        ends = []
        for place, outwards in ((0, -1.0), (-1, 1.0)):
            radius = float(self.hits[place, 0])
            incline = face.slope(radius)
            incidence = incline + float(self.psi[place])
            # Across the ray and along the face: docs/theory.md, section 9, beam footprint.
            ends.append(radius + outwards * float(self.width[place]) * np.cos(incline) / max(np.cos(incidence), 0.1))
        return max(ends[0], 0.0), ends[1]

    @property
    def single_viewpoint_error_mm(self) -> float:
        """Diameter of the smallest ball, about the point that the rays pass nearest to, that all of them meet."""
        cosine = np.cos(self.elevations)
        centre = np.sum(cosine**2 * self.crossing) / np.sum(cosine**2)
        return float(2.0 * np.max(np.abs(self.crossing - centre) * cosine))


def zone_of(view: CoaxialView, volume: Volume, middle: float, rays: int = RAYS) -> Zone:
    """The zone in which a view images a working volume, seen from a height ``middle`` of the rig."""
    tangents = np.repeat(np.tan(volume.elevations), 2)
    distances = np.tile(volume.distances, 2)
    heights = view.own_heights(middle + tangents * distances)
    with np.errstate(all="ignore"):
        corners = aim_at_points(view.instrument, view.path, distances, heights, widest_angle(view.camera))
        return _zone(view, np.linspace(np.min(corners), np.max(corners), rays), np.array(volume.distances))


def _zone(view: CoaxialView, psi: Array, distances: Array) -> Zone:
    camera = view.camera
    chief = chief_rays_at(view.instrument, view.path, psi)
    first = trace_sequential(view.instrument, view.path, pinhole_directions(psi), apertures=False).hits[0]
    images = images_about(view.instrument, view.path, chief, distances)
    (start_r, start_z), (ahead_r, ahead_z) = exit_lines(view.instrument, view.path, psi)
    along, across = stretches(camera, psi)
    discs = [
        np.abs(blur_disc(camera, psi[:, None], image) * stretch[:, None])
        for image, stretch in ((images.tangential, along), (images.sagittal, across))
    ]

    def elevation_at(angles: Array) -> Array:
        trace = trace_sequential(view.instrument, view.path, pinhole_directions(angles.ravel()), apertures=False)
        return elevation_angles(trace.direction).reshape(angles.shape)

    radial = derivative(lambda angles: image_radius(camera, angles), psi) / derivative(elevation_at, psi)
    widths = np.abs(1.0 - chief.first_leg[:, None] * images.tangential)
    return Zone(
        psi=psi,
        radius_mm=image_radius(camera, psi),
        hits=np.stack([np.hypot(first[:, 0], first[:, 1]), first[:, 2]], axis=-1),
        slope=np.asarray(ahead_z / ahead_r),
        width=np.asarray(camera.pupil_radius_mm * np.cos(psi) * widths.max(axis=1)),
        pupil_radius=camera.pupil_radius_mm,
        blur_mm=np.maximum(*discs),
        blur_rad=np.asarray(discs[0] / np.abs(radial)[:, None]),
        crossing=np.asarray(start_z - start_r * ahead_z / ahead_r),
    )


def passes_outside(zone: Zone, place: int, mirror: Mirror) -> float:
    """How far the light to a zone's end keeps outside the outer rim of a mirror; negative if it does not."""
    return _passes(zone, place, outline(mirror)[[-1, len(outline(mirror)) // 2 - 1]], 1.0)


def passes_inside(zone: Zone, place: int, mirror: Mirror) -> float:
    """How far the light to a zone's end keeps inside a mirror's hole; negative if it does not."""
    return _passes(zone, place, outline(mirror)[[0, len(outline(mirror)) // 2]], -1.0)


def _passes(zone: Zone, place: int, rims: Array, side: float) -> float:
    psi, (_, top) = float(zone.psi[place]), zone.hits[place]
    share = rims[:, 1] / top
    width = zone.pupil_radius * np.cos(psi) * (1.0 - share) + zone.width[place] * share
    free = side * (rims[:, 1] * np.tan(psi) - rims[:, 0]) * np.cos(psi) - width
    return float(np.min(free))


def passes_below(zone: Zone, points: Array) -> float:
    """How far the light that leaves keeps below points (n, 2) in section that it passes."""
    return _clears(zone, points, 1.0)


def passes_above(zone: Zone, points: Array) -> float:
    """How far the light that leaves keeps above points (n, 2) in section that it passes."""
    return _clears(zone, points, -1.0)


def _clears(zone: Zone, points: Array, side: float) -> float:
    beyond = points[None, :, 0] - zone.hits[:, :1]
    over = points[None, :, 1] - zone.hits[:, 1:] - zone.slope[:, None] * beyond
    free = side * over * np.cos(zone.elevations)[:, None] - zone.width[:, None]
    # Points nearer to the axis than the mirror's own are not passed.
    return float(np.min(np.where(beyond > 0.0, free, FAR_MM), initial=FAR_MM))


def distance_between(one: Mirror, other: Mirror) -> float:
    """Least distance of two solids' outlines that do not cross."""
    first, second = outline(one), outline(other)
    return float(np.min(np.hypot(*(first[:, None] - second[None]).transpose(2, 0, 1))))


def rims_of(mirrors: Sequence[Mirror]) -> Array:
    """Outlines (n, 2) of some solids, together."""
    return np.concatenate([outline(mirror) for mirror in mirrors]) if mirrors else np.empty((0, 2))
