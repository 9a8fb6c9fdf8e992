"""Malformed requirements end with one line that names file, key and what is allowed; nothing is written."""

import tomllib
from pathlib import Path

import pytest
import tomli_w
from click.testing import CliRunner

from designer.cli import cli

SAMPLE = (Path(__file__).parent / "sample.toml").read_text(encoding="utf-8")

# name: (text to replace in the sample, its replacement, the key that the line names, what the line says is allowed)
MALFORMED = {
    "misspelt key": (
        "focal_length_mm",
        "focal_lenght_mm",
        "camera.lens.focal_lenght_mm",
        "did you mean focal_length_mm?",
    ),
    "misspelt table": ("[envelope]", "[envelop]", "envelop", "did you mean envelope?"),
    "misspelt top-level key": ("baseline_mm", "base_line_mm", "base_line_mm", "did you mean baseline_mm?"),
    "key without its unit": ("height_mm = 140", "height = 140", "envelope.height", "did you mean height_mm?"),
    "light that may touch": (
        "[manufacture]\n",
        "[manufacture]\nclearance_mm = 0\n",
        "manufacture.clearance_mm",
        "must be a number from 0.001 to 1000 (mm)",
    ),
    "unknown key": ("seed = 0", "colour = 3", "solve.colour", "allowed: seed, starts, configurations"),
    "missing key": ("f_number = 5.6\n", "", "camera.lens.f_number", "required"),
    "missing table": (
        "[envelope]\nheight_mm = 140\ndiameter_mm = 80\nmirror_diameter_mm = 60\n",
        "",
        "envelope",
        "required",
    ),
    "table instead of number": ("baseline_mm = 100", "baseline_mm = {low = 1}", "baseline_mm", "a number or a range"),
    "unknown table": ("[solve]\nseed = 0", "[other]", "other", "allowed: name, title"),
    "number with unit": ("height_mm = 140", 'height_mm = "140 mm"', "envelope.height_mm", "without quotes"),
    "boolean": ("f_number = 5.6", "f_number = true", "camera.lens.f_number", "a number from 0.5 to 128"),
    "date": ("front_mm = 4", "front_mm = 2024-01-01", "camera.lens.front_mm", "a number from 0 to 1000"),
    "nan": ("height_mm = 140", "height_mm = nan", "envelope.height_mm", "a number from 1 to 100000"),
    "infinity": ("baseline_mm = 100", "baseline_mm = inf", "baseline_mm", "a number or a range"),
    "infinite range": ("[1000, 5000]", "[1000, inf]", "working_volume.distance_mm", "a range [low, high]"),
    "minus infinite focus": (
        "focus_distance_mm = 100",
        "focus_distance_mm = -inf",
        "camera.lens.focus_distance_mm",
        "or inf",
    ),
    "fractional pixels": ("width_px = 1600", "width_px = 1600.5", "camera.width_px", "a whole number"),
    "no pixels": ("height_px = 1200", "height_px = 0", "camera.height_px", "from 16 to 100000"),
    "negative baseline": ("baseline_mm = 100", "baseline_mm = -100", "baseline_mm", "from 1 to 100000"),
    "baseline in metres": ("baseline_mm = 100", "baseline_mm = 0.1", "baseline_mm", "is that metres?"),
    "baseline range inverted": (
        "baseline_mm = 100",
        "baseline_mm = [120, 80]",
        "baseline_mm",
        "swap the two: [80, 120]",
    ),
    "baseline range of three": (
        "baseline_mm = 100",
        "baseline_mm = [80, 100, 120]",
        "baseline_mm",
        "range [low, high]",
    ),
    "baseline range empty": ("baseline_mm = 100", "baseline_mm = [100, 100]", "baseline_mm", "write the number alone"),
    "elevation inverted": ("[-16, 16]", "[16, -16]", "working_volume.elevation_deg", "swap the two: [-16, 16]"),
    "elevation beyond the zenith": ("[-16, 16]", "[-16, 95]", "working_volume.elevation_deg", "from -89 to 89"),
    "elevation in radians": ("[-16, 16]", "[-0.28, 0.28]", "working_volume.elevation_deg", "is that radians?"),
    "elevation a number": ("[-16, 16]", "16", "working_volume.elevation_deg", "a range [low, high]"),
    "elevation of texts": ("[-16, 16]", '["-16", "16"]', "working_volume.elevation_deg", "without quotes"),
    "distance inverted": ("[1000, 5000]", "[5000, 1000]", "working_volume.distance_mm", "swap the two"),
    "distance in metres": ("[1000, 5000]", "[1, 5]", "working_volume.distance_mm", "is that metres?"),
    "distance inside the envelope": (
        "[1000, 5000]",
        "[30, 5000]",
        "working_volume.distance_mm",
        "outside the envelope",
    ),
    "envelope in metres": ("height_mm = 140", "height_mm = 0.14", "envelope.height_mm", "is that metres?"),
    "envelope narrower than the lens": (
        "diameter_mm = 80\nmirror_diameter_mm = 60",
        "diameter_mm = 12",
        "envelope.diameter_mm",
        "at least the diameter of the lens",
    ),
    "envelope lower than the nearest mirror": (
        "height_mm = 140",
        "height_mm = 20",
        "envelope.height_mm",
        "must be at least 23",
    ),
    "mirror wider than the envelope": (
        "mirror_diameter_mm = 60",
        "mirror_diameter_mm = 90",
        "envelope.mirror_diameter_mm",
        "at most envelope.diameter_mm (80)",
    ),
    "smallest mirror larger than the largest": (
        "smallest_mirror_radius_mm = 5",
        "smallest_mirror_radius_mm = 40",
        "manufacture.smallest_mirror_radius_mm",
        "at most envelope.mirror_diameter_mm / 2 = 30",
    ),
    "pitch in micrometres": ("0.0044", "4.4", "camera.pixel_pitch_mm", "is that micrometres?"),
    "pitch in metres": ("0.0044", "4.4e-6", "camera.pixel_pitch_mm", "is that metres?"),
    "image circle beyond the sensor": (
        "image_circle_radius_px = 600",
        "image_circle_radius_px = 1001",
        "camera.image_circle_radius_px",
        "half the sensor's diagonal (1000 px)",
    ),
    "zone gap wider than the image": (
        "zone_gap_px = 4",
        "zone_gap_px = 600",
        "manufacture.zone_gap_px",
        "smaller than camera.image_circle_radius_px",
    ),
    "focal length in metres": (
        "focal_length_mm = 12",
        "focal_length_mm = 0.012",
        "camera.lens.focal_length_mm",
        "is that metres?",
    ),
    "focus nearer than the focal length": (
        "focus_distance_mm = 100",
        "focus_distance_mm = 12",
        "camera.lens.focus_distance_mm",
        "greater than 1.001 times the focal length, 12.012 mm",
    ),
    "focus at the focal length but for rounding": (
        "focus_distance_mm = 100",
        "focus_distance_mm = 12.005",
        "camera.lens.focus_distance_mm",
        "greater than 1.001 times the focal length, 12.012 mm",
    ),
    "barrel narrower than its pupil": (
        "f_number = 5.6",
        "f_number = 0.8",
        "camera.lens.radius_mm",
        "radius of the entrance pupil",
    ),
    "barrel narrower than the pupil of its longest focal length": (
        "focal_length_mm = 12",
        "focal_length_mm = [8, 80]",
        "camera.lens.radius_mm",
        "radius of the entrance pupil, longest focal length / (2 f_number) = 7.143 mm",
    ),
    "front behind the pupil": ("front_mm = 4", "front_mm = -4", "camera.lens.front_mm", "above the entrance pupil"),
    "misspelt lens": ("[camera.lens]", "[camera.lens_]", "camera.lens_", "did you mean lens?"),
    "slope in radians": (
        "largest_slope_deg = 70",
        "largest_slope_deg = 1.2",
        "manufacture.largest_slope_deg",
        "is that radians?",
    ),
    "unknown goal": (
        'minimise = "depth_error"',
        'minimise = "weight"',
        "objective.minimise",
        "must be one of depth_error, height, diameter, volume",
    ),
    "same goal twice": (
        'then = "height"',
        'then = "depth_error"',
        "objective.then",
        "must differ from objective.minimise",
    ),
    "percent as a fraction": (
        "within_percent = 1",
        "within_percent = 0.01",
        "objective.within_percent",
        "1 means 1 percent",
    ),
    "negative percent": ("within_percent = 1", "within_percent = -1", "objective.within_percent", "from 0 to 1000"),
    "no noise": ("noise_px = 0.1", "noise_px = 0", "noise_px", "from 0.001 to 10"),
    "no starts": ("starts = 8", "starts = 0", "solve.starts", "from 1 to 10000"),
    "seed a float": ("seed = 0", "seed = 1.5", "solve.seed", "a whole number"),
    "no configuration": ('["folded-*"]', "[]", "solve.configurations", "an array of at least one name"),
    "unknown configuration": (
        '"folded-*"',
        '"folded-HyPl-Hi-upper_outer"',
        "solve.configurations",
        "did you mean folded-HyPl-",
    ),
    "pattern without a match": ('"folded-*"', '"plane-*"', "solve.configurations", "none of the 44"),
    "configurations a text": ('["folded-*"]', '"folded-*"', "solve.configurations", "an array of at least one name"),
    "fixed mirror misspelt": (
        "[fixed.mirror.primary]",
        "[fixed.mirror.primry]",
        "fixed.mirror.primry",
        "did you mean primary?",
    ),
    "fixed mirror not studied": (
        "[fixed.mirror.primary]\nradius_mm = -12",
        "[fixed.mirror.lower]",
        "fixed.mirror.lower",
        "no configuration in solve.configurations has this mirror",
    ),
    "fixed mirror of no parameters": (
        "radius_mm = -12\nconic = -1.3\n",
        "",
        "fixed.mirror.primary",
        "at least one of radius_mm, conic, vertex_mm",
    ),
    "fixed sphere": ("conic = -1.3", "conic = 0", "fixed.mirror.primary.conic", "must be below 0"),
    "fixed radius zero": (
        "radius_mm = -12",
        "radius_mm = 0",
        "fixed.mirror.primary.radius_mm",
        "leave it out for a plane",
    ),
    "fixed gain zero": ("gain = 0.05", "gain = 0", "fixed.view.upper.gain", "must not be 0"),
    "fixed viewpoints that are no baseline apart": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.view]\nlower.viewpoint_mm = 20\nupper.viewpoint_mm = 90\n",
        "fixed.view.upper.viewpoint_mm = 90",
        "less fixed.view.lower.viewpoint_mm (20) must be the baseline, baseline_mm = 100; it is 70",
    ),
    "fixed hyperboloid curved the wrong way": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nradius_mm = -12\nconic = -1.3\n",
        "fixed.mirror.direct.radius_mm = -12",
        "must be above 0 for the hyperboloid",
    ),
    "fixed primary curved the wrong way": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.primary]\nradius_mm = 12\nconic = -1.3\n",
        "fixed.mirror.primary.radius_mm = 12",
        "must be below 0 for the hyperboloid",
    ),
    "fixed mirror below the pinhole": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.secondary]\nvertex_mm = -12\n",
        "fixed.mirror.secondary.vertex_mm",
        "above 0",
    ),
    "fixed viewpoint below the pinhole": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.view.upper]\nviewpoint_mm = -12\n",
        "fixed.view.upper.viewpoint_mm",
        "above 0",
    ),
    "fixed gain of more than one": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.view.upper]\ngain = 1.2\n",
        "fixed.view.upper.gain",
        "between -1 and 1",
    ),
    "fixed gain and conic": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nconic = -1.3\n[fixed.view.upper]\ngain = 0.05\n",
        "fixed.mirror.direct",
        "conic asks for a conic constant of -1.3, the view's gain for -1.2216066; leave one of them out",
    ),
    "fixed vertex and viewpoint against conic": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nconic = -1.3\nvertex_mm = 100\n[fixed.view.upper]\nviewpoint_mm = 120\n",
        "fixed.mirror.direct",
        "leave one of them out",
    ),
    "fixed vertex and viewpoint of no mirror": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nvertex_mm = 50\n[fixed.view.upper]\nviewpoint_mm = 120\n",
        "fixed.mirror.direct",
        "leave no mirror",
    ),
    "fixed sphere round the pinhole": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nvertex_mm = 50\nradius_mm = -50\n",
        "fixed.mirror.direct",
        "leave no mirror",
    ),
    "fixed secondary without a focus at the pinhole": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.secondary]\nconic = -1.3\nvertex_mm = 100\nradius_mm = 20\n",
        "fixed.mirror.secondary.conic = -1.3",
        "must be -1.44 for a focus at the pinhole",
    ),
    "fixed primary without a focus at its viewpoint": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.primary]\nconic = -1.3\nvertex_mm = 9\nradius_mm = -8\n[fixed.view.lower]\nviewpoint_mm = 11\n",
        "fixed.mirror.primary.conic = -1.3",
        "must be -25 for a focus at the lower viewpoint",
    ),
    "fixed mirrors of two families": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.primary]\nconic = -1.3\n[fixed.mirror.lower]\nconic = -1.3\n",
        "fixed.mirror",
        "none of the 44 configurations has these mirrors together: primary (hyperboloid), lower (hyperboloid)",
    ),
    "fixed paraboloid with a hyperboloid": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.primary]\nconic = -1\n[fixed.mirror.secondary]\nconic = -1.3\n",
        "fixed.mirror",
        "none of the 44",
    ),
    "fixed direct paraboloid": (
        "[fixed.mirror.primary]\nradius_mm = -12\nconic = -1.3\n\n[fixed.view.upper]\ngain = 0.05\n",
        "[fixed.mirror.direct]\nconic = -1\n",
        "fixed.mirror",
        "none of the 44",
    ),
    "name of a folder above": ("baseline_mm = 100", 'baseline_mm = 100\nname = "../x"', "name", "letters, digits"),
    "number of thousands of digits": ("noise_px = 0.1", "noise_px = " + "9" * 5000, "TOML", "not valid TOML"),
    "key twice": ("noise_px = 0.1", "noise_px = 0.1\nnoise_px = 0.2", "line 3", "not valid TOML"),
    "key with a line break": ("noise_px = 0.1", '"noise\\npx" = 0.1', "noise px", "did you mean noise_px?"),
    "value with a line break": ("noise_px = 0.1", 'noise_px = "a\\nb"', "noise_px", "a number from 0.001 to 10"),
    "value of thousands of characters": (
        "noise_px = 0.1",
        f'noise_px = "{"x" * 9999}"',
        "noise_px",
        "a number from 0.001 to 10",
    ),
    "deep nesting": ("noise_px = 0.1", "noise_px = " + "[" * 3000 + "]" * 3000, "nested", "nested too deeply"),
}

