"""The focus of a design in lines for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.cli.table import aligned

if TYPE_CHECKING:
    from designer.evaluate.focus_table import ElevationFocus, FocusTable


def describe_focus(table: FocusTable) -> list[str]:
    """Focus and largest blur, and a row for each end of both views."""
    near, far = (f"{distance:g} mm" for distance in table["distances_mm"])
    here, best = (
        "infinity" if distance is None else f"{distance:.4g} mm"
        for distance in (table["focus_distance_mm"], table["best_focus_distance_mm"])
    )
    header = ("view", "elevation (deg)", f"blur at {near} (px, deg)", f"at {far} (px, deg)", "sharp from", "to (mm)")
    return [
        f"focus: with the lens at f/{table['f_number']:g}, focused at {here}, the blur is at most "
        f"{table['largest_blur_px']:.1f} px, {table['largest_blur_deg']:.2f} degrees in the scene;",
        f"  at the best focus, {best}, at most {table['largest_blur_at_best_focus_px']:.1f} px. "
        f"Sharp means at most {table['sharp_blur_deg']:g} degrees.",
        *(f"  {line}" for line in aligned([header, *map(_row, table["elevations"])])),
    ]


def _row(row: ElevationFocus) -> tuple[str, ...]:
    from_mm, to_mm = row["sharp_from_mm"], row["sharp_to_mm"]
    near, far = (f"{px:.1f}, {deg:.2f}" for px, deg in zip(row["blur_px"], row["blur_deg"], strict=True))
    return (
        row["view"],
        f"{row['elevation_deg']:+.2f}",
        near,
        far,
        "nowhere" if from_mm is None else f"{from_mm:.4g}",
        "" if from_mm is None else "infinity" if to_mm is None else f"{to_mm:.4g}",
    )
