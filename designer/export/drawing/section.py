"""A mirror cut along its axis, with its dimensions: the axis lies level, the light comes from the left."""

from __future__ import annotations

import numpy as np

from designer.design import Design, Mirror
from designer.evaluate.face_dimensions import FaceDimensions, depth_mm, face_dimensions
from designer.export.drawing import paper
from designer.export.drawing.paper import Area, Dimension, Drawn, Label, Line, Mark, Point, hatched
from designer.typesetting.markup import number

WIDTH_MM, HEIGHT_MM = 112.0, 190.0
DECIMALS = 3
_COLUMN_MM = 9.0
_ROOM: Point = (58.0, 136.0)
_SAMPLES = 120


def section_of(design: Design, name: str) -> Drawn:
    """The section of one mirror: hatched on both sides of the axis, edges beyond the cut thin."""
    mirror, face = design.mirror(name), face_dimensions(design, name)
    inner, outer = mirror.inner_radius_mm, mirror.outer_radius_mm
    rims = (depth_mm(mirror, inner), depth_mm(mirror, outer))
    least, most = min(0.0, *rims), max(0.0, *(rim + mirror.thickness_mm for rim in rims))
    scale = paper.scale_for(most - least, 2.0 * outer, _ROOM)
    axis = HEIGHT_MM / 2.0 - 4.0

    def at(depth: float, radius: float) -> Point:
        return WIDTH_MM / 2.0 + (depth - (least + most) / 2.0) * scale, axis - radius * scale

    profile = [(depth_mm(mirror, float(r)), float(r)) for r in np.linspace(inner, outer, _SAMPLES)]
    drawn: list[Mark] = []
    for half in _halves(profile):
        outline = [at(depth, r) for depth, r in half]
        outline += [at(depth + mirror.thickness_mm, r) for depth, r in reversed(half)]
        drawn += [*hatched(outline), Area(tuple(outline))]
    drawn += [Line((at(depth, -r), at(depth, r))) for depth, r in _edges_beyond(mirror, rims)]
    drawn.append(Line(((at(least, 0.0)[0] - 6.0, axis), (at(most, 0.0)[0] + 6.0, axis)), 0.18, "chain"))
    x, y = at(0.0, 0.0)
    if inner > 0.0:
        drawn.append(Line(((x, y - 1.2), (x, y + 1.2)), 0.3))
    drawn.append(Label("V", (x - 2.0, y + 3.0)))
    drawn += _dimensions(mirror, face, scale, (least, most))
    drawn.append(Label("section through the axis; light from the left", (WIDTH_MM / 2.0, HEIGHT_MM - 4.0), size=7.0))
    return Drawn(tuple(drawn), scale, WIDTH_MM)


def _halves(profile: list[Point]) -> list[list[Point]]:
    """The profile (depth, radius) on both sides of the axis; one piece where there is no hole."""
    mirrored = [(depth, -r) for depth, r in profile]
    return [profile, mirrored] if profile[0][1] > 0.0 else [[*reversed(mirrored), *profile[1:]]]


def _edges_beyond(mirror: Mirror, rims: tuple[float, float]) -> list[Point]:
    """Circles that are seen behind the cut, as (depth, radius): those of the hole, and that of the hollow side."""
    inner, outer = mirror.inner_radius_mm, mirror.outer_radius_mm
    hole = [(rims[0], inner), (rims[0] + mirror.thickness_mm, inner)] if inner > 0.0 else []
    if rims[0] == rims[1]:
        return hole
    return [*hole, (rims[1] + mirror.thickness_mm if rims[1] > rims[0] else rims[1], outer)]


def _dimensions(mirror: Mirror, face: FaceDimensions, scale: float, ends: tuple[float, float]) -> list[Mark]:
    """Diameters beside the section, lengths above and below it."""
    inner, outer, thickness = mirror.inner_radius_mm, mirror.outer_radius_mm, mirror.thickness_mm
    least, most = ends
    axis, rim = HEIGHT_MM / 2.0 - 4.0, depth_mm(mirror, outer)

    def x_of(depth: float) -> float:
        return WIDTH_MM / 2.0 + (depth - (least + most) / 2.0) * scale

    def diameter(x: float, radius: float, depth: float, words: str = "") -> Dimension:
        heights = (axis - radius * scale, axis + radius * scale)
        text = f"{words}⌀{number(2.0 * radius, DECIMALS)}"
        return Dimension("upright", x, heights, (x_of(depth), x_of(depth)), text)

    left, right = x_of(least), x_of(most)
    drawn: list[Mark] = []
    if face.has_margin:
        clear_inner, clear_outer = face.clear_radii_mm
        drawn.append(diameter(left - 2.0 * _COLUMN_MM, clear_outer, depth_mm(mirror, clear_outer), "clear "))
        if clear_inner > 0.0:
            drawn.append(diameter(left - _COLUMN_MM, clear_inner, depth_mm(mirror, clear_inner), "clear "))
    drawn.append(diameter(right + 2.0 * _COLUMN_MM, outer, rim + thickness))
    if inner > 0.0:
        drawn.append(diameter(right + _COLUMN_MM, inner, depth_mm(mirror, inner) + thickness))
    top, bottom = axis - outer * scale, axis + outer * scale
    if thickness > 0.0:
        level = (x_of(rim), x_of(rim + thickness))
        drawn.append(Dimension("level", top - 8.0, level, (top, top), number(thickness, DECIMALS)))
    if abs(rim) >= 0.5 * 10.0**-DECIMALS:
        level, starts = (
            ((x_of(0.0), x_of(rim)), (axis, bottom)) if rim > 0.0 else ((x_of(rim), x_of(0.0)), (bottom, axis))
        )
        drawn.append(Dimension("level", bottom + 8.0, level, starts, number(abs(rim), DECIMALS), right=rim > 0.0))
        near = min(depth_mm(mirror, inner), rim)
        far = max(depth_mm(mirror, inner), rim) + thickness
        overall = f"({number(far - near, DECIMALS)})"
        drawn.append(Dimension("level", bottom + 16.0, (x_of(near), x_of(far)), (bottom, bottom), overall))
    return drawn
