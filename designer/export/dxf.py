"""Half-profiles of mirrors and housing (``.dxf``) for CAD: exact conics, in mm, to be revolved about the axis.

The drawing's x is the distance from the axis, its y the height above the pinhole.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np

from designer.design import Design, Mirror
from designer.export.conic_arc import profile_arc
from designer.export.dxf_document import dxf_document, text_of
from designer.export.housing_words import housing_words
from designer.files import InputError
from designer.trace.instrument import sag
from designer.trace.outline import housing_sections

# What every CAD program takes in the name of a layer.
_LAYER_NAME = re.compile(r"[A-Za-z0-9_. -]{1,100}")
# A drawing's own tolerance is some 1e-10 of its size.
LARGEST_MM = 1e6
_TEXT_HEIGHT_MM = 2.5
HOUSING_LAYER = "housing"


def dxf_drawing(design: Design) -> dict[str, str]:
    """The drawing, by the design's configuration. Each mirror has a layer for its face and one for its substrate.

    Raises
    ------
    InputError
        A profile or a name is none that a drawing can hold.
    """
    _check(design)
    with dxf_document() as drawing:
        for mirror in design.mirrors:
            _draw_mirror(drawing, mirror)
        _draw_housing(drawing, design)
        _draw_notes(drawing, design)
        return {design.configuration: text_of(drawing)}


def _check(design: Design) -> None:
    names = [mirror.name.lower() for mirror in design.mirrors]
    for mirror in design.mirrors:
        if not _LAYER_NAME.fullmatch(mirror.name) or names.count(mirror.name.lower()) > 1:
            raise InputError(
                f"mirror {mirror.name!r}: cannot name a layer; use letters, digits, _, - and full stops, and no "
                "two names that differ only in case"
            )
        largest = max(abs(mirror.vertex_mm), mirror.outer_radius_mm, mirror.thickness_mm)
        rim = abs(float(sag(mirror, mirror.outer_radius_mm)))
        if not (largest <= LARGEST_MM and rim <= LARGEST_MM):
            raise InputError(f"mirror {mirror.name}: larger than a drawing can hold (at most {LARGEST_MM:g} mm)")


def _draw_mirror(drawing: Any, mirror: Mirror) -> None:
    face, blank = f"{mirror.name} face", f"{mirror.name} substrate"
    drawing.layers.add(face, color=1)
    drawing.layers.add(blank, color=8)
    arc, space = profile_arc(mirror), drawing.modelspace()
    back = tuple((r, z + mirror.back_offset_mm) for r, z in arc.points)
    for points, layer in ((arc.points, face), (back, blank)):
        if mirror.radius_mm is None:
            space.add_line(points[0], points[2], dxfattribs={"layer": layer})
        else:
            curve = space.add_spline(dxfattribs={"layer": layer})
            curve.set_open_rational([(r, z, 0.0) for r, z in points], [1.0, arc.weight, 1.0], degree=2)
    for rim, behind in ((arc.points[0], back[0]), (arc.points[2], back[2])):
        space.add_line(rim, behind, dxfattribs={"layer": blank})


def _draw_housing(drawing: Any, design: Design) -> None:
    """The wall of a tube, or one strut, as a closed outline."""
    sections = housing_sections(design)
    if not sections:
        return
    if np.abs(sections[-1]).max() > LARGEST_MM:
        raise InputError(f"housing: larger than a drawing can hold (at most {LARGEST_MM:g} mm)")
    drawing.layers.add(HOUSING_LAYER, color=4)
    corners = [(float(r), float(z)) for r, z in sections[-1]]
    for start, end in pairwise(corners):
        drawing.modelspace().add_line(start, end, dxfattribs={"layer": HOUSING_LAYER})


def _draw_notes(drawing: Any, design: Design) -> None:
    """The axis, the pinhole, and what the drawing shows in words."""
    drawing.layers.add("axis", color=5)
    drawing.layers.add("notes", color=7)
    rims = [mirror.vertex_mm + float(sag(mirror, mirror.outer_radius_mm)) for mirror in design.mirrors]
    space = drawing.modelspace()
    low, high = min(0.0, *rims), max(0.0, *rims)
    space.add_line((0.0, low - 10.0), (0.0, high + 10.0), dxfattribs={"layer": "axis"})
    space.add_point((0.0, 0.0), dxfattribs={"layer": "axis"})
    lines = [
        " ".join(design.configuration.split()),
        "Half-profiles, all lengths in mm. x: distance from the axis; y: height above the pinhole (the point).",
        *(
            f"{mirror.name}: vertex {mirror.vertex_mm!r}, R {mirror.radius_mm if mirror.radius_mm else 'infinite'}, "
            f"K {mirror.conic!r}, from radius {mirror.inner_radius_mm!r} to {mirror.outer_radius_mm!r}, "
            f"reflecting side faces {mirror.faces}"
            for mirror in design.mirrors
        ),
        *housing_words(design),
    ]
    for number, line in enumerate(lines, 2):
        place = (0.0, low - 10.0 - 2.0 * _TEXT_HEIGHT_MM * number)
        text = space.add_text(line, height=_TEXT_HEIGHT_MM, dxfattribs={"layer": "notes"})
        text.set_placement(place)
