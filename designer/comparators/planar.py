"""One camera under two plane mirrors, one above the other, that turn both halves of its image to the same side.

Plane mirrors before one camera are the oldest of these ideas (Goshtasby and Gruver, 1993; Nene and Nayar, ICCV 1998;
Gluckman and Nayar, PAMI 2002). A plane neither widens nor narrows a view: both halves of the image together must hold
the elevations twice over, so that the lens has to be chosen for it, and the sensor looks one way only. Of the
arrangements this one has a vertical baseline, the longer side of most envelopes.

Since it looks one way only, it may be mounted at a tilt, its envelope with it. The baseline is the distance between the
virtual pinholes across the middle ray of the working volume, over the cosine of that ray's elevation: as long as a
vertical one that gives the same disparity.

Frame of the camera: pinhole at the origin, optical axis +z, view towards +x; mm and radians. Edges run along y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from designer.comparators.asked import Asked
from designer.comparators.coaxial import SPARE, TENTHS_OF_A_DEGREE, UNBOUNDED, error_of
from designer.comparators.errors import Azimuth, Rig
from designer.comparators.head import camera_with
from designer.comparators.planar_view import Flat, PlanarView
from designer.comparators.search import Measured, Space
from designer.comparators.sight import blur_disc
from designer.design import Camera
from designer.trace.arrays import Array
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.sequential import trace_sequential

LEAST_AZIMUTH_DEG, MOST_AZIMUTH_DEG = 20.0, 110.0
"""What a planar sensor must see around, at least; it then sees as much as costs little depth."""
FOCAL_LENGTHS = (0.15, 1.0)
"""The lens's focal length over the requirement's: bounds of the choice."""
GAUSS = (Azimuth(0.0, 4.0 / 9.0), Azimuth(float(np.sqrt(0.6)), 5.0 / 9.0))
"""Three nodes over the azimuths seen, of which the outer two are alike."""
WIDEST = 1.0
MOST_TILT = 1.2


@dataclass(frozen=True, slots=True)
class Beam:
    """The light of one view, at the corners (n,) of what it must see.

    ``places`` (n, 2) are image places, ``hits`` (n, 3) points on the mirror, ``ahead`` and ``leaving`` (n, 3)
    directions before and behind it, ``width`` (n,) half-widths of the light at the mirror, ``blur_mm`` and ``blur_rad``
    (n,) diameters of the blur.
    """

    places: Array
    hits: Array
    ahead: Array
    leaving: Array
    width: Array
    blur_mm: Array
    blur_rad: Array


@dataclass(frozen=True, slots=True)
class Plate:
    """A rectangular mirror: along its rise from ``low`` to ``high``, ``half`` to either side, with its thickness."""

    flat: Flat
    low: float
    high: float
    half: float
    thickness: float

    @property
    def corners(self) -> Array:
        """The eight corners (8, 3)."""
        own = np.array(
            [
                [along, across, back]
                for along in (self.low, self.high)
                for across in (-self.half, self.half)
                for back in (0.0, self.thickness)
            ]
        )
        return np.asarray(own @ self.flat.rotation.T + np.array([0.0, 0.0, self.flat.height]))

    @property
    def section(self) -> Array:
        """The four corners (4, 2) in the plane y = 0, as (x, z)."""
        return self.corners[self.corners[:, 1] > 0.0][:, [0, 2]]

    def holds(self, points: Array) -> Array:
        """Which points (n, 3) of its plane lie on the mirror."""
        own = self.flat.own(points)
        return np.asarray((own[:, 0] >= self.low) & (own[:, 0] <= self.high) & (np.abs(own[:, 1]) <= self.half))


@dataclass(frozen=True, slots=True)
class Planar:
    """A camera under two plates; the lower view's first."""

    camera: Camera
    views: tuple[PlanarView, PlanarView]
    plates: tuple[Plate, Plate]
    beams: tuple[Beam, Beam]
    rig: Rig
    half_azimuth: float
    baseline_mm: float
    height_mm: float
    diameter_mm: float

    @property
    def largest_blur_px(self) -> float:
        """Largest diameter of the blur on the sensor."""
        return max(float(np.max(beam.blur_mm)) for beam in self.beams) / self.camera.pixel_pitch_mm

    @property
    def largest_blur_deg(self) -> float:
        """Largest blur in the scene."""
        return float(np.degrees(max(np.max(beam.blur_rad) for beam in self.beams)))

    @property
    def single_viewpoint_error_mm(self) -> float:
        """How far traced rays pass from where the camera seems to stand, twice: none but for rounding."""
        missed = []
        for view, beam in zip(self.views, self.beams, strict=True):
            offset = beam.hits - view.flat.seen(np.zeros(3))
            aside = offset - np.sum(offset * beam.leaving, axis=1)[:, None] * beam.leaving
            missed.append(np.max(np.linalg.norm(aside, axis=1)))
        return float(2.0 * max(missed))


