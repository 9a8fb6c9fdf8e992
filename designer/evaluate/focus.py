"""How sharp a finished design is through its own lens: best focus, blur and depth of field, to first order.

Lengths in mm, reciprocals in 1/mm; angles in degrees where a name says so, else radians. Nothing here is traced:
``designer.verify.light`` measures the same with rays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design, ViewName
from designer.optics.focus import (
    ChiefRay,
    FocusedLens,
    blur_in_scene,
    chief_ray,
    image_conjugates,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from designer.optics.view import half_angle_tangent

Array = NDArray[np.float64]

ELEVATIONS = 33
SHARP_BLUR_DEG = 0.5
"""Up to this blur in the scene a design is called sharp: for the paper's requirement nine tenths of a pinhole's points
are left (``designer check``)."""


@dataclass(frozen=True, slots=True)
class ViewFocus:
    """One view's focus at elevations (n,) in degrees and distances (k,) in mm from the axis.

    ``reciprocal_depths`` (n, k) are 1 / z_V in 1/mm of the virtual images. ``blur_px`` and ``blur_deg`` (n, k) are
    diameters of the blur on the sensor (the larger one of an ellipse), and in the scene as an angle of elevation, both
    signed: negative for an image nearer than the focus.
    """

    elevations_deg: Array
    distances_mm: Array
    reciprocal_depths: Array
    blur_px: Array
    blur_deg: Array

    @property
    def largest_blur_px(self) -> float:
        """Largest diameter of the blur on the sensor."""
        return float(np.max(np.abs(self.blur_px)))

    @property
    def largest_blur_deg(self) -> float:
        """Largest blur in the scene."""
        return float(np.max(np.abs(self.blur_deg)))


@dataclass(frozen=True, slots=True)
class DesignFocus:
    """Focus of a design as recorded, and the reciprocal focus that would blur least, with the largest blur it leaves.

    At ``best_reciprocal_focus`` the lens keeps its f-number and its nominal focal length.
    """

    lens: FocusedLens
    upper: ViewFocus
    lower: ViewFocus
    best_reciprocal_focus: float
    best_largest_blur_px: float

    @property
    def by_name(self) -> dict[ViewName, ViewFocus]:
        """Both views by name, the upper one first."""
        return {"upper": self.upper, "lower": self.lower}

    @property
    def largest_blur_px(self) -> float:
        """Largest blur of both views on the sensor, at the recorded focus."""
        return max(self.upper.largest_blur_px, self.lower.largest_blur_px)

    @property
    def largest_blur_deg(self) -> float:
        """Largest blur of both views in the scene, at the recorded focus."""
        return max(self.upper.largest_blur_deg, self.lower.largest_blur_deg)


@dataclass(frozen=True, slots=True)
class FocusScore:
    """Focus and blur of a design as its score holds them; distances from the pinhole, None for infinity.

    Blurs are the largest diameters of either view over its elevations and the distances of the working volume, on the
    sensor and as an angle in the scene.
    """

    focus_distance_mm: float | None
    f_number: float
    largest_blur_px: float
    largest_blur_deg: float
    largest_blur_px_of_views: Mapping[ViewName, float]
    largest_blur_deg_of_views: Mapping[ViewName, float]
    best_focus_distance_mm: float | None
    largest_blur_at_best_focus_px: float


def focus_score(design: Design) -> FocusScore | None:
    """Focus and largest blurs of a design, to first order; None if its numbers yield none.

    That is a view of three or more mirrors, whose foci no record holds, or a design that is absurd.
    """
    try:
        with np.errstate(all="ignore"):
            focus = focus_of_design(design)
            best = focus.best_reciprocal_focus
            views: dict[ViewName, ViewFocus] = {"upper": focus.upper, "lower": focus.lower}
            score = FocusScore(
                focus_distance_mm=design.camera.focus_distance_mm,
                f_number=design.camera.f_number,
                largest_blur_px=focus.largest_blur_px,
                largest_blur_deg=focus.largest_blur_deg,
                largest_blur_px_of_views={name: view.largest_blur_px for name, view in views.items()},
                largest_blur_deg_of_views={name: view.largest_blur_deg for name, view in views.items()},
                best_focus_distance_mm=1.0 / best if best > 0.0 else None,
                largest_blur_at_best_focus_px=focus.best_largest_blur_px,
            )
    except (ValueError, ArithmeticError):
        return None
    numbers = (score.largest_blur_px, score.largest_blur_deg, score.largest_blur_at_best_focus_px)
    return score if all(map(math.isfinite, numbers)) else None


def focus_of_design(design: Design, elevations: int = ELEVATIONS) -> DesignFocus:
    """Focus of both views over their recorded elevations, at the nearest and the farthest distance of the volume.

    In between, 1 / z_V rises or falls steadily with 1 / distance: the two ends decide.
    """
    lens = lens_of_camera(design.camera)
    upper, lower = _view_focus(design, "upper", lens, elevations), _view_focus(design, "lower", lens, elevations)
    depths = np.concatenate([upper.reciprocal_depths.ravel(), lower.reciprocal_depths.ravel()])
    stretches = np.concatenate([_stretch(design, name, lens, elevations) for name in ("upper", "lower")])
    best = best_focus(depths, stretches)
    sharpest = refocused(lens, best)
    largest = float(np.max(np.abs(sharpest.blur(depths)) * stretches)) / design.camera.pixel_pitch_mm
    return DesignFocus(lens, upper=upper, lower=lower, best_reciprocal_focus=best, best_largest_blur_px=largest)


def best_focus(reciprocal_depths: ArrayLike, weights: ArrayLike = 1.0) -> float:
    """The reciprocal focus w = 1/u in 1/mm, not below zero, that makes the largest weight |w - 1/z_V| least.

    Equal weights bound the blur on the sensor: w is the middle of the range. Weights of 1 / |dr/dphi| bound it in the
    scene. (With the nominal focal length kept, f grows a little with w, and the image with it: relative to the image
    the answer is exact.)
    """
    depths, weight = (np.ravel(part) for part in np.broadcast_arrays(np.asarray(reciprocal_depths, float), weights))
    # Two of the lines weight (w - 1/z), one falling and one rising, cross highest where the largest is least.
    total = weight[:, None] + weight[None, :]
    crossing = weight[:, None] * weight[None, :] * np.abs(depths[:, None] - depths[None, :]) / total
    first, second = np.unravel_index(int(np.argmax(crossing)), crossing.shape)
    best = (weight[first] * depths[first] + weight[second] * depths[second]) / total[first, second]
    return max(float(best), 0.0)


def refocused(lens: FocusedLens, reciprocal_focus: float) -> FocusedLens:
    """The same glass focused elsewhere: nominal focal length and f-number kept, principal distance f0 / (1 - f0 w)."""
    nominal = lens.principal_distance / (1.0 + lens.principal_distance * lens.reciprocal_focus)
    return FocusedLens(nominal / (1.0 - nominal * reciprocal_focus), lens.f_number, reciprocal_focus, lens.law)


def depth_of_field(ray: ChiefRay, lens: FocusedLens, largest_blur_mm: ArrayLike) -> tuple[Array, Array]:
    """Nearest and farthest distance from the axis in mm along chief rays that blur no more than that, perspectively.

    The farthest is infinite where infinity is sharp enough; both are NaN where nothing in front of the mirror is.
    """
    a, b, c, d = (np.asarray(term, dtype=float) for term in image_conjugates(ray))
    half = np.asarray(largest_blur_mm, dtype=float) / (lens.pupil_diameter * lens.principal_distance)
    ends = [lens.reciprocal_focus - half, lens.reciprocal_focus + half]
    with np.errstate(all="ignore"):
        # 1 / z_V = (c + d y) / (a + b y), solved for y = 1 / L.
        first, second = ((a * end - c) / (d - b * end) for end in ends)
        nearest = np.where(ray.viewpoint_distance > 0.0, 1.0 / np.asarray(ray.viewpoint_distance), np.inf)
        low, high = np.minimum(first, second), np.maximum(first, second)
        # Sharp between the two, or outside of them if the pole of 1 / z_V lies between: the middle decides.
        middle = (low + high) / 2.0
        between = np.abs((c + d * middle) / (a + b * middle) - lens.reciprocal_focus) <= half
        beyond = ~between & (low >= 0.0)
        low, high = (
            np.where(between, low, np.where(beyond, 0.0, high)),
            np.where(between, high, np.where(beyond, low, np.inf)),
        )
        low, high = np.maximum(low, 0.0), np.minimum(high, nearest)
        secant = np.sqrt(1.0 + np.asarray(ray.slope) ** 2)
        is_sharp = high >= low
        near, far = np.where(is_sharp, 1.0 / high, np.nan) / secant, np.where(is_sharp, 1.0 / low, np.nan) / secant
    return np.asarray(near), np.asarray(far)


def _view_focus(design: Design, name: ViewName, lens: FocusedLens, count: int) -> ViewFocus:
    path = light_path_of_design(design, name)
    low, high = design.views.by_name[name].elevation_deg
    elevations = np.linspace(low, high, count)
    distances = np.array(design.working_volume.distance_mm)
    slope = np.tan(np.radians(elevations))[:, None]
    ray = chief_ray(path, slope)
    depths = reciprocal_image_depth(ray, reciprocal_along_ray(slope, distances))
    blur = lens.blur(depths)
    in_scene = np.degrees(blur_in_scene(path, slope, lens, blur))
    on_sensor = blur * lens.law.largest_stretch(ray.half_tangent) / design.camera.pixel_pitch_mm
    return ViewFocus(elevations, distances, depths, on_sensor, in_scene)


def _stretch(design: Design, name: ViewName, lens: FocusedLens, count: int) -> Array:
    """What the law of the lens stretches the blur of a view by, (2 count,): for each elevation, near and far."""
    view = design.views.by_name[name]
    low, high = view.elevation_deg
    slope = np.tan(np.radians(np.linspace(low, high, count)))
    stretch = lens.law.largest_stretch(view.gain * half_angle_tangent(slope, view.sense))
    return np.repeat(np.broadcast_to(stretch, slope.shape), 2)
