"""Files that no camera and no designer wrote: one line and exit code 2, at once, and no traceback."""

import json
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from designer.cli import cli
from designer.design import read_design
from designer.files import InputError
from designer.imaging.images import read_raw_image
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.requirement import requirement_to_toml
from support import CONFIGS, DATA
from support.shipped_problems import shipped_requirement

DESIGN = DATA / "folded_hypl_hy.json"


def refused(*words: object) -> str:
    result = CliRunner().invoke(cli, [str(word) for word in words])
    assert result.exit_code == 2, (result.output, result.exception)
    (line,) = result.stderr.splitlines()
    return line


def png_claiming(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"\0" * 99)) + chunk(b"IEND", b"")


def bmp_claiming(width: int, height: int) -> bytes:
    header = struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, 0, 0, 0, 0, 0, 0)
    return b"BM" + struct.pack("<IHHI", 154, 0, 0, 54) + header + b"\0" * 100


@pytest.mark.parametrize("claiming", [png_claiming, bmp_claiming])
def test_an_image_that_claims_too_many_pixels_is_refused_by_its_header(claiming, tmp_path):
    path = tmp_path / "raw.img"
    path.write_bytes(claiming(60_000, 60_000))
    line = refused("stereo", DESIGN, path, "--out", tmp_path / "out")
    assert line == f"designer: {path}: 60000 x 60000 pixels, but the design's camera has 1600 x 1200"
    camera = read_design(DESIGN).camera.model_copy(update={"width_px": 60_000, "height_px": 60_000})
    with pytest.raises(InputError, match="not a readable image"):
        read_raw_image(path, camera)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".bmp", ".tiff"])
def test_an_image_of_another_size_is_not_decoded(ending, tmp_path, monkeypatch):
    path = tmp_path / f"raw{ending}"
    cv2.imwrite(str(path), np.zeros((400, 500), np.uint8))
    monkeypatch.setattr(cv2, "imdecode", lambda *arguments: pytest.fail("decoded"))
    with pytest.raises(InputError, match="500 x 400 pixels, but the design's camera has 1600 x 1200"):
        read_raw_image(path, read_design(DESIGN).camera)


@pytest.mark.parametrize("command", ["evaluate", "trace", "check", "render"])
@pytest.mark.parametrize("key", ["configuration", "variant"])
def test_half_a_surrogate_pair_in_a_design_is_refused(command, key, tmp_path):
    path = tmp_path / "design.json"
    path.write_text(json.dumps(json.loads(DESIGN.read_text()) | {key: "a\ud800"}))
    rest = ("--out", tmp_path / "raw.png") if command == "render" else ()
    assert refused(command, path, *rest) == (
        f"designer: {path}: contains \\ud800, half of a surrogate pair, which is no character"
    )


@pytest.fixture
def study_folder(tmp_path: Path) -> Path:
    (tmp_path / "requirement.toml").write_text(requirement_to_toml(shipped_requirement("indoor_robot")))
    (tmp_path / "designs.csv").write_text("configuration,status,reason\n")
    return tmp_path


@pytest.mark.parametrize(
    ("table", "instead", "message"),
    [
        ("envelope", "envelope = 3", "envelope = 3: must be a table with the keys height_mm"),
        ("camera", "camera = {lens = 4}", "camera.width_px: is required but missing"),
    ],
)
def test_a_report_of_a_requirement_that_cannot_be(table, instead, message, study_folder):
    path = study_folder / "requirement.toml"
    kept = re.sub(rf"(?ms)^\[{table}[.\]].*?(?=^\[(?!{table}\.))", "", path.read_text())
    path.write_text(f"{instead}\n{kept}")
    assert message in refused("report", study_folder)


@pytest.mark.parametrize("command", ["report", "compare"])
def test_a_table_with_an_endless_field_is_refused(command, study_folder):
    path = study_folder / "designs.csv"
    path.write_text(f"configuration,status,reason\ndirect-HyHy-upper_outer,impossible,{'a' * 200_000}\n")
    line = refused(command, *(study_folder,) * (2 if command == "compare" else 1))
    assert "designs.csv: not a table that a study wrote: field larger than field limit" in line


@pytest.mark.parametrize(
    ("key", "requirement", "message"),
    [
        ("baseline_mm\\u0000", "base.toml", r"no such key (baseline_mm\x00); did you mean baseline_mm?"),
        (f"working_volume.elevation_deg.{'1' * 5000}", "base.toml", "the requirement has no such key (1111"),
        ("baseline_mm", "ba\\u0000se.toml", "no file can have this name: it contains a NUL character"),
    ],
)
def test_a_sweep_over_what_is_no_key(key, requirement, message, tmp_path):
    (tmp_path / "base.toml").write_text((CONFIGS / "indoor_robot.toml").read_text())
    path = tmp_path / "sweep.toml"
    path.write_text(f'requirement = "{requirement}"\n[[axis]]\nkey = "{key}"\nvalues = [1, 2]\n')
    line = refused("sweep", path, "--out", tmp_path / "out")
    assert message in line
    assert len(line) < 500


def test_a_camera_too_large_to_render_is_said_before_the_work(tmp_path):
    text = (CONFIGS / "indoor_robot.toml").read_text()
    text = re.sub(r"(?m)^(width|height)_px = \d+", r"\1_px = 100000", text)
    (tmp_path / "large.toml").write_text(text)
    line = refused("study", tmp_path / "large.toml", "--out", tmp_path / "out")
    assert "camera of 100000 x 100000 pixels is too large to render: at most 250 megapixels" in line
    assert line.endswith("use --checks 0 to study it without end-to-end checks")
    design = read_design(DESIGN)
    world = build_world("office", design)
    large = {"width_px": 100_000, "height_px": 100_000}
    with pytest.raises(InputError, match="too large to render"):
        render(design.model_copy(update={"camera": design.camera.model_copy(update=large)}), world)


def test_too_little_memory_is_one_line(monkeypatch):
    def exhausted(path: Path) -> None:
        raise MemoryError

    monkeypatch.setattr("designer.design.read_design", exhausted)
    result = CliRunner().invoke(cli, ["trace", str(DESIGN)])
    assert (result.exit_code, result.stderr) == (1, "designer: out of memory\n")


INTERRUPTED_IMPORT = """
import signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "click":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
sys.argv = ["designer", "--version"]
from designer.__main__ import main
main()
"""


def test_an_interrupt_during_the_first_imports_is_one_line():
    ended = subprocess.run([sys.executable, "-c", INTERRUPTED_IMPORT], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "designer: interrupted\n")
