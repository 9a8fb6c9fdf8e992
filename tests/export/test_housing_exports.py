"""Housings in the formats that hold them, read back; and in the others said to be left out."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from designer.export.formats import exported_files
from designer.export.order.words import parts_list, read_me
from designer.export.stl import housing_meshes
from designer.files import InputError
from support.housings import with_struts, with_tube
from support.studied_designs import SHARP_NAMES, sharp_design

DESIGN = sharp_design(SHARP_NAMES[2])
TUBE, STRUTS = with_tube(DESIGN, wall_mm=2.5), with_struts(DESIGN, number=3, width_mm=5.0)


def volume_of(mesh) -> float:
    """By the divergence theorem."""
    a, b, c = (mesh.corners_mm[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)


def test_triangles_close_solids_of_the_right_volume_in_their_places():
    tube = TUBE.tube
    (mesh,) = housing_meshes(TUBE).values()
    ring = np.pi * (tube.outer_radius_mm**2 - tube.inner_radius_mm**2) * (tube.high_mm - tube.low_mm)
    assert volume_of(mesh) == pytest.approx(ring, rel=1e-3)
    radii = np.hypot(mesh.corners_mm[:, 0], mesh.corners_mm[:, 1])
    assert set(np.round(radii, 9)) == {round(tube.inner_radius_mm, 9), round(tube.outer_radius_mm, 9)}
    rods = housing_meshes(STRUTS)
    assert list(rods) == ["strut_1", "strut_2", "strut_3"]
    height = STRUTS.housing.high_mm - STRUTS.housing.low_mm
    for place, rod in enumerate(rods.values()):
        assert volume_of(rod) == pytest.approx(np.pi * 2.5**2 * height, rel=1e-3)
        azimuth = 2.0 * np.pi * place / 3.0
        middle = STRUTS.housing.radius_mm * np.array([np.cos(azimuth), np.sin(azimuth)])
        off = np.linalg.norm(rod.corners_mm[:, :2] - middle, axis=1)
        assert off.max() == pytest.approx(2.5)
    # Every edge of the triangles has one neighbour on either side.
    edges = np.concatenate([mesh.triangles[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    assert len({tuple(edge) for edge in edges}) == len(edges)
    assert {tuple(edge) for edge in edges} == {tuple(edge[::-1]) for edge in edges}
    assert "tube.stl" in exported_files(TUBE, "stl")


def test_a_drawing_for_cad_has_the_wall_and_every_dimension_in_words():
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf, which writes and reads DXF, is not installed")
    (content,) = exported_files(TUBE, "dxf").values()
    space = ezdxf.read(io.StringIO(content)).modelspace()
    lines = [line for line in space.query("LINE") if line.dxf.layer == "housing"]
    corners = {(round(p.x, 9), round(p.y, 9)) for line in lines for p in (line.dxf.start, line.dxf.end)}
    tube = TUBE.tube
    expected = {(r, z) for r in (tube.inner_radius_mm, tube.outer_radius_mm) for z in (tube.low_mm, tube.high_mm)}
    assert corners == {(round(r, 9), round(z, 9)) for r, z in expected}
    words = " ".join(text.dxf.text for text in space.query("TEXT"))
    assert f"inner radius {tube.inner_radius_mm!r}, wall 2.5" in words


def test_step_has_the_tube_and_the_struts(tmp_path: Path):
    pytest.importorskip("OCP", reason="the CAD kernel (cadquery-ocp-novtk), which writes STEP, is not installed")
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    def volume(content: bytes) -> float:
        (tmp_path / "part.step").write_bytes(content)
        reader = STEPControl_Reader()
        reader.ReadFile(str(tmp_path / "part.step"))
        reader.TransferRoots()
        found = GProp_GProps()
        BRepGProp.VolumeProperties_s(reader.OneShape(), found)
        return found.Mass()

    files = exported_files(TUBE, "step")
    assert volume(files["tube.step"]) == pytest.approx(TUBE.tube.volume_mm3, rel=1e-6)
    files = exported_files(STRUTS, "step")
    rods = [volume(files[f"strut_{place}.step"]) for place in (1, 2, 3)]
    assert sum(rods) == pytest.approx(STRUTS.housing.volume_mm3, rel=1e-6)
    parts = [volume(files[f"{mirror.name}.step"]) for mirror in DESIGN.mirrors]
    camera = DESIGN.camera
    barrel = np.pi * camera.lens_radius_mm**2 * camera.lens_length_mm
    assert volume(files["assembly.step"]) == pytest.approx(sum(parts) + sum(rods) + barrel, rel=1e-6)


@pytest.mark.parametrize("name", ["zmx", "povray"])
def test_formats_without_it_say_so_in_the_file(name):
    for design, words in ((TUBE, "its wall shifts every ray"), (STRUTS, "they hide some azimuths")):
        for content in exported_files(design, name).values():
            assert words in str(content)
    assert not any("Not in this file: the tube" in str(each) for each in exported_files(DESIGN, name).values())


def test_a_mirror_of_the_tubes_name_is_refused():
    (first, *others) = TUBE.mirrors
    renamed = TUBE.model_copy(update={"mirrors": (first.model_copy(update={"name": "tube"}), *others)})
    with pytest.raises(InputError, match="a part of the housing has this name"):
        exported_files(renamed, "stl")


def test_an_order_lists_the_tube_with_its_mass_and_what_is_open():
    rows = list(csv.DictReader(io.StringIO(parts_list(TUBE))))
    (row,) = [row for row in rows if row["part"].startswith("tube")]
    ring = np.pi * (TUBE.tube.outer_radius_mm**2 - TUBE.tube.inner_radius_mm**2) * TUBE.tube.length_mm
    assert float(row["mass_g"]) == pytest.approx(1.19e-3 * ring, abs=0.01)
    (struts,) = [row for row in csv.DictReader(io.StringIO(parts_list(STRUTS))) if row["part"].startswith("strut")]
    assert struts["quantity"] == "3"
    assert "without correction its wall would shift depth by" in read_me(TUBE, [], {}, [])
    assert "the design has none" in read_me(DESIGN, [], {}, [])
