"""The stereo command: what it writes from a captured image, and how it refuses what it cannot use."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from designer.cli import cli
from designer.design import write_design
from designer.imaging.stereo.placement import ImagePlacement, ViewPlacements
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import coarse_prototype

PLACEMENT = ImagePlacement((405.0, 296.0), np.radians(20.0), 0.98)
CAMERA_OPTIONS = ("--center", 405, 296, "--rotation-deg", 20, "--scale", 0.98)


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, ["stereo", *(str(word) for word in words)])


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design and the raw image of a camera that is off centre, turned and a little too far."""
    folder = tmp_path_factory.mktemp("captured")
    write_design(coarse_prototype(), folder / "design.json")
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    raw = raw_image(coarse_prototype(), eccentric_wall(1700.0, 0.6), texture, PLACEMENT, noise=2.0)
    cv2.imwrite(str(folder / "raw.png"), cv2.merge([raw, raw, np.zeros_like(raw)]))
    return folder


@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_a_captured_image_becomes_a_point_cloud(captured, tmp_path, sampling):
    out = tmp_path / "out"
    result = run(
        captured / "design.json", captured / "raw.png", "-o", out, *CAMERA_OPTIONS, "--columns", 900,
        "--sampling", sampling,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert {path.name for path in out.iterdir()} == {
        "upper.png", "lower.png", "disparity.png", "outcomes.png", "depth.png", "floor_plan.png", "points.ply",
        "stereo.npz", "placement.toml", "summary.json",
    }  # fmt: skip
    assert summary["outcomes"]["kept"] > 0.85
    assert f"{summary['points']} points" in result.stdout
    shift = summary["depth_shift_per_scale"]
    # 2 D / b, less the cosines at the pinhole: of an eccentric wall at 1.7 m, seen over 100 mm.
    assert 0.95 * 2.0 * summary["median_distance_mm"] / 100.0 < shift["median"] < 1.06 * shift["largest"]
    assert (
        f"systematic: 0.1 % of image scale shifts these distances by {0.1 * shift['median']:.2g} % (median), "
        f"up to {0.1 * shift['largest']:.2g} %"
    ) in result.stdout
    arrays = np.load(out / "stereo.npz")
    shape = (summary["panorama"]["rows"], 900)
    assert arrays["distance_mm"].shape == shape
    wall = eccentric_wall(1700.0, 0.6)(np.radians(arrays["azimuth_deg"]))
    assert np.nanmedian(np.abs(arrays["distance_mm"] / wall - 1)) < 0.02
    depth = cv2.imread(str(out / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert depth.dtype == np.uint16
    known = arrays["outcome"] == 0
    np.testing.assert_array_equal(depth > 0, known)
    unit = summary["depth_png_unit_mm"]
    np.testing.assert_allclose(depth[known] * unit, arrays["distance_mm"][known], atol=0.51 * unit)
    upper = cv2.imread(str(out / "upper.png"))
    assert upper.shape == (*shape, 3)
    assert upper[..., 0].mean() > 50
    assert upper[..., 2].mean() < 1
    assert summary["provenance"]["inputs"]["raw"]["file"] == "raw.png"


def test_an_uncorrected_camera_gives_fewer_points(captured, tmp_path):
    words = (captured / "design.json", captured / "raw.png", "--columns", 900, "-o")
    corrected, plain = tmp_path / "corrected", tmp_path / "plain"
    assert run(*words, corrected, *CAMERA_OPTIONS).exit_code == 0
    assert run(*words, plain).exit_code == 0
    points = [json.loads((folder / "summary.json").read_text())["points"] for folder in (corrected, plain)]
    assert points[1] < 0.7 * points[0]


def test_the_centre_can_be_found(captured, tmp_path):
    words = ("--find-center", "--rotation-deg", 20, "--scale", 0.98, "--columns", 900)
    result = run(captured / "design.json", captured / "raw.png", "-o", tmp_path / "out", *words)
    assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    np.testing.assert_allclose(summary["request"]["placement"]["center_px"], PLACEMENT.center_px, atol=0.05)
    assert result.stdout.startswith("center: ")
    assert summary["outcomes"]["kept"] > 0.85


def test_two_centres_are_found_written_and_read_again(captured, tmp_path):
    apart = ViewPlacements(upper=ImagePlacement((402.6, 297.2)), lower=ImagePlacement((400.0, 300.5)))
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    raw = raw_image(coarse_prototype(), eccentric_wall(1700.0, 0.6), texture, apart, noise=2.0)
    cv2.imwrite(str(tmp_path / "raw.png"), raw)
    words = (captured / "design.json", tmp_path / "raw.png", "--columns", 900, "-o")
    found = run(*words, tmp_path / "found", "--find-center")
    assert found.exit_code == 0, found.output
    upper, lower, turn, *_ = found.stdout.splitlines()
    assert upper.startswith("upper center: 402.")
    assert lower.startswith("lower center: 400.")
    assert turn.startswith(("the lower view is turned by 0.00", "the lower view is turned by -0.00"))
    again = run(*words, tmp_path / "again", "--placement", tmp_path / "found" / "placement.toml")
    assert again.exit_code == 0, again.output
    summaries = [json.loads((tmp_path / name / "summary.json").read_text()) for name in ("found", "again")]
    assert summaries[0]["outcomes"]["kept"] > 0.85
    assert summaries[0]["points"] == summaries[1]["points"]
    placements = [summary["provenance"]["placements"] for summary in summaries]
    for view, truth in (("upper", apart.upper), ("lower", apart.lower)):
        np.testing.assert_allclose(placements[0][view]["center_px"], truth.center_px, atol=0.1)
        assert placements[1][view]["center_px"] == placements[0][view]["center_px"]
    assert summaries[1]["provenance"]["inputs"]["placement"]["file"] == "placement.toml"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[upper]\ncenter_px = [400.0, 300.0]\n", "lower: is required but missing"),
        ("[upper]\ncenter_px = [400.0]\n[lower]\ncenter_px = [400.0, 300.0]\n", "upper.center_px = [400.0]: "),
        ("[upper]\ncenter_px = [nan, 1.0]\n[lower]\ncenter_px = [1.0, 1.0]\n", "upper.center_px.0 = nan: "),
        ("[upper]\ncenter_px = [4.0, 3.0]\nscale = 0.0\n[lower]\ncenter_px = [4.0, 3.0]\n", "upper.scale = 0.0: "),
        ("[upper]\ncenter_px = [4.0, 3.0]\nturn = 0.0\n[lower]\ncenter_px = [4.0, 3.0]\n", "upper.turn: "),
        ("[upper\n", "not valid TOML"),
    ],
)
def test_an_impossible_placement_file_is_refused(captured, tmp_path, text, message):
    path = tmp_path / "own.toml"
    path.write_text(text)
    line = refused(captured / "design.json", captured / "raw.png", "--placement", path, out=tmp_path / "out")
    assert f"own.toml: {message}" in line


def test_a_placement_file_excludes_the_options_that_it_replaces(captured, tmp_path):
    words = ("--placement", tmp_path / "own.toml", "--scale", 0.98)
    line = refused(captured / "design.json", captured / "raw.png", *words, out=tmp_path / "out")
    assert "leave out --center, --rotation-deg and --scale" in line


def test_another_matcher_and_plain_sampling(captured, tmp_path):
    words = ("--matcher", "semi-global", "--no-equalise", "--level-brightness", "--columns", 900)
    result = run(captured / "design.json", captured / "raw.png", "-o", tmp_path / "out", *CAMERA_OPTIONS, *words)
    assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["outcomes"]["kept"] > 0.8
    assert summary["equalisation_sigma_px"] is None
    assert summary["request"]["matcher"] == "semi_global"


def refused(*words: object, out: Path) -> str:
    result = run(*words, "-o", out)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert not out.exists()
    (line,) = result.stderr.splitlines()
    return line


@pytest.mark.parametrize("kept", [0, 5, 40, 5000, -13, -1])
@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_a_truncated_image_is_refused(captured, tmp_path, kept, ending):
    image = cv2.imread(str(captured / "raw.png"))
    _, encoded = cv2.imencode(ending, image)
    path = tmp_path / f"cut{ending}"
    path.write_bytes(encoded.tobytes()[:kept])
    line = refused(captured / "design.json", path, out=tmp_path / "out")
    assert f"cut{ending}: " in line
    assert "truncated" in line or "not a readable image" in line


def test_a_damaged_png_is_refused(captured, tmp_path):
    data = bytearray((captured / "raw.png").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (tmp_path / "bad.png").write_bytes(data)
    assert "truncated or damaged" in refused(captured / "design.json", tmp_path / "bad.png", out=tmp_path / "out")


def test_what_cannot_be_used_is_refused_in_a_line(captured, tmp_path):
    design, raw, out = captured / "design.json", captured / "raw.png", tmp_path / "out"
    assert "cannot be read" in refused(design, tmp_path / "none.png", out=out)
    assert "cannot be read" in refused(tmp_path / "none.json", raw, out=out)
    assert "not a readable image" in refused(design, design, out=out)
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((480, 640), np.uint8))
    assert "640 x 480 pixels, but the design's camera has 800 x 600" in refused(design, tmp_path / "small.png", out=out)
    record = json.loads(design.read_text())
    del record["views"]["lower"]["gain"]
    (tmp_path / "incomplete.json").write_text(json.dumps(record))
    assert "views.lower.gain: is required but missing" in refused(tmp_path / "incomplete.json", raw, out=out)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--window", 8), "must be odd"),
        (("--distance-mm", 5000, 1000), "lower limit"),
        (("--distance-mm", -5, 1000), "must be from 1 to 1e+09 mm"),
        (("--distance-mm", 1e300, 1e301), "from 1 to 1e+09 mm"),
        (("--elevation-deg", 80, 88), "no view sees any of it"),
        (("--columns", 90, "--elevation-deg", 0, 1), "panoramas 1 px high, less than the matching --window of 9"),
        (("--columns", 20000, "--elevation-deg", -89, 89), "20000 x 9889 pixels; at most 10 million"),
        (("--center", 1e300, 3), "within 1e+06 pixels"),
        (("--center", 1e5, 3), "neither view's image falls on the sensor"),
        (("--noise-px", 1e300), "at most 1000"),
        (("--elevation-deg", 10, -10), "lower limit"),
        (("--elevation-deg", -95, 0), "between -89 and 89"),
        (("--scale", 0), "between 0.1 and 10"),
        (("--noise-px", 0), "must be positive"),
        (("--center", "nan", 3), "finite"),
        (("--slab-mm", 5, 5), "lower limit"),
    ],
)
def test_impossible_options_are_refused(captured, tmp_path, words, message):
    assert message in refused(captured / "design.json", captured / "raw.png", *words, out=tmp_path / "out")


def test_a_second_run_that_breaks_off_leaves_no_summary_of_the_first(captured, tmp_path):
    words = (captured / "design.json", captured / "raw.png", "--columns", 900, "-o", tmp_path / "out")
    assert run(*words).exit_code == 0
    cloud = tmp_path / "out" / "points.ply"
    cloud.unlink()
    cloud.mkdir()
    broken = run(*words)
    assert broken.exit_code == 2
    assert "points.ply: cannot be written" in broken.stderr
    assert (tmp_path / "out" / "upper.png").exists()
    assert not (tmp_path / "out" / "summary.json").exists()


def test_an_image_without_any_match_is_still_written(captured, tmp_path):
    cv2.imwrite(str(tmp_path / "black.png"), np.zeros((600, 800), np.uint8))
    result = run(captured / "design.json", tmp_path / "black.png", "-o", tmp_path / "out", "--columns", 900)
    assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["points"] == 0
    assert summary["outcomes"]["no_texture"] > 0.9
    assert result.stderr.startswith("few points are left: check that the image and the design belong together")
