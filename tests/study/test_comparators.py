"""Comparators in a study's folder, its report and the terminal; nothing of them unless asked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from report.sample_study import write_sample_study

from designer.cli.comparators import other_ideas
from designer.comparators.row import ComparatorRow
from designer.files import InputError
from designer.report.content.comparators import comparators
from designer.report.figures.registry import COMPARED, DrawnFigure, study_figures
from designer.report.figures.style import report_style
from designer.study.comparators import read_comparators, write_comparators
from designer.study.folder import read_study, write_study
from designer.study.manifest import read_manifest
from designer.study.names import COMPARATORS_TABLE
from designer.study.study import Study

ROWS = (
    ComparatorRow(
        "stacked_cameras", "two stacked cameras", "too_large", "does not fit into 140 mm x 80 mm", 2, 360.0,
        0.0101, 0.02, 100.0, 261.0, 36.9, 5.3, 0.5, 1e-13, 12.0, 8.9, None, "lower: vertex 1 mm; upper: vertex 2 mm",
    ),
    ComparatorRow(
        "two_spheres", "two spheres", "feasible", "", 1, 360.0,
        0.0669, 0.2, 15.8, 139.3, 51.7, 4.1, 0.5, 7.9, 12.0, 8.5, 142.0, 'a "quoted", word',
    ),
    ComparatorRow("planar_mirrors", "two plane mirrors", "infeasible", "no design was found", 1),
)  # fmt: skip


@pytest.fixture
def study(tmp_path: Path) -> Study:
    write_sample_study(tmp_path / "sample")
    return read_study(tmp_path / "sample")


def drawn(study: Study) -> dict[str, DrawnFigure]:
    """The figures of the section by the names of their files."""
    with report_style():
        figures = {figure.file(): figure.drawn(study) for figure in study_figures(COMPARED)}
    return {name: drawing for name, drawing in figures.items() if drawing is not None}


def test_the_table_is_read_back_as_it_was_written(tmp_path):
    write_comparators(ROWS, tmp_path)
    assert read_comparators(tmp_path / COMPARATORS_TABLE) == ROWS
    assert COMPARATORS_TABLE in (read_manifest(tmp_path) or {})


def test_a_study_without_them_removes_those_of_an_earlier_one(study, tmp_path):
    folder = tmp_path / "again"
    write_study(study, folder)
    write_comparators(ROWS, folder)
    assert read_study(folder).comparators == ROWS
    write_study(study, folder)
    assert not (folder / COMPARATORS_TABLE).exists()
    assert read_study(folder).comparators == ()


def test_a_table_of_someone_else_is_not_replaced(tmp_path):
    (tmp_path / COMPARATORS_TABLE).write_text("mine")
    with pytest.raises(InputError, match=r"comparators\.csv: not written by the study"):
        write_comparators(ROWS, tmp_path)


@pytest.mark.parametrize(
    ("found", "instead", "message"),
    [
        ("too_large", "huge", "status = 'huge': must be one of feasible, too_large, infeasible, failed"),
        ("comparator,", "idea,", "column comparator is missing"),
        ("140 mm x 80 mm,2,", "140 mm x 80 mm,two,", "cameras = 'two': must be a whole number"),
    ],
)
def test_a_damaged_table_is_refused_in_one_line(tmp_path, found, instead, message):
    write_comparators(ROWS, tmp_path)
    path = tmp_path / COMPARATORS_TABLE
    path.write_text(path.read_text().replace(found, instead, 1))
    with pytest.raises(InputError) as refused:
        read_comparators(path)
    assert str(refused.value) == f"{path}: {message}"


def test_report_and_terminal_show_them_beside_the_winner(study):
    asked = replace(study, comparators=ROWS)
    section = comparators(asked, drawn(asked))
    winner = study.feasible[0]
    assert "figures/trade-comparators.svg" in section
    assert f"{winner.configuration} (winner)" in section
    assert "two stacked cameras *" in section
    assert "6.69" in section
    table = "\n".join(other_ideas(asked))
    assert [line.split()[0] for line in table.splitlines()[3:4]] == [winner.configuration]
    assert "6.690 %" in table
    assert "two stacked cameras: does not fit into 140 mm x 80 mm" in table


def test_without_the_option_there_is_nothing_of_them(study):
    assert comparators(study, {}) == ""
    assert other_ideas(study) == []
    assert drawn(study) == {}
