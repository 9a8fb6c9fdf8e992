"""A study replaces and removes only what a study wrote, and only if it is as it was written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from designer.design import read_design
from designer.files import InputError
from designer.study.claim import claimed, locked_study
from designer.study.folder import remove_checks, write_page, write_report, write_study
from designer.study.manifest import MANIFEST, announce, read_manifest, settle
from designer.study.names import PAGE, names_of_check, names_of_study
from designer.study.row import Row
from designer.study.study import Study
from support import DATA
from support.shipped_problems import shipped_requirement

NAME = "folded-HyPl-Hy-upper_outer"
OTHER = "direct-HyHy-upper_outer"


def study_of(*names: str) -> Study:
    """A study in which these configurations are feasible."""
    design = read_design(DATA / "folded_hypl_hy.json")
    rows = tuple(
        Row({"configuration": name, "status": "feasible", "rank": place}) for place, name in enumerate(names, 1)
    )
    designs = {name: design.model_copy(update={"configuration": name}) for name in names}
    return Study(shipped_requirement("indoor_robot"), rows, designs, (), {"designer": "0.2.0", "solvers": {}})


def write_whole(folder: Path) -> None:
    """A study with a check and a report."""
    write_study(study_of(NAME), folder)
    names = names_of_check(NAME)
    announce(folder, names)
    (folder / names[0]).parent.mkdir(parents=True)
    for name in names[:-1]:
        (folder / name).write_text("a check", encoding="utf-8")
    settle(folder, names)
    write_page(folder, "<!DOCTYPE html>")
    write_report(folder, b"%PDF-", {"trade-height.svg": b"<svg/>", f"cross-section-{NAME}.svg": b"<svg/>"})


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def put_mine(folder: Path) -> dict[str, bytes]:
    """A user's files at every place of a study's folder."""
    for name in (
        "notes.txt",
        "designs/my-hand-edited.json",
        "designs/package.json",
        "figures/trade-mine.svg",
        "figures/check-raw-mine.svg",
        "checks/bench1/raw.png",
        "checks/bench1/notes/day1.txt",
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("mine", encoding="utf-8")
    return {name: content for name, content in files_of(folder).items() if content == b"mine"}


def forget_manifest(folder: Path) -> None:
    """Make a folder as version 0.2 left it."""
    (folder / MANIFEST).unlink()
    (folder / PAGE).unlink(missing_ok=True)


def forget_manifest_and_figures(folder: Path) -> None:
    """Make a folder as version 0.1 left it."""
    forget_manifest(folder)
    (folder / "figures" / "report.json").unlink()


@pytest.mark.parametrize("age", [lambda folder: None, forget_manifest, forget_manifest_and_figures])
def test_a_second_study_leaves_what_is_not_its_own(age: Callable[[Path], None], tmp_path: Path) -> None:
    write_whole(tmp_path)
    mine = put_mine(tmp_path)
    age(tmp_path)
    with claimed(tmp_path, names_of_study([OTHER])) as kept:
        assert kept == [
            "checks/bench1/",
            "designs/my-hand-edited.json",
            "designs/package.json",
            "figures/check-raw-mine.svg",
            "figures/trade-mine.svg",
            "notes.txt",
        ]
    write_study(study_of(OTHER), tmp_path)
    remove_checks(tmp_path)
    left = files_of(tmp_path)
    assert mine.items() <= left.items()
    assert set(left) - set(mine) == {
        ".study.lock",
        "designs.csv",
        f"designs/{OTHER}.json",
        "fronts.csv",
        "manifest.json",
        "provenance.json",
        "requirement.toml",
    }


@pytest.mark.parametrize(
    "name",
    ["requirement.toml", f"designs/{NAME}.json", "study.html", "study.pdf", "figures/trade-height.svg"],
)
def test_what_was_changed_stays_and_is_named_before_the_work(name: str, tmp_path: Path) -> None:
    write_whole(tmp_path)
    (tmp_path / name).write_text("changed", encoding="utf-8")
    before = files_of(tmp_path)
    message = f"{name}: not written by the study, or changed since; move it away"
    with pytest.raises(InputError, match=message), claimed(tmp_path, names_of_study([NAME])):
        pass

    def write() -> None:
        if name.endswith((".toml", ".json")):
            write_study(study_of(NAME), tmp_path)
        elif name == "study.html":
            write_page(tmp_path, "<!DOCTYPE html><p>")
        else:
            write_report(tmp_path, b"%PDF-", {"trade-height.svg": b"<svg/>"})

    with pytest.raises(InputError, match=message):
        write()
    assert files_of(tmp_path)[name] == before[name]


@pytest.mark.parametrize("age", [lambda folder: None, forget_manifest])
def test_a_table_of_lenses_that_no_study_wrote_is_in_the_way(age: Callable[[Path], None], tmp_path: Path) -> None:
    write_study(study_of(NAME), tmp_path)
    (tmp_path / "lenses.csv").write_text("mine", encoding="utf-8")
    age(tmp_path)
    message = "lenses.csv: not written by the study, or changed since; move it away"
    with pytest.raises(InputError, match=message), claimed(tmp_path, names_of_study([NAME])):
        pass
    write_study(study_of(NAME), tmp_path)
    assert (tmp_path / "lenses.csv").read_text(encoding="utf-8") == "mine"


def test_a_changed_design_that_no_study_writes_again_stays(tmp_path: Path) -> None:
    write_study(study_of(NAME), tmp_path)
    (tmp_path / "designs" / f"{NAME}.json").write_text("changed", encoding="utf-8")
    with claimed(tmp_path, names_of_study([OTHER])) as kept:
        assert kept == [f"designs/{NAME}.json"]
    write_study(study_of(OTHER), tmp_path)
    assert (tmp_path / "designs" / f"{NAME}.json").read_text(encoding="utf-8") == "changed"


@pytest.mark.parametrize(
    "name", ["package.json", "requirement.toml", "designs/mine.json", ".gitignore", "provenance.json"]
)
def test_a_folder_that_is_no_study_is_refused_and_left_alone(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("{}", encoding="utf-8")
    message = "not the folder of a study; choose an empty or a new folder with --out"
    with pytest.raises(InputError, match=message), claimed(tmp_path, ()):
        pass
    assert files_of(tmp_path) == {name: b"{}"}


def test_an_empty_folder_and_an_absent_one_are_taken_also_again(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "absent", tmp_path / "absent"):
        with claimed(folder, names_of_study([NAME])) as kept:
            assert kept == []


def test_a_study_cut_off_while_it_wrote_is_its_own(tmp_path: Path) -> None:
    names = ["designs.csv", f"designs/{NAME}.json"]
    announce(tmp_path, names)
    (tmp_path / "designs.csv").write_text("whatever", encoding="utf-8")
    with claimed(tmp_path, names_of_study([NAME])) as kept:
        assert kept == []
    write_study(study_of(NAME), tmp_path)
    assert None not in (read_manifest(tmp_path) or {"": None}).values()


@pytest.mark.parametrize(
    "content", ["", "[]", '{"files": 3}', '{"files": {"../../precious": null}}', '{"files": {"/etc/passwd": null}}']
)
def test_a_manifest_that_is_damaged_or_leads_elsewhere_is_refused(content: str, tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match="is damaged"):
        read_manifest(tmp_path)


def test_the_manifest_lists_every_file_that_was_written(tmp_path: Path) -> None:
    write_whole(tmp_path)
    manifest = read_manifest(tmp_path)
    assert manifest is not None
    assert set(manifest) == set(files_of(tmp_path)) - {MANIFEST}
    assert set(json.loads((tmp_path / MANIFEST).read_text(encoding="utf-8"))) == {"files"}


HOLD = "import sys, time; from pathlib import Path; from designer.study.claim import claimed\n" + (
    "with claimed(Path(sys.argv[1]), ()):\n    print('held', flush=True); time.sleep(60)"
)


def test_two_studies_do_not_work_in_one_folder_and_a_killed_one_gives_it_back(tmp_path: Path) -> None:
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert holder.stdout is not None
    try:
        assert holder.stdout.readline() == "held\n"
        for hold in (lambda: claimed(tmp_path, ()), lambda: locked_study(tmp_path)):
            with pytest.raises(InputError, match="another process is working on the study in this folder"), hold():
                pass
    finally:
        os.kill(holder.pid, signal.SIGKILL)
        holder.communicate(timeout=20)
    with claimed(tmp_path, ()):
        pass
