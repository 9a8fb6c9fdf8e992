"""``designer export``: which files it writes where, and with which line it refuses."""

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from designer import api
from designer.cli import cli
from designer.export.formats import EXPORTS
from designer.extras import is_installed
from support import DATA, ROOT

PROTOTYPE = DATA / "folded_hypl_hy.json"
FILES = {
    "sag": {"secondary.csv", "primary.csv", "direct.csv"},
    "zmx": {"upper.zmx", "lower.zmx"},
    "optiland": {"upper.json", "lower.json"},
    "stl": {"secondary.stl", "primary.stl", "direct.stl"},
    "step": {"secondary.step", "primary.step", "direct.step", "assembly.step"},
    "drawing": {"secondary.pdf", "primary.pdf", "direct.pdf", "assembly.pdf"},
    "drawing-dxf": {"secondary.dxf", "primary.dxf", "direct.dxf", "assembly.dxf"},
}

UNITS = {".step": b"SI_UNIT(.MILLI.,.METRE.)", ".pdf": b""}
"""How a file says that its lengths are in mm, if not in these letters; pages are compressed."""


def refused(*words: object) -> str:
    result = CliRunner().invoke(cli, ["export", *map(str, words)])
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    (line,) = result.stderr.splitlines()
    return line


def changed(folder: Path, *places: tuple[tuple[str | int, ...], Any]) -> Path:
    """The prototype's file with some values replaced."""
    record = json.loads(PROTOTYPE.read_text(encoding="utf-8"))
    for keys, value in places:
        part = record
        for key in keys[:-1]:
            part = part[key]
        part[keys[-1]] = value
    path = folder / "design.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", EXPORTS)
def test_every_format_is_written_alike_by_command_and_api(name: str, tmp_path: Path) -> None:
    extra = EXPORTS[name].extra
    if extra is not None and not is_installed(extra):
        pytest.skip(f"the extra {extra} is not installed")
    alone = EXPORTS[name].one_file_for == "design"
    ours, theirs = (tmp_path / f"{who}{EXPORTS[name].suffix if alone else ''}" for who in ("command", "api"))
    result = CliRunner().invoke(cli, ["export", str(PROTOTYPE), "--to", name, "-o", str(ours)])
    assert result.exit_code == 0, result.output
    written = api.export(api.read_design(PROTOTYPE), name, theirs)
    if alone:
        assert ours.read_bytes() == theirs.read_bytes()
    else:
        assert {path.name for path in ours.iterdir()} == {path.name for path in written} == FILES[name]
        assert all((ours / path.name).read_bytes() == path.read_bytes() for path in written)
    *lines, last = result.stdout.splitlines()
    assert lines == [f"{(ours if alone else ours / path.name)} written" for path in written]
    assert last == f"not in this format: {EXPORTS[name].leaves_out}"
    assert all(UNITS.get(path.suffix, b"mm") in path.read_bytes() for path in written)


def test_help_and_documentation_name_every_format() -> None:
    shown = " ".join(CliRunner().invoke(cli, ["export", "--help"]).stdout.split())
    table = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    for name, entry in EXPORTS.items():
        assert f" {name} {entry.description}; {entry.written_as}; without {entry.leaves_out}" in shown
        assert f"| `{name}` |" in table


def test_a_target_that_does_not_fit_is_refused_and_left_alone(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    assert refused(PROTOTYPE, "--to", "sag", "-o", taken).endswith(
        "taken: is a file; sag needs a folder, for a file of each mirror"
    )
    assert taken.read_text(encoding="utf-8") == "mine"
    assert refused(PROTOTYPE, "--to", "povray", "-o", tmp_path).endswith(
        "is a folder; povray needs a file that ends in .pov"
    )
    assert refused(PROTOTYPE, "--to", "povray", "-o", taken).endswith("taken: must end in .pov for povray")
    (tmp_path / "out" / "upper.zmx").mkdir(parents=True)
    assert "is a folder" in refused(PROTOTYPE, "--to", "zmx", "-o", tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["upper.zmx"]


def test_an_unknown_format_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    line = refused("absent.json", "--to", "zemax", "-o", tmp_path / "out")
    assert line == f"designer: format 'zemax': must be one of {', '.join(EXPORTS)}"
    assert "absent.json: cannot be read" in refused("absent.json", "--to", "zmx", "-o", tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "places", "words"),
    [
        ("zmx", [(("views", "upper", "elevation_deg"), [0, 95])], "views.upper: no ray of the image"),
        ("zmx", [(("mirrors", 0, "vertex_mm"), 1e12)], ""),
        ("optiland", [(("working_volume", "distance_mm"), [-1, 100])], "working_volume.distance_mm"),
        ("povray", [(("mirrors", 0, "thickness_mm"), 1e9)], "beyond what POV-Ray resolves"),
        ("sag", [(("mirrors", 0, "outer_radius_mm"), 1e9)], "mirror secondary: a face from radius 0 to 1e+09 mm"),
        (
            "sag",
            [(("mirrors", 2, "name"), "../direct"), (("views", "upper", "path"), ["../direct"])],
            "mirror '../direct': cannot name a file",
        ),
        (
            "sag",
            [(("mirrors", 2, "name"), "Primary"), (("views", "upper", "path"), ["Primary"])],
            "differ only in case",
        ),
    ],
)
def test_what_a_format_cannot_hold_is_refused_whole(
    name: str, places: list[tuple[tuple[str | int, ...], Any]], words: str, tmp_path: Path
) -> None:
    design, out = changed(tmp_path, *places), tmp_path / f"out{'.pov' if name == 'povray' else ''}"
    line = refused(design, "--to", name, "-o", out)
    assert line.startswith(f"designer: {design}: ")
    assert words in line
    assert not out.exists()
