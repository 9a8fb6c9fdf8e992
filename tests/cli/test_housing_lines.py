"""`designer trace` and `designer evaluate` on designs with a housing, and absurd ones."""

import json

import pytest
from click.testing import CliRunner

from designer.cli import cli
from designer.design import write_design
from designer.verify.wall_reflections import wall_reflections
from support.housings import with_struts, with_tube
from support.studied_designs import SHARP_NAMES, sharp_design

DESIGN = sharp_design(SHARP_NAMES[2])


def run(tmp_path, design, *arguments):
    write_design(design, tmp_path / "design.json")
    return CliRunner().invoke(cli, [arguments[0], str(tmp_path / "design.json"), *arguments[1:]])


def test_trace_says_what_a_tube_does(tmp_path):
    result = run(tmp_path, with_tube(DESIGN), "trace")
    assert result.exit_code == 0
    assert "depth without correction at 120 mm: -1.138 mm" in result.output
    assert "epipolar geometry does not change" in result.output
    assert "the inner wall reflects the far side" in result.output


def test_evaluate_says_it_in_words_and_in_json(tmp_path):
    design = with_tube(DESIGN)
    assert "smeared over 0.658 mm" in run(tmp_path, design, "evaluate").output
    content = json.loads(run(tmp_path, design, "evaluate", "--json").stdout)
    assert content["evaluation"]["housing"]["uncorrected_bias"][0]["bias_mm"] == pytest.approx(-1.138, abs=1e-3)
    (first, *_) = wall_reflections(design)["upper"]
    assert content["wall_reflections_deg"]["upper"][0] == pytest.approx(list(first))
    assert "housing" not in json.loads(run(tmp_path, DESIGN, "evaluate", "--json").stdout)["evaluation"]


def test_struts_are_described(tmp_path):
    result = run(tmp_path, with_struts(DESIGN), "trace")
    assert "3 struts, 4 mm thick" in result.output
    assert "at 0, 120, 240 deg" in result.output


@pytest.mark.parametrize(
    "change",
    [
        {"inner_radius_mm": 1e-6},
        {"wall_mm": 1e6},
        {"inner_radius_mm": 1e6},
        {"low_mm": -1e6, "high_mm": -9e5},
        {"wall_mm": 1e-300},
    ],
)
def test_an_absurd_tube_is_rejected_and_not_stumbled_over(tmp_path, change):
    design = with_tube(DESIGN)
    absurd = design.model_copy(update={"housing": design.housing.model_copy(update=change)})
    traced = run(tmp_path, absurd, "trace")
    assert traced.exit_code == 1, traced.output
    assert "NOT passed" in traced.output
    evaluated = run(tmp_path, absurd, "evaluate", "--json")
    assert evaluated.exit_code in {0, 2}
    assert not isinstance(evaluated.exception, ArithmeticError | ValueError | TypeError)
