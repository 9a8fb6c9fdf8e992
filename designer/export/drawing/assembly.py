"""The assembly: all mirrors on their axis over the camera, cut, with heights above the pinhole and the light's ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from designer.design import VIEW_NAMES, Design, Mirror, ViewName
from designer.evaluate.fabrication import size_of
from designer.export.drawing import paper
from designer.export.drawing.paper import (
    FINE,
    Area,
    Balloon,
    Colour,
    Dash,
    Dimension,
    Dot,
    Drawn,
    Label,
    Line,
    Mark,
    Point,
    hatched,
)
from designer.trace.outline import (
    SIDES,
    CylinderSection,
    Polyline,
    body_box,
    face_height,
    face_outline,
    housing_sections,
    leaving_rays,
    lens_box,
    substrate,
)
from designer.typesetting.markup import number

Placing = Callable[[float, float], Point]
"""From a signed distance from the axis and a height, in mm, to paper."""

HEIGHT_MM = 190.0
SCALES = (
    10.0,
    5.0,
    4.0,
    3.0,
    2.5,
    2.0,
    1.5,
    1.0,
    *(1.0 / n for n in (1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 15, 20, 50, 100)),
)
_WIDTH_MM = 146.0
_LEFT_MM, _RIGHT_MM, _TOP_MM, _BOTTOM_MM = 16.0, 44.0, 15.0, 7.0
_LINE_OF_TEXT_MM = 3.9
_SAMPLES = 60
_COLOUR: dict[ViewName, Colour] = {"upper": "blue", "lower": "orange"}
_DASH: dict[ViewName, Dash] = {"upper": "solid", "lower": "dashed"}


def assembly_drawing(design: Design) -> Drawn:
    """The system cut along its axis; the upper view's light leaves to the right, the lower view's to the left."""
    size = size_of(design)
    heights = [view.viewpoint_mm for view in design.views.by_name.values()]
    top = max(float(size.top), *heights)
    low = min(0.0, float(size.bottom), *heights, design.camera.lens_seat_mm)
    # Room below the lens's seat shows that the camera goes on.
    low -= 0.06 * (top - low)
    radius = max(float(size.radius), design.camera.body_radius_mm, design.camera.lens_radius_mm)
    room = (_WIDTH_MM - _LEFT_MM - _RIGHT_MM, HEIGHT_MM - _TOP_MM - _BOTTOM_MM)
    scale = paper.scale_for(2.15 * radius, top - low, room, SCALES)
    centre = _LEFT_MM + room[0] / 2.0
    # What is left over of the height goes to both ends alike.
    first = _TOP_MM + (room[1] - (top - low) * scale) / 2.0

    def at(across: float, height: float) -> Point:
        return centre + across * scale, first + (top - height) * scale

    frame = (_LEFT_MM, _WIDTH_MM - _RIGHT_MM, _TOP_MM - 4.0, HEIGHT_MM - _BOTTOM_MM + 2.0)
    drawn: list[Mark] = [Line((at(0.0, low), (centre, frame[2])), 0.18, "chain")]
    for view in VIEW_NAMES:
        for ray in leaving_rays(design, view, 2, 100.0 * (radius + top - low)):
            points = _cut_off([at(float(x), float(z)) for x, z in ray], frame)
            drawn.append(Line(tuple(points), 0.25, _DASH[view], _COLOUR[view]))
    boxes = [lens_box(design.camera, low), body_box(design.camera, low)]
    for box in boxes:
        drawn += _open_below(box, at) if box.high > low else []
    for index, mirror in enumerate(design.mirrors):
        for half in _outlines(mirror):
            outline = tuple(at(float(x), float(z)) for x, z in half)
            drawn += [Area(outline, 0.3, "white"), *hatched(outline, 1.2, rising=index % 2 == 0), Area(outline, 0.35)]
    for section in housing_sections(design):
        wall = tuple(at(float(x), float(z)) for x, z in section[:-1])
        drawn.append(Area(wall, 0.25, "light blue"))
    drawn += _balloons(design, at)
    drawn += _heights(design, at, frame)
    drawn += _overall(design, at)
    return Drawn(tuple(drawn), scale, _WIDTH_MM)


def _outlines(mirror: Mirror) -> list[Polyline]:
    """A mirror's section on both sides of the axis; one piece where there is no hole."""
    if mirror.inner_radius_mm > 0.0:
        return [substrate(mirror, _SAMPLES, side)[:-1] for side in SIDES]
    front = np.vstack([face_outline(mirror, _SAMPLES, -1.0)[::-1], face_outline(mirror, _SAMPLES)[1:]])
    return [np.vstack([front, (front + np.array([0.0, mirror.back_offset_mm]))[::-1]])]


def _cut_off(points: Sequence[Point], frame: tuple[float, float, float, float]) -> list[Point]:
    """A polyline whose last leg ends at the frame (left, right, top, bottom)."""
    *kept, last = points
    (x, y), (u, v) = kept[-1], last
    shares = [1.0]
    for start, end, least, most in ((x, u, frame[0], frame[1]), (y, v, frame[2], frame[3])):
        if end != start:
            shares.append(max(((most if end > start else least) - start) / (end - start), 0.0))
    share = min(shares)
    return [*kept, (x + share * (u - x), y + share * (v - y))]


