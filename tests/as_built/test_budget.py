"""The cheapest classes of tolerances: against every other choice, and as a file that can be used again."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from designer.as_built import budget
from designer.as_built.budget import CLASSES, allocate, tolerances_of
from designer.as_built.model import perturbable
from designer.as_built.sensitivity import sensitivities
from designer.as_built.study import budget_csv, study_tolerances
from designer.as_built.tolerances import (
    Tolerances,
    read_tolerances,
    tolerance_of_grade,
    tolerance_values,
    tolerances_to_toml,
)
from designer.as_built.yields import simulate
from designer.files import InputError
from support.studied_designs import sharp_design

# As the shipped requirements have it: without it noise alone counts, and few sensors are good.
DESIGN = sharp_design("indoor_robot:folded-HyHy-Hy-upper_outer").model_copy(update={"scale_uncertainty": 2e-4})
OPEN = (
    ("primary", "tilt_deg"),
    ("secondary", "tilt_deg"),
    ("direct", "conic"),
    ("camera", "principal_distance_percent"),
)
TRIALS = 300


def all_but_some_given() -> Tolerances:
    """Precise tolerances of all but the open ones, and costs that make no two choices equal."""
    mirrors = {
        name: {
            key: tolerance_of_grade("precision", name, key)
            for key in ("decentre_mm", "tilt_deg", "axial_shift_mm", "radius_percent", "conic")
            if (name, key) not in OPEN
        }
        for name in ("primary", "secondary", "direct")
    }
    camera = {
        key: tolerance_of_grade("precision", "camera", key)
        for key in ("shift_mm", "tilt_deg", "axial_shift_mm", "radial_distortion")
    }
    cost = {
        "of": {
            "tilt_deg": {"coarse": 1.0, "standard": 2.3, "precision": 5.1},
            "conic": {"coarse": 0.7, "standard": 1.9, "precision": 3.2},
            "principal_distance_percent": {"coarse": 0.2, "standard": 1.3, "precision": 4.7},
        }
    }
    return Tolerances.model_validate({"mirror": mirrors, "camera": camera, "cost": cost})


@pytest.mark.slow
@pytest.mark.parametrize("asked", [0.5, 0.9])
def test_no_choice_of_classes_is_cheaper(asked: float) -> None:
    """All 81, each judged by the same traced sensors."""
    model, tolerances = perturbable(DESIGN), all_but_some_given()
    values = tolerance_values(DESIGN, model.parameters, tolerances)
    found = allocate(model, tolerances, sensitivities(model, values, 0.1), asked, TRIALS, 0)
    assert found.reached.value >= asked
    cheapest = np.inf
    for classes in itertools.product(CLASSES, repeat=len(OPEN)):
        chosen, cost = tolerances.model_dump(exclude_none=True), 0.0
        for (part, key), grade in zip(OPEN, classes, strict=True):
            table = chosen["camera"] if part == "camera" else chosen["mirror"][part]
            table[key] = tolerance_of_grade(grade, part, key)
            cost += getattr(tolerances.cost.of[key], grade)
        if cost < cheapest:
            sizes = tolerance_values(DESIGN, model.parameters, Tolerances.model_validate(chosen))
            if simulate(model, sizes, 0.1, TRIALS, 0).result.value >= asked:
                cheapest = cost
    assert found.cost == pytest.approx(cheapest)
    assert cheapest < found.cost_of_class["precision"]


def test_a_budget_can_be_used_as_a_file(tmp_path) -> None:
    """The yield that it promises is the yield of its file; given tolerances stay, and the table lists the others."""
    asked = all_but_some_given()
    study = study_tolerances(DESIGN, asked, TRIALS, asked_yield=0.8)
    assert study.budget is not None
    filled = tolerances_of(study.budget, asked)
    np.testing.assert_array_equal(tolerance_values(DESIGN, study.model.parameters, filled), study.values)
    assert {(choice.part, choice.key) for choice in study.budget.choices} == set(OPEN)
    assert study.trials.result == study.budget.reached
    assert study.trials.result.value >= 0.8
    (tmp_path / "budget.toml").write_text(tolerances_to_toml(study.tolerances), encoding="utf-8")
    again = read_tolerances(tmp_path / "budget.toml", DESIGN)
    assert study_tolerances(DESIGN, again, TRIALS).trials.result == study.trials.result
    assert again.mirror["secondary"].decentre_mm == asked.mirror["secondary"].decentre_mm
    assert budget_csv(study.budget).count("\n") == 1 + len(OPEN)
    assert study.budget.cost == pytest.approx(sum(choice.cost for choice in study.budget.choices))


def test_what_no_class_reaches_is_said() -> None:
    """Without a scale uncertainty not even the finest class is enough for nine of ten."""
    strict = DESIGN.model_copy(update={"scale_uncertainty": 0.0})
    study = study_tolerances(strict, Tolerances(), TRIALS, asked_yield=0.95)
    assert study.budget is not None
    assert study.budget.choices == ()
    finest = study_tolerances(strict, Tolerances(grade="precision"), TRIALS).trials.result
    assert study.budget.reached == finest
    assert finest.value < 0.95
    assert study.tolerances == Tolerances()


def test_where_the_search_fails_the_finest_classes_are_still_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not called out of reach while they reach it."""
    monkeypatch.setattr(budget, "ATTEMPTS", 0)
    found = study_tolerances(DESIGN, all_but_some_given(), TRIALS, asked_yield=0.8).budget
    assert found is not None
    assert found.reached.value >= 0.8
    assert {choice.chosen for choice in found.choices} == {"precision"}
    assert found.cost == found.cost_of_class["precision"]


@pytest.mark.slow
def test_only_the_ratios_of_costs_matter() -> None:
    """The same classes where all costs double."""
    study = study_tolerances(DESIGN, all_but_some_given(), TRIALS, asked_yield=0.8)
    content = all_but_some_given().model_dump(exclude_none=True)
    for costs in content["cost"]["of"].values():
        for grade in CLASSES:
            costs[grade] *= 2.0
    doubled = study_tolerances(DESIGN, Tolerances.model_validate(content), TRIALS, asked_yield=0.8)
    assert study.budget is not None
    assert doubled.budget is not None
    assert [c.chosen for c in doubled.budget.choices] == [c.chosen for c in study.budget.choices]
    assert doubled.budget.cost == pytest.approx(2.0 * study.budget.cost)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[cost.of.wobble]\ncoarse = 1", "cost.*wobble.*must be one of .*tilt_deg"),
        ("[cost]\ncoarse = -1", "cost.coarse = -1.*greater than or equal to 0"),
        ("[cost]\nfine = 1", "cost.fine"),
    ],
)
def test_costs_that_cannot_be(tmp_path, text: str, told: str) -> None:
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read_tolerances(tmp_path / "own.toml", DESIGN)


@pytest.mark.parametrize("share", [0.0, 1.0, float("nan")])
def test_a_yield_that_cannot_be_asked_for(share: float) -> None:
    with pytest.raises(InputError, match="must be more than 0 and less than 100"):
        study_tolerances(DESIGN, Tolerances(), TRIALS, asked_yield=share)
