"""Processes that die of themselves, as for want of memory: once, or whenever their task runs."""

from __future__ import annotations

import csv
import json
import os
import signal
import time
from functools import partial
from multiprocessing import forkserver
from pathlib import Path

import pytest
from mortal import (
    ALWAYS,
    mortal,
    name_of_configuration,
    name_of_design,
    name_of_first,
    name_of_point,
    pass_check,
    raising,
    slow_then_mortal,
    square,
)

from designer.requirement import set_key
from designer.study import checks, run
from designer.study.checks import CheckProgress, check_designs
from designer.study.folder import read_study
from designer.study.processes import local_processes, run_each, why_it_failed
from designer.study.run import run_study
from designer.study.sweep import run as sweep_run
from designer.study.sweep.definition import read_sweep
from designer.study.task import pareto_front_of, solve_configuration
from support import CONFIGS
from support.shipped_problems import however_blurred, shipped_requirement

REASON = "its process died twice, perhaps out of memory"
FEASIBLE = ("folded-HyPl-Hy-upper_outer", "folded-PaPa-Hy-upper_inner")
ONLY = (*FEASIBLE, "direct-ElEl-upper_outer")


@pytest.mark.parametrize("jobs", [1, 3])
@pytest.mark.parametrize("deaths", [{"3": 1}, {"0": ALWAYS, "5": ALWAYS}])
def test_each_task_runs_whose_own_process_does_not_die_twice(jobs, deaths, tmp_path):
    numbers = [*range(8), -1]
    task = partial(mortal, tmp_path, deaths, str, square)
    with local_processes(jobs) as processes:
        found = dict(run_each(processes, task, [(number,) for number in numbers]))
        again = dict(run_each(processes, square, [(12,)]))
    assert again[0].result() == 144
    reasons = {8: "ValueError: below zero"} | {int(name): REASON for name in deaths if deaths[name] == ALWAYS}
    errors = {index: future.exception() for index, future in found.items()}
    assert {index: why_it_failed(error) for index, error in errors.items() if error is not None} == reasons
    results = {index: future.result() for index, future in found.items() if index not in reasons}
    assert results == {index: index**2 for index in range(9) if index not in reasons}


def test_who_was_lost_with_another_may_still_die_once(tmp_path):
    """The death of another's process is not one of its own, whichever of the two came first."""
    (tmp_path / "marks").mkdir()
    with local_processes(2) as processes:
        # A pool that has just been built may hear of a death only when something else has ended.
        list(run_each(processes, square, [(1,), (2,)]))
        found = dict(run_each(processes, slow_then_mortal, [(tmp_path / "marks", number) for number in (7, 0)]))
    assert found[0].result() == 7
    assert why_it_failed(found[1].exception()) == REASON
    assert len(list((tmp_path / "marks").iterdir())) == 3


def test_a_process_that_dies_idle_costs_nothing(tmp_path):
    with local_processes(2) as processes:
        steps = run_each(processes, square, [(number,) for number in range(6)])
        found = dict([next(steps)])
        for process in list(processes._pool._processes.values()):
            process.kill()
        found |= dict(steps)
    assert [found[index].result() for index in range(6)] == [0, 1, 4, 9, 16, 25]


def requirement_of_study():
    return set_key(however_blurred(shipped_requirement("indoor_robot")), "solve.starts", 2)


