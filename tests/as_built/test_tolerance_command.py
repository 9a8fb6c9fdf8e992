"""``designer tolerance``: what it refuses, what it says of a bad design, and what it never overwrites."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from designer import api
from designer.cli import cli
from designer.design import Design, Sharpness, write_design
from designer.files import InputError
from designer.verify.judge import judge
from support.studied_designs import SHARP_NAMES, sharp_design
from support.wide_designs import LAWS, wide_design


def run(folder, design, *words):
    write_design(design, folder / "design.json")
    words = ("tolerance", str(folder / "design.json"), "--trials", "20", "-o", str(folder / "out"), *words)
    return CliRunner().invoke(cli, words)


def test_a_design_that_the_tracer_rejects_is_called_so_first(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    design = design.model_copy(update={"sharpness": Sharpness(max_blur_deg=0.01)})
    problems = judge(design).problems
    assert any("deg allowed" in problem for problem in problems)
    result = run(tmp_path, design)
    assert result.exit_code == 1
    first, *_ = result.output.splitlines()
    assert first == f"rejected by the ray tracer: {'; '.join(problems)}"
    assert result.stderr.count("\n") == 1
    summary = json.loads((tmp_path / "out" / "tolerance.json").read_text(encoding="utf-8"))
    assert summary["problems"] == list(problems)
    assert "yield" in result.stdout


def test_a_lens_that_does_not_fill_its_image_circle_is_refused_as_by_evaluate(tmp_path):
    design = wide_design(LAWS[0])
    camera = design.camera.model_dump() | {"projection": "equisolid", "distortion": (), "focal_length_mm": 0.1}
    design = Design.model_validate({**design.model_dump(by_alias=True), "camera": camera})
    result = run(tmp_path, design)
    assert result.exit_code == 2
    assert "camera.projection: the image radius rises up to" in result.stderr
    evaluated = CliRunner().invoke(cli, ["evaluate", str(tmp_path / "design.json")])
    assert evaluated.exit_code == 2
    assert evaluated.stderr.splitlines()[-1] == result.stderr.strip()
    assert not (tmp_path / "out").exists()


def test_nothing_is_overwritten_that_it_did_not_write(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    out = tmp_path / "out"
    assert run(tmp_path, design, "--write-trial", "3", "--write-trial", "4").exit_code == 0
    assert run(tmp_path, design, "--write-trial", "4", "--seed", "1").exit_code == 0
    assert {path.name for path in out.iterdir()} == {
        "sensitivity.csv",
        "tolerance.json",
        "trial_000004.json",
        "trials.csv",
    }
    assert json.loads((out / "tolerance.json").read_text(encoding="utf-8"))["provenance"]["seed"] == 1
    before = {path: path.read_bytes() for path in out.iterdir()}
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    result = run(tmp_path, design)
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"{out}: notes.txt: not written by designer tolerance, or changed since" in result.stderr
    assert {path: path.read_bytes() for path in before} == before
    (out / "notes.txt").unlink()
    (out / "trials.csv").write_text("edited", encoding="utf-8")
    with pytest.raises(InputError, match=r"trials\.csv: not written by designer tolerance, or changed since"):
        api.tolerance(design, trials=20, folder=out)
    assert (out / "trials.csv").read_text(encoding="utf-8") == "edited"


@pytest.mark.parametrize("content", ["{}", "[]", '{"files": 3}', "no JSON", '{"files": {"../design.json": null}}'])
def test_a_folder_with_another_summary_is_refused(tmp_path, content):
    out = tmp_path / "out"
    out.mkdir()
    (out / "tolerance.json").write_text(content, encoding="utf-8")
    result = run(tmp_path, sharp_design(SHARP_NAMES[13]))
    assert (result.exit_code, result.stdout) == (2, "")
    assert "tolerance.json: not written by designer tolerance" in result.stderr
    assert (out / "tolerance.json").read_text(encoding="utf-8") == content


def test_a_run_that_broke_off_is_replaced(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "tolerance.json").write_text('{"files": {"trials.csv": null}}', encoding="utf-8")
    (out / "trials.csv").write_text("half", encoding="utf-8")
    assert run(tmp_path, sharp_design(SHARP_NAMES[13])).exit_code == 0
    assert (out / "trials.csv").read_text(encoding="utf-8").startswith("trial,")
