"""``designer tolerance``: what it refuses, what it says of a bad design, and what it never overwrites."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from designer import api
from designer.as_built.study import study_tolerances
from designer.as_built.tolerances import CameraTolerances, MirrorTolerances, Tolerances, tolerances_of_grade
from designer.cli import cli
from designer.cli.tolerance import describe_tolerances
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


def tight(**others):
    """Tolerances of zero but for those given of the mirrors."""
    mirrors = dict.fromkeys(MirrorTolerances.model_fields, 0.0) | others
    return Tolerances(
        mirrors=MirrorTolerances.model_validate(mirrors),
        camera=CameraTolerances.model_validate(dict.fromkeys(CameraTolerances.model_fields, 0.0)),
    )


def test_what_has_no_tolerance_may_depart_by_anything_only_if_it_does_nothing():
    """A plane's shift within itself and the scale of the image do nothing; a tilt does, whatever its tolerance."""
    design = sharp_design(SHARP_NAMES[1]).model_copy(update={"sharpness": None})
    impacts = {i.parameter.name: i for i in study_tolerances(design, tight(), 10).impacts}
    for name in ("secondary decentre x", "secondary decentre y", "camera principal distance departure"):
        assert impacts[name].allowed_in_words() == "any"
    usual = study_tolerances(design, tolerances_of_grade("standard"), 10).impacts
    tilt = next(i for i in usual if i.parameter.name == "direct tilt x")
    assert impacts["direct tilt x"].allowed == pytest.approx(tilt.allowed, rel=1e-6)


@pytest.mark.parametrize("uncertainty", [0.0, 2e-4])
def test_the_depth_error_is_said_to_count_the_scale_where_it_does(uncertainty):
    design = sharp_design(SHARP_NAMES[13]).model_copy(update={"scale_uncertainty": uncertainty})
    first = describe_tolerances(study_tolerances(design, tight(), 10))[0]
    assert first.endswith(" % as designed (noise and scale)" if uncertainty else " % as designed (noise)")


def test_few_good_sensors_bring_a_hint():
    design = sharp_design(SHARP_NAMES[0])
    names = " or ".join(mirror.name for mirror in design.mirrors)
    said = {}
    for grade in ("coarse", "standard"):
        study = study_tolerances(design, tolerances_of_grade(grade), 200)
        assert study.trials.result.value < 0.1
        said[grade] = "\n".join(describe_tolerances(study))
    assert f"  few are good: try --grade standard, and --align {names}, if assembly" in said["coarse"]
    assert "  few are good: try --grade precision, and --align" in said["standard"]
    aligned = "\n".join(
        describe_tolerances(study_tolerances(design, tolerances_of_grade("coarse"), 200, align="secondary"))
    )
    assert "try --grade standard\n" in aligned
    own = "\n".join(
        describe_tolerances(study_tolerances(design, Tolerances(mirrors=MirrorTolerances(tilt_deg=1.0)), 50))
    )
    assert 'try grade = "precision" or tighter tolerances of your own, and --align' in own
    assert "few are good" not in "\n".join(describe_tolerances(study_tolerances(design, tight(), 200)))
