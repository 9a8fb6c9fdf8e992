"""Solids of the mirrors with exact surfaces (``.step``, AP214), in mm, each in its place above the pinhole.

The outline of half a section, two exact arcs of a conic and two straight edges, is turned about the axis by the CAD
kernel Open CASCADE. Its surfaces of revolution are the conics themselves, not approximations. The assembly has each
mirror as a part with its name, the housing and the lens barrel.
"""

from __future__ import annotations

import itertools
import math
import re
import tempfile
from pathlib import Path
from typing import Any

from designer.design import Design, Mirror
from designer.export.assembly_name import ASSEMBLY, check_names_of_parts, housing_parts
from designer.export.conic_arc import LARGEST_MM, LEAST_MM, ConicArc, check_solid, profile_arc
from designer.files import InputError
from designer.housing import Struts, Tube

_WRITTEN_AT = re.compile(rb"'\d{4}-\d\d-\d\dT[\d:]+'")
_PLAIN = re.compile(r"[A-Za-z0-9_. -]{1,100}")
_PLACED = re.compile(rb"(?<=NEXT_ASSEMBLY_USAGE_OCCURRENCE\(')\d+")
_PART = "mirror"
_NO_TIME = b"'1970-01-01T00:00:00'"


def step_solids(design: Design) -> dict[str, bytes]:
    """The solids of a design's mirrors and housing, by their names; last the assembly. Same design, same bytes.

    Raises
    ------
    InputError
        A mirror is none that the kernel can build, or has the assembly's name.
    """
    check_names_of_parts(design)
    solids = {mirror.name: mirror_solid(mirror) for mirror in design.mirrors} | _housing(design)
    files = {name: _file(solid, name) for name, solid in solids.items()}
    return files | {ASSEMBLY: _assembly(solids | _barrel(design))}


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


def _housing(design: Design) -> dict[str, Any]:
    """The tube as a hollow cylinder, or each strut as a round rod, by their names; nothing without a housing."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    housing = design.housing
    if housing is None:
        return {}
    if isinstance(housing, Tube):
        outer, inner = (_rod(0.0, 0.0, each, housing) for each in (housing.outer_radius_mm, housing.inner_radius_mm))
        return {"tube": BRepAlgoAPI_Cut(outer, inner).Shape()}
    rods = {}
    for name, azimuth in zip(housing_parts(design), map(math.radians, housing.azimuths_deg), strict=True):
        x, y = housing.radius_mm * math.cos(azimuth), housing.radius_mm * math.sin(azimuth)
        rods[name] = _rod(x, y, housing.width_mm / 2.0, housing)
    return rods


def _rod(x: float, y: float, radius: float, housing: Tube | Struts) -> Any:
    """A vertical cylinder as tall as the housing."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    if min(radius, housing.length_mm) < LEAST_MM or max(radius, abs(housing.low_mm), abs(housing.high_mm)) > LARGEST_MM:
        raise InputError(f"housing: its lengths must be between {LEAST_MM:g} and {LARGEST_MM:g} mm")
    foot = gp_Ax2(gp_Pnt(x, y, housing.low_mm), gp_Dir(0.0, 0.0, 1.0))
    return BRepPrimAPI_MakeCylinder(foot, radius, housing.length_mm).Shape()


def _barrel(design: Design) -> dict[str, Any]:
    """The lens barrel as a plain cylinder, from its seat to its front; nothing if it has no length."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    camera = design.camera
    if not camera.lens_length_mm:
        return {}
    sizes = (camera.lens_length_mm, camera.lens_radius_mm)
    if min(sizes) < LEAST_MM or max(*sizes, abs(camera.lens_front_mm)) > LARGEST_MM:
        raise InputError(f"the lens barrel: its lengths must be between {LEAST_MM:g} and {LARGEST_MM:g} mm")
    seat = gp_Ax2(gp_Pnt(0.0, 0.0, camera.lens_seat_mm), gp_Dir(0.0, 0.0, 1.0))
    return {"lens barrel": BRepPrimAPI_MakeCylinder(seat, camera.lens_radius_mm, camera.lens_length_mm).Shape()}


def _file(solid: Any, name: str) -> bytes:
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    _be_quiet()
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    Interface_Static.SetCVal_s("write.step.product.name", _PART)
    writer.Transfer(solid, STEPControl_AsIs)
    # A running number would make every file of the same design another one.
    return re.sub(rb"'%b \d+'" % _PART.encode("ascii"), f"'{_shown(name)}'".encode("ascii"), _written(writer, name))


def _assembly(solids: dict[str, Any]) -> bytes:
    """Solids as named parts of one product."""
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    whole = shapes.NewShape()
    TDataStd_Name.Set_s(whole, TCollection_ExtendedString(ASSEMBLY))
    for name, solid in solids.items():
        part = shapes.AddShape(solid, False)
        for label in (part, shapes.AddComponent(whole, part, TopLoc_Location())):
            TDataStd_Name.Set_s(label, TCollection_ExtendedString(_shown(name)))
    shapes.UpdateAssemblies()
    _be_quiet()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.SetNameMode(True)
    writer.Transfer(document)
    # The kernel numbers the parts that it has placed so far, those of other files too.
    numbers = itertools.count(1)
    return _PLACED.sub(lambda _: b"%d" % next(numbers), _written(writer, "the assembly"))


def _shown(name: str) -> str:
    return name if _PLAIN.fullmatch(name) else _PART


def _be_quiet() -> None:
    from OCP.Message import Message, Message_Gravity

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)


def _written(writer: Any, name: str) -> bytes:
    """What a writer of the kernel writes, without the time at which it did."""
    from OCP.IFSelect import IFSelect_RetDone

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"
        if writer.Write(str(path)) != IFSelect_RetDone:
            raise InputError(f"{name}: the CAD kernel cannot write it")
        return _WRITTEN_AT.sub(_NO_TIME, path.read_bytes(), count=1)
