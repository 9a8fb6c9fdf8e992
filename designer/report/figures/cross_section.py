"""The system cut along its axis, to scale, with traced rays of both views and the dimensions a shop asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from designer.design import VIEW_NAMES, Design, Mirror, ViewName
from designer.evaluate.fabrication import size_of
from designer.report.figures.style import GREY, HALO, INK, LIGHT_GREY, VIEW_COLOUR, VIEW_LINE, new_figure
from designer.trace.outline import (
    SIDES,
    body_box,
    face_height,
    face_outline,
    housing_sections,
    leaving_rays,
    lens_box,
    substrate,
)

SCALES = (0.5, 0.75, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0)
"""Reductions 1 : n in which drawings are made, the first that fits."""

SIDE_MM, TOP_MM, BOTTOM_MM = 12.0, 11.0, 2.0
"""Paper around the drawing, for the dimension lines."""

WALL = "#cfe3ee"
"""Fill of a tube's wall, or of struts."""

RAYS = 5
SAMPLES_OF_A_FACE = 120
VIEWPOINT_MARKER = {"upper": "^", "lower": "v"}


@dataclass(frozen=True, slots=True)
class ScaledFigure:
    """A finished drawing and its reduction 1 : ``scale``."""

    figure: Figure
    scale: float


def draw_cross_section(design: Design, width_mm: float, height_mm: float) -> ScaledFigure:
    """Draw a design within a space on paper: the upper view's rays on the right, the lower view's on the left.

    Rays fan out over the elevations asked of each view; dotted lines lead the leaving rays back to the viewpoint.
    """
    outline = _Outline.of(design)
    below, above = _room_for_rays(design, outline)
    low, high = outline.low - below, outline.high + above
    free_width, free_height = width_mm - 2 * SIDE_MM, height_mm - TOP_MM - BOTTOM_MM
    scale = _scale(2 * 1.4 * outline.half_width, high - low, free_width, free_height)
    # Paper left over goes to the leaving rays.
    half_width = min(free_width * scale / 2, 2.4 * outline.half_width)
    paper_height = (high - low) / scale + TOP_MM + BOTTOM_MM
    figure = new_figure(width_mm, paper_height, constrained=False)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-width_mm * scale / 2, width_mm * scale / 2)
    axes.set_ylim(low - BOTTOM_MM * scale, high + TOP_MM * scale)

    frame = _Frame(-half_width, half_width, low, high)
    axes.plot([0, 0], [low, high], color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1.5, 2)), zorder=1)
    for name in VIEW_NAMES:
        _draw_rays(axes, design, name, frame)
    _draw_camera(axes, design, frame)
    for mirror in design.mirrors:
        _draw_mirror(axes, mirror)
    for section in housing_sections(design):
        axes.add_patch(Polygon(section[:-1], facecolor=WALL, edgecolor=GREY, linewidth=0.5, alpha=0.6, zorder=2.8))
    _draw_balloons(axes, design, scale)
    _draw_viewpoints(axes, design, frame, scale)
    _draw_dimensions(axes, design, outline, frame, scale)
    return ScaledFigure(figure, scale)


@dataclass(frozen=True, slots=True)
class _Frame:
    left: float
    right: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class _Outline:
    """What has to fit into the drawing, and the extent that the height measures."""

    half_width: float
    low: float
    high: float
    head_low: float
    head_high: float

    @property
    def height(self) -> float:
        return self.high - self.low

    @classmethod
    def of(cls, design: Design) -> _Outline:
        size, seat = size_of(design), design.camera.lens_seat_mm
        head_low, head_high = float(size.bottom), float(size.top)
        viewpoints = [view.viewpoint_mm for view in design.views.by_name.values()]
        low = min(0.0, head_low, *viewpoints, max(seat, head_low - 0.2 * (head_high - head_low)))
        high = max(head_high, *viewpoints)
        half_width = max(float(size.radius), 0.3 * (high - low))
        return cls(half_width, low, high, head_low, head_high)


