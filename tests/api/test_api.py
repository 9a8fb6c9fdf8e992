"""The API: what it computes is what the rooms below compute, and input that cannot be used ends in one line."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from designer import api
from designer.cli import cli
from designer.imaging.images import read_raw_image
from designer.imaging.stereo.placement import ImagePlacement
from designer.imaging.stereo.rig import point_cloud
from support import DATA, ROOT
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import coarse_prototype, prototype

TEXTURE = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
WALL = eccentric_wall(1700.0, 0.6)


@pytest.fixture(scope="module")
def image() -> np.ndarray:
    return raw_image(coarse_prototype(), WALL, TEXTURE, noise=2.0)


def test_importing_it_loads_nothing_heavy() -> None:
    heavy = ("scipy", "pandas", "matplotlib", "casadi", "cv2", "plotly", "numba", "typst")
    code = f"import sys, designer.api; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_every_name_is_documented() -> None:
    text = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    assert [name for name in api.__all__ if name not in text] == []


def test_a_design_survives_its_file(tmp_path: Path) -> None:
    api.write_design(tmp_path / "design.json", prototype())
    assert api.read_design(tmp_path / "design.json") == prototype()


def test_a_design_is_scored_as_its_mirrors_make_it() -> None:
    design = prototype()
    lower = design.views.lower.model_copy(update={"gain": 1.1 * design.views.lower.gain})
    claimed = design.model_copy(update={"views": design.views.model_copy(update={"lower": lower})})
    honest, corrected = api.evaluate(design), api.evaluate(claimed)
    assert honest.contradictions == ()
    assert [sentence for sentence in corrected.contradictions if "views.lower.gain" in sentence]
    assert corrected.depth_error_rms == pytest.approx(honest.depth_error_rms, rel=1e-6)
    assert honest.depth_error_worst > honest.depth_error_rms
    assert honest.limit_ratio >= 1.0


def test_a_rendered_image_is_that_of_the_command(tmp_path: Path) -> None:
    api.write_design(tmp_path / "design.json", coarse_prototype())
    words = ["render", str(tmp_path / "design.json"), "-o", str(tmp_path / "raw.png"), "--scene", "cylinder"]
    noise = ["--noise-electrons", "9", "--full-well-electrons", "5000", "--seed", "4", "--samples", "1"]
    assert CliRunner().invoke(cli, [*words, *noise]).exit_code == 0
    rendered = api.render(
        coarse_prototype(), "cylinder", samples=1, read_noise_electrons=9, full_well_electrons=5000, seed=4
    )
    np.testing.assert_array_equal(rendered, read_raw_image(tmp_path / "raw.png", coarse_prototype().camera))
    silent = api.render(coarse_prototype(), "cylinder", samples=1, seed=4)
    assert not np.array_equal(silent, rendered)


def test_one_rig_serves_many_images_and_files(tmp_path: Path, image: np.ndarray) -> None:
    rig = api.stereo_rig(coarse_prototype())
    first = api.reconstruct(rig, image)
    other = api.reconstruct(rig, image[::-1].copy())
    again = api.reconstruct(coarse_prototype(), image)
    api.write_image(tmp_path / "raw.png", image)
    from_file = api.reconstruct(rig, tmp_path / "raw.png")
    for found in (again, from_file):
        np.testing.assert_array_equal(found.cloud.positions_mm, first.cloud.positions_mm)
    assert not np.array_equal(other.matches.disparities, first.matches.disparities, equal_nan=True)
    # The wall stands where it was put.
    x, y, _ = first.cloud.positions_mm.T
    error = np.hypot(x, y) / WALL(np.arctan2(y, x)) - 1.0
    assert abs(np.median(error)) < 0.002
    assert np.median(np.abs(error)) < 0.02


def test_a_centre_is_found_and_used() -> None:
    truth = ImagePlacement((403.0, 297.0), np.radians(20.0), 0.98)
    image = raw_image(coarse_prototype(), WALL, TEXTURE, truth, noise=2.0)
    start = api.placement(coarse_prototype(), rotation_deg=20.0, scale=0.98)
    assert start.center_px == coarse_prototype().camera.principal_point_px
    found = api.find_center(coarse_prototype(), image, start)
    np.testing.assert_allclose(found.center_px, truth.center_px, atol=0.05)
    assert (found.rotation_rad, found.scale) == (truth.rotation_rad, truth.scale)
    centred = api.reconstruct(api.stereo_rig(coarse_prototype(), placement=found, columns=900), image)
    plain = api.reconstruct(api.stereo_rig(coarse_prototype(), placement=start, columns=900), image)
    assert len(plain.cloud.positions_mm) < 0.7 * len(centred.cloud.positions_mm)


def test_points_are_written_as_ply(tmp_path: Path, image: np.ndarray) -> None:
    cloud = api.reconstruct(api.stereo_rig(coarse_prototype(), columns=450), image).cloud
    api.write_point_cloud(tmp_path / "points.ply", cloud)
    header = (tmp_path / "points.ply").read_bytes().partition(b"end_header")[0].decode()
    assert f"element vertex {len(cloud.positions_mm)}\n" in header


DRAWINGS = {
    "cross_section": lambda: api.draw_cross_section(prototype()),
    "image_layout": lambda: api.draw_image_layout(prototype()),
    "resolution": lambda: api.draw_resolution(prototype()),
    "virtual_images": lambda: api.draw_virtual_images(prototype(), prototype()),
    "depth_error": lambda: api.draw_depth_error(prototype()),
    "depth_map": lambda: api.draw_depth_map(prototype(), image_circle_px=100),
    "single_mirror_principles": api.draw_single_mirror_principles,
    "folded_principle": api.draw_folded_principle,
}


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_shows_itself_once_and_saves_itself(name: str, tmp_path: Path) -> None:
    drawing = DRAWINGS[name]()
    vector, pixels = drawing._repr_svg_(), drawing._repr_png_()
    assert (vector is None) != (pixels is None)
    assert vector is None or vector.rstrip().endswith("</svg>")
    assert pixels is None or pixels.startswith(b"\x89PNG")
    starts = {"svg": b"<?xml", "pdf": b"%PDF", "png": b"\x89PNG"}
    for kind, start in starts.items():
        drawing.save(tmp_path / f"drawing.{kind}")
        assert (tmp_path / f"drawing.{kind}").read_bytes().startswith(start)
    with pytest.raises(api.InputError, match=r"must end in \.svg, \.pdf, \.png"):
        drawing.save(tmp_path / "drawing.gif")


def test_images_and_points_are_drawn(image: np.ndarray) -> None:
    rig = api.stereo_rig(coarse_prototype(), columns=450)
    found = api.reconstruct(rig, image)
    compared = api.compare_equalisation(rig, image)
    assert set(compared.rejected) == {"bilinear", "smoothed_alike", "equalised"}
    drawings = [
        api.draw_raw(image),
        api.draw_kernels(rig, image),
        api.draw_panoramas(found),
        api.draw_equalisation(compared, columns=(100, 200)),
        api.draw_point_cloud(found.cloud, coarse_prototype()),
        api.draw_floor_plan(found.cloud, (-100.0, 100.0), 5000.0),
    ]
    assert len({drawing._repr_png_() for drawing in drawings}) == len(drawings)


def test_colours_of_an_image_are_drawn_as_they_are() -> None:
    blue = np.zeros((60, 80, 3), np.uint8)
    blue[..., 0] = 255  # OpenCV's order
    (axes,) = api.draw_raw(blue).figure.axes
    np.testing.assert_array_equal(axes.images[0].get_array()[0, 0], [0, 0, 255])


def test_multipliers_say_what_a_taller_envelope_is_worth() -> None:
    asked = api.requirement(ROOT / "configs/indoor_robot.toml", solve__starts=4, sharpness__max_blur_deg=1.0)
    name = "folded-HyPl-Hy-upper_outer"
    slopes = api.multipliers(asked, name)
    assert slopes["envelope.height_mm"] <= 0.0
    assert slopes["working_volume.distance_mm.1"] > 0.0
    with pytest.raises(api.InputError, match="is not a configuration of this requirement"):
        api.multipliers(asked, "folded-XyPl-Hy-upper_outer")


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((600, 801), np.uint8), r"shape \(600, 801\)"),
        (np.zeros((600, 800)), "float64"),
        (DATA / "folded_hypl_hy.json", "not a readable image"),
        ("no_such_file.png", "cannot be read"),
    ],
)
def test_images_that_cannot_be_used_are_refused(image: Any, message: str) -> None:
    with pytest.raises(api.InputError, match=message):
        api.reconstruct(coarse_prototype(), image)


def test_options_that_cannot_be_used_are_refused(image: np.ndarray) -> None:
    rig = api.stereo_rig(coarse_prototype(), columns=450, equalise=False)
    with pytest.raises(api.InputError, match="built without equalisation"):
        api.compare_equalisation(rig, image)
    with pytest.raises(api.InputError, match="built without equalisation"):
        api.draw_kernels(rig, image)
    with pytest.raises(api.InputError, match="read noise"):
        api.render(coarse_prototype(), read_noise_electrons=-1)
    with pytest.raises(api.InputError, match="scene"):
        api.render(coarse_prototype(), "no_such_scene")


def test_points_have_the_colours_of_the_panorama_whichever_way_they_are_made(image: np.ndarray) -> None:
    rig = api.stereo_rig(coarse_prototype(), columns=450)
    found = api.reconstruct(rig, image)
    alone = point_cloud(rig, image, found.matches)
    np.testing.assert_array_equal(alone.colours, found.cloud.colours)
    np.testing.assert_array_equal(alone.colours[:, 0], found.upper[alone.rows, alone.columns])
