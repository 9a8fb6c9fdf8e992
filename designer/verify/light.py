"""What the full pupil sees: which share of a scene point's light arrives, how sharp, and where the two views mix.

A chief ray may pass where half of the light of its point does not: a bundle fills the pupil, is aimed at the point as
if nothing were in the way, and is then followed to the first surface that each ray meets. Backwards from the image, the
rays that the lens gathers in one image point are followed in the same way: some may come through the other view.

Frame: pinhole (centre of the entrance pupil) at the origin, optical axis +z, millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, ViewName
from designer.trace.aiming import pinhole_angles, widest_pinhole_angle
from designer.trace.arrays import Array
from designer.trace.first_hit import PathReport, Status, compare_with_path, trace_first_hits
from designer.trace.image_law import image_radius, is_perspective, stretches
from designer.trace.instrument import Instrument, build_instrument
from designer.trace.pencils import DISC_RMS_PER_DIAMETER, Bundles, pupil_places, trace_bundles

# 216 rays through the pupil: one of them is half a percent of the light.
RINGS = 6
# Rays this far apart in elevation measure how finely a view resolves.
STEP_DEG = 1e-3
# Rings across an image zone, narrower towards its ends, where the views mix.
ZONE_CELLS = 16


@dataclass(frozen=True, slots=True)
class ViewLight:
    """The light of one view through the full pupil, at elevations (n) and distances from the axis (k).

    ``arrives`` (n, k) is the share of the light of a scene point that meets the mirrors of the path, each first, and
    leaves; ``stopped_by`` (n, k) what stands in the way of most of the rest, or the mirror that it misses ("" if all
    arrives). ``blur_px`` (n, k) is the diameter
    of the evenly lit disc with the root-mean-square radius of the traced spot; NaN if a ray finds no way.
    ``elevations_deg`` begin with the lowest and end with the highest that the view must see.

    ``mixed_at_ends`` are the shares of the light at the image points of the lowest and of the highest elevation that
    belong to the other view, among all that comes through either; ``mixed_in_zone`` the same over the whole zone
    between them. NaN if no light of either view comes there. ``pixels_per_degree`` (n,) is what a degree of elevation
    measures along the radius, by traced rays. Where the lens is not perspective it makes an ellipse of the disc, whose
    larger diameter is meant; it is ``elongation`` (n,) times that along the radius.
    """

    elevations_deg: tuple[float, ...]
    distances_mm: tuple[float, ...]
    arrives: Array
    stopped_by: NDArray[np.str_]
    blur_px: Array
    mixed_at_ends: tuple[float, float]
    mixed_in_zone: float
    pixels_per_degree: Array
    elongation: Array | float = 1.0

    @property
    def blur_deg(self) -> Array:
        """Blurs as angles of elevation in the scene, (n, k)."""
        return np.asarray(self.blur_px / (self.pixels_per_degree * self.elongation)[:, None])

    @property
    def least_arriving(self) -> float:
        """The smallest share that arrives from either end of the elevations, at any distance."""
        return float(np.min(self.arrives[[0, -1]]))

    @property
    def largest_blur_px(self) -> float:
        """The largest blur at any elevation and distance; NaN if one is unknown."""
        return float(np.max(self.blur_px))


def view_light(design: Design, *, rings: int = RINGS) -> dict[ViewName, ViewLight]:
    """Trace the full pupil's light of both views, by name: at both ends and the middle of the elevations, near and far.

    The elevations are those recorded for each view, the distances those of the working volume, every elevation at
    either distance: a little more than the volume holds. Nothing is said of image radii beyond the sensor.
    """
    instrument = build_instrument(design)
    views = design.views.by_name
    paths = {name: instrument.path(view.path) for name, view in views.items()}
    bundles = {
        name: trace_bundles(
            design, name, (view.elevation_deg[0], sum(view.elevation_deg) / 2.0, view.elevation_deg[1]),
            design.working_volume.distance_mm, rings=rings,
        )
        for name, view in views.items()
    }  # fmt: skip
    others: dict[ViewName, ViewName] = {"upper": "lower", "lower": "upper"}
    return {
        name: _view_light(design, instrument, name, bundles[name], paths[name], paths[other], rings)
        for name, other in others.items()
    }


def arriving_share(instrument: Instrument, path: tuple[int, ...], bundles: Bundles) -> tuple[Array, NDArray[np.str_]]:
    """Shares (n, k) of bundles that meet exactly the path's mirrors, and the names (n, k) of what stops most others."""
    half = len(bundles.places_mm) // 2
    shape = (*bundles.slopes.shape[:2], half)
    starts = _starts(bundles.places_mm[:half], shape)
    report = _follow(instrument, path, bundles.directions[:, :, :half].reshape(-1, 3), starts)
    status, element = report.status.reshape(shape), report.element.reshape(shape)
    passed = status == Status.OK
    names = np.array(
        [[_most_common(instrument, element[i, j][~passed[i, j]]) for j in range(shape[1])] for i in range(shape[0])]
    )
    return passed.mean(axis=-1), names


