"""``designer target``, ``designer render --target``, ``designer calibrate``, and stereo with what it wrote."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from designer.calibration.target import make_target, read_target, write_target
from designer.calibration.target_pose import facing_pose
from designer.cli import cli
from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import read_design, write_design
from support.calibration_targets import drawn_image
from support.studied_designs import sharp_design

DESIGN = sharp_design("indoor_robot:folded-HyHy-Hy-upper_outer")
TARGET = make_target(9, 6, 40.0)


@pytest.fixture
def files(tmp_path):
    write_design(DESIGN, tmp_path / "design.json")
    write_target(tmp_path / "target.toml", TARGET)
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((60, 80), np.uint8))
    return tmp_path


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def test_a_target_is_written_with_its_file(tmp_path):
    code, said = run("target", "-o", tmp_path / "t.pdf", "--columns", 7, "--rows", 5, "--square-mm", 25)
    assert code == 0
    assert "7 x 5 squares of 25 mm, 175 x 125 mm" in said
    assert (tmp_path / "t.pdf").read_bytes().startswith(b"%PDF")
    assert read_target(tmp_path / "t.toml") == make_target(7, 5, 25.0)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("target", "-o", "t.png"), "t.png: must end in .pdf"),
        (("target", "-o", "t.pdf", "--rows", "2"), "target: rows = 2: must be greater than or equal to 3"),
        (
            ("calibrate", "design.json", "small.png", "-o", "b.json", "--target", "target.toml"),
            "small.png: 80 x 60 pixels, but the design's camera has 1600 x 1200",
        ),
        (
            ("calibrate", "design.json", "small.png", "-o", "b.json", "--target", "none.toml"),
            "none.toml: cannot be read",
        ),
        (
            ("calibrate", "design.json", "small.png", "-o", "b.txt", "--target", "target.toml"),
            "b.txt: must end in .json",
        ),
        (
            ("calibrate", "design.json", "small.png", "-o", "b.json", "--target", "target.toml", "--grade", "fine"),
            "grade = 'fine': must be coarse, standard, precision",
        ),
        (("render", "design.json", "-o", "r.png", "--target-pose", *"123456"), "--target-pose: needs --target"),
        (
            ("render", "design.json", "-o", "r.png", "--target", "target.toml", "--scene", "cylinder"),
            "--target: needs a scene that has materials",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(files, monkeypatch, arguments: tuple[str, ...], reason: str):
    monkeypatch.chdir(files)
    code, said = run(*arguments)
    assert code == 2
    assert said.startswith(f"designer: {reason}")
    assert said.count("\n") == 1


@pytest.mark.slow
def test_a_built_sensor_is_calibrated_and_used(files, monkeypatch):
    """Drawn images of targets through a sensor with errors; then its panoramas show the same azimuth in a column."""
    monkeypatch.chdir(files)
    errors = AsBuilt(
        mirrors={"direct": MirrorDeparture(decentre_x_mm=0.1, tilt_y_deg=0.1)},
        camera=CameraDeparture(image_shift_x_px=4.0),
    )
    built = DESIGN.model_copy(update={"as_built": errors})
    from designer.as_built.parameters import values_of

    values = np.append(values_of(built), [4.0, 0.0])
    random = np.random.default_rng(4)
    for place in range(5):
        pose = facing_pose(
            TARGET.size_mm,
            72.0 * place,
            random.uniform(320.0, 380.0),
            DESIGN.views.middle_mm,
            tuple(random.uniform(-25.0, 25.0, 3)),
        )
        cv2.imwrite(f"{place}.png", drawn_image(DESIGN, values, TARGET, pose, seed=place))
    images = [f"{place}.png" for place in range(5)]
    code, said = run("calibrate", "design.json", *images, "-o", "built.json", "--target", "target.toml")
    assert code == 0, said
    assert "built.json written" in said
    assert "the images do not say how the sensor stands in the room" in said
    found = read_design(files / "built.json")
    assert found.as_built is not None
    assert abs(found.as_built.camera.image_shift_x_px - 4.0) < 15.0
    record = json.loads((files / "built.json").read_text())["calibration"]
    assert record["images_used"] == [1, 2, 3, 4, 5]
    assert all(rms < 0.05 for rms in record["residual_px"].values())
    assert len(record["provenance"]["inputs"]["image 5"]["sha256"]) == 64
    code, said = run("stereo", "built.json", "0.png", "-o", "out", "--no-equalise", "--columns", "900")
    assert code == 0, said
    assert "as built: the sensor is traced" in said
    assert not (files / "out" / "placement.toml").exists()
    code, said = run(
        "stereo", "built.json", "0.png", "-o", "out", "--no-equalise", "--columns", "900", "--scale", "1.001"
    )
    assert "as built: not used, since the options say where the image lies" in said
    assert (files / "out" / "placement.toml").exists()
