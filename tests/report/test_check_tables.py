"""The end-to-end checks in the report: read back, drawn, and only those of the study's own designs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from sample_check import BIAS, PREDICTED, write_sample_check
from sample_study import prototype, write_sample_study
from test_figures import assert_inside_canvas

from designer.design import Design
from designer.files import InputError
from designer.imaging.endtoend.check_files import fingerprint
from designer.report.content.sections import source
from designer.report.document import write_pdf
from designer.report.figures.check import draw_check_errors, draw_check_maps, draw_floor_plan, errors_by_distance
from designer.report.figures.style import report_style
from designer.study.checked import read_check
from designer.study.folder import read_study
from designer.study.manifest import settle


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two designs of which one passed its check and one failed."""
    designs = (prototype(), prototype(direct_kind="ellipsoid"))
    path = write_sample_study(tmp_path_factory.mktemp("study") / "sample", designs=designs)
    for design, passed in zip(read_study(path).best(), (True, False), strict=True):
        write_sample_check(path / "checks" / design[1].configuration, design[1], passed=passed)
    return path


def test_each_checked_design_has_a_page_with_its_verdict(folder: Path) -> None:
    study = read_study(folder)
    text = source(study, {})
    assert text.count("= End-to-end check") == 1
    for row, checked in study.checks():
        assert f"check-maps-{row.configuration}.svg" in text
        assert checked.passed == (row.rank == 1)
    assert "passes where tested" in text
    assert '"fails"' in text
    assert '"too few pixels"' in text
    assert write_pdf(study, folder).stat().st_size < 10_000_000
    assert len(list((folder / "figures").glob("check-*.svg"))) == 8


def test_a_design_that_could_not_be_checked_stands_there_with_the_reason(folder: Path, tmp_path: Path) -> None:
    """For the winner in the verdict too; where nothing was checked, the section says no more than that."""
    copy = tmp_path / "study"
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("figures", "study.pdf"))
    (row, design), (second, _) = read_study(copy).best()
    shutil.rmtree(copy / "checks" / row.configuration)
    (copy / "checks" / row.configuration).mkdir()
    content = {"configuration": row.configuration, "reason": "ValueError: -1 #x", "design_sha256": fingerprint(design)}
    (copy / "checks" / row.configuration / "unchecked.json").write_text(json.dumps(content), encoding="utf-8")
    text = source(read_study(copy), {})
    assert text.count("could not be checked") == 2
    assert '"could not be checked: ValueError: −1 #x"' in text
    assert f"check-maps-{second.configuration}.svg" in text
    shutil.rmtree(copy / "checks" / second.configuration)
    text = source(read_study(copy), {})
    assert text.count("= End-to-end check") == 1
    assert "check-maps" not in text
    assert write_pdf(read_study(copy), copy).exists()


def test_without_checks_there_is_no_section_and_no_figure_of_earlier_ones(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "study"
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("checks"))
    (copy / "figures").mkdir(exist_ok=True)
    earlier = "check-maps-of-an-earlier-study.svg"
    (copy / "figures" / earlier).write_text("<svg/>", encoding="utf-8")
    settle(copy, [f"figures/{earlier}"])
    write_pdf(read_study(copy), copy)
    assert "End-to-end check" not in source(read_study(copy), {})
    assert not (copy / "figures" / earlier).exists()


def test_a_check_of_another_design_is_not_shown(folder: Path) -> None:
    _, design = read_study(folder).best()[0]
    checks = folder / "checks" / design.configuration
    assert read_check(checks, design) is not None
    assert read_check(checks, design.model_copy(update={"baseline_mm": design.baseline_mm * (1 + 1e-12)})) is None
    assert read_check(folder / "checks" / "absent", design) is None


def spoilt(folder: Path, design: Design, copy: Path, name: str, content: bytes | None) -> Path:
    """A copy of a design's check of which one file holds other bytes, or is gone."""
    shutil.copytree(folder / "checks" / design.configuration, copy)
    (copy / name).unlink()
    if content is not None:
        (copy / name).write_bytes(content)
    return copy


SPOILT = [
    (name, content)
    for name in ("check.json", "check.npz", "raw.png", "upper.png")
    for content in (b"", b"{}", b"\x89PNG\r\n\x1a\n", None)
    if (name, content) != ("check.json", None)
]


@pytest.mark.parametrize(("name", "content"), SPOILT)
def test_a_damaged_check_is_named(name: str, content: bytes | None, folder: Path, tmp_path: Path) -> None:
    _, design = read_study(folder).best()[0]
    with pytest.raises(InputError, match=name):
        read_check(spoilt(folder, design, tmp_path / "check", name, content), design)


def test_a_check_without_its_verdict_is_not_finished(folder: Path, tmp_path: Path) -> None:
    _, design = read_study(folder).best()[0]
    assert read_check(spoilt(folder, design, tmp_path / "check", "check.json", None), design) is None


def test_measured_errors_by_distance_are_those_that_were_made(folder: Path) -> None:
    _, checked = read_study(folder).checks()[0]
    distance, measured, predicted, bias = errors_by_distance(checked)
    near, far = checked.design.working_volume.distance_mm
    assert near < distance[0] < distance[-1] < far
    # Each of the 16 bins holds about 2400 normal errors; 1.4826 MAD of them scatters by 2.4 percent.
    np.testing.assert_allclose(measured, PREDICTED, rtol=0.08)
    np.testing.assert_allclose(predicted, PREDICTED, rtol=1e-3)
    np.testing.assert_allclose(bias, BIAS, atol=0.08 * PREDICTED)


def test_nothing_of_a_check_is_cut_at_the_edge(folder: Path) -> None:
    _, checked = read_study(folder).checks()[0]
    with report_style():
        assert_inside_canvas(draw_check_maps(checked, 170.0))
        assert_inside_canvas(draw_floor_plan(checked, 84.0, 46.0))
        assert_inside_canvas(draw_check_errors(checked, 92.0, 45.0))