def spaces(asked: Asked) -> Iterator[Space[Planar]]:
    """The spaces to search: the upper view's mirror before the axis as seen from the scene, or behind it.

    Variables are, of each mirror, the angle at the pinhole of its middle ray and the height at which that meets it;
    how far the camera stands from the axis of the envelope, and how far the whole leans; half of the azimuths; and the
    lens, which may be a shorter one.
    """
    top = asked.greatest_height
    nearest = asked.requirement.camera.nearest_mirror_mm
    off = asked.requirement.envelope.diameter_mm / 2.0
    focal_length = asked.lens.focal_lengths_mm[1]
    sides = ((-WIDEST, 0.0), (0.0, WIDEST))
    bounds = [
        (nearest, top),
        (nearest, top),
        (-off, off),
        (-MOST_TILT, MOST_TILT),
        (np.radians(LEAST_AZIMUTH_DEG) / 2.0, np.radians(MOST_AZIMUTH_DEG) / 2.0),
        (FOCAL_LENGTHS[0] * focal_length, FOCAL_LENGTHS[1] * focal_length),
        *asked.lens_bounds[1:],
    ]
    for upper_side in (1.0, -1.0):
        angles = sides if upper_side > 0.0 else sides[::-1]
        yield Space([*angles, *bounds], partial(_measure, asked, upper_side))


def put_together(asked: Asked, values: Array) -> Planar:
    """The camera with both mirrors, each as large as its light needs."""
    *of_mirrors, axis, tilt, half_azimuth, focal_length, reciprocal_focus, f_number = (float(value) for value in values)
    lens = asked.lens.model_copy(update={"projection": "perspective", "distortion": ()})
    camera = camera_with(asked.requirement, lens, focal_length, reciprocal_focus, f_number)
    angles, heights = of_mirrors[:2], of_mirrors[2:]
    elevation = float(np.arctan(asked.middle_slope))
    flats = [_flat(angle, height, elevation - tilt) for angle, height in zip(angles, heights, strict=True)]
    lower, upper = (PlanarView(camera, flat, flat.instrument(camera), axis, tilt) for flat in flats)
    viewpoints = np.stack([lower.viewpoint, upper.viewpoint])
    middle_x, middle_z = viewpoints.mean(axis=0)
    # The middle ray of the volume passes the middle of the baseline, wherever that stands.
    middle = float(middle_z - middle_x * asked.middle_slope)
    beams = tuple(_beam(asked, view, middle, half_azimuth) for view in (lower, upper))
    plates = tuple(_plate(asked, flat, beam) for flat, beam in zip(flats, beams, strict=True))
    corners = np.concatenate([plate.corners for plate in plates])
    azimuths = tuple(Azimuth(node.angle * half_azimuth, node.weight) for node in GAUSS)
    return Planar(
        camera=camera,
        views=(lower, upper),
        plates=(plates[0], plates[1]),
        beams=(beams[0], beams[1]),
        rig=Rig(lower, upper, middle, azimuths=azimuths),
        half_azimuth=half_azimuth,
        baseline_mm=float((viewpoints[1] - viewpoints[0]) @ np.array([-asked.middle_slope, 1.0])),
        height_mm=float(corners[:, 2].max() - min(corners[:, 2].min(), camera.lens_front_mm)),
        diameter_mm=float(2.0 * np.max(np.hypot(corners[:, 0] - axis, corners[:, 1]))),
    )


def _flat(angle: float, height: float, elevation: float) -> Flat:
    """The flat that turns the ray at an angle from the axis to an elevation, where it has risen to a height."""
    incline = (elevation + np.pi / 2.0 - angle) / 2.0
    return Flat(float(height * (1.0 - np.tan(angle) * np.tan(incline))), float(incline))


