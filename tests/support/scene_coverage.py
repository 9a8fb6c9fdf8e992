"""What of a working volume a scene fills: the share of its directions in each band of distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.imaging.render.scenes.layout import BANDS
from designer.imaging.render.scenes.world import Array, World, first_surfaces

ELEVATIONS, AZIMUTHS = 64, 720
# Two places on one line of sight are the same if their distances differ by no more than this, relative.
SAME_POINT = 2e-3


@dataclass(frozen=True, slots=True, eq=False)
class BandCoverage:
    """Where the first surfaces seen from the middle of the baseline lie.

    ``limits_mm`` (bands + 1,) are those of the bands. ``shares`` (bands,) is the share of the volume's directions
    whose first surface lies in each; ``seen_by_both`` (bands,) of those that neither viewpoint finds hidden.
    ``by_elevation`` (bands, elevations) is that second share for each of the ``elevations_deg`` (elevations,), the
    middles of equal steps of tan(elevation).
    """

    limits_mm: Array
    shares: Array
    seen_by_both: Array
    elevations_deg: Array
    by_elevation: Array


def band_coverage(
    world: World, design: Design, elevations: int = ELEVATIONS, azimuths: int = AZIMUTHS, bands: int = BANDS
) -> BandCoverage:
    """The share of the directions of a design's working volume whose first surface lies in each band of distance.

    Directions are even in azimuth and in tan(elevation), as the panoramas' pixels nearly are.
    """
    near, far = design.working_volume.distance_mm
    low, high = np.tan(np.radians(design.working_volume.elevation_deg))
    slopes = low + (high - low) * (np.arange(elevations) + 0.5) / elevations
    angles = 2.0 * np.pi * (np.arange(azimuths) + 0.5) / azimuths
    slope, angle = (grid.ravel() for grid in np.meshgrid(slopes, angles, indexing="ij"))
    directions = np.stack([np.cos(angle), np.sin(angle), slope]) / np.hypot(1.0, slope)
    middle = np.array([[0.0], [0.0], [design.views.middle_mm]])
    hits = first_surfaces(world, np.broadcast_to(middle, directions.shape), directions)
    distance = np.where(hits.surface >= 0, np.hypot(hits.points[0], hits.points[1]), np.inf)
    both = np.ones(distance.shape, dtype=bool)
    for view in (design.views.lower, design.views.upper):
        both &= _is_seen(world, view.viewpoint_mm, hits.points)
    limits = np.geomspace(near, far, bands + 1)
    # Rounding must not lose a wall that stands at the very end of the volume.
    limits_of_search = limits * np.array([1.0 - 1e-9, *np.ones(bands - 1), 1.0 + 1e-9])
    band = np.searchsorted(limits_of_search, distance, side="right") - 1
    in_band: NDArray[np.bool_] = (band[None, :] == np.arange(bands)[:, None]).reshape(bands, elevations, azimuths)
    seen = in_band & both.reshape(elevations, azimuths)
    return BandCoverage(
        limits, in_band.mean(axis=(1, 2)), seen.mean(axis=(1, 2)), np.degrees(np.arctan(slopes)), seen.mean(axis=2)
    )


def _is_seen(world: World, viewpoint_mm: float, points: Array) -> NDArray[np.bool_]:
    """Whether nothing stands between a viewpoint on the axis and points (3, n); NaN points are not seen."""
    start = np.array([[0.0], [0.0], [viewpoint_mm]])
    known = np.isfinite(points[0])
    towards = points[:, known] - start
    length = np.linalg.norm(towards, axis=0)
    reached = first_surfaces(world, np.broadcast_to(start, towards.shape), towards / length).distance
    seen = np.zeros(points.shape[1], dtype=bool)
    seen[known] = reached > length * (1.0 - SAME_POINT)
    return seen
