"""Optiland's files: it loads them and traces the full pupil to our points."""

import json
from pathlib import Path

import numpy as np
import pytest
from sequential_rays import check_against_optiland, pupil_rays

from designer.export.optiland import optiland_files
from designer.export.sequential import sequential_views
from support.studied_designs import NAMES, studied_design


@pytest.mark.parametrize("name", NAMES)
def test_optiland_traces_our_rays_to_our_points(name: str, tmp_path: Path) -> None:
    fileio = pytest.importorskip("optiland.fileio", reason="optiland, the independent tracer, is not installed")
    design = studied_design(name)
    views = sequential_views(design)
    for view_name, text in optiland_files(design).items():
        path = tmp_path / f"{view_name}.json"
        path.write_text(text, encoding="utf-8")
        view, optic = views[view_name], fileio.load_optiland_file(str(path))
        rays = pupil_rays(design, view_name, view.sensor_heights_mm, view.wall_mm)
        check_against_optiland(optic, rays, tolerance_mm=1e-9)
        # Its own fields and pupil, without a ray of ours: chief rays leave at the elevations of the fields.
        for elevation, height in zip(view.elevations_deg, view.sensor_heights_mm, strict=True):
            chief = optic.trace_generic(0.0, height / optic.fields.max_field, 0.0, 0.0, 0.55)
            assert float(np.degrees(np.arctan2(chief.N, chief.M))[0]) == pytest.approx(elevation, abs=1e-7)


@pytest.mark.parametrize("name", NAMES[:2])
def test_surfaces_stand_where_the_design_has_them(name: str) -> None:
    design = studied_design(name)
    for view_name, text in optiland_files(design).items():
        system = json.loads(text)
        _, lens, *mirrors, wall = system["surface_group"]["surfaces"]
        assert "mm" in system["name"]
        assert lens["is_stop"]
        for surface, mirror_name in zip(mirrors, design.views.by_name[view_name].path, strict=True):
            mirror = design.mirror(mirror_name)
            assert surface["geometry"]["cs"]["z"] == mirror.vertex_mm
            assert surface["geometry"]["radius"] == (mirror.radius_mm or np.inf)
            assert (surface["aperture"]["r_min"], surface["aperture"]["r_max"]) == (
                mirror.inner_radius_mm,
                mirror.outer_radius_mm,
            )
        viewpoint = design.views.by_name[view_name].viewpoint_mm
        assert wall["geometry"]["cs"]["z"] == pytest.approx(viewpoint, abs=1e-6)