def other_view_share(
    instrument: Instrument,
    path: tuple[int, ...],
    other_path: tuple[int, ...],
    image_slopes: Array,
    places: Array,
    reciprocal_focus: float,
) -> tuple[Array, Array]:
    """Shares (n,) of the pupil through which an image point sees its own view, and the other one.

    ``image_slopes`` (n,) are tan(psi) of the image points, which the lens, focused at 1/u, fills from all ``places``
    (p, 3) of the pupil: the slope there is tan(psi) - place / u. The places are those of
    :func:`designer.trace.pencils.pupil_places`.
    """
    places = places[: len(places) // 2]
    slopes = np.stack([image_slopes, np.zeros_like(image_slopes)], axis=-1)[:, None] - places[:, :2] * reciprocal_focus
    ahead = np.concatenate([slopes, np.ones((*slopes.shape[:2], 1))], axis=-1)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    shape = slopes.shape[:2]
    trace = trace_first_hits(instrument, ahead.reshape(-1, 3), _starts(places, shape))
    own, other = (
        (compare_with_path(trace, mirrors).status.reshape(shape) == Status.OK).mean(axis=-1)
        for mirrors in (path, other_path)
    )
    return own, other


def _view_light(
    design: Design,
    instrument: Instrument,
    name: ViewName,
    bundles: Bundles,
    path: tuple[int, ...],
    other_path: tuple[int, ...],
    rings: int,
) -> ViewLight:
    camera, view = design.camera, design.views.by_name[name]
    reciprocal_focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    arrives, stopped_by = arriving_share(instrument, path, bundles)
    rms = bundles.rms_radius_mm(camera.focal_length_mm, reciprocal_focus)
    low, high = view.elevation_deg
    along, across = stretches(camera, bundles.psi)
    longer = np.maximum(along, across)
    at_ends, in_zone = _mixing(design, instrument, path, other_path, bundles.psi[[0, -1]], rings)
    return ViewLight(
        elevations_deg=(low, (low + high) / 2.0, high),
        distances_mm=design.working_volume.distance_mm,
        arrives=arrives,
        stopped_by=stopped_by,
        blur_px=rms / DISC_RMS_PER_DIAMETER / camera.pixel_pitch_mm * longer[:, None],
        mixed_at_ends=at_ends,
        mixed_in_zone=in_zone,
        pixels_per_degree=_pixels_per_degree(design, instrument, path, np.array([low, (low + high) / 2.0, high])),
        elongation=longer / along,
    )


def _pixels_per_degree(design: Design, instrument: Instrument, path: tuple[int, ...], elevations_deg: Array) -> Array:
    """Pixels along the radius per degree of elevation, (n,), from rays that leave on either side of each elevation."""
    camera = design.camera
    beside = np.radians(elevations_deg[:, None] + STEP_DEG * np.array([-0.5, 0.5]))
    psi = pinhole_angles(instrument, path, beside.ravel(), widest_pinhole_angle(design)).reshape(beside.shape)
    if is_perspective(camera):
        radius_px = camera.focal_length_mm / camera.pixel_pitch_mm * np.tan(psi)
    else:
        radius_px = image_radius(camera, psi) / camera.pixel_pitch_mm
    return np.asarray(np.abs(radius_px[:, 1] - radius_px[:, 0]) / STEP_DEG)


def _mixing(
    design: Design,
    instrument: Instrument,
    path: tuple[int, ...],
    other_path: tuple[int, ...],
    ends: Array,
    rings: int,
) -> tuple[tuple[float, float], float]:
    """The other view's share at the image points of both ends (pinhole angles), and over the zone between them."""
    if not np.isfinite(ends).all():
        return (np.nan, np.nan), np.nan
    camera = design.camera
    reciprocal_focus = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    places = pupil_places(camera.pupil_radius_mm, rings)

    def shares(image_slopes: Array) -> tuple[Array, Array]:
        return other_view_share(instrument, path, other_path, image_slopes, places, reciprocal_focus)

    low, high = np.tan(ends)
    with np.errstate(invalid="ignore"):
        own, other = shares(np.array([low, high]))
        at_ends = other / (own + other)
        if not other.any():
            # The zones of the chief rays are disjoint: farther from the other zone there is no more of it.
            return (float(at_ends[0]), float(at_ends[1])), float(at_ends.max())
        borders = low + (high - low) * (1.0 - np.cos(np.linspace(0.0, np.pi, ZONE_CELLS + 1))) / 2.0
        own, other = shares((borders[1:] + borders[:-1]) / 2.0)
        # Image points weigh by the area of the ring that they stand for.
        radii = borders if is_perspective(camera) else image_radius(camera, np.arctan(borders))
        area = np.abs(np.diff(radii**2))
        in_zone = np.sum(area * other) / np.sum(area * (own + other))
    return (float(at_ends[0]), float(at_ends[1])), float(in_zone)


def _follow(instrument: Instrument, path: tuple[int, ...], directions: Array, starts: Array) -> PathReport:
    """First-hit rays against a path; one without a direction has missed the first mirror."""
    known = np.isfinite(directions).all(axis=1)
    if known.all():
        return compare_with_path(trace_first_hits(instrument, directions, starts), path)
    status = np.full(len(directions), Status.MISSED, dtype=np.int8)
    leg, element = np.zeros(len(directions), dtype=np.intp), np.full(len(directions), path[0], dtype=np.intp)
    if known.any():
        found = compare_with_path(trace_first_hits(instrument, directions[known], starts[known]), path)
        status[known], leg[known], element[known] = found.status, found.leg, found.element
    return PathReport(status, leg, element)


def _starts(places: Array, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(places, (*shape, 3)).reshape(-1, 3)


def _most_common(instrument: Instrument, elements: NDArray[np.intp]) -> str:
    """The name of the element that stops, or is missed by, most of some rays; empty if there are none."""
    return instrument.elements[int(np.bincount(elements).argmax())] if elements.size else ""
