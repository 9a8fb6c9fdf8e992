"""Solids of the mirrors with exact surfaces (``.step``, AP214), in mm, each in its place above the pinhole.

The outline of half a section, two exact arcs of a conic and two straight edges, is turned about the axis by the CAD
kernel Open CASCADE. Its surfaces of revolution are the conics themselves, not approximations.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

from designer.design import Design, Mirror
from designer.export.conic_arc import ConicArc, check_solid, profile_arc
from designer.files import InputError

_WRITTEN_AT = re.compile(rb"'\d{4}-\d\d-\d\dT[\d:]+'")
_PLAIN = re.compile(r"[A-Za-z0-9_. -]{1,100}")
_PART = "mirror"
_NO_TIME = b"'1970-01-01T00:00:00'"


def step_solids(design: Design) -> dict[str, bytes]:
    """The solid of each mirror of a design, by the mirror's name; the same design gives the same bytes.

    Raises
    ------
    InputError
        A mirror is none that the kernel can build.
    """
    return {mirror.name: _file(mirror_solid(mirror), mirror.name) for mirror in design.mirrors}


def mirror_solid(mirror: Mirror) -> Any:
    """A mirror as a solid of the kernel.

    Raises
    ------
    InputError
        The mirror has no thickness, is too small or too large, or the kernel finds no closed solid.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    check_solid(mirror)
    face, offset = profile_arc(mirror), mirror.back_offset_mm
    back = ConicArc(tuple((r, z + offset) for r, z in face.points), face.weight)  # type: ignore[arg-type]
    wire = BRepBuilderAPI_MakeWire()
    for edge in (
        _arc_edge(face),
        _straight_edge(face.points[2], back.points[2]),
        _arc_edge(back),
        _straight_edge(face.points[0], back.points[0]),
    ):
        wire.Add(edge)
    axis = gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    solid = BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), axis).Shape()
    if not BRepCheck_Analyzer(solid).IsValid():
        raise InputError(f"mirror {mirror.name}: the CAD kernel finds no closed solid")
    return solid


def _point(point: tuple[float, float]) -> Any:
    from OCP.gp import gp_Pnt

    return gp_Pnt(point[0], 0.0, point[1])


def _straight_edge(start: tuple[float, float], end: tuple[float, float]) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

    return BRepBuilderAPI_MakeEdge(_point(start), _point(end)).Edge()


def _arc_edge(arc: ConicArc) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.collections import Array1_double, Array1_gp_Pnt
    from OCP.Geom import Geom_BezierCurve

    start, _, end = arc.points
    if arc.weight == 1.0 and start[1] == end[1]:  # a plane's
        return _straight_edge(start, end)
    points, weights = Array1_gp_Pnt(1, 3), Array1_double(1, 3)
    for index, (point, weight) in enumerate(zip(arc.points, (1.0, arc.weight, 1.0), strict=True), 1):
        points.SetValue(index, _point(point))
        weights.SetValue(index, weight)
    return BRepBuilderAPI_MakeEdge(Geom_BezierCurve(points, weights)).Edge()


def _file(solid: Any, name: str) -> bytes:
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Interface import Interface_Static
    from OCP.Message import Message, Message_Gravity
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    Interface_Static.SetCVal_s("write.step.product.name", _PART)
    writer.Transfer(solid, STEPControl_AsIs)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mirror.step"
        if writer.Write(str(path)) != IFSelect_RetDone:
            raise InputError(f"mirror {name}: the CAD kernel cannot write it")
        content = path.read_bytes()
    # The time of writing and a running number would make every file of the same design another one.
    shown = name if _PLAIN.fullmatch(name) else _PART
    content = re.sub(rb"'%b \d+'" % _PART.encode("ascii"), f"'{shown}'".encode("ascii"), content)
    return _WRITTEN_AT.sub(_NO_TIME, content, count=1)
