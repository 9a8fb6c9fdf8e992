"""How softly the image zones end: the light that each view's first mirror sends to the sensor, along the radius."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from designer.design import Design, ViewName
from designer.evaluate.penumbra import ZoneRims, mixing_band_px, share_of_pupil, zone_rims
from designer.evaluate.resolution import image_zones
from designer.report.figures.style import PURPLE, VIEW_COLOUR, VIEW_LINE, new_figure

_MARGIN = 0.25
"""Room drawn on either side of the border, as a share of the distance between the two zones."""


def draw_zone_edges(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the share of the pupil through which each view is seen across the border between the two zones.

    The zones of the elevations asked of the views are shaded; where both views are seen, they mix.
    """
    zones, rims = image_zones(design), zone_rims(design)
    inner, outer = design.views.inner, design.views.outer
    ends, begins = zones[inner][1], zones[outer][0]
    known = [rim for rim in (rims[inner].outer, rims[outer].inner) if rim is not None]
    low = min([ends, *(rim.inner_px for rim in known)])
    high = max([begins, *(rim.outer_px for rim in known)])
    room = _MARGIN * (high - low)
    radius = np.linspace(max(low - room, 0.0), high + room, 601)
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    for name, (start, end) in ((inner, (radius[0], ends)), (outer, (begins, radius[-1]))):
        axes.axvspan(start, end, color=VIEW_COLOUR[name], alpha=0.13, linewidth=0.0)
    shares = _shares(radius, rims, inner, outer)
    for name, share in shares.items():
        axes.plot(radius, 100.0 * share, color=VIEW_COLOUR[name], linestyle=VIEW_LINE[name], label=f"{name} view")
    band = mixing_band_px(design)
    if band is not None:
        mixed = f"both views: {band[0]:.0f} to {band[1]:.0f} px"
        axes.axvspan(*band, facecolor="none", edgecolor=PURPLE, hatch="////", linewidth=0.0, label=mixed)
    axes.set_xlim(radius[0], radius[-1])
    axes.set_ylim(0.0, 105.0)
    axes.grid(True)
    axes.set_xlabel("image radius (px)")
    axes.set_ylabel("light of the pupil (%)")
    figure.legend(loc="outside upper center", ncols=2, columnspacing=1.2)
    return figure


def _shares(
    radius: np.ndarray, rims: dict[ViewName, ZoneRims], inner: ViewName, outer: ViewName
) -> dict[ViewName, np.ndarray]:
    """Shares of the pupil that see either view; the rim nearer to the lens also covers, or uncovers, the other view."""
    end, begin = rims[inner].outer, rims[outer].inner
    of_inner = 1.0 - share_of_pupil(radius, end)
    of_outer = np.ones_like(radius) if begin is None else share_of_pupil(radius, begin)
    if begin is None or end.height_mm < begin.height_mm:
        of_outer = np.minimum(of_outer, 1.0 - of_inner)
    else:
        of_inner = np.minimum(of_inner, 1.0 - of_outer)
    return {inner: of_inner, outer: of_outer}
