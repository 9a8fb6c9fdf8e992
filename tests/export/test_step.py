"""STEP files, read again by Open CASCADE: valid solids in mm, of the right volume, exactly on the conic."""

import math
from pathlib import Path

import numpy as np
import pytest

from designer.design import Mirror
from designer.export.step import step_solids
from designer.files import InputError
from designer.trace.instrument import sag
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design

pytest.importorskip("OCP", reason="the CAD kernel (cadquery-ocp-novtk), which writes and reads STEP, is not installed")

DESIGNS = [
    sharp_design(SHARP_NAMES[1]),
    studied_design(NAMES[5]),
    studied_design(NAMES[11]),
    studied_design(NAMES[12]),
]


def read_solid(content: bytes, folder: Path):
    """The one solid of a file, read in mm."""
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    path = folder / "mirror.step"
    path.write_bytes(content)
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_RetDone
    assert reader.TransferRoots() == 1
    return reader.OneShape()


def volume(solid) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, found)
    return found.Mass()


def points_on(solid) -> list[np.ndarray]:
    """Points (n, 3) of each face of a solid, over its whole range of parameters."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    faces, found = TopExp_Explorer(solid, TopAbs_FACE), []
    while faces.More():
        surface = BRepAdaptor_Surface(TopoDS.Face(faces.Current()))
        us = np.linspace(surface.FirstUParameter(), surface.LastUParameter(), 9)
        vs = np.linspace(surface.FirstVParameter(), surface.LastVParameter(), 41)
        points = [surface.Value(float(u), float(v)) for u in us for v in vs]
        found.append(np.array([(p.X(), p.Y(), p.Z()) for p in points]))
        faces.Next()
    return found


def vertices_of(solid) -> np.ndarray:
    """The ends (n, 3) of a solid's edges."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_VERTEX
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    vertices, found = TopExp_Explorer(solid, TopAbs_VERTEX), []
    while vertices.More():
        point = BRep_Tool.Pnt_s(TopoDS.Vertex(vertices.Current()))
        found.append((point.X(), point.Y(), point.Z()))
        vertices.Next()
    return np.array(found)


def extent_along_axis(mirror: Mirror) -> float:
    """From the lowest rim to the highest."""
    rims = [float(sag(mirror, radius)) for radius in (mirror.inner_radius_mm, mirror.outer_radius_mm)]
    return float(np.ptp(rims)) + mirror.thickness_mm


def distance_from_conic(mirror: Mirror, points: np.ndarray, offset: float) -> np.ndarray:
    """First-order distance (n,) of points (n, 3) from the face shifted by ``offset``."""
    curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
    radius, z, k = np.hypot(points[:, 0], points[:, 1]), points[:, 2] - mirror.vertex_mm - offset, 1.0 + mirror.conic
    value = curvature * (radius**2 + k * z**2) - 2.0 * z
    return np.abs(value / np.hypot(2.0 * curvature * radius, 2.0 * curvature * k * z - 2.0))


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_open_cascade_reads_exact_solids_back(design, tmp_path: Path) -> None:
    contents = step_solids(design)
    assert list(contents) == [*(mirror.name for mirror in design.mirrors), "assembly"]
    assert contents == step_solids(design)
    for mirror in design.mirrors:
        solid = read_solid(contents[mirror.name], tmp_path)
        # Pappus: the base ring's area times the thickness, as face and back are the same curve.
        ring = math.pi * (mirror.outer_radius_mm**2 - mirror.inner_radius_mm**2)
        assert volume(solid) == pytest.approx(ring * mirror.thickness_mm, rel=1e-6)
        faces = points_on(solid)
        assert len(faces) == 4
        for offset in (0.0, mirror.back_offset_mm):
            on_conic = [points for points in faces if distance_from_conic(mirror, points, offset).max() < 1e-9]
            assert len(on_conic) == 1
        corners = vertices_of(solid)
        radii = np.hypot(corners[:, 0], corners[:, 1])
        assert (radii.min(), radii.max()) == pytest.approx((mirror.inner_radius_mm, mirror.outer_radius_mm), abs=1e-9)
        assert np.ptp(corners[:, 2]) == pytest.approx(extent_along_axis(mirror), abs=1e-9)


def test_a_mirror_without_a_hole_closes_on_the_axis(tmp_path: Path) -> None:
    mirror = DESIGNS[1].mirrors[0].model_copy(update={"inner_radius_mm": 0.0})
    content = step_solids(DESIGNS[1].model_copy(update={"mirrors": (mirror,)}))[mirror.name]
    expected = math.pi * mirror.outer_radius_mm**2 * mirror.thickness_mm
    assert volume(read_solid(content, tmp_path)) == pytest.approx(expected, rel=1e-6)


def test_what_is_no_solid_is_refused() -> None:
    mirror = DESIGNS[0].mirrors[0].model_copy(update={"thickness_mm": 0.0})
    with pytest.raises(InputError, match="no thickness"):
        step_solids(DESIGNS[0].model_copy(update={"mirrors": (mirror,)}))


def read_assembly(content: bytes, folder: Path):
    """The parts of an assembly in their places, by name."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    path = folder / "assembly.step"
    path.write_bytes(content)
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    assert reader.Perform(str(path), document)
    whole, parts = Sequence_TDF_Label(), Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(whole)
    assert whole.Length() == 1
    assert XCAFDoc_ShapeTool.GetComponents_s(whole.Value(1), parts)
    found = {}
    for index in range(1, parts.Length() + 1):
        name = TDataStd_Name()
        assert parts.Value(index).FindAttribute(TDataStd_Name.GetID_s(), name)
        found[name.Get().ToExtString()] = XCAFDoc_ShapeTool.GetShape_s(parts.Value(index))
    return found


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_the_assembly_has_every_part_in_its_place(design, tmp_path: Path) -> None:
    camera = design.camera
    parts = read_assembly(step_solids(design)["assembly"], tmp_path)
    assert list(parts) == [*(mirror.name for mirror in design.mirrors), "lens barrel"]
    for mirror in design.mirrors:
        ring = math.pi * (mirror.outer_radius_mm**2 - mirror.inner_radius_mm**2)
        assert volume(parts[mirror.name]) == pytest.approx(ring * mirror.thickness_mm, rel=1e-6)
        rims = [mirror.vertex_mm + float(sag(mirror, r)) for r in (mirror.inner_radius_mm, mirror.outer_radius_mm)]
        ends = [height + offset for height in rims for offset in (0.0, mirror.back_offset_mm)]
        heights = vertices_of(parts[mirror.name])[:, 2]
        assert (heights.min(), heights.max()) == pytest.approx((min(ends), max(ends)), abs=1e-9)
    barrel = vertices_of(parts["lens barrel"])
    assert volume(parts["lens barrel"]) == pytest.approx(math.pi * camera.lens_radius_mm**2 * camera.lens_length_mm)
    assert (barrel[:, 2].min(), barrel[:, 2].max()) == pytest.approx((camera.lens_seat_mm, camera.lens_front_mm))


def test_a_mirror_named_as_the_assembly_is_refused() -> None:
    mirror = DESIGNS[0].mirrors[0].model_copy(update={"name": "Assembly"})
    with pytest.raises(InputError, match="give the mirror another"):
        step_solids(DESIGNS[0].model_copy(update={"mirrors": (mirror,)}))
