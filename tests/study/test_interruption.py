"""Killed or interrupted at any moment, a study leaves whole files or none, and can be run again."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from designer.design import read_design
from designer.study.claim import LOCK
from support import CONFIGS
from support.shipped_problems import SHIPPED, toml_with_coarse_pixels, toml_with_constant_noise

COMMAND = Path(sys.executable).with_name("designer")
REQUIREMENT = CONFIGS / f"{SHIPPED[0]}.toml"
ONLY = ("folded-HyPl-Hy-upper_outer", "direct-HyHy-upper_inner")


def start(folder: Path) -> subprocess.Popen[bytes]:
    """A short study as a process group of its own: few starts, and a quarter of the pixels to render."""
    requirement = folder.parent / "short.toml"
    if not requirement.exists():
        text = toml_with_coarse_pixels(toml_with_constant_noise(REQUIREMENT.read_text(encoding="utf-8")))
        requirement.write_text(f"{text}\n[solve]\nstarts = 2\n", encoding="utf-8")
    how = ("--no-pdf", "--quiet", "--jobs", "2", "--checks", "1")
    arguments = [COMMAND, "study", requirement, "--out", folder, *how, "--only", *ONLY]
    return subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True)


def finish(folder: Path) -> float:
    """Run a study undisturbed; seconds it took."""
    started = time.monotonic()
    process = start(folder)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    return time.monotonic() - started


def results_of(folder: Path) -> tuple[list[dict[str, str]], dict[str, str]]:
    """Everything a study writes but times: rows of the table, and the other files' text."""
    with (folder / "designs.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        del row["seconds"]
    names = [
        "requirement.toml",
        "fronts.csv",
        *(f"designs/{path.name}" for path in (folder / "designs").glob("*.json")),
    ]
    return rows, {name: (folder / name).read_text(encoding="utf-8") for name in names}


def assert_every_file_is_whole(folder: Path, complete: Path) -> None:
    """Every file that a reader sees is a whole one; what is half-written hides behind a dot."""
    visible = [path for path in folder.rglob("*") if path.is_file() and not path.name.startswith(".")]
    for path in visible:
        name = path.relative_to(folder)
        assert (complete / name).exists(), f"{name} belongs to no study"
        if path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))
        if name.parts[0] == "designs":
            read_design(path)
        if path.suffix == ".csv":
            assert path.read_text(encoding="utf-8").count("\n") == (complete / name).read_text(encoding="utf-8").count(
                "\n"
            )
    expected = {
        path.relative_to(complete) for path in complete.rglob("*") if path.is_file() and not path.name.startswith(".")
    }
    found = {path.relative_to(folder) for path in visible}
    if (folder / "provenance.json").exists():
        assert {name for name in found if name.parts[0] != "checks"} == {
            name for name in expected if name.parts[0] != "checks"
        }
    # The best designs are checked after the study is written; check.json comes last of a check's files.
    for verdict in folder.glob("checks/*/check.json"):
        inside = verdict.parent.relative_to(folder)
        assert {name for name in found if name.parent == inside} == {name for name in expected if name.parent == inside}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    folder = tmp_path_factory.mktemp("undisturbed") / "study"
    return folder, finish(folder)


@pytest.mark.slow
def test_a_study_stopped_at_any_moment_can_be_run_again(undisturbed, tmp_path):
    """Stopped at random, and killed as soon as the first design appears; run again, it gives the same numbers."""
    complete, duration = undisturbed
    folder = tmp_path / "study"
    moments = random.Random(0)
    for number in (signal.SIGKILL, signal.SIGINT):
        stop(start(folder), number, moments.uniform(0.3, 1.05) * duration)
        assert_every_file_is_whole(folder, complete)
    process = start(folder)
    while not list(folder.glob("designs/*.json")) and process.poll() is None:
        time.sleep(0.0005)
    stop(process, signal.SIGKILL)
    assert_every_file_is_whole(folder, complete)
    finish(folder)
    assert_every_file_is_whole(folder, complete)
    assert results_of(folder) == results_of(complete)


def stop(process: subprocess.Popen[bytes], number: signal.Signals, after_seconds: float = 0.0) -> None:
    """Signal the whole process group, as Ctrl-C in a terminal does."""
    time.sleep(after_seconds)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)
    process.communicate(timeout=60)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["study", "sweep"])
def test_an_interrupt_while_processes_start_is_answered_in_one_line(command, tmp_path):
    """Ctrl-C reaches the whole process group: the server that imports, and a process that is on its way."""
    asked = REQUIREMENT if command == "study" else REQUIREMENT.parent / "sweeps" / "lens_and_baseline.toml"
    for tenths in range(2, 22, 3):
        process = subprocess.Popen(
            [COMMAND, command, asked, "--out", tmp_path / "out", "--jobs", "2", "--no-pdf", "--quiet"],
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert process.stderr is not None
        time.sleep(tenths / 10.0)
        os.killpg(process.pid, signal.SIGINT)
        errors = process.communicate(timeout=30)[1]
        # Before its own first line Python itself answers.
        assert tenths < 5 or (process.returncode, errors) == (130, "designer: interrupted\n")


@pytest.mark.slow
def test_termination_does_not_wait_for_the_running_solve(tmp_path):
    """With one job too: the second configuration takes most of a minute with so many starts."""
    requirement = tmp_path / "long.toml"
    requirement.write_text(f"{REQUIREMENT.read_text(encoding='utf-8')}\n[solve]\nstarts = 500\n", encoding="utf-8")
    folder = tmp_path / "study"
    only = ("direct-ElEl-upper_outer", "folded-HyHy-Hy-upper_outer")
    process = subprocess.Popen(
        [COMMAND, "study", requirement, "--out", folder, "--jobs", "1", "--only", *only],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stderr is not None
    assert "direct-ElEl-upper_outer: impossible" in process.stderr.readline()
    time.sleep(0.5)
    terminated = time.monotonic()
    process.terminate()
    _, errors = process.communicate(timeout=120)
    assert time.monotonic() - terminated < 3.0
    assert (process.returncode, errors) == (143, "designer: terminated\n")
    assert [path.name for path in folder.iterdir()] == [LOCK]
    deadline = time.monotonic() + 10
    while members(process.pid) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert members(process.pid) == []


@pytest.mark.slow
def test_a_killed_parent_leaves_no_process_behind(tmp_path):
    process = start(tmp_path / "study")
    deadline = time.monotonic() + 60
    while len(members(process.pid)) < 4 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    assert len(members(process.pid)) >= 4  # itself, the fork server and two workers at least
    process.kill()
    process.communicate(timeout=30)
    while members(process.pid) and time.monotonic() < deadline:
        time.sleep(0.2)
    left = members(process.pid)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    assert left == []


def members(group: int) -> list[int]:
    """The living processes of a process group."""
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError, IndexError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[2]) == group and fields[0] != "Z":
                found.append(int(entry.name))
    return found