def _room_for_rays(design: Design, outline: _Outline) -> tuple[float, float]:
    """Space under and over the system in which steep leaving rays can be followed, mm."""
    views = design.views.by_name.values()
    lowest = min(view.elevation_deg[0] for view in views)
    highest = max(view.elevation_deg[1] for view in views)
    steepness = np.tan(np.radians([-lowest, highest]))
    below, above = np.clip(0.5 * outline.half_width * steepness, 0.05 * outline.height, 0.25 * outline.height)
    return float(below), float(above)


def _backwards(mirror: Mirror) -> float:
    return 1.0 if mirror.faces == "down" else -1.0


def _scale(width: float, height: float, paper_width: float, paper_height: float) -> float:
    needed = max(width / paper_width, height / paper_height)
    return next((scale for scale in SCALES if scale >= needed), needed)


def _draw_rays(axes: Axes, design: Design, name: ViewName, frame: _Frame) -> None:
    length = 4.0 * (frame.right + frame.high - frame.low)
    colour, style = VIEW_COLOUR[name], VIEW_LINE[name]
    viewpoint = design.views.by_name[name].viewpoint_mm
    rays = leaving_rays(design, name, RAYS, length)
    for index, ray in enumerate(rays):
        path = np.vstack([ray[:-1], _clip_to_frame(ray[-2], ray[-1], frame)])
        width = 1.0 if index in (0, len(rays) - 1) else 0.45
        axes.plot(path[:, 0], path[:, 1], color=colour, linestyle=style, linewidth=width, zorder=3)
        axes.plot([path[-2, 0], 0.0], [path[-2, 1], viewpoint], color=colour, linestyle=":", linewidth=0.5, zorder=2)


def _clip_to_frame(start: np.ndarray, end: np.ndarray, frame: _Frame) -> np.ndarray:
    """The point where a leaving ray meets the edge of the drawing."""
    step = end - start
    fractions = [1.0]
    for axis, (least, greatest) in enumerate(((frame.left, frame.right), (frame.low, frame.high))):
        if step[axis] != 0.0:
            bound = greatest if step[axis] > 0 else least
            fractions.append(max((bound - start[axis]) / step[axis], 0.0))
    clipped: np.ndarray = start + min(fractions) * step
    return clipped


def _draw_camera(axes: Axes, design: Design, frame: _Frame) -> None:
    camera = design.camera
    bottom = min(frame.low, camera.lens_front_mm)
    boxes = [(lens_box(camera, bottom), "#eeeeee")]
    if camera.lens_seat_mm > bottom:
        boxes.append((body_box(camera, bottom), "#dddddd"))
    for box, colour in boxes:
        # Open at the bottom: the camera goes on below the drawing.
        corners = box.outline[:-1]
        axes.add_patch(Polygon(corners, closed=False, facecolor=colour, edgecolor=GREY, linewidth=0.7, zorder=2.5))


def _draw_mirror(axes: Axes, mirror: Mirror) -> None:
    for side in SIDES:
        blank, front = substrate(mirror, SAMPLES_OF_A_FACE, side), face_outline(mirror, SAMPLES_OF_A_FACE, side)
        axes.add_patch(Polygon(blank[:-1], facecolor=LIGHT_GREY, edgecolor=GREY, linewidth=0.4, zorder=4))
        axes.plot(front[:, 0], front[:, 1], color=INK, linewidth=1.7, solid_capstyle="butt", zorder=5)


def _draw_balloons(axes: Axes, design: Design, scale: float) -> None:
    """Number the mirrors as in the prescription, behind each mirror where no light passes."""
    step = 4.2 * scale
    upper, lower = design.views.upper.viewpoint_mm, design.views.lower.viewpoint_mm
    taken: list[tuple[float, float]] = [(0.0, upper), (0.0, lower)]
    for number, mirror in enumerate(design.mirrors, start=1):
        radius = (mirror.inner_radius_mm + mirror.outer_radius_mm) / 2
        back = face_height(mirror, radius) + mirror.back_offset_mm
        anchor = (-radius, back)
        candidates = [
            (anchor[0] + sideways * step, back + _backwards(mirror) * away * step)
            for away in (1.0, 1.6, 2.3, 3.0)
            for sideways in (0.0, -0.8, 0.8, -1.6, 1.6)
        ]
        place = next((spot for spot in candidates if _is_clear(spot, taken, step)), candidates[0])
        taken.append(place)
        axes.plot([anchor[0], place[0]], [anchor[1], place[1]], color=INK, linewidth=0.5, zorder=6)
        axes.text(
            *place,
            str(number),
            ha="center",
            va="center",
            fontsize=8.0,
            zorder=7,
            bbox={"boxstyle": "circle,pad=0.22", "facecolor": "white", "edgecolor": INK, "linewidth": 0.6},
        )


