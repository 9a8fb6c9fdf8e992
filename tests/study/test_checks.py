"""Designs of a study checked end to end."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path

import pytest
from mortal import ALWAYS, break_at_the_pinhole, name_of_design, pass_check, raising

from designer.design import Design, read_design
from designer.imaging.endtoend.check_files import fingerprint
from designer.report.content.check_section import check_page
from designer.study import checks
from designer.study.checked import read_check, read_unchecked
from designer.study.checks import CheckProgress, check_designs
from designer.study.manifest import settle
from designer.study.row import Row
from support import DATA

OLD_HASH = "4db91a2773d6774951fd51ed109e51c40d77c1ea04ac43bde7b1d851cc66b156"


@pytest.fixture
def design() -> Design:
    """A small design, quick to check."""
    whole = read_design(DATA / "folded_hypl_hy.json")
    pixels = {"width_px": 800, "height_px": 600, "pixel_pitch_mm": 2 * whole.camera.pixel_pitch_mm}
    return whole.model_copy(update={"camera": whole.camera.model_copy(update=pixels)})


def test_earlier_checks_go_and_nothing_else(tmp_path: Path) -> None:
    earlier, notes = tmp_path / "checks" / "direct-HyHy-upper_outer", tmp_path / "checks" / "mine"
    for place, name in ((earlier, "check.json"), (notes, "notes.txt")):
        place.mkdir(parents=True)
        (place / name).write_text("{}", encoding="utf-8")
    settle(tmp_path, ["checks/direct-HyHy-upper_outer/check.json"])
    assert check_designs([], tmp_path) == {}
    assert not earlier.exists()
    assert notes.exists()


def test_a_check_that_breaks_down_is_said_and_stops_nothing(
    design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "study"
    camera = design.camera.model_copy(update={"width_px": 16})
    other = design.model_copy(update={"camera": camera})
    broken = partial(raising, tmp_path, {design.configuration: ALWAYS}, name_of_design, pass_check)
    monkeypatch.setattr(checks, "_check_half", broken)
    told: list[CheckProgress] = []
    assert check_designs([design], folder, progress=told.append) == {design.configuration: False}
    (step,) = told
    assert step.problem == "RuntimeError: broken"
    written = folder / "checks" / design.configuration
    assert read_check(written, design) is None
    assert read_unchecked(written / "unchecked.json", design) == step.problem
    assert read_unchecked(written / "unchecked.json", other) is None
    assert check_designs([], folder) == {}
    assert not written.exists()


def test_a_check_of_which_one_half_breaks_down_leaves_nothing_of_the_other(
    design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checks, "_check_half", break_at_the_pinhole)
    assert check_designs([design], tmp_path) == {design.configuration: False}
    (left,) = (tmp_path / "checks" / design.configuration).iterdir()
    assert read_unchecked(left, design) == "RuntimeError: broken"


@pytest.mark.slow
def test_a_check_is_written_that_the_report_reads_and_is_the_same_twice(design: Design, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    told: list[CheckProgress] = []
    passed = check_designs([design], folder, progress=told.append)
    checked = read_check(folder / "checks" / design.configuration, design)
    assert checked is not None
    row = Row({"configuration": design.configuration, "status": "feasible", "rank": 1})
    assert " px (" in check_page(row, checked)
    assert passed == {design.configuration: checked.passed}
    assert [(step.done, step.total, step.passed) for step in told] == [(1, 1, checked.passed)]
    again = tmp_path / "again"
    shutil.copytree(folder, again)
    check_designs([design], again)
    for name in ("raw.png", "upper.png", "check.npz", "check.json"):
        first, second = (place / "checks" / design.configuration / name for place in (folder, again))
        assert first.read_bytes() == second.read_bytes(), name


def test_an_old_design_keeps_the_hash_that_its_check_was_written_with() -> None:
    """By the code of before the uncertainty of the scale was recorded."""
    design = read_design(DATA / "folded_hypl_hy.json")
    assert fingerprint(design) == OLD_HASH
    assert fingerprint(design.model_copy(update={"scale_uncertainty": 2e-4})) != OLD_HASH
