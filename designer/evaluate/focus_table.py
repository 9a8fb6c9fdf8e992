"""The focus of a finished design as a table: for the terminal in lines, for JSON in plain numbers."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from designer.design import Design
from designer.evaluate.focus import DesignFocus, ViewFocus, depth_of_field, focus_of_design
from designer.optics.focus import blur_in_scene, chief_ray, light_path_of_design

# Blur in the scene that leaves a matcher most of its points. Of those that a pinhole keeps of the pipe scene, a lens
# that blurs up to so much keeps 86 %, one that blurs up to 0.4 degrees 92 % (``designer check --lens``).
TOLERABLE_BLUR_DEG = 0.75


class ElevationFocus(TypedDict):
    """The focus at one elevation; blur at the nearest and the farthest distance of the working volume.

    ``blur_px`` and ``blur_deg`` are diameters on the sensor and in the scene. Between ``sharp_from_mm`` and
    ``sharp_to_mm`` from the axis the blur is at most ``tolerable_blur_deg``; the second is None where infinity is
    sharp, both where nothing is.
    """

    view: str
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
    tolerable_blur_deg: float
    distances_mm: list[float]
    elevations: list[ElevationFocus]


def focus_table(design: Design) -> FocusTable | None:
    """Focus and blur at the ends of both views, in plain numbers; None if the numbers of the design yield none.

    That is a view of three or more mirrors, whose foci no record holds, or a design that is absurd.
    """
    try:
        with np.errstate(all="ignore"):
            table = _table(design, focus_of_design(design))
    except (ValueError, ArithmeticError):
        return None
    numbers = [table["largest_blur_px"], table["largest_blur_deg"], table["largest_blur_at_best_focus_px"]]
    return table if np.isfinite(numbers).all() else None


def describe_focus(table: FocusTable) -> list[str]:
    """The table in lines."""
    near, far = (f"{distance:g} mm" for distance in table["distances_mm"])
    here, best = (
        "infinity" if distance is None else f"{distance:.4g} mm"
        for distance in (table["focus_distance_mm"], table["best_focus_distance_mm"])
    )
    header = ("view", "elevation (deg)", f"blur at {near} (px, deg)", f"at {far} (px, deg)", "sharp from", "to (mm)")
    rows: list[tuple[str, ...]] = [header]
    for row in table["elevations"]:
        from_mm, to_mm = row["sharp_from_mm"], row["sharp_to_mm"]
        rows.append(
            (
                row["view"],
                f"{row['elevation_deg']:+.2f}",
                *(f"{px:.1f}, {deg:.2f}" for px, deg in zip(row["blur_px"], row["blur_deg"], strict=True)),
                "nowhere" if from_mm is None else f"{from_mm:.4g}",
                "" if from_mm is None else "infinity" if to_mm is None else f"{to_mm:.4g}",
            )
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        f"focus: through the lens (f/{table['f_number']:g}, focused at {here}) a point is up to "
        f"{table['largest_blur_px']:.1f} px wide, {table['largest_blur_deg']:.2f} degrees in the scene;",
        f"  focused at {best}, which is best for both views, up to {table['largest_blur_at_best_focus_px']:.1f} px. "
        f"Up to {table['tolerable_blur_deg']:g} degrees (sharp) leave most of the matches.",
        *(
            "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        ),
    ]


def _table(design: Design, focus: DesignFocus) -> FocusTable:
    best = focus.best_reciprocal_focus
    return {
        "f_number": design.camera.f_number,
        "focus_distance_mm": design.camera.focus_distance_mm,
        "best_focus_distance_mm": 1.0 / best if best > 0.0 else None,
        "largest_blur_px": focus.largest_blur_px,
        "largest_blur_deg": max(focus.upper.largest_blur_deg, focus.lower.largest_blur_deg),
        "largest_blur_at_best_focus_px": focus.best_largest_blur_px,
        "tolerable_blur_deg": TOLERABLE_BLUR_DEG,
        "distances_mm": list(design.working_volume.distance_mm),
        "elevations": [
            _at_elevation(design, focus, name, view, place)
            for name, view in (("upper", focus.upper), ("lower", focus.lower))
            for place in (0, -1)
        ],
    }


def _at_elevation(design: Design, focus: DesignFocus, name: str, view: ViewFocus, place: int) -> ElevationFocus:
    path = light_path_of_design(design, name)
    slope = np.tan(np.radians(view.elevations_deg[place]))
    # Blur in the scene is in proportion to that on the sensor.
    tolerable_mm = float(np.radians(TOLERABLE_BLUR_DEG) / blur_in_scene(path, slope, focus.lens, 1.0))
    near, far = (float(end) for end in depth_of_field(chief_ray(path, slope), focus.lens, tolerable_mm))
    return {
        "view": name,
        "elevation_deg": float(view.elevations_deg[place]),
        "blur_px": [float(blur) for blur in np.abs(view.blur_px[place])],
        "blur_deg": [float(blur) for blur in np.abs(view.blur_deg[place])],
        "sharp_from_mm": near if np.isfinite(near) else None,
        "sharp_to_mm": far if np.isfinite(far) else None,
    }