def _beam(asked: Asked, view: PlanarView, middle: float, half_azimuth: float) -> Beam:
    low, high = np.tan(asked.volume.elevations)
    distances = np.array(asked.volume.distances, dtype=float)
    slopes, reach = (part.ravel() for part in np.meshgrid([low, high], distances, indexing="ij"))
    parts = [view.points(reach, middle + slopes * reach, azimuth) for azimuth in (-half_azimuth, 0.0, half_azimuth)]
    points = np.concatenate(parts)
    places = view.places(points)
    ahead, hits, leaving = view.traced(places)
    first, second = np.linalg.norm(hits, axis=1), np.linalg.norm(points - hits, axis=1)
    psi = np.arccos(ahead[:, 2])
    blur = np.abs(blur_disc(view.camera, psi, 1.0 / (first + second)))
    return Beam(
        places=places,
        hits=hits,
        ahead=ahead,
        leaving=leaving,
        width=np.asarray(view.camera.pupil_radius_mm * second / (first + second)),
        blur_mm=blur,
        # A plane keeps angles, and nowhere does a radian measure less than f on the sensor.
        blur_rad=np.asarray(blur / view.camera.focal_length_mm),
    )


def _plate(asked: Asked, flat: Flat, beam: Beam) -> Plate:
    own = flat.own(beam.hits)
    facing = np.abs(beam.ahead @ flat.rotation[:, 2])
    margin = asked.requirement.manufacture.edge_margin_mm
    along = beam.width / facing
    return Plate(
        flat,
        float(np.min(own[:, 0] - along)) - margin,
        float(np.max(own[:, 0] + along)) + margin,
        float(np.max(np.abs(own[:, 1]) + along)) + margin,
        asked.requirement.manufacture.substrate_thickness_mm,
    )


def _measure(asked: Asked, upper_side: float, values: Array) -> Measured[Planar] | None:
    built = put_together(asked, values)
    if not all(np.isfinite(beam.hits).all() for beam in built.beams):
        return None
    sharpness, camera = asked.requirement.sharpness, built.camera
    (near, far), (lower, upper) = built.plates, built.beams
    pixel, half_mirror = camera.pixel_pitch_mm, asked.requirement.envelope.mirror_diameter_mm / 2.0
    all_places = np.concatenate([lower.places, upper.places]) / pixel
    slopes = np.concatenate([beam.ahead[:, :2] / beam.ahead[:, 2:] for beam in built.beams])
    blurs = (float(np.max(lower.blur_mm)) + float(np.max(upper.blur_mm))) / 2.0
    first, second = (lower, upper) if upper_side > 0.0 else (upper, lower)
    gap = float(np.min(second.places[:, 0]) - np.max(first.places[:, 0]))
    camera_section = np.array(
        [
            [side * radius, height]
            for side in (-1.0, 1.0)
            for radius, height in (
                (camera.lens_radius_mm, camera.lens_front_mm),
                (camera.body_radius_mm, camera.lens_seat_mm),
            )
        ]
    )
    free = [
        _beside(upper, near.section, upper_side, camera.pupil_radius_mm),
        _over(lower, far.section, 1.0),
        _over(upper, near.section, -1.0),
        *(_over(beam, camera_section, -1.0) for beam in built.beams),
        _apart(near, far),
    ]
    sizes = [size for plate in built.plates for size in ((plate.high - plate.low) / 2.0, plate.half)]
    spares = [
        camera.width_px / 2.0 - float(np.max(np.abs(all_places[:, 0]))),
        camera.height_px / 2.0 - float(np.max(np.abs(all_places[:, 1]))),
        (gap - blurs) / pixel - asked.requirement.manufacture.zone_gap_px,
        float(min(np.min(beam.hits[:, 2]) for beam in built.beams)) - asked.requirement.camera.nearest_mirror_mm,
        *(half_mirror - size for size in sizes),
        *(size - asked.requirement.manufacture.smallest_mirror_radius_mm for size in sizes),
        (min(sharpness.max_blur_deg, UNBOUNDED) - built.largest_blur_deg) * TENTHS_OF_A_DEGREE,
        min(sharpness.max_blur_px, UNBOUNDED) - built.largest_blur_px,
        camera.lens_radius_mm
        - camera.pupil_radius_mm
        - camera.lens_front_mm * float(np.max(np.hypot(slopes[:, 0], slopes[:, 1]))),
        # The light that leaves must not come back to the mirror that it leaves.
        *(
            float(np.degrees(plate.flat.incline - np.max(np.arctan2(beam.leaving[:, 2], beam.leaving[:, 0]))))
            for plate, beam in zip(built.plates, built.beams, strict=True)
        ),
        *(distance - asked.requirement.manufacture.clearance_mm for distance in free),
        built.baseline_mm - asked.baselines[0],
        asked.baselines[1] - built.baseline_mm,
        asked.requirement.envelope.height_mm - built.height_mm,
        asked.requirement.envelope.diameter_mm - built.diameter_mm,
        # Off its axis a camera counts, since it stands out sideways.
        asked.requirement.envelope.diameter_mm / 2.0 - abs(built.views[0].axis) - camera.body_radius_mm,
    ]
    return Measured(built, error_of(asked, built.rig), built.height_mm, built.diameter_mm, np.array(spares) - SPARE)