def results_of(folder: Path) -> tuple[list[dict[str, str]], list[dict[str, str]], dict[str, bytes]]:
    """Rows of the table without times, those of the fronts, and the designs."""
    tables = []
    for name in ("designs.csv", "fronts.csv"):
        with (folder / name).open(encoding="utf-8", newline="") as stream:
            tables.append(list(csv.DictReader(stream)))
    for row in tables[0]:
        del row["seconds"]
    return tables[0], tables[1], {path.name: path.read_bytes() for path in (folder / "designs").iterdir()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    run_study(requirement_of_study(), folder, only=ONLY)
    return folder


@pytest.mark.slow
def test_a_study_whose_processes_die_once_finds_the_same(undisturbed, tmp_path, monkeypatch):
    solve = partial(mortal, tmp_path / "solving", {FEASIBLE[0]: 1}, name_of_configuration, solve_configuration)
    trace = partial(mortal, tmp_path / "fronts", {FEASIBLE[1]: 1}, name_of_first, pareto_front_of)
    monkeypatch.setattr(run, "solve_configuration", solve)
    monkeypatch.setattr(run, "pareto_front_of", trace)
    run_study(requirement_of_study(), tmp_path / "study", jobs=2, only=ONLY)
    assert results_of(tmp_path / "study") == results_of(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["dies", "raises"])
def test_a_study_goes_on_without_what_dies_or_raises_always(how, undisturbed, tmp_path, monkeypatch):
    always = {"dies": mortal, "raises": raising}[how]
    whole, without_front = FEASIBLE
    lost = "direct-ElEl-upper_outer"
    solve = partial(always, tmp_path / "solving", {lost: ALWAYS}, name_of_configuration, solve_configuration)
    trace = partial(always, tmp_path / "fronts", {without_front: ALWAYS}, name_of_first, pareto_front_of)
    monkeypatch.setattr(run, "solve_configuration", solve)
    monkeypatch.setattr(run, "pareto_front_of", trace)
    run_study(requirement_of_study(), tmp_path / "study", jobs=2, only=ONLY)
    rows, fronts, designs = results_of(tmp_path / "study")
    complete_rows, complete_fronts, complete_designs = results_of(undisturbed)
    reason = REASON if how == "dies" else "RuntimeError: broken"
    by_name = {row["configuration"]: row for row in rows}
    assert (by_name[lost]["status"], by_name[lost]["reason"]) == ("failed", reason)
    assert {name: row.pop("pareto_front_problem") for name, row in by_name.items()} == {
        whole: "",
        without_front: reason,
        lost: "",
    }
    assert [row for row in rows if row["configuration"] != lost] == [
        {name: value for name, value in row.items() if name != "pareto_front_problem"}
        for row in complete_rows
        if row["configuration"] != lost
    ]
    assert designs == complete_designs
    assert fronts == [row for row in complete_fronts if row["configuration"] == whole]
    assert (tmp_path / "study" / "provenance.json").exists()


def test_a_check_whose_process_dies_concerns_its_own_design_alone(undisturbed, tmp_path, monkeypatch):
    dead, whole = FEASIBLE
    check = partial(mortal, tmp_path / "deaths", {dead: ALWAYS, whole: 1}, name_of_design, pass_check)
    monkeypatch.setattr(checks, "_check_half", check)
    told: list[CheckProgress] = []
    designs = [read_study(undisturbed).designs[name] for name in FEASIBLE]
    assert check_designs(designs, undisturbed, jobs=2, progress=told.append) == {dead: False, whole: True}
    assert {step.configuration: step.problem for step in told} == {dead: REASON, whole: ""}
    assert [step.done for step in told] == [1, 2]
    written = json.loads((undisturbed / "checks" / dead / "unchecked.json").read_text(encoding="utf-8"))
    assert written["reason"] == REASON


SWEEP = """
plan = "grid"
requirement = "base.toml"
[[axis]]
key = "baseline_mm"
values = [96, 98]
"""


@pytest.mark.parametrize("moment", ["before the first task", "between two tasks"])
def test_a_server_of_processes_that_is_killed_is_replaced(moment):
    done = []
    with local_processes(2, "math") as processes:
        if moment == "before the first task":
            time.sleep(0.5)
            os.kill(forkserver._forkserver._forkserver_pid, signal.SIGKILL)
        for index, future in run_each(processes, time.sleep, [(0.2,)] * 5):
            if not done and moment == "between two tasks":
                os.kill(forkserver._forkserver._forkserver_pid, signal.SIGKILL)
            assert future.result() is None
            done.append(index)
    assert sorted(done) == [0, 1, 2, 3, 4]


def test_a_sweep_whose_processes_die_for_ever_ends_in_one_line(tmp_path, monkeypatch):
    """An OSError, which the command line answers in one line and with exit code 1."""
    base = (CONFIGS / "indoor_robot.toml").read_text(encoding="utf-8")
    (tmp_path / "base.toml").write_text(f'{base}\n[solve]\nconfigurations = ["direct-ElEl-*"]\n', encoding="utf-8")
    (tmp_path / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    monkeypatch.setattr(sweep_run, "MOST_LOST_WORKERS", 2)
    task = partial(mortal, tmp_path / "deaths", {"point": ALWAYS}, name_of_point, sweep_run.solve_task)
    monkeypatch.setattr(sweep_run, "solve_task", task)
    with pytest.raises(
        OSError, match=r"processes died 3 times, the last time at points \d; perhaps they ran out"
    ) as error:
        sweep_run.run_sweep(*read_sweep(tmp_path / "sweep.toml"), tmp_path / "out")
    assert "\n" not in str(error.value)
