"""``designer view``: which page it opens, and what it does without a browser."""

from __future__ import annotations

import shutil
import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from click.testing import CliRunner, Result

from designer.cli import cli
from designer.departures import AsBuilt, CameraDeparture
from designer.design import Design, read_design, write_design
from designer.study.folder import write_study
from designer.study.row import Row
from designer.study.study import Study
from support import DATA
from support.shipped_problems import shipped_requirement

DESIGN = DATA / "folded_hypl_hy.json"
NAME = "folded-HyPl-Hy-upper_outer"


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    urls: list[str] = []

    def open_url(url: str) -> bool:
        urls.append(url)
        return True

    monkeypatch.setattr(webbrowser, "open", open_url)
    return urls


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    design = read_design(DESIGN)
    rows = (Row({"configuration": NAME, "status": "feasible", "rank": 1}),)
    study = Study(shipped_requirement("indoor_robot"), rows, {NAME: design}, (), {"designer": "0.2.0", "solvers": {}})
    write_study(study, tmp_path / "a study")
    return tmp_path / "a study"


def path_of(url: str) -> Path:
    return Path(unquote(urlsplit(url).path))


def test_a_folder_without_a_page_gets_it_and_one_with_a_page_keeps_it(folder: Path, opened: list[str]) -> None:
    assert run("view", folder).output == ""
    assert path_of(opened[0]) == folder / "study.html"
    written = (folder / "study.html").read_bytes()
    assert b'id="payload"' in written
    assert run("view", folder).exit_code == 0
    assert (folder / "study.html").read_bytes() == written
    assert len(opened) == 2


def test_a_design_of_a_study_is_selected_on_its_page(folder: Path, opened: list[str]) -> None:
    run("view", folder)
    path = folder / "designs" / f"{NAME}.json"
    assert run("view", path).exit_code == 0
    assert path_of(opened[1]) == folder / "study.html"
    assert urlsplit(opened[1]).fragment == f"design={NAME}"
    # Edited, it is no longer the design that the page shows.
    path.write_text(path.read_text(encoding="utf-8").replace('"noise_px": 0.1', '"noise_px": 0.2'), encoding="utf-8")
    assert run("view", path).exit_code == 0
    assert path_of(opened[2]) != folder / "study.html"


def test_a_design_alone_has_a_page_of_its_own(tmp_path: Path, opened: list[str]) -> None:
    copy = tmp_path / "mine.json"
    shutil.copy(DESIGN, copy)
    assert run("view", copy).exit_code == 0
    page = path_of(opened[0])
    assert page.name == "mine.html"
    assert NAME in page.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == [copy]


def test_departures_are_said_to_be_left_out(tmp_path: Path, opened: list[str]) -> None:
    built = AsBuilt(camera=CameraDeparture(shift_x_mm=0.1))
    for name, design in (("plain", read_design(DESIGN)), ("built", replace_built(built))):
        write_design(design, tmp_path / f"{name}.json")
        assert run("view", tmp_path / f"{name}.json").exit_code == 0
    told = ["this is the design without them" in path_of(url).read_text(encoding="utf-8") for url in opened]
    assert told == [False, True]
    assert "this is the design without them" in run("view", tmp_path / "built.json").stderr


def replace_built(built: AsBuilt) -> Design:
    return read_design(DESIGN).model_copy(update={"as_built": built})


def test_a_design_that_cannot_be_scored_is_named(tmp_path: Path, opened: list[str]) -> None:
    design = read_design(DESIGN)
    camera = design.camera.model_copy(update={"distortion": (-1000.0,)})
    path = tmp_path / "bent.json"
    write_design(design.model_copy(update={"camera": camera}), path)
    result = run("view", path)
    assert (result.exit_code, opened) == (2, [])
    assert result.stderr.startswith(f"designer: {path}: ")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("answer", [False, webbrowser.Error("could not locate runnable browser")])
def test_without_a_browser_the_path_is_printed(
    answer: bool | webbrowser.Error, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def open_url(url: str) -> bool:
        if isinstance(answer, webbrowser.Error):
            raise answer
        return answer

    monkeypatch.setattr(webbrowser, "open", open_url)
    result = run("view", folder)
    assert (result.exit_code, result.stdout) == (0, f"{folder / 'study.html'}\n")


def test_what_is_neither_is_refused_in_one_line(tmp_path: Path, opened: list[str]) -> None:
    for path, told in (
        (tmp_path, "not the folder of a study: it contains neither study.html nor designs.csv"),
        (tmp_path / "absent.json", "cannot be read"),
    ):
        result = run("view", path)
        assert (result.exit_code, result.stdout) == (2, "")
        assert told in result.stderr
        assert result.stderr.count("\n") == 1
    assert opened == []
