"""Whether built sensors are as sharp as their design must be, at the places where the judge measures blur.

Those are the lowest, the middle and the highest elevation of each view, near and far; here all around the axis. The
limits are those of the judge (:mod:`designer.verify.light_verdict`), what it allows for aberrations included, in pixels
on the sensor of the design: what a degree of elevation measures there changes little with small departures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.image import elongation, radius_and_slope
from designer.as_built.projection import Linear, Targets, linearise, project, targets_of
from designer.design import VIEW_NAMES, Design, Sharpness, ViewName
from designer.verify.light_verdict import BLUR_TOLERANCE, BLUR_TOLERANCE_PX

# As many as the grid of the working volume has.
AZIMUTHS = 6


@dataclass(frozen=True, slots=True, eq=False)
class SharpPoints:
    """Points of one view whose blur is judged, how their images change, and the largest blur (n,) allowed in px."""

    targets: Targets
    linear: Linear
    limit_px: Array


def is_judged(sharpness: Sharpness | None) -> bool:
    """Whether anything bounds the blur."""
    return sharpness is not None and (sharpness.max_blur_px is not None or sharpness.max_blur_deg is not None)


def sharp_points(design: Design) -> dict[ViewName, SharpPoints] | None:
    """The points of both views whose blur is judged; None if nothing bounds it.

    Raises
    ------
    ValueError
        A view does not show them all.
    """
    asked = design.sharpness
    if asked is None or not is_judged(asked):
        return None
    found: dict[ViewName, SharpPoints] = {}
    for name, record in design.views.by_name.items():
        low, high = record.elevation_deg
        elevation, distance, azimuth = (
            part.ravel()
            for part in np.meshgrid(
                np.radians([low, (low + high) / 2.0, high]),
                np.array(design.working_volume.distance_mm),
                2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS,
                indexing="ij",
            )
        )
        slope = np.tan(elevation)
        height = record.viewpoint_mm + distance * slope
        targets = targets_of(
            design, name, np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height], -1)
        )
        linear = linearise(design, name, targets)
        limit = np.full(len(slope), np.inf)
        if asked.max_blur_px is not None:
            limit = np.minimum(limit, asked.max_blur_px * (1.0 + BLUR_TOLERANCE) + BLUR_TOLERANCE_PX)
        if asked.max_blur_deg is not None:
            _, per_slope = radius_and_slope(design.camera, record, slope)
            per_degree = np.radians(np.abs(per_slope) * (1.0 + slope**2)) / design.camera.pixel_pitch_mm
            largest = asked.max_blur_deg * (1.0 + BLUR_TOLERANCE) * per_degree + BLUR_TOLERANCE_PX
            limit = np.minimum(limit, largest * elongation(design.camera, targets.slopes))
        found[name] = SharpPoints(targets, linear, limit)
    return found


def blur_of_limit(design: Design, points: dict[ViewName, SharpPoints] | None, values: Array) -> Array:
    """Largest ratio (T,) of blur to the largest allowed, of systems of departures (T, parameters).

    A sensor is sharp if it is at most 1. NaN where a view does not show all points; zero if nothing bounds the blur.
    """
    if points is None:
        return np.zeros(len(values))
    ratios = [
        np.max(
            np.abs(project(design, view, points[view].targets, values, points[view].linear).blur_px)
            / points[view].limit_px,
            axis=1,
        )
        for view in VIEW_NAMES
    ]
    return np.asarray(np.maximum(*ratios), dtype=float)


def describe_limit(sharpness: Sharpness) -> str:
    """The limits in words."""
    asked = [
        f"{most:g} {unit}"
        for most, unit in ((sharpness.max_blur_px, "px"), (sharpness.max_blur_deg, "deg"))
        if most is not None
    ]
    return " and ".join(asked)