FILES = {
    "empty": (b"", "is required but missing"),
    "byte-order mark": (b"\xef\xbb\xbf" + SAMPLE.encode(), "byte-order mark"),
    "UTF-16": (SAMPLE.encode("utf-16"), "not UTF-8 text"),
    "Latin-1": (SAMPLE.encode() + b"# \xe4", "not UTF-8 text"),
    "binary": (bytes(range(256)) * 8, "UTF-8"),
    "null bytes": (b"\0" * 100, "not valid TOML"),
    "JSON": (b'{"baseline_mm": 100}', "not valid TOML"),
    "huge": (b"# comment\n" * 200_000, "larger than 1 MB"),
}


def refusal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> str:
    """Run the study of a file in tmp_path; return the one line of its refusal."""
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    result = CliRunner().invoke(cli, ["study", name])
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert len(lines) == 1, result.stderr
    assert "Traceback" not in lines[0]
    assert len(lines[0]) < 400
    assert name in lines[0]
    assert sorted(tmp_path.rglob("*")) == before
    return lines[0]


@pytest.mark.parametrize("case", MALFORMED)
def test_a_malformed_requirement_ends_with_one_line(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, new, key, allowed = MALFORMED[case]
    assert old in SAMPLE
    (tmp_path / "asked.toml").write_text(SAMPLE.replace(old, new, 1), encoding="utf-8")
    line = refusal(tmp_path, monkeypatch, "asked.toml")
    assert key in line
    assert allowed in line


@pytest.mark.parametrize("case", FILES)
def test_a_file_that_is_no_toml_ends_with_one_line(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content, allowed = FILES[case]
    (tmp_path / "asked.toml").write_bytes(content)
    assert allowed in refusal(tmp_path, monkeypatch, "asked.toml")


@pytest.mark.parametrize(
    ("table", "allowed"),
    [
        ("envelope", "must be a table with the keys height_mm, diameter_mm, mirror_diameter_mm"),
        ("fixed", "must be a table with the keys mirror, view"),
    ],
)
def test_a_number_where_a_table_belongs(
    table: str, allowed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = tomllib.loads(SAMPLE) | {table: 5}
    (tmp_path / "asked.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    assert f"asked.toml: {table} = 5: {allowed}" in refusal(tmp_path, monkeypatch, "asked.toml")


@pytest.mark.parametrize("lens", ["12 mm", 12, []])
def test_a_lens_that_is_neither_table_nor_catalogue(
    lens: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = tomllib.loads(SAMPLE)
    content["camera"]["lens"] = lens
    (tmp_path / "asked.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    line = refusal(tmp_path, monkeypatch, "asked.toml")
    assert f"camera.lens = {lens!r}: must be a table [camera.lens], or a catalogue" in line


def test_a_folder_or_an_absent_file_ends_with_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "folder.toml").mkdir()
    assert "cannot be read: Is a directory" in refusal(tmp_path, monkeypatch, "folder.toml")
    assert "cannot be read: No such file" in refusal(tmp_path, monkeypatch, "absent.toml")


def test_one_bad_lens_of_a_catalogue_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lens = SAMPLE[SAMPLE.index("[camera.lens]") : SAMPLE.index("[manufacture]")]
    catalogue = lens.replace("[camera.lens]", "[[camera.lens]]")
    wide = catalogue.replace("radius_mm = 7", 'radius_mm = 41\nname = "fat"')
    (tmp_path / "asked.toml").write_text(SAMPLE.replace(lens, catalogue + wide), encoding="utf-8")
    assert "lens 2 (fat)" in refusal(tmp_path, monkeypatch, "asked.toml")
    wrong = catalogue.replace("f_number = 5.6", "f_number = 0")
    (tmp_path / "asked.toml").write_text(SAMPLE.replace(lens, catalogue + wrong), encoding="utf-8")
    assert "camera.lens.1.f_number = 0:" in refusal(tmp_path, monkeypatch, "asked.toml")
