"""The noise of matched image points, measured on a scene of its own, for the end-to-end check to predict from.

The calibration scene is a ring of flat walls of different tones around the sensor, at all working distances
(:func:`designer.imaging.render.scenes.library.calibration_world`). Its depth errors, divided by what one pixel of
noise in each view would cause to first order, are the noise. It depends on elevation, since the views resolve texture
more finely at one end of their range than at the other; on distance, since with it the two views look at a point in
other directions, more or less aslant; and on contrast, since noise in the pixels matters where there is little of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from designer.design import Design, PerView
from designer.evaluate.depth import depth_error_of_slopes, stereo_pair_of
from designer.imaging.images import Image
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.lens import RenderedLens, default_samples
from designer.imaging.render.raytracing import render_all
from designer.imaging.render.scenes.world import Array, World, first_surfaces
from designer.imaging.render.sensor import sensor_of
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, MatchingOptions, contrast_of
from designer.imaging.stereo.panorama import AZIMUTH_PADDING
from designer.imaging.stereo.rig import StereoRig, match_image, sample
from designer.trace.first_hit import Status, compare_with_path, trace_first_hits

# The standard deviation of a normal distribution is this times its median absolute deviation.
NORMAL_PER_MAD = 1.4826

BANDS = 4
STRIPS = 12
CONTRAST_CLASSES = 8
# Fewer pixels than this say nothing.
FEWEST_PIXELS = 500


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """The noise of an image point in each view, in raw pixels: that of a place in a panorama times that of contrast.

    ``table_px`` has shape (bands of distance, rows of the upper panorama), ``log_distances`` (bands,) the middle of
    each band as natural logarithm of mm; without bands nothing could be measured. Pixels of the ``contrasts`` (n,),
    as :func:`designer.imaging.stereo.matching.contrast_of` has them, have ``factors`` (n,) times that noise.
    """

    table_px: Array
    log_distances: Array
    contrasts: Array
    factors: Array

    def at(self, distance: Array, contrast: Array) -> Array:
        """The noise at true distances in mm and contrasts, both (columns, rows); NaN where it is not known."""
        if not len(self.log_distances):
            return np.full(distance.shape, np.nan)
        return _interpolated(self.table_px, self.log_distances, distance) * np.interp(
            contrast, self.contrasts, self.factors
        )

    @property
    def summary(self) -> dict[str, float]:
        """Its median, least and largest over elevations and distances; NaN if nothing could be measured."""
        shares = {"median": 0.5, "least": 0.0, "largest": 1.0}
        known = self.table_px.size > 0
        return {name: float(np.quantile(self.table_px, share)) if known else np.nan for name, share in shares.items()}


def distance_bands(design: Design) -> Array:
    """The limits in mm of the bands of distance, ``BANDS`` + 1 of them: equal ratios over the working volume."""
    near, far = design.working_volume.distance_mm
    return np.geomspace(near, far, BANDS + 1)


def calibrate_noise(rig: StereoRig, raw: Image, points: Array, options: MatchingOptions = ACCURATE_OPTIONS) -> Noise:
    """Measure the noise of a rig's matches in a raw image of the calibration scene.

    It is the robust standard deviation of the depth errors over what one pixel of noise would cause, in strips of
    elevation and distance; and of what is left, in classes of contrast. ``points`` (3, columns, rows) are what the
    upper panorama's pixels truly show.
    """
    matches = match_image(rig, raw, options)
    distance = np.hypot(points[0], points[1])
    normalised = (matches.distances_mm / distance - 1.0) / error_per_pixel(rig, distance)
    rows = rig.grid.rows
    strips = np.linspace(0, rows, STRIPS + 1).astype(int)
    table, middles = [], []
    for near, far in pairwise(distance_bands(rig.design)):
        chosen = np.isfinite(normalised) & (distance >= near) & (distance < far)
        measured = {
            (low + high - 1) / 2.0: robust_deviation(normalised[:, low:high][chosen[:, low:high]])
            for low, high in pairwise(strips)
            if chosen[:, low:high].sum() >= FEWEST_PIXELS
        }
        if measured:
            table.append(np.interp(np.arange(rows), list(measured), list(measured.values())))
            middles.append(np.log(near * far) / 2.0)
    if not table:
        return Noise(np.empty((0, rows)), np.empty(0), np.ones(1), np.ones(1))
    table_px, log_distances = np.array(table), np.array(middles)
    normalised /= _interpolated(table_px, log_distances, distance)
    known = np.isfinite(normalised)
    contrast, normalised = contrast_in(rig, raw, options)[known], normalised[known]
    limits = np.quantile(contrast, np.linspace(0.0, 1.0, CONTRAST_CLASSES + 1))
    classes = [(contrast >= low) & (contrast <= high) for low, high in pairwise(limits)]
    contrasts = np.array([np.median(contrast[chosen]) for chosen in classes])
    factors = np.array([robust_deviation(normalised[chosen]) for chosen in classes])
    return Noise(table_px, log_distances, contrasts, factors)


def contrast_in(rig: StereoRig, raw: Image, options: MatchingOptions) -> Array:
    """Contrast along the scan lines of the upper panorama, (columns, rows), in grey levels, of a grey raw image."""
    return contrast_of(sample(rig, raw)["upper"], options.window).astype(float)


def record(
    design: Design,
    worlds: Sequence[World],
    detector: Detector,
    samples: int | None,
    seeds: Sequence[int],
    lens: RenderedLens | None,
) -> list[Image]:
    """The raw images (h, w) in 8 bits that a system records of worlds, each with its seed of the detector's noise.

    Through a lens or, without one, a pinhole; without ``samples`` with as many rays as are enough.
    """
    samples = default_samples(lens) if samples is None else samples
    rendered = render_all(design, worlds, samples=samples, aperture=lens is not None, seed=seeds[-1], lens=lens)
    return [
        np.asarray(expose(image, detector, seed=seed), dtype=np.uint8)
        for image, seed in zip(rendered, seeds, strict=True)
    ]


def true_points(rig: StereoRig, built: Design, worlds: Sequence[World]) -> list[Array]:
    """What the upper panorama's pixels show, (3, columns, rows), in each world; NaN where seen another way.

    Traced from the pixels' places in the raw image, once for all worlds.
    """
    table = rig.tables["upper"]
    inner = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    u, v = table.u_px[inner].astype(float), table.v_px[inner].astype(float)
    sensor = sensor_of(built)
    trace = trace_first_hits(sensor.instrument, sensor.directions(u.ravel(), v.ravel(), None, None))
    path = sensor.instrument.path(built.views.upper.path)
    seen = compare_with_path(trace, path).status == Status.OK
    left = sensor.leaving(trace.exit_point[seen], trace.exit_direction[seen])
    seen[seen] = left.is_free
    start, ahead = left.point[left.is_free].T, left.direction[left.is_free].T
    found = []
    for world in worlds:
        points = np.full((3, u.size), np.nan)
        points[:, seen] = first_surfaces(world, start, ahead).points
        found.append(points.reshape(3, *u.shape))
    return found


def error_per_pixel(rig: StereoRig, distance: Array) -> Array:
    """sigma_D / D (columns, rows) of one pixel of noise in each view, at true distances."""
    pair, grid = stereo_pair_of(rig.design), rig.grid
    slope_upper = np.asarray(grid.slope("upper", np.arange(grid.rows)))[None, :]
    slopes = PerView(lower=slope_upper + pair.baseline / distance, upper=slope_upper)
    return np.asarray(depth_error_of_slopes(pair, slopes, rig.design.camera.pixel_pitch_mm))


def robust_deviation(values: Array) -> float:
    """``NORMAL_PER_MAD`` times the median absolute deviation from the median; NaN of nothing."""
    if not values.size:
        return np.nan
    return float(NORMAL_PER_MAD * np.median(np.abs(values - np.median(values))))


def _interpolated(table: Array, log_distances: Array, distance: Array) -> Array:
    """A table's values, (columns, rows), at distances (columns, rows) in mm; constant beyond its first and last."""
    count = len(log_distances)
    place = np.interp(np.log(distance), log_distances, np.arange(count))
    lower = np.clip(np.where(np.isfinite(place), place, 0.0).astype(int), 0, max(count - 2, 0))
    share, rows = place - lower, np.arange(distance.shape[1])
    return np.asarray((1.0 - share) * table[lower, rows] + share * table[np.minimum(lower + 1, count - 1), rows])
