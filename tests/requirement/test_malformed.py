"""Malformed requirements end with one line that names file, key and what is allowed; nothing is written."""

import tomllib
from pathlib import Path

import pytest
import tomli_w
from click.testing import CliRunner
from malformed_cases import MALFORMED

from designer.cli import cli

SAMPLE = (Path(__file__).parent / "sample.toml").read_text(encoding="utf-8")

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
