"""Places that cannot be written: one line that names what was typed, exit code 2; a full disk stays a failure."""

import errno
import os
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from designer.cli import cli
from designer.design import write_design
from designer.extras import is_installed
from designer.files import UnwritableError, write_atomically
from support.imaging_designs import coarse_prototype
from support.studied_designs import SHARP_NAMES, sharp_design


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder: two designs, an image, and a file that stands where a folder would have to be."""
    monkeypatch.chdir(tmp_path)
    write_design(sharp_design(SHARP_NAMES[0]), Path("design.json"))
    write_design(coarse_prototype(), Path("coarse.json"))
    camera = coarse_prototype().camera
    cv2.imwrite("raw.png", np.full((camera.height_px, camera.width_px), 90, np.uint8))
    Path("taken").write_text("a file", encoding="utf-8")
    return tmp_path


COMMANDS = {
    "order": ("order", "design.json"),
    "export": ("export", "design.json", "--to", "sag"),
    "tolerance": ("tolerance", "coarse.json", "--trials", "20"),
    "stereo": ("stereo", "coarse.json", "raw.png", "--columns", "400"),
}
NAMES = [name for name in COMMANDS if name != "order" or is_installed("drawing")]


def run(name: str, out: str) -> Result:
    return CliRunner().invoke(cli, [*COMMANDS[name], "-o", out])


def refuse(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Whatever is put into a folder, the system says no with this number (root itself may write anywhere)."""

    def failing(*arguments: object, **options: object) -> None:
        raise OSError(number, os.strerror(number), "/somewhere/.hidden.abc")

    monkeypatch.setattr(tempfile, "mkstemp", failing)
    monkeypatch.setattr(tempfile, "mkdtemp", failing)


def check_refused(result: Result, told: str) -> None:
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"designer: {told}")
    assert "cannot be written: " in line
    assert "Errno" not in line
    assert "hidden" not in line


@pytest.mark.parametrize("name", NAMES)
def test_below_a_file_nothing_is_written(name: str, folder: Path) -> None:
    check_refused(run(name, "taken/below"), "taken/below")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_a_folder_without_permission_is_named_as_it_was_typed(
    name: str, number: int, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse(monkeypatch, number)
    check_refused(run(name, "out"), "out")


@pytest.mark.parametrize("name", NAMES)
def test_a_full_disk_is_a_failure(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, errno.ENOSPC)
    result = run(name, "out")
    assert result.exit_code == 1
    assert "No space left on device" in result.stderr


@pytest.mark.skipif("order" not in NAMES, reason="typst, which typesets an order's drawings, is not installed")
def test_an_order_does_not_take_the_place_of_everything(folder: Path) -> None:
    result = run("order", "/")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("designer: /: is the root of all folders")


def test_a_file_in_the_place_of_a_folder_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine", encoding="utf-8")
    for target in (tmp_path / "taken" / "a.txt", tmp_path / "taken" / "b" / "a.txt"):
        with pytest.raises(UnwritableError, match="a file is in the place of a folder"):
            write_atomically(target, "other")
    assert (tmp_path / "taken").read_text(encoding="utf-8") == "mine"