def _open_below(box: CylinderSection, at: Placing) -> list[Mark]:
    corners = ((-box.radius, box.low), (-box.radius, box.high), (box.radius, box.high), (box.radius, box.low))
    outline = tuple(at(*corner) for corner in corners)
    return [Area(outline, 0.0, "light grey", "white"), Line(outline, 0.25)]


def _balloons(design: Design, at: Placing) -> list[Mark]:
    """Number the mirrors, beyond their outer edge, where no other number stands."""
    drawn: list[Mark] = []
    taken: list[Point] = []
    for index, mirror in enumerate(design.mirrors, 1):
        middle = face_height(mirror, mirror.outer_radius_mm) + mirror.back_offset_mm / 2.0
        x, y = at(-mirror.outer_radius_mm, middle)
        away = -1.0 if mirror.faces == "down" else 1.0
        candidates = [(x - 5.0 - dx, y + away * dy) for dx in (0.0, 3.0, 6.0) for dy in (0.0, 4.0, -4.0, 8.0, -8.0)]
        free = (c for c in candidates if all(np.hypot(c[0] - a, c[1] - b) > 5.2 for a, b in taken))
        place = next(free, candidates[0])
        taken.append(place)
        drawn += [Line((place, (x, y)), FINE), Balloon(str(index), place)]
    return drawn


def _features(design: Design) -> list[tuple[float, str]]:
    """Heights above the pinhole that the drawing gives, with what is there."""
    camera, views, housing = design.camera, design.views, design.housing
    ends: list[tuple[float, str]] = []
    if housing is not None:
        ends = [(housing.low_mm, f"foot of {housing.kind}"), (housing.high_mm, f"top of {housing.kind}")]
    return [
        *ends,
        *((mirror.vertex_mm, f"vertex V{index}") for index, mirror in enumerate(design.mirrors, 1)),
        (views.upper.viewpoint_mm, "upper viewpoint"),
        (views.lower.viewpoint_mm, "lower viewpoint"),
        (0.0, "pinhole"),
        (camera.lens_front_mm, "lens front"),
        (camera.lens_seat_mm, "lens seat on camera"),
    ]


def _heights(design: Design, at: Placing, frame: tuple[float, float, float, float]) -> list[Mark]:
    """A column of heights on the right, each led to its point on the axis."""
    features = sorted(_features(design), reverse=True)
    wanted = [at(0.0, height)[1] for height, _ in features]
    places = _spread(wanted, _LINE_OF_TEXT_MM, frame[2], HEIGHT_MM - 6.0)
    drawn: list[Mark] = [Label("height above the pinhole", (_WIDTH_MM - 2.0, 6.0), "right", size=7.0)]
    edge = frame[1]
    for (height, words), y, place in zip(features, wanted, places, strict=True):
        x = at(0.0, height)[0]
        drawn.append(Line(((x, y), (edge, y), (edge + 4.0, place), (edge + 5.0, place)), FINE, colour="grey"))
        drawn.append(Dot((x, y), 0.55))
        drawn.append(Label(number(height, 3), (edge + 16.5, place), "right", size=7.5))
        drawn.append(Label(words, (edge + 17.5, place), "left", size=7.0))
    return drawn


def _spread(wanted: Sequence[float], spacing: float, first: float, last: float) -> list[float]:
    """Places in ascending order, near the wanted ones, no two closer than the spacing."""
    places: list[float] = []
    for place in wanted:
        places.append(max(place, places[-1] + spacing if places else first))
    for index in reversed(range(len(places))):
        most = last if index == len(places) - 1 else places[index + 1] - spacing
        places[index] = min(places[index], most)
    return places


def _overall(design: Design, at: Placing) -> list[Mark]:
    """Overall height, from the lower of lens front and lowest edge, and overall diameter."""
    size = size_of(design)
    top, bottom, radius = float(size.top), float(size.bottom), float(size.radius)
    widest = max(design.mirrors, key=lambda mirror: mirror.outer_radius_mm)
    rim = face_height(widest, widest.outer_radius_mm) if design.housing is None else design.housing.high_mm
    (left, rim_y), (right, _) = at(-radius, rim), at(radius, rim)
    across = Dimension("level", 7.0, (left, right), (rim_y, rim_y), f"⌀{number(2.0 * radius, 3)}")
    high, low = at(0.0, top)[1], at(0.0, bottom)[1]
    starts = (at(-_reach(design, top), top)[0], at(-_reach(design, bottom), bottom)[0])
    upright = Dimension("upright", 6.0, (high, low), starts, number(top - bottom, 3))
    return [across, upright]


def _reach(design: Design, height: float) -> float:
    """How far from the axis the part reaches that is at this height: an edge of a mirror, lens or housing."""
    reaches = [design.camera.lens_radius_mm if height == design.camera.lens_front_mm else 0.0]
    housing = design.housing
    if housing is not None and height in (housing.low_mm, housing.high_mm):
        reaches.append(housing.outer_radius_mm)
    for mirror in design.mirrors:
        for radius in (mirror.inner_radius_mm, mirror.outer_radius_mm):
            face = face_height(mirror, radius)
            if min(abs(face - height), abs(face + mirror.back_offset_mm - height)) < 1e-6:
                reaches.append(radius)
    return max(reaches)
