"""``designer render`` and ``designer check``: files, exit codes, and refusals of one line."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from designer.cli import cli
from designer.design import write_design
from support import DATA
from support.imaging_designs import coarse_prototype
from support.studied_designs import sharp_design, with_coarse_pixels


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


def refused(*words: object) -> str:
    result = run(*words)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    (line,) = result.stderr.splitlines()
    return line


@pytest.fixture
def coarse(tmp_path: Path) -> Path:
    """The prototype over a sensor of 160 x 120 pixels, and a circle of image that leaves the corners dark."""
    record = json.loads((DATA / "folded_hypl_hy.json").read_text(encoding="utf-8"))
    record["camera"] |= {"width_px": 160, "height_px": 120, "pixel_pitch_mm": 0.044, "image_circle_radius_px": 60}
    path = tmp_path / "coarse.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    return path


def test_render_writes_an_image_and_what_its_pixels_see(coarse: Path, tmp_path: Path) -> None:
    image, truth = tmp_path / "raw.png", tmp_path / "truth.npz"
    result = run("render", coarse, "--scene", "office", "-o", image, "--bits", "16", "--truth", truth)
    assert result.exit_code == 0, result.output
    assert "160 x 120 pixels, scene office" in result.stdout
    pixels = cv2.imread(str(image), cv2.IMREAD_UNCHANGED)
    assert (pixels.shape, pixels.dtype) == ((120, 160), np.uint16)
    assert pixels[0, 0] == 0
    with np.load(truth) as arrays:
        assert arrays["view"].shape == (120, 160)
        seen = arrays["view"] > 0
        assert seen.mean() > 0.3
        assert np.isfinite(arrays["distance_mm"][seen]).all()
        np.testing.assert_allclose(
            np.hypot(*np.moveaxis(arrays["point_mm"], -1, 0)[:2]), arrays["distance_mm"], rtol=1e-5, equal_nan=True
        )
    assert pixels[seen].std() > 1000


def test_the_same_seed_gives_the_same_file_and_another_does_not(coarse: Path, tmp_path: Path) -> None:
    def rendered(seed: int, name: str) -> bytes:
        out = tmp_path / name
        words = ("--samples", 1, "--noise-electrons", 20, "--seed", seed, "-o", out)
        assert run("render", coarse, *words).exit_code == 0
        return out.read_bytes()

    assert rendered(3, "a.png") == rendered(3, "b.png")
    assert rendered(3, "a.png") != rendered(4, "c.png")


def test_through_the_lens_the_image_is_blurred_and_darker(coarse: Path, tmp_path: Path) -> None:
    pinhole, lens, same = (tmp_path / f"{name}.png" for name in ("pinhole", "lens", "same"))
    for out, words in ((pinhole, ()), (lens, ("--lens",)), (same, ("--aperture", "--samples", 3))):
        result = run("render", coarse, "-o", out, *words)
        assert result.exit_code == 0, result.output
        assert ("through a lens of 12 mm, f/8, focused at infinity" in result.stdout) is bool(words)
    assert lens.read_bytes() == same.read_bytes()
    sharp, blurred = (cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float) for path in (pinhole, lens))
    assert 0.5 * sharp.mean() < blurred.mean() < 0.9 * sharp.mean()
    assert np.abs(np.diff(blurred, axis=1)).mean() < 0.8 * np.abs(np.diff(sharp, axis=1)).mean()


@pytest.mark.slow
def test_a_check_with_a_pinhole_beside_it_says_both(coarse: Path) -> None:
    words = ("check", coarse, "--scene", "cylinder", "--pinhole", "--samples", 1)
    result = run(*words, "--json")
    content = json.loads(result.stdout, parse_constant=pytest.fail)
    assert set(content) == {"pinhole", "lens", "kept_of_pinhole", "passed"}
    assert result.exit_code == (0 if content["passed"] else 1)
    text = run(*words).stdout
    assert (
        text.index("texture, through a pinhole")
        < text.index("texture, through a lens of 12 mm")
        < text.index("points seen by both")
    )
    assert text.splitlines()[-1].startswith("geometry ")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--scene", "attic"), "scene 'attic': must be one of auto, office"),
        (("--scene", "ghost.obj"), "ghost.obj: cannot be read"),
        (("--texture", "furry"), "texture 'furry': must be one of rich, poor, repetitive"),
        (("--samples", "0"), "--samples 0: must be from 1 to 16"),
        (("--noise-electrons", "-1"), "--noise-electrons -1: must be at least 0"),
        (("--noise-electrons", "nan"), "--noise-electrons nan: must be at least 0"),
        (("--full-well-electrons", "0"), "--full-well-electrons 0: must be at least 1"),
        (("--sensor-height-mm", "-3"), "sensor height -3 mm: must be greater than 0"),
    ],
)
def test_render_refuses_in_a_line_and_writes_nothing(
    coarse: Path, tmp_path: Path, options: tuple[str, ...], said: str
) -> None:
    assert said in refused("render", coarse, "-o", tmp_path / "raw.png", *options)
    assert not (tmp_path / "raw.png").exists()


def test_render_names_the_wrong_file(coarse: Path, tmp_path: Path) -> None:
    assert "raw.jpg: must end in .png" in refused("render", coarse, "-o", tmp_path / "raw.jpg")
    assert "truth.txt: must end in .npz" in refused(
        "render", coarse, "-o", tmp_path / "raw.png", "--truth", tmp_path / "truth.txt"
    )
    assert "nowhere.json: cannot be read" in refused("render", tmp_path / "nowhere.json", "-o", tmp_path / "raw.png")
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert "cannot be written" in refused("render", coarse, "-o", tmp_path / "file" / "raw.png", "--samples", 1)


def test_check_refuses_in_a_line(coarse: Path, tmp_path: Path) -> None:
    assert "scene 'attic': must be one of auto" in refused("check", coarse, "--scene", "attic")
    assert "--noise-electrons -1" in refused("check", coarse, "--noise-electrons", "-1")
    broken = json.loads(coarse.read_text(encoding="utf-8"))
    del broken["camera"]["focal_length_mm"]
    coarse.write_text(json.dumps(broken), encoding="utf-8")
    assert "camera.focal_length_mm: is required but missing" in refused("check", coarse)


@pytest.mark.slow
def test_check_prints_bands_definition_and_verdict(tmp_path: Path) -> None:
    sharp = sharp_design("indoor_robot:folded-HyHy-Hy-upper_outer")
    write_design(with_coarse_pixels(sharp, 2), tmp_path / "design.json")
    result = run("check", tmp_path / "design.json")
    assert result.exit_code == 0, result.output
    assert "passes if at least one of the 4 distance bands" in result.stdout
    assert result.stdout.splitlines()[-1] == "passed"


@pytest.mark.slow
def test_check_fails_with_exit_code_1_where_there_is_nothing_to_match(tmp_path: Path) -> None:
    write_design(coarse_prototype(), tmp_path / "design.json")
    result = run("check", tmp_path / "design.json", "--samples", 1, "--texture", "poor", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["passed"] is False
