"""Zemax files, read again: by a reader and tracer of this page alone, and by optiland."""

from pathlib import Path

import numpy as np
import pytest
from sequential_rays import check_against_optiland, pupil_rays, reflected

from designer.export.sequential import sequential_views
from designer.export.zmx import zmx_files
from designer.files import InputError
from support.studied_designs import NAMES, studied_design


def surfaces_of(text: str) -> tuple[dict[str, list[str]], list[dict[str, list[str]]]]:
    """Words by operand, parameters by number too: of the head, and of each surface."""
    head: dict[str, list[str]] = {}
    surfaces: list[dict[str, list[str]]] = []
    for line in text.splitlines():
        operand, *words = line.split()
        if operand == "SURF":
            assert int(words[0]) == len(surfaces)
            surfaces.append({})
        else:
            key = f"PARM {words.pop(0)}" if operand == "PARM" else operand
            (surfaces[-1] if surfaces else head)[key] = words
    return head, surfaces


@pytest.mark.parametrize("name", NAMES)
def test_chief_rays_leave_at_the_elevations_of_the_fields(name: str) -> None:
    """Light from the field's sensor point, through the lens's centre and the file's own conics, meets the wall at
    distance times the tangent of the elevation: the view has a single viewpoint, and it is where the wall's zero is."""
    design = studied_design(name)
    for view_name, text in zmx_files(design).items():
        view = design.views.by_name[view_name]
        head, (sensor, lens, *mirrors, turn, _) = surfaces_of(text)
        assert head["UNIT"][0] == "MM"
        assert (lens["TYPE"], turn["TYPE"], turn["PARM 3"]) == (
            ["PARAXIAL"],
            ["COORDBRK"],
            ["90.0"] if len(mirrors) == 1 else ["-90.0"],
        )
        assert float(turn["DISZ"][0]) == 0.0
        assert float(head["ENPD"][0]) == pytest.approx(2.0 * design.camera.pupil_radius_mm, rel=1e-15)
        sensor_y = np.array(head["YFLN"], dtype=float)
        ahead = np.stack([0.0 * sensor_y, -sensor_y, 0.0 * sensor_y + float(sensor["DISZ"][0])], axis=-1)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        point, height = np.zeros_like(ahead), float(lens["DISZ"][0])
        for mirror, record in zip(mirrors, view.path, strict=True):
            assert mirror["GLAS"][0] == "MIRROR"
            point, ahead = reflected(point, ahead, height, float(mirror["CURV"][0]), float(mirror["CONI"][0]))
            inner, outer = (float(word) for word in mirror["CLAP"][:2])
            assert (inner, outer) == (design.mirror(record).inner_radius_mm, design.mirror(record).outer_radius_mm)
            radius = np.hypot(point[:, 0], point[:, 1])
            assert ((radius >= inner) & (radius <= outer)).all()
            height += float(mirror["DISZ"][0])
        distance = float(turn["PARM 2"][0])
        at_wall = point + ((distance - point[:, 1]) / ahead[:, 1])[:, None] * ahead
        elevations = np.radians(np.linspace(*view.elevation_deg, len(sensor_y)))
        assert (ahead[:, 1] > 0.0).all()
        assert at_wall[:, 2] - height == pytest.approx(distance * np.tan(elevations), abs=1e-6 * distance)


@pytest.mark.parametrize("name", NAMES)
def test_optiland_reads_it_and_traces_the_full_pupil_to_our_points(name: str, tmp_path: Path) -> None:
    fileio = pytest.importorskip("optiland.fileio", reason="optiland, the independent reader, is not installed")
    design = studied_design(name)
    views = sequential_views(design)
    for view_name, text in zmx_files(design).items():
        path = tmp_path / f"{view_name}.zmx"
        path.write_text(text, encoding="ascii", newline="")
        rays = pupil_rays(design, view_name, views[view_name].sensor_heights_mm, views[view_name].wall_mm)
        check_against_optiland(fileio.load_zemax_file(str(path)), rays, tolerance_mm=1e-9)


def test_a_view_that_does_not_see_its_range_is_refused() -> None:
    design = studied_design(NAMES[0])
    blind = design.views.upper.model_copy(update={"elevation_deg": (-10.0, 95.0)})
    views = design.views.model_copy(update={"upper": blind})
    with pytest.raises(InputError, match=r"views\.upper: no ray .* at an elevation of"):
        zmx_files(design.model_copy(update={"views": views}))
