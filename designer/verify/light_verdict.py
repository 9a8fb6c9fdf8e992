"""What the full pupil's light says against a design: light that is lost, views that mix, blur.

A chief ray that passes proves nothing of the light around it; these are the lines of the verdict that do.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.design import Design, Sharpness, ViewName
from designer.verify.light import ViewLight

# The largest share of a zone's light that may belong to the other view.
MOST_MIXED = 0.01
# The traced blur of a finite pupil, aberrations and all, may exceed the first-order one that was bounded by so much.
BLUR_TOLERANCE = 0.05
BLUR_TOLERANCE_PX = 0.5


def light_problems(design: Design, light: Mapping[ViewName, ViewLight]) -> list[str]:
    """One sentence for each way in which the light of a view falls short of what was asked; none if nothing was."""
    if design.sharpness is None:
        return []
    asked = design.sharpness
    return [
        f"{name} view, full pupil: {problem}"
        for name, view in light.items()
        for problem in (*_lost(asked, view), *_mixed(view), *_blurred(asked, view))
    ]


def _lost(asked: Sharpness, light: ViewLight) -> list[str]:
    """At each end of the range, where too little of the light arrives."""
    found = []
    for place in (0, -1):
        distance = int(np.argmin(light.arrives[place]))
        share = 100.0 * float(light.arrives[place, distance])
        if not share >= asked.least_light_percent:
            by = str(light.stopped_by[place, distance])
            found.append(
                f"{share:.0f} % of the light arrives at {light.elevations_deg[place]:.4g} deg "
                f"(at least {asked.least_light_percent:g} % required)"
                + (f"; most of the rest ends at {by}" if by else "")
            )
    return found


def _mixed(light: ViewLight) -> list[str]:
    # Not a number where no light comes at all, which is another line.
    worst = float(np.nanmax([light.mixed_in_zone, *light.mixed_at_ends, 0.0]))
    if worst <= MOST_MIXED:
        return []
    return [
        f"{100.0 * worst:.2g} % of the light in its image zone comes through the other view's mirrors "
        f"(at most {100.0 * MOST_MIXED:g} %)"
    ]


def _blurred(asked: Sharpness, light: ViewLight) -> list[str]:
    found = []
    for blur, most, slack, unit in (
        (light.blur_px, asked.max_blur_px, np.full(len(light.elevations_deg), BLUR_TOLERANCE_PX), "px"),
        (light.blur_deg, asked.max_blur_deg, BLUR_TOLERANCE_PX / light.pixels_per_degree, "deg"),
    ):
        if most is None:
            continue
        excess = blur - (most * (1.0 + BLUR_TOLERANCE) + slack[:, None])
        if not np.all(excess <= 0.0):
            place, distance = np.unravel_index(int(np.argmax(np.nan_to_num(excess, nan=np.inf))), excess.shape)
            found.append(
                f"blur of {blur[place, distance]:.3g} {unit} at {light.elevations_deg[place]:.4g} deg and "
                f"{light.distances_mm[distance]:g} mm (at most {most:g} {unit} allowed)"
            )
    return found
