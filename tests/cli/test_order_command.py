"""``designer order``: everything in one folder, whole or not at all, and over nothing but an order."""

import csv
import hashlib
import io
import json
import math
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from designer import api
from designer.cli import cli
from designer.departures import AsBuilt, MirrorDeparture
from designer.design import Design, write_design
from designer.export.formats import EXPORTS, exported_files
from designer.export.order import folder as order_folder
from designer.export.order.words import parts_list, read_me
from designer.extras import is_installed
from support.studied_designs import SHARP_NAMES, sharp_design
from support.wide_designs import LAWS, wide_design

DESIGN = sharp_design(SHARP_NAMES[0])

if not is_installed("drawing"):
    pytest.skip("typst, which typesets an order's drawings, is not installed", allow_module_level=True)


def run(*words: object):
    return CliRunner().invoke(cli, ["order", *map(str, words)])


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def design_file(tmp_path: Path) -> Path:
    path = tmp_path / "design.json"
    write_design(DESIGN, path)
    return path


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An order through the Python interface."""
    folder = tmp_path_factory.mktemp("orders") / "order"
    made = api.order(DESIGN, folder)
    assert set(made.files) | {order_folder.LIST} == set(content_of(folder))
    assert made.problems == ()
    return folder


def test_an_order_holds_every_format_that_is_there_and_says_what_is_not(written: Path) -> None:
    found = content_of(written)
    readme = found["README.md"].decode()
    for name, entry in EXPORTS.items():
        if entry.extra is None or is_installed(entry.extra):
            for file, content in exported_files(DESIGN, name).items():
                assert found[f"{name}/{file}"] == (content.encode() if isinstance(content, str) else content)
            assert f"- `{name}/`: {entry.description}" in readme
        else:
            assert not any(file.startswith(f"{name}/") for file in found)
            assert f"- `{name}`: format '{name}' needs more: pip install" in readme
    assert "## What is not specified yet" in readme
    assert "The independent ray tracer accepts this design." in readme
    assert Design.model_validate_json(found["design.json"]) == DESIGN


def test_the_drawings_name_the_file_that_the_order_holds(written: Path) -> None:
    """The SHA-256 on the sheets and in the README is that of design.json."""
    assert hashlib.sha256((written / "design.json").read_bytes()).hexdigest() in (written / "README.md").read_text()


def test_the_parts_list_names_each_mirror_with_its_drawing_and_mass(written: Path) -> None:
    rows = {row["part"]: row for row in csv.DictReader(io.StringIO((written / "parts.csv").read_text()))}
    for mirror in DESIGN.mirrors:
        row = rows[f"{mirror.name} mirror"]
        ring = math.pi * (mirror.outer_radius_mm**2 - mirror.inner_radius_mm**2)
        assert float(row["mass_g"]) == pytest.approx(2.70e-3 * ring * mirror.thickness_mm, abs=0.006)
        assert (written / row["drawing"]).is_file()
        assert row["quantity"] == "1"
    assert (written / rows["assembly"]["drawing"]).is_file()
    assert any(part.startswith("lens: 12 mm M12") for part in rows)


def test_a_study_and_a_configuration_are_a_design(design_file: Path, written: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    write_design(DESIGN, study / "designs" / f"{DESIGN.configuration}.json")
    result = run(study, DESIGN.configuration, "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert content_of(tmp_path / "out") == content_of(written)
    for words, told in (
        ((study,), "CONFIGURATION is missing; it has folded-HyHy-Hy-upper_outer"),
        ((study, "../design"), "has no design of ../design; it has folded-HyHy-Hy-upper_outer"),
        ((design_file, "folded"), "is no study's folder"),
        ((tmp_path / "absent.json",), "cannot be read"),
    ):
        refused = run(*words, "-o", tmp_path / "new")
        assert (refused.exit_code, refused.stdout) == (2, "")
        (line,) = refused.stderr.splitlines()
        assert told in line
        assert not (tmp_path / "new").exists()


def test_an_order_replaces_an_unchanged_order_and_nothing_else(design_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    files = {"README.md": "one", "drawing/a.pdf": b"1"}
    order_folder.write_order_folder(out, files)
    order_folder.write_order_folder(out, {"README.md": "two"})
    assert set(content_of(out)) == {"README.md", order_folder.LIST}
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
    for disturb in ("mine.txt", "README.md", order_folder.LIST):
        (out / disturb).write_text("mine")
        before = content_of(out)
        result = run(design_file, "-o", out)
        assert (result.exit_code, result.stdout) == (2, "")
        assert len(result.stderr.splitlines()) == 1
        assert content_of(out) == before
        if disturb == "mine.txt":
            (out / disturb).unlink()
        else:
            (out / "README.md").write_text("two")
    study = tmp_path / "study"
    study.mkdir()
    (study / "manifest.json").write_text("{}")
    assert "manifest.json: not written by an order" in run(design_file, "-o", study).stderr
    assert "is no folder" in run(design_file, "-o", design_file).stderr


def test_a_failure_leaves_the_earlier_order_in_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    order_folder.write_order_folder(out, {"README.md": "one"})
    before, rename = content_of(out), Path.rename

    def failing(path: Path, target: Path) -> Path:
        if path.name == "new":
            raise OSError("no space left")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(OSError, match="no space"):
        order_folder.write_order_folder(out, {"README.md": "two"})
    assert content_of(out) == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_rejected_design_is_written_with_a_warning_and_ends_with_1(tmp_path: Path) -> None:
    record = json.loads(DESIGN.model_dump_json(by_alias=True))
    record["mirrors"][2]["vertex_mm"] += 5.0
    path = tmp_path / "moved.json"
    path.write_text(json.dumps(record))
    result = run(path, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "rejected by the ray tracer: " in result.stderr
    assert "Do not order it as it is" in (tmp_path / "out" / "README.md").read_text()


def test_an_order_points_to_the_budget_of_tolerances(written: Path) -> None:
    readme = (written / "README.md").read_text()
    assert "designer tolerance" in readme
    assert "docs/tolerances.md" in readme


def test_an_order_of_a_design_with_departures_says_that_they_are_left_out(written: Path, tmp_path: Path) -> None:
    path = tmp_path / "built.json"
    built = AsBuilt(mirrors={DESIGN.mirrors[0].name: MirrorDeparture(decentre_x_mm=0.05)})
    write_design(DESIGN.model_copy(update={"as_built": built}), path)
    result = run(path, "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "(as_built)" in result.stdout
    assert "this is the design without them" in result.stdout
    assert "this is the design without them" in (tmp_path / "out" / "README.md").read_text()
    assert "as_built" not in (written / "README.md").read_text()


@pytest.mark.parametrize("law", LAWS)
def test_the_parts_list_tells_the_law_of_a_lens_to_the_last_digit(law: str) -> None:
    camera = wide_design(law).camera
    (lens,) = [row[0] for row in csv.reader(io.StringIO(parts_list(wide_design(law)))) if row[0].startswith("lens: ")]
    assert f"projection: {camera.projection}, r = " in lens
    digits = [float(found.replace("−", "-")) for found in re.findall(r"k\d = ([−\d.e]+)", lens)]
    assert digits == list(camera.distortion)


def test_words_of_a_file_stay_in_their_cells() -> None:
    camera = DESIGN.camera.model_copy(update={"name": 'a "b",\nc'})
    design = DESIGN.model_copy(update={"camera": camera, "configuration": "x\n# y"})
    assert 'camera: a "b", c' in [row[0] for row in csv.reader(io.StringIO(parts_list(design)))]
    assert read_me(design, [], {}, ()).splitlines()[0] == "# x # y"
