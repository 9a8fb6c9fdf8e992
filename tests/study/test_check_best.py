"""The best designs of a study checked end to end."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

import pytest
from mortal import ALWAYS, name_of_design, pass_check, raising

from designer.design import read_design, write_design
from designer.report.content.check_section import check_page
from designer.study import checks
from designer.study.checked import read_check, read_unchecked
from designer.study.checks import CheckProgress, best_designs, check_best
from designer.study.results import Row
from support import DATA

HEADER = "configuration,family,topology,status,reason\n"


def _folder(path: Path) -> Path:
    """A study's folder that holds one small design."""
    design = read_design(DATA / "folded_hypl_hy.json")
    pixels = {"width_px": 800, "height_px": 600, "pixel_pitch_mm": 2 * design.camera.pixel_pitch_mm}
    coarse = design.model_copy(update={"camera": design.camera.model_copy(update=pixels)})
    (path / "designs").mkdir(parents=True)
    write_design(coarse, path / "designs" / f"{design.configuration}.json")
    rows = (
        f"{design.configuration},folded,upper_outer,feasible,\ndirect-ElEl-upper_outer,direct,upper_outer,impossible,\n"
    )
    (path / "designs.csv").write_text(HEADER + rows, encoding="utf-8")
    return path


def test_only_feasible_designs_are_checked_and_earlier_checks_go(tmp_path: Path) -> None:
    folder = _folder(tmp_path / "study")
    assert [design.configuration for design in best_designs(folder, 3)] == ["folded-HyPl-Hy-upper_outer"]
    earlier, notes = folder / "checks" / "direct-HyHy-upper_outer", folder / "checks" / "mine"
    for place, name in ((earlier, "check.json"), (notes, "notes.txt")):
        place.mkdir(parents=True)
        (place / name).write_text("{}", encoding="utf-8")
    assert check_best(folder, 0) == {}
    assert not earlier.exists()
    assert notes.exists()


def test_a_check_that_breaks_down_is_said_and_stops_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = _folder(tmp_path / "study")
    (path,) = (folder / "designs").iterdir()
    design = read_design(path)
    camera = design.camera.model_copy(update={"width_px": 16})
    other = design.model_copy(update={"camera": camera})
    broken = partial(raising, tmp_path, {design.configuration: ALWAYS}, name_of_design, pass_check)
    monkeypatch.setattr(checks, "_check_and_write", broken)
    told: list[CheckProgress] = []
    assert check_best(folder, 1, progress=told.append) == {design.configuration: False}
    (step,) = told
    assert step.problem == "RuntimeError: broken"
    written = folder / "checks" / design.configuration
    assert read_check(written, design) is None
    assert read_unchecked(written, design) == step.problem
    assert read_unchecked(written, other) is None
    assert check_best(folder, 0) == {}
    assert not written.exists()


@pytest.mark.slow
def test_a_check_is_written_that_the_report_reads_and_is_the_same_twice(tmp_path: Path) -> None:
    folder = _folder(tmp_path / "study")
    (design,) = best_designs(folder, 3)
    told: list[CheckProgress] = []
    passed = check_best(folder, 3, progress=told.append)
    checked = read_check(folder / "checks" / design.configuration, design)
    assert checked is not None
    row = Row(design.configuration, "folded", "upper_outer", "feasible", "", {"rank": 1.0}, {})
    assert " px (" in check_page(row, checked)
    assert passed == {design.configuration: checked.passed}
    assert [(step.done, step.total, step.passed) for step in told] == [(1, 1, checked.passed)]
    again = tmp_path / "again"
    shutil.copytree(folder, again)
    check_best(again, 3)
    for name in ("raw.png", "upper.png", "check.npz", "check.json"):
        first, second = (place / "checks" / design.configuration / name for place in (folder, again))
        assert first.read_bytes() == second.read_bytes(), name
