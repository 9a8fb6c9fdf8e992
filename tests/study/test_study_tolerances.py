"""What the best designs of a study forgive: as of each alone, kept in the folder, told in the report."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.as_built.named import NamedTolerances, named_tolerances
from designer.as_built.study import study_tolerances
from designer.as_built.tolerances import tolerances_of_grade
from designer.cli.tolerated import forgiveness
from designer.files import InputError
from designer.report.content.as_built import as_built, most_forgiving_in_words
from designer.requirement import read_requirement
from designer.study.names import TOLERANCES
from designer.study.row import Row
from designer.study.study import Study
from designer.study.tolerances import (
    Forgiveness,
    StudyTolerances,
    read_tolerances_of_study,
    to_be_built,
    tolerate_designs,
)
from support import CONFIGS
from support.studied_designs import sharp_design

NAMES = ("indoor_robot:folded-HyHy-Hy-upper_outer", "indoor_robot:folded-HyPl-Hy-upper_inner")
DESIGNS = [sharp_design(name).model_copy(update={"scale_uncertainty": 2e-4}) for name in NAMES]
TRIALS = 200


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def found(folder: Path) -> StudyTolerances:
    return tolerate_designs(
        DESIGNS, tolerances_of_grade("precision"), "precision", folder, jobs=2, seed=3, trials=TRIALS
    )


def study_with(found: StudyTolerances) -> Study:
    rows = tuple(
        Row({"configuration": design.configuration, "status": "feasible", "rank": rank})
        for rank, design in enumerate(DESIGNS, start=1)
    )
    designs = {design.configuration: design for design in DESIGNS}
    return Study(read_requirement(CONFIGS / "indoor_robot.toml"), rows, designs, tolerances=found)


def test_a_design_in_a_study_is_what_it_is_alone(found: StudyTolerances) -> None:
    alone = study_tolerances(DESIGNS[1], tolerances_of_grade("precision"), TRIALS, seed=3)
    record = found.of(DESIGNS[1].configuration)
    assert record is not None
    errors = np.sort(alone.trials.depth_error_after)
    assert record.depth_errors[0] == errors[0]
    assert record.depth_errors[100] == errors[-1]
    assert record.high == pytest.approx(np.quantile(errors, 0.95), rel=0.01)
    assert record.good == alone.trials.result.value
    assert [each.growth for each in record.impacts] == [each.growth_after for each in alone.impacts]
    assert record.depth_error_as_designed == alone.model.noise


def test_what_stands_in_the_folder_is_what_was_found(found: StudyTolerances, folder: Path) -> None:
    assert read_tolerances_of_study(folder, DESIGNS) == found
    # A design that is no longer the one that was tried says nothing.
    other = [DESIGNS[0], DESIGNS[1].model_copy(update={"noise_px": 0.2})]
    assert read_tolerances_of_study(folder, other) is None


@pytest.mark.parametrize("spoilt", ["{", '{"designs": 3}', "[]", ""])
def test_a_damaged_file_is_named(found: StudyTolerances, tmp_path: Path, spoilt: str) -> None:
    (tmp_path / TOLERANCES).write_text(spoilt, encoding="utf-8")
    with pytest.raises(InputError, match=r"tolerances\.json: "):
        read_tolerances_of_study(tmp_path, DESIGNS)


def test_report_and_terminal_say_it(found: StudyTolerances) -> None:
    told = "\n".join(forgiveness(study_with(found)))
    markup = as_built(study_with(found), {})
    for design in DESIGNS:
        assert design.configuration in told
        assert design.configuration in markup
    assert "the winner is also the most forgiving" in told
    assert as_built(replace(study_with(found), tolerances=None), {}) == ""


def test_the_most_forgiving_design_has_the_least_high_percentile(found: StudyTolerances) -> None:
    """Even where another is better as designed."""
    steep = tuple(np.linspace(0.010, 0.030, 101))
    flat = tuple(np.linspace(0.012, 0.014, 101))
    first = Forgiveness(configuration="a", design_sha256="", depth_error_as_designed=0.010, depth_errors=steep)
    second = Forgiveness(configuration="b", design_sha256="", depth_error_as_designed=0.012, depth_errors=flat)
    blind = Forgiveness(configuration="c", design_sha256="", depth_errors=(None,) * 101)
    both = found.model_copy(update={"designs": (first, second, blind)})
    assert both.most_forgiving is second
    words = most_forgiving_in_words(both)
    assert "is b: 1.390 % at the 95th percentile, where the winner has 2.900 %" in words
    assert "As designed, it has 1.200 % and the winner 1.000 %" in words


def test_tolerances_are_a_grade_or_a_file(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text("[mirror.secondary]\ntilt_deg = 0.02\n", encoding="utf-8")
    assert named_tolerances("coarse") == NamedTolerances("coarse", tolerances_of_grade("coarse"))
    found = named_tolerances(str(own))
    assert (found.values.mirror["secondary"].tilt_deg, found.name) == (0.02, "own.toml")
    own.write_text("[mirror.third]\ntilt_deg = 0.02\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"mirror\.third: must be a mirror of the design: lower, upper, primary"):
        named_tolerances(str(own))
    with pytest.raises(InputError, match="tolerances fine: must be coarse, standard, precision, or a TOML file"):
        named_tolerances("fine")


def test_a_design_that_cannot_be_built_says_why(tmp_path: Path) -> None:
    mirror = DESIGNS[0].mirrors[0]
    cut = mirror.model_copy(update={"radius_mm": 500.0})
    broken = DESIGNS[0].model_copy(update={"mirrors": (cut, *DESIGNS[0].mirrors[1:])})
    found = tolerate_designs([broken], tolerances_of_grade("coarse"), "coarse", tmp_path, trials=10)
    assert found.designs[0].problem
    assert json.loads((tmp_path / TOLERANCES).read_text())["designs"][0]["problem"] == found.designs[0].problem


def test_a_design_that_forgives_more_than_the_best_is_built_too() -> None:
    """Whichever it is by ray tracing: the direct design at standard tolerances, though its nominal error is larger."""
    names = ("ceiling_watch:folded-HyEl-El-upper_inner", "ceiling_watch:direct-HyEl-upper_inner")
    folded, direct = (sharp_design(name) for name in names)
    standard = tolerances_of_grade("standard")
    traced = [
        np.quantile(study_tolerances(design, standard, TRIALS, seed=3).trials.depth_error_after, 0.95)
        for design in (folded, direct)
    ]
    assert traced[1] < 0.7 * traced[0]
    assert to_be_built([folded, direct], standard, best=1) == [folded, direct]
    assert to_be_built([direct, folded], standard, best=1) == [direct]
    assert to_be_built([folded, direct], standard, best=2) == [folded, direct]