def _beside(beam: Beam, section: Array, side: float, width: float) -> float:
    """How far the light on its way to the mirror keeps to one side of points (n, 2) in section: +x for 1, -x for -1."""
    tangent = (beam.ahead[:, 0] / beam.ahead[:, 2])[:, None]
    free = side * (section[None, :, 1] * tangent - section[None, :, 0]) / np.hypot(1.0, tangent)
    return float(np.min(free)) - width


def _over(beam: Beam, section: Array, side: float) -> float:
    """How far points (n, 2) in section that the leaving light passes lie above it, or below it for a side of -1."""
    slope = (beam.leaving[:, 2] / beam.leaving[:, 0])[:, None]
    beyond = section[None, :, 0] - beam.hits[:, :1]
    over = side * (section[None, :, 1] - beam.hits[:, 2:] - slope * beyond) / np.hypot(1.0, slope)
    return float(np.min(np.where(beyond > 0.0, over - beam.width[:, None], 1e3), initial=1e3))


def _apart(near: Plate, far: Plate) -> float:
    """Least distance between two plates in section, by points along their faces and backs."""
    shares = np.linspace(0.0, 1.0, 12)[:, None]
    lines = []
    for plate in (near, far):
        first, second, third, fourth = plate.section
        lines.append(np.concatenate([first + shares * (third - first), second + shares * (fourth - second)]))
    return float(np.min(np.hypot(*(lines[0][:, None] - lines[1][None]).transpose(2, 0, 1))))


def problems_of(asked: Asked, built: Planar) -> list[str]:
    """One sentence for everything that the tracer finds wrong with a planar sensor; none if it does what it should."""
    camera = built.camera
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    rim = camera.pupil_radius_mm * np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=-1)
    pupil = np.concatenate([np.zeros((1, 3)), rim])
    elevations = np.tan(np.linspace(*asked.volume.elevations, 9))
    azimuths = np.linspace(-built.half_azimuth, built.half_azimuth, 9)
    problems = []
    for name, view, plate, other in (
        ("lower", built.views[0], built.plates[0], built.plates[1]),
        ("upper", built.views[1], built.plates[1], built.plates[0]),
    ):
        points = np.concatenate(
            [
                view.points(np.full(9, distance), built.rig.middle_mm + elevations * distance, azimuth)
                for azimuth in azimuths
                for distance in asked.volume.distances
            ]
        )
        starts = np.repeat(pupil, len(points), axis=0)
        seen = np.tile(view.flat.seen(points), (len(pupil), 1))
        ahead = (seen - starts) / np.linalg.norm(seen - starts, axis=1)[:, None]
        beside = _other(built, view)
        own, elsewhere = (
            trace_sequential(each.instrument, (0,), ahead, starts, apertures=False) for each in (view, beside)
        )
        missed = np.logical_not(plate.holds(own.point))
        nearer = np.linalg.norm(elsewhere.point - starts, axis=1) < np.linalg.norm(own.point - starts, axis=1)
        blocked = nearer & other.holds(elsewhere.point)
        left = trace_first_hits(view.instrument, own.direction, own.point, starts_in_lens=False)
        again = trace_sequential(beside.instrument, (0,), own.direction, own.point, apertures=False)
        caught = np.isfinite(again.point[:, 0]) & other.holds(again.point)
        for what, lost in (
            ("miss its mirror", missed),
            ("meet the other mirror first", blocked),
            ("end at the camera", left.status != Status.ESCAPED),
            ("end at the other mirror", caught),
        ):
            if lost.any():
                problems.append(f"{name} view: {int(lost.sum())} of {lost.size} rays {what}")
    return problems


def _other(built: Planar, view: PlanarView) -> PlanarView:
    return built.views[1] if view is built.views[0] else built.views[0]
