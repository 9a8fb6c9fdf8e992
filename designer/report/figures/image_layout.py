"""Where the two views fall on the sensor: zones in the image circle, their soft edges, and where the views mix."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Annulus, Circle, Patch, Rectangle

from designer.design import Design
from designer.evaluate.penumbra import mixing_band_px, zone_rims
from designer.evaluate.resolution import image_zones
from designer.report.figures.style import GREY, INK, PURPLE, VIEW_COLOUR, new_figure

_SENSOR_COLOUR = "#f7f7f7"
_ZONE_COLOUR = {"upper": "#bcd9ea", "lower": "#f3cdb3"}


def draw_image_layout(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the sensor's rectangle, the usable image circle and the zone that each view's asked elevations fill.

    Grey rings are the penumbrae of the mirrors' rims, and the hatched one is where light of both views arrives.
    """
    camera = design.camera
    circle_px = camera.image_radius_mm / camera.pixel_pitch_mm
    figure = new_figure(width_mm, height_mm)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.spines[:].set_visible(False)
    half_width, half_height = camera.width_px / 2, camera.height_px / 2
    axes.add_patch(
        Rectangle(
            (-half_width, -half_height),
            camera.width_px,
            camera.height_px,
            facecolor=_SENSOR_COLOUR,
            edgecolor=INK,
            lw=0.9,
        )
    )
    axes.add_patch(Circle((0, 0), circle_px, fill=False, edgecolor=GREY, linewidth=0.8, linestyle=(0, (4, 2))))
    # Each zone is a disc with the sensor's colour laid over its middle, the outer zone first.
    for name, (inner, outer) in sorted(image_zones(design).items(), key=lambda zone: -zone[1][1]):
        edge = VIEW_COLOUR[name]
        axes.add_patch(Circle((0, 0), outer, facecolor=_ZONE_COLOUR[name], edgecolor=edge, linewidth=0.9))
        axes.add_patch(Circle((0, 0), inner, facecolor=_SENSOR_COLOUR, edgecolor=edge, linewidth=0.9))
        label = f"{name}: {inner:.0f} to {outer:.0f} px"
        axes.plot([], [], linestyle="none", marker="o", color=_ZONE_COLOUR[name], markeredgecolor=edge, label=label)
        axes.annotate(name, (0, (inner + outer) / 2), ha="center", va="center", color=INK, fontsize=7.5)
    handles = [*axes.get_legend_handles_labels()[0], *_soft_edges(axes, design)]
    axes.plot([0], [0], marker="+", color=INK, markersize=6, markeredgewidth=0.8)
    reach_x, reach_y = (1.03 * max(side, circle_px) for side in (half_width, half_height))
    axes.set_xlim(-reach_x, reach_x)
    axes.set_ylim(reach_y, -reach_y)
    axes.set_xlabel("$u - u_0$ (px)")
    axes.set_ylabel("$v - v_0$ (px)")
    figure.legend(handles=handles, loc="outside upper center", ncols=2, handlelength=1.0, columnspacing=1.2)
    return figure


def _soft_edges(axes: Axes, design: Design) -> list[Patch]:
    """Draw the penumbrae of the rims and the band in which the views mix; returns their entries of the legend."""
    rims = [rim for zone in zone_rims(design).values() for rim in (zone.inner, zone.outer) if rim is not None]
    for rim in rims:
        axes.add_patch(
            Annulus((0, 0), rim.outer_px, min(rim.width_px, rim.outer_px), facecolor=GREY, alpha=0.45, linewidth=0.0)
        )
    widths = [rim.width_px for rim in rims]
    handles = [Patch(facecolor=GREY, alpha=0.45, label=f"penumbrae: {min(widths):.0f} to {max(widths):.0f} px")]
    band = mixing_band_px(design)
    if band is None:
        return [*handles, Patch(facecolor="none", label="the views do not mix")]
    style: dict[str, Any] = {"facecolor": "none", "edgecolor": PURPLE, "hatch": "//////", "linewidth": 0.0}
    axes.add_patch(Annulus((0, 0), band[1], band[1] - band[0], **style))
    return [*handles, Patch(label=f"views mix: {band[0]:.0f} to {band[1]:.0f} px", **style)]
