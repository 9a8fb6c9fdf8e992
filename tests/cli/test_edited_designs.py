"""``designer evaluate`` and ``designer trace`` on records that were edited by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from designer.cli import cli
from support import DATA

PROTOTYPE = DATA / "folded_hypl_hy.json"
Edit = Callable[[dict[str, Any]], object]


def run(command: str, edit: Edit, folder: Path, *options: str) -> Result:
    record = json.loads(PROTOTYPE.read_text(encoding="utf-8"))
    edit(record)
    path = folder / "design.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    return CliRunner().invoke(cli, [command, *options, str(path)])


def swap_views(record: dict[str, Any]) -> None:
    views = record["views"]
    views["upper"], views["lower"] = views["lower"], views["upper"]


def nothing(record: dict[str, Any]) -> None:
    """A record as it was."""


@pytest.mark.parametrize(
    ("edit", "warning"),
    [
        (lambda record: record.update(baseline_mm=90), "baseline_mm is recorded as 90, but the viewpoints lie 100 mm"),
        (lambda record: record.update(baseline_mm=-5), "baseline_mm is recorded as -5"),
        (swap_views, "views.upper has its viewpoint at 0 mm, below that of views.lower at 100 mm"),
        (lambda record: record["views"]["upper"].update(viewpoint_mm=110), "cross the axis at 100 mm"),
        (lambda record: record["views"]["lower"].update(gain=0.05), "views.lower.gain is recorded as 0.05"),
        (lambda record: record["views"]["lower"].update(sense="direct"), "views.lower.sense is recorded as direct"),
    ],
)
def test_a_contradiction_is_a_warning_and_the_mirrors_are_scored(edit: Edit, warning: str, tmp_path: Path):
    true = json.loads(run("evaluate", nothing, tmp_path, "--json").stdout)
    assert true["warnings"] == []
    result = run("evaluate", edit, tmp_path, "--json")
    assert result.exit_code == 0
    assert result.stderr.startswith("designer: warning: ")
    assert warning in result.stderr
    content = json.loads(result.stdout)
    assert content["evaluation"]["baseline_mm"] == pytest.approx(100.0)
    for key in ("depth_error_rms", "limit_ratio", "depth_error_rms_second_order"):
        assert content["evaluation"][key] == pytest.approx(true["evaluation"][key], rel=1e-9)
    assert content["trace"]["passed"] is False
    assert run("trace", edit, tmp_path).exit_code == 1


def test_other_contradictions_are_warnings_too(tmp_path: Path):
    result = run(
        "evaluate", lambda record: record.update(height_mm=50, configuration="direct-HyHy-upper_outer"), tmp_path
    )
    assert result.exit_code == 0
    assert [line for line in result.stderr.splitlines() if "height_mm is 50" in line and "115.472" in line]
    assert [line for line in result.stderr.splitlines() if "configuration direct-HyHy-upper_outer" in line]


def test_fabrication_notes_come_before_the_verdict(tmp_path: Path):
    def narrow(record: dict[str, Any]) -> None:
        record["mirrors"][1]["inner_radius_mm"] = 0.3

    note = json.loads(run("evaluate", narrow, tmp_path, "--json").stdout)["evaluation"]["fabrication_notes"][0]
    assert "has a hole 0.60 mm in diameter (below 2 mm)" in note
    assert f"before ordering mirrors:\n  - {note}\n" in run("evaluate", narrow, tmp_path).stdout


def test_a_refusal_names_the_file(tmp_path: Path):
    result = run("evaluate", lambda record: record["mirrors"][1].update(radius_mm=-1e-300), tmp_path)
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1] == (
        f"designer: {tmp_path / 'design.json'}: mirrors.1.radius_mm = -1e-300: "
        "must be zero or from 1e-15 to 1e+15 in magnitude"
    )


@pytest.mark.parametrize(
    ("noise_px", "said", "unsaid"),
    [
        (0.1, (), ("first order:", "Monte Carlo", "68 %")),
        (0.3, ("depth error, first order:", "with second order:"), ("neither is valid",)),
        (0.8, ("depth error, first order:", "neither is valid at the worst points"), ()),
    ],
)
def test_what_first_order_does_not_say(noise_px: float, said: tuple[str, ...], unsaid: tuple[str, ...], tmp_path: Path):
    output = run("evaluate", lambda record: record.update(noise_px=noise_px), tmp_path).stdout
    assert all(words in output for words in said)
    assert not any(words in output for words in unsaid)


@pytest.mark.parametrize(("uncertainty", "said"), [(0.0, "does not count it"), (2e-4, "a scale known to 0.02 %")])
def test_what_the_scale_does_is_said(uncertainty: float, said: str, tmp_path: Path):
    output = run("evaluate", lambda record: record.update(scale_uncertainty=uncertainty), tmp_path).stdout
    (line,) = [line for line in output.splitlines() if line.startswith("0.1 % of image scale shifts the depth by ")]
    assert said in line


def test_the_middle_of_the_monte_carlo_is_the_second_order_deviation_where_that_holds(tmp_path: Path):
    content = json.loads(run("evaluate", lambda record: record.update(noise_px=0.5), tmp_path, "--json").stdout)
    measured, summary = content["monte_carlo"], content["evaluation"]
    assert summary["second_order_valid"] is False
    assert measured["lost"] == 0
    # Errors of near and far points mixed: narrower in the middle than a Gaussian of the same rms.
    width = (measured["high"] - measured["low"]) / 2
    assert 0.7 * summary["depth_error_rms"] < width < summary["depth_error_rms_second_order"]
    assert measured["high"] > -measured["low"] > 0
