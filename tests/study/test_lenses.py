"""What a study says of each lens of a catalogue is what a study of that lens alone finds."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from designer.files import InputError
from designer.optimise.search import search
from designer.requirement import Requirement, set_key
from designer.study.folder import read_study, write_study
from designer.study.manifest import read_manifest
from designer.study.names import LENSES
from designer.study.run import run_study
from designer.study.study import Study
from support.shipped_problems import CONFIGURATIONS, shipped_requirement

NAME = "folded-HyHy-Hy-upper_outer"
NUMBERS = (
    "depth_error_rms",
    "height_mm",
    "diameter_mm",
    "f_number",
    "focus_distance_mm",
    "largest_blur_px",
    "largest_blur_deg",
)
REQUIREMENT = set_key(shipped_requirement("indoor_robot"), "solve.starts", 3)


def lens(name: str, **changes: float) -> dict[str, Any]:
    given: dict[str, Any] = REQUIREMENT.camera.model_dump(exclude_unset=True)["lens"]
    return given | {"name": name} | changes


GOOD = lens("12 mm")
WORSE = lens("8 mm", focal_length_mm=8.0)
TOO_LONG = lens("25 mm", focal_length_mm=25.0, nearest_focus_mm=200.0)
UNNAMED = lens("")


def with_lenses(*lenses: dict[str, Any]) -> Requirement:
    return set_key(REQUIREMENT, "camera.lens", list(lenses) if len(lenses) > 1 else lenses[0])


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    folder = tmp_path_factory.mktemp("lenses")
    return run_study(with_lenses(WORSE, GOOD, TOO_LONG), folder, only=(NAME,)), folder


def test_each_lens_reaches_what_a_study_of_it_alone_finds(catalogue, tmp_path):
    """Two lenses are feasible and one is not; the best is not the first."""
    study, _ = catalogue
    rows = study.lenses_of(NAME)
    assert [(row.number, row.lens, row.status, row.is_chosen) for row in rows] == [
        (1, "8 mm", "feasible", False),
        (2, "12 mm", "feasible", True),
        (3, "25 mm", "infeasible", False),
    ]
    for number, (row, one) in enumerate(zip(rows, (WORSE, GOOD, TOO_LONG), strict=True)):
        alone = run_study(with_lenses(one), tmp_path / str(number), only=(NAME,))
        (found,) = alone.rows
        assert (row.status, row.reason) == (found.status, found.reason)
        for name in NUMBERS:
            value = getattr(row, name)
            assert value == (None if found.number(name) is None else pytest.approx(found.number(name), rel=1e-9))
        assert alone.lenses == ()
        assert not (tmp_path / str(number) / LENSES).exists()
    assert rows[0].depth_error_rms > 1.02 * rows[1].depth_error_rms


def test_the_chosen_lens_is_that_of_the_design(catalogue):
    study, _ = catalogue
    (chosen,) = [row for row in study.lenses if row.is_chosen]
    (row,) = study.rows
    assert chosen.lens == row.text("lens")
    for name in NUMBERS:
        assert getattr(chosen, name) == row.number(name)


def test_the_file_holds_what_the_study_knows_and_can_be_read_back(catalogue, tmp_path):
    study, folder = catalogue
    with (folder / LENSES).open(encoding="utf-8", newline="") as stream:
        written = list(csv.DictReader(stream))
    assert [row["lens"] for row in written] == ["8 mm", "12 mm", "25 mm"]
    assert written[2]["depth_error_rms"] == ""
    assert written[2]["reason"] == study.lenses[2].reason
    again = read_study(folder)
    write_study(again, tmp_path)
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / LENSES), pd.read_csv(folder / LENSES))
    assert [row.is_chosen for row in again.lenses] == [False, True, False]
    assert LENSES in (read_manifest(tmp_path) or {})
    # A study with one lens leaves no table of an earlier one behind.
    write_study(Study(study.requirement, study.rows, study.designs), tmp_path)
    assert not (tmp_path / LENSES).exists()
    damaged = (folder / LENSES).read_text(encoding="utf-8").replace(f"{NAME},1,", f"{NAME},first,")
    (tmp_path / LENSES).write_text(damaged, encoding="utf-8")
    with pytest.raises(InputError, match=r"lenses\.csv: number = 'first': must be the number of a lens"):
        read_study(tmp_path)


def test_a_lens_without_a_name_has_its_number_and_one_that_a_rule_excludes_its_rule(tmp_path):
    """The inner zone is nothing beside the gap where the second lens is so short."""
    tiny = lens("2.5 mm", focal_length_mm=2.5)
    asked = set_key(with_lenses(UNNAMED, tiny), "manufacture.zone_gap_px", 300)
    study = run_study(asked, tmp_path, only=("folded-HyPl-Hy-upper_outer",))
    first, second = study.lenses
    assert first.lens == "lens 1"
    assert second.status == "impossible"
    assert second.reason


def test_with_one_lens_or_unasked_a_search_says_nothing_of_lenses():
    chosen = CONFIGURATIONS["folded-PlHy-Hy-upper_outer"]
    assert search(with_lenses(GOOD), chosen, each_lens=True).by_lens == ()
    assert search(with_lenses(GOOD, WORSE), chosen).by_lens == ()
    both = search(with_lenses(GOOD, WORSE), chosen, each_lens=True)
    assert [found.status for found in both.by_lens] == ["impossible", "impossible"]
