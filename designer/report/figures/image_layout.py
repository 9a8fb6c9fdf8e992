"""Where the two views fall on the sensor: zones in the image circle, in pixels."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from designer.design import Design
from designer.evaluate.resolution import image_zones
from designer.report.figures.style import GREY, INK, VIEW_COLOUR, new_figure

_SENSOR_COLOUR = "#f7f7f7"
_ZONE_COLOUR = {"upper": "#bcd9ea", "lower": "#f3cdb3"}


def draw_image_layout(design: Design, width_mm: float, height_mm: float) -> Figure:
    """Draw the sensor's rectangle, the usable image circle and the zone that each view's asked elevations fill."""
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
    axes.plot([0], [0], marker="+", color=INK, markersize=6, markeredgewidth=0.8)
    reach_x, reach_y = (1.03 * max(side, circle_px) for side in (half_width, half_height))
    axes.set_xlim(-reach_x, reach_x)
    axes.set_ylim(reach_y, -reach_y)
    axes.set_xlabel("$u - u_0$ (px)")
    axes.set_ylabel("$v - v_0$ (px)")
    figure.legend(loc="outside upper center", ncols=2, handlelength=1.0)
    return figure
