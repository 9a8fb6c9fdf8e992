"""Through focus: how the largest blur of each view changes with the focus, and which distances stay sharp.

Lengths in mm, reciprocals in 1/mm; blurs are angles of elevation in the scene, in degrees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import VIEW_NAMES, Design, ViewName
from designer.evaluate.focus import (
    ELEVATIONS,
    SHARP_BLUR_DEG,
    ViewFocus,
    best_focus,
    depth_of_field,
    focus_of_design,
    refocused,
)
from designer.optics.focus import blur_in_scene, chief_ray, lens_of_camera, light_path_of_design

Array = NDArray[np.float64]

# A design at its limit reaches it within what the solver leaves.
_AT_THE_LIMIT = 1.001


@dataclass(frozen=True, slots=True)
class SharpRange:
    """Nearest and farthest distance from the axis (n,) that stay within the limit, at elevations (n,) in degrees.

    ``farthest_mm`` is infinite where infinity is sharp; both are NaN where nothing is.
    """

    elevations_deg: Array
    nearest_mm: Array
    farthest_mm: Array

    @property
    def common_mm(self) -> tuple[float, float] | None:
        """Nearest and farthest distance that are sharp at every elevation; None if there is none."""
        near, far = float(np.max(self.nearest_mm)), float(np.min(self.farthest_mm))
        return (near, far) if near <= far else None


def blur_limit_deg(design: Design) -> float:
    """The blur in the scene that the design's requirement allows; where it does not say, what is called sharp."""
    asked = design.sharpness.max_blur_deg if design.sharpness else None
    return asked or SHARP_BLUR_DEG


def largest_blur_through_focus(design: Design, reciprocal_focus: ArrayLike) -> Mapping[ViewName, Array]:
    """Largest blur (n,) of each view over its elevations and the working distances, refocused to 1/u (n,).

    The lens keeps its nominal focal length and its f-number. As an angle in the scene a blur is p (w - 1/z_V) over
    |dr/dphi| / f, and the principal distance f drops out.
    """
    reciprocal = np.asarray(reciprocal_focus, dtype=float)
    focus = focus_of_design(design)
    lens = focus.lens
    views: dict[ViewName, ViewFocus] = {"upper": focus.upper, "lower": focus.lower}
    found: dict[ViewName, Array] = {}
    for name, view in views.items():
        slope = np.tan(np.radians(view.elevations_deg))[:, None]
        path = light_path_of_design(design, name)
        largest = []
        for w in reciprocal.ravel():
            there = refocused(lens, float(w))
            blur = blur_in_scene(path, slope, there, there.blur(view.reciprocal_depths))
            largest.append(np.max(np.abs(np.degrees(blur))))
        found[name] = np.reshape(largest, reciprocal.shape)
    return found


def sharpest_focus(design: Design) -> tuple[float, float]:
    """The reciprocal focus 1/u that makes the largest blur in the scene least, over both views, and that blur.

    Nominal focal length and f-number are the lens's. The design's own focus may differ: it suits other goals too, or
    none if nothing limits the blur.
    """
    focus = focus_of_design(design)
    depths, weights = [], []
    for name, view in focus.by_name.items():
        slope = np.tan(np.radians(view.elevations_deg))[:, None]
        weight = blur_in_scene(light_path_of_design(design, name), slope, focus.lens, 1.0)
        depths.append(view.reciprocal_depths.ravel())
        weights.append(np.broadcast_to(weight, view.reciprocal_depths.shape).ravel())
    best = best_focus(np.concatenate(depths), np.concatenate(weights))
    return best, max(float(largest) for largest in largest_blur_through_focus(design, best).values())


def sharp_range(
    design: Design, view_name: ViewName, limit_deg: float | None = None, elevations: int = ELEVATIONS
) -> SharpRange:
    """Depth of field of a view as focused: the distances that blur by no more than the limit, at each elevation."""
    limit = blur_limit_deg(design) if limit_deg is None else limit_deg
    lens, path = lens_of_camera(design.camera), light_path_of_design(design, view_name)
    elevation = np.linspace(*design.views.by_name[view_name].elevation_deg, num=elevations)
    slope = np.tan(np.radians(elevation))
    # Blur in the scene is in proportion to that on the sensor.
    largest_mm = np.radians(limit * _AT_THE_LIMIT) / blur_in_scene(path, slope, lens, 1.0)
    return SharpRange(elevation, *depth_of_field(chief_ray(path, slope), lens, largest_mm))


def depth_of_field_of_design(design: Design, limit_deg: float | None = None) -> tuple[float, float] | None:
    """Nearest and farthest distance that both views show sharply at every elevation; None if there is none."""
    ranges = [sharp_range(design, name, limit_deg).common_mm for name in VIEW_NAMES]
    known = [ends for ends in ranges if ends is not None]
    if len(known) < len(ranges):
        return None
    near, far = max(near for near, _ in known), min(far for _, far in known)
    return (near, far) if near <= far else None
