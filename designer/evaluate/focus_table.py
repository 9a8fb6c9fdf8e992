"""The focus of a finished design as a table of plain numbers, for the terminal and for JSON."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from designer.design import Design, ViewName
from designer.evaluate.focus import (
    SHARP_BLUR_DEG,
    DesignFocus,
    ViewFocus,
    depth_of_field,
    focus_of_design,
    focus_score,
)
from designer.optics.focus import blur_in_scene, chief_ray, light_path_of_design


class ElevationFocus(TypedDict):
    """The focus at one elevation; blur at the nearest and the farthest distance of the working volume.

    ``blur_px`` and ``blur_deg`` are diameters on the sensor and in the scene. Between ``sharp_from_mm`` and
    ``sharp_to_mm`` from the axis the blur is at most ``sharp_blur_deg``; the second is None where infinity is
    sharp, both where nothing is.
    """

    view: ViewName
    elevation_deg: float
    blur_px: list[float]
    blur_deg: list[float]
    sharp_from_mm: float | None
    sharp_to_mm: float | None


class FocusTable(TypedDict):
    """How sharp a design is through its own lens, in the middle of its chief rays; distances are None at infinity."""

    f_number: float
    focus_distance_mm: float | None
    best_focus_distance_mm: float | None
    largest_blur_px: float
    largest_blur_deg: float
    largest_blur_at_best_focus_px: float
    sharp_blur_deg: float
    distances_mm: list[float]
    elevations: list[ElevationFocus]


def focus_table(design: Design) -> FocusTable | None:
    """Focus and blur at the ends of both views, in plain numbers; None where :func:`focus_score` is."""
    score = focus_score(design)
    if score is None:
        return None
    focus = focus_of_design(design)
    return {
        "f_number": score.f_number,
        "focus_distance_mm": score.focus_distance_mm,
        "best_focus_distance_mm": score.best_focus_distance_mm,
        "largest_blur_px": score.largest_blur_px,
        "largest_blur_deg": score.largest_blur_deg,
        "largest_blur_at_best_focus_px": score.largest_blur_at_best_focus_px,
        "sharp_blur_deg": SHARP_BLUR_DEG,
        "distances_mm": list(design.working_volume.distance_mm),
        "elevations": [
            _at_elevation(design, focus, name, view, place) for name, view in focus.by_name.items() for place in (0, -1)
        ],
    }


def _at_elevation(design: Design, focus: DesignFocus, name: ViewName, view: ViewFocus, place: int) -> ElevationFocus:
    path = light_path_of_design(design, name)
    slope = np.tan(np.radians(view.elevations_deg[place]))
    # Blur in the scene is in proportion to that on the sensor.
    sharp_mm = float(np.radians(SHARP_BLUR_DEG) / blur_in_scene(path, slope, focus.lens, 1.0))
    near, far = (float(end) for end in depth_of_field(chief_ray(path, slope), focus.lens, sharp_mm))
    return {
        "view": name,
        "elevation_deg": float(view.elevations_deg[place]),
        "blur_px": [float(blur) for blur in np.abs(view.blur_px[place])],
        "blur_deg": [float(blur) for blur in np.abs(view.blur_deg[place])],
        "sharp_from_mm": near if np.isfinite(near) else None,
        "sharp_to_mm": far if np.isfinite(far) else None,
    }
