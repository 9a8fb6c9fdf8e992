"""The design file: what is read, and what is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from designer.design import PerView, design_to_json, read_design, write_design
from designer.files import InputError

PROTOTYPE = Path(__file__).parent / "data" / "folded_hypl_hy.json"


def with_value(keys: tuple[str | int, ...], value: object) -> dict[str, Any]:
    """The prototype's record with one value replaced."""
    record = json.loads(PROTOTYPE.read_text(encoding="utf-8"))
    part = record
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    return record


def refusal(text: str, folder: Path) -> str:
    path = folder / "design.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_design(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("camera", "focal_length_mm"), "12.0", "camera.focal_length_mm = '12.0': must be a valid number"),
        (("camera", "focal_length_mm"), True, "camera.focal_length_mm = True: must be a valid number"),
        (("camera", "image_circle_radius_px"), "600", "camera.image_circle_radius_px = '600': must be a valid number"),
        (("camera", "width_px"), "1600", "camera.width_px = '1600': must be a valid integer"),
        (("camera", "width_px"), True, "camera.width_px = True: must be a valid integer"),
        (("camera", "height_px"), 1200.5, "camera.height_px = 1200.5: must be a valid integer"),
        (("camera", "height_px"), 10**400, "must be less than or equal to 1000000"),
        (("mirrors", 1, "radius_mm"), "-12.8", "mirrors.1.radius_mm = '-12.8': must be a valid number"),
        (("mirrors", 1, "conic"), False, "mirrors.1.conic = False: must be a valid number"),
        (("mirrors", 1, "vertex_mm"), 10**400, "mirrors.1.vertex_mm = 1000000"),
        (("views", "upper", "gain"), None, "views.upper.gain = None: must be a valid number"),
        (("views", "upper", "elevation_deg"), [True, 10], "views.upper.elevation_deg.0 = True: must be a valid number"),
        (("working_volume", "distance_mm"), ["1000", 5000], "working_volume.distance_mm.0 = '1000'"),
        (("noise_px",), float("nan"), "noise_px = nan: must be a finite number"),
        (("zone_gap_px",), "0", "zone_gap_px = '0': must be a valid number"),
        (("schema",), True, "schema = True: must be 1"),
    ],
)
def test_only_numbers_are_numbers(keys, value, words: str, tmp_path: Path):
    assert words in refusal(json.dumps(with_value(keys, value)), tmp_path)


def test_whole_numbers_are_numbers(tmp_path: Path):
    path = tmp_path / "design.json"
    path.write_text(json.dumps(with_value(("camera", "focal_length_mm"), 12)), encoding="utf-8")
    assert read_design(path) == read_design(PROTOTYPE)


def test_a_number_too_long_to_read(tmp_path: Path):
    text = json.dumps(with_value(("noise_px",), 7)).replace('"noise_px": 7', '"noise_px": ' + "7" * 5000)
    assert "thousands of digits" in refusal(text, tmp_path)


def test_what_is_written_is_read_again(tmp_path: Path):
    design = read_design(PROTOTYPE)
    write_design(design, tmp_path / "again.json")
    assert read_design(tmp_path / "again.json") == design


@pytest.mark.parametrize(("circle_px", "radius_px"), [(None, 600), (580.0, 580), (1000.0, 1000), (1e300, 1000)])
def test_the_usable_image_ends_with_the_sensor(circle_px, radius_px: float, tmp_path: Path):
    path = tmp_path / "design.json"
    path.write_text(json.dumps(with_value(("camera", "image_circle_radius_px"), circle_px)), encoding="utf-8")
    assert read_design(path).camera.image_radius_mm == pytest.approx(radius_px * 0.0044)


def test_the_law_of_the_lens_is_kept_and_its_absence_means_perspective(tmp_path: Path):
    perspective = read_design(PROTOTYPE)
    assert perspective.camera.projection == "perspective"
    assert "projection" not in design_to_json(perspective)
    assert "distortion" not in design_to_json(perspective)
    path = tmp_path / "design.json"
    content = with_value(("camera", "projection"), "equidistant")
    content["camera"]["distortion"] = [0.01, -0.002]
    path.write_text(json.dumps(content), encoding="utf-8")
    fisheye = read_design(path)
    assert fisheye.camera.distortion == (0.01, -0.002)
    write_design(fisheye, tmp_path / "again.json")
    assert read_design(tmp_path / "again.json") == fisheye


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("camera", "projection"), "fisheye", "camera.projection = 'fisheye'"),
        (("camera", "distortion"), [0.1, 0, 0, 0], "perspective takes at most 3 coefficients, not 4"),
        (("camera", "distortion"), [float("inf")], "must be a finite number"),
    ],
)
def test_laws_that_there_are_not(keys, value, words: str, tmp_path: Path):
    assert words in refusal(json.dumps(with_value(keys, value)), tmp_path)


def test_a_pair_of_views_cannot_be_taken_by_order():
    pair = PerView(lower="below", upper="above")
    assert (pair["lower"], pair["upper"]) == ("below", "above")
    with pytest.raises(KeyError):
        _, _ = pair
    with pytest.raises(TypeError):
        PerView("below", "above")