def _is_clear(spot: tuple[float, float], taken: list[tuple[float, float]], distance: float) -> bool:
    return all(np.hypot(spot[0] - other[0], spot[1] - other[1]) > 1.1 * distance for other in taken)


def _draw_viewpoints(axes: Axes, design: Design, frame: _Frame, scale: float) -> None:
    """Mark pinhole and viewpoints on the axis; the viewpoints' names stand in the margin, on the baseline's ends."""
    axes.plot([0.0], [0.0], marker="x", color=INK, markersize=5.0, zorder=8, linestyle="none")
    label = axes.text(1.9 * scale, 0.0, "$O$", ha="left", va="top", fontsize=9.0, zorder=9)
    label.set_path_effects(HALO)
    margin = frame.right + 2.0 * scale
    for name, view in design.views.by_name.items():
        symbol, height, colour = f"$F_{name[0]}$", view.viewpoint_mm, VIEW_COLOUR[name]
        axes.plot([0.0], [height], marker=VIEWPOINT_MARKER[name], color=colour, markersize=5.0, zorder=8)
        axes.text(margin, height + 0.4 * scale, symbol, color=colour, ha="center", va="bottom", fontsize=9.0)


def _draw_dimensions(axes: Axes, design: Design, outline: _Outline, frame: _Frame, scale: float) -> None:
    gap = 4.0 * scale
    left, right, top = frame.left - gap, frame.right + gap, frame.high + gap
    radius, rim = _widest(design)
    for height in (outline.head_low, outline.head_high):
        _extension(axes, (0.0, height), (left - 0.3 * gap, height))
    for view in design.views.by_name.values():
        _extension(axes, (0.0, view.viewpoint_mm), (right + 0.3 * gap, view.viewpoint_mm))
    for side in (-1.0, 1.0):
        _extension(axes, (side * radius, rim), (side * radius, top + 0.3 * gap))
    _dimension(axes, (left, outline.head_low), (left, outline.head_high), f"$H$ = {design.height_mm:.1f}", -1, scale)
    low, high = sorted((design.views.lower.viewpoint_mm, design.views.upper.viewpoint_mm))
    _dimension(axes, (right, low), (right, high), f"$b$ = {design.baseline_mm:.1f}", 1, scale)
    _dimension(axes, (-radius, top), (radius, top), f"$W$ = {design.diameter_mm:.1f}", 0, scale)


def _widest(design: Design) -> tuple[float, float]:
    """Radius and height of the place where the head is widest, as high up as it is."""
    if design.housing is not None:
        return design.housing.outer_radius_mm, design.housing.high_mm
    widest = max(design.mirrors, key=lambda mirror: mirror.outer_radius_mm)
    return widest.outer_radius_mm, face_height(widest, widest.outer_radius_mm)


def _extension(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.plot([start[0], end[0]], [start[1], end[1]], color="#9a9a9a", linewidth=0.35, zorder=0.5)


def _dimension(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, outwards: int, scale: float
) -> None:
    arrow = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
    axes.annotate("", xy=end, xytext=start, arrowprops=arrow, zorder=6)
    x, y = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    if outwards == 0:
        axes.text(x, y + 0.8 * scale, text, ha="center", va="bottom", fontsize=8.5)
    else:
        axes.text(x + outwards * 2.6 * scale, y, text, ha="center", va="center", rotation=90, fontsize=8.5)
