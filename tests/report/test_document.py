"""The report as a whole: it builds from any folder, says everything, and is the same twice."""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sample_study import prototype, two_direct_mirrors, write_sample_study

from designer.configurations import enumerate_configurations
from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.focus import focus_score
from designer.files import InputError
from designer.report.content.legible import legible_source
from designer.report.content.lens import other_projections
from designer.report.content.sections import source
from designer.report.content.tables import excluded, fabrication, ranking_table
from designer.report.document import draw_figures, write_pdf
from designer.report.figures import registry
from designer.report.figures.registry import PAGE_PANEL, DrawnFigure, ReportFigure
from designer.report.typst.pdf import typeset
from designer.requirement import set_key
from designer.study.folder import read_study
from designer.study.manifest import settle
from designer.study.study import LensRow
from designer.typesetting.glyphs import missing_characters
from designer.typesetting.markup import cell, typographic

SQUARE = b'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><rect width="9" height="9"/></svg>'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    designs = (prototype(), prototype(direct_kind="ellipsoid"))
    path = write_sample_study(tmp_path_factory.mktemp("study") / "sample", name="indoor_robot", designs=designs)
    write_pdf(read_study(path), path)
    return path


def test_a_report_with_its_figures_appears_beside_the_study(folder: Path) -> None:
    assert (folder / "study.pdf").read_bytes().startswith(b"%PDF-")
    names = {path.name for path in (folder / "figures").iterdir()}
    for panel in ("cross-section", "image-layout", "resolution", "depth-resolution", "depth-error"):
        assert f"{panel}-folded-HyPl-Hy-upper_outer.svg" in names
    assert {"trade-height.svg", "trade-diameter.svg", "fronts-height.svg", "fronts-diameter.svg"} <= names
    assert names - set(json.loads((folder / "figures" / "report.json").read_text())) == {"report.json"}


def test_the_same_folder_gives_the_same_bytes_in_any_number_of_processes(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "elsewhere"
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("figures", "study.pdf"))
    write_pdf(read_study(copy), copy, jobs=2)
    assert (copy / "study.pdf").read_bytes() == (folder / "study.pdf").read_bytes()
    for figure in (folder / "figures").iterdir():
        assert (copy / "figures" / figure.name).read_bytes() == figure.read_bytes()


def test_all_44_stand_in_the_ranking_with_status_and_reason(folder: Path) -> None:
    study = read_study(folder)
    table = ranking_table(study.rows)
    listed = re.findall(r'name-of\("([^"]+)"\)', table)
    assert sorted(listed) == sorted(configuration.name for configuration in enumerate_configurations())
    assert [row.rank for row in study.feasible] == list(range(1, len(study.feasible) + 1))
    without_reason = [row for row in study.rows if row.status != "feasible" and not row.reason]
    assert not without_reason
    assert table.count("impossible") == len(study.with_status("impossible"))


def test_ties_are_called_ties_in_verdict_and_ranking(folder: Path) -> None:
    """The sample's designs share the first objective; apart by 2 percent they are tied within 5 only."""
    study = read_study(folder)
    tied = "Ranks 1 and 2 are tied within 1 % in depth error; height decides their order."
    assert source(study, {}).count(tied) == 2
    first, second, *others = study.rows
    apart = replace(study, rows=(first, second.with_values(first_stage_depth_error_rms=0.0121 * 1.02), *others))
    assert "are tied" not in source(apart, {})
    assert "No other design is tied with it within 1 % in depth error." in source(apart, {})
    objective = study.requirement.objective.model_copy(update={"within_percent": 5.0})
    wide = replace(apart, requirement=study.requirement.model_copy(update={"objective": objective}))
    assert source(wide, {}).count(tied.replace("1 %", "5 %")) == 2


def test_the_lenses_of_a_catalogue_are_compared_for_the_winner_alone(folder: Path) -> None:
    study = read_study(folder)
    winner, second = (row.configuration for row in study.feasible[:2])
    rows = (
        LensRow(winner, 1, "8 mm #1", False, "feasible", 0.0157, 121.3, 60.0, 5.6, None, 4.2, 0.5),
        LensRow(winner, 2, "12 mm", True, "feasible", 0.0123, 118.2, 61.5, 5.6, 145.3, 5.54, 0.48),
        LensRow(winner, 3, "25 mm", False, "infeasible", reason="no feasible point found; smallest violation: blur"),
        LensRow(second, 1, "8 mm #1", False, "impossible", reason="no room for the inner zone at 8 mm"),
    )
    assert "= Lenses" not in source(study, {})
    several = replace(study, lenses=rows)
    section = source(several, {}).split("= Lenses")[1].split("= Requirement")[0]
    chosen = [cell(value) for value in ("12 mm", "chosen", "1.23", "118.2", "5.60", "145", "0.48", "5.5")]
    assert ", ".join(chosen) in section
    assert cell("infinity") in section
    assert cell("infeasible: smallest violation: blur") in section
    assert "no room" not in section
    assert typeset(f'#import "style.typ": *\n= Lenses{section}', {}).startswith(b"%PDF")


def test_impossible_configurations_are_listed_once_under_their_rule(folder: Path) -> None:
    study = read_study(folder)
    impossible = study.with_status("impossible")
    table = excluded(impossible)
    assert sorted(re.findall(r'name-of\("([^"]+)"\)', table)) == sorted(row.configuration for row in impossible)
    for reason in {row.reason for row in impossible}:
        assert table.count(cell(typographic(reason))) == 1
    # Each stands in the report once, and in the ranking no more.
    whole = source(study, {})
    assert all(whole.count(f'#name-of("{row.configuration}")') == 1 for row in impossible)


def test_every_best_design_has_a_page_on_its_lens_and_its_mirrors(folder: Path) -> None:
    study = read_study(folder)
    whole = source(study, {})
    for row, design in study.best():
        assert f"Rank {row.rank}: lens and fabrication" in whole
        focus = focus_score(design)
        assert focus is not None
        assert f"{focus.largest_blur_px_of_views['lower']:.1f} px) in the lower view" in whole
        mass = sum(mirror_shape(design, mirror.name).mass_g for mirror in design.mirrors)
        assert '"all")], [#text("")]' in fabrication(design)
        assert f"{mass:.1f}" in fabrication(design)


def test_the_paper_stands_beside_ours_for_the_indoor_robot_alone(folder: Path) -> None:
    study = read_study(folder)
    assert "paper's prototype" in source(study, {})
    elsewhere = replace(study, requirement=study.requirement.model_copy(update={"name": "elsewhere"}))
    assert "paper's prototype (Jang" not in source(elsewhere, {})


def test_a_study_without_a_feasible_design_says_what_came_closest(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "none", designs=())
    study = read_study(path)
    text = source(study, {})
    assert "Limiting constraints" in text
    assert "diameter of the mirror system" in text
    assert "None of the 44" in text
    assert write_pdf(study, path).read_bytes().startswith(b"%PDF-")


@pytest.mark.parametrize("key", ["fabrication_notes", "remarks"])
def test_fabrication_notes_stand_on_the_design_s_page_and_the_verdict_points_there(key: str, tmp_path: Path) -> None:
    """Those of version 0.1, which called them remarks, too."""
    noted = prototype().model_copy(update={"score": {**prototype().score, key: ["it is -2 mm [wide] #x"] * 3}})
    path = write_sample_study(tmp_path / "noted", designs=(noted, two_direct_mirrors()))
    study = read_study(path)
    drawn = draw_figures(study)
    told = source(study, drawn)
    figures = {name: drawing.svg for name, drawing in drawn.items()}
    assert told.count('[#text("It is −2 mm [wide] #x.")]') == 3
    assert told.count("#fabrication-notes(") == 1
    assert "Before ordering its mirrors, read the 3 fabrication notes on its page" in told
    assert typeset(told, figures).startswith(b"%PDF-")


def test_one_feasible_design_is_enough(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "one", designs=(prototype(),))
    assert "only feasible design" in source(read_study(path), {})
    assert write_pdf(read_study(path), path).exists()


def test_columns_fronts_and_provenance_may_be_missing(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "lean", designs=(prototype(),))
    (path / "fronts.csv").unlink()
    (path / "provenance.json").unlink()
    with (path / "designs.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    kept = "configuration family topology status reason depth_error_rms limit_ratio baseline_mm height_mm diameter_mm"
    with (path / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=kept.split(), extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    study = read_study(path)
    drawn = draw_figures(study)
    figures = {name: drawing.svg for name, drawing in drawn.items()}
    assert typeset(source(study, drawn), figures).startswith(b"%PDF-")


@pytest.mark.parametrize(
    ("title", "description", "shown"),
    [
        ("室内机器人", "Ein Fühler für Räume, 1 bis 5 m", "none"),
        ("Робот № 1: θ = 16°, ½ × Ø80 − “ça”", "実験 of a 日本 lens", "… of a … lens"),
    ],
)
def test_nothing_is_printed_that_the_fonts_lack(title: str, description: str, shown: str, tmp_path: Path) -> None:
    """Words are replaced, and a note says so; what the fonts have stays as it was written."""
    path = write_sample_study(tmp_path / "none", title=title, designs=())
    asked = path / "requirement.toml"
    asked.write_text(
        re.sub(r"description = .*", f'description = "{description}"', asked.read_text(encoding="utf-8")),
        encoding="utf-8",
    )
    study = read_study(path)
    text, note = legible_source(study, {})
    assert not missing_characters(text)
    key, kept = ("title", description) if shown == "none" else ("description", title)
    assert f"do not contain some characters of {key}:" in note
    assert note in text
    assert kept in text
    assert shown == "none" or shown in text
    told: list[str] = []
    write_pdf(study, path, told.append)
    assert told == [note]


def test_where_the_fonts_have_everything_nothing_is_said(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "plain", title="Größe und Reichweite", designs=())
    study = read_study(path)
    assert legible_source(study, {}) == (source(study, {}), "")


@pytest.mark.parametrize(
    ("second_valid", "verdict_says", "page_says"),
    [
        ("True", "to second order it is 8.77 % (at worst 13.5 %)", "8.77 %, at worst 13.5 %"),
        ("False", "beyond the validity of both first and second order", "also invalid: use the traced points"),
    ],
)
def test_errors_beyond_first_order_are_flagged_everywhere(
    second_valid: str, verdict_says: str, page_says: str, tmp_path: Path
) -> None:
    """In the verdict, in the ranking (beside a design without a star) and on the design's page."""
    path = write_sample_study(tmp_path / "far", designs=(prototype(), prototype(topology="upper_inner")))
    plain = source(read_study(path), {})
    assert "A star marks" not in plain
    assert '"to second order"' not in plain
    with (path / "designs.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    far = {
        "first_order_valid": "False",
        "depth_error_rms_second_order": "0.0877",
        "depth_error_worst_second_order": "0.135",
        "second_order_valid": second_valid,
    }
    flagged = [row | (far if row["rank"] == "1" else dict.fromkeys(far, "True")) for row in rows]
    with (path / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(flagged[0]))
        writer.writeheader()
        writer.writerows(flagged)
    study = read_study(path)
    text = source(study, {})
    assert verdict_says in text
    assert "A star marks errors that exceed 6.5 % somewhere" in text
    table = ranking_table(study.rows)
    assert (table.count('#text("*")'), table.count('#hide("*")')) == (1, 1)
    assert page_says in text
    assert write_pdf(read_study(path), path).exists()


def test_what_the_scale_does_is_told_where_a_table_has_it(tmp_path: Path) -> None:
    """In the winner's facts beside its drawing and on its page; the verdict says for what scale, if any."""
    path = write_sample_study(tmp_path / "scale", designs=(prototype(),))
    requirement = (path / "requirement.toml").read_text(encoding="utf-8")
    with (path / "designs.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    plain = source(read_study(path), {})
    assert "shifts the depth by" not in plain
    shifts = {"depth_shift_per_scale": "54.97", "depth_shift_per_scale_worst": "103.5"}
    with (path / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=[*rows[0], *shifts])
        writer.writeheader()
        writer.writerows(row | shifts for row in rows)
    for uncertainty, told in (("0", 0), ("0.03", 1)):
        key = f"baseline_mm = 100.0\nscale_uncertainty_percent = {uncertainty}"
        (path / "requirement.toml").write_text(requirement.replace("baseline_mm = 100.0", key), encoding="utf-8")
        text = source(read_study(path), {})
        assert text.count('("0.1 % of image scale", "shifts the depth by 5.50 % rms, up to 10.4 %")') == 2
        assert text.count("0.1 px of noise and 0.03 % of image scale") == told
        assert f'("scale uncertainty", "{uncertainty} %")' in text
    assert write_pdf(read_study(path), path).exists()


def test_azimuths_that_the_sensor_cuts_off_are_told_beside_the_requirement(tmp_path: Path) -> None:
    """On a square sensor a circle of radius r loses 4 arccos(side / 2r) of 2 pi; here a third."""
    study = read_study(write_sample_study(tmp_path / "wide", designs=(prototype(),)))
    assert "beyond the sensor" not in source(study, {})
    camera = study.requirement.camera
    square = {"width_px": 1000, "height_px": 1000, "image_circle_radius_px": 500 / np.cos(np.pi / 12)}
    wide = study.requirement.model_copy(update={"camera": camera.model_copy(update=square)})
    told = source(replace(study, requirement=wide), {})
    assert "33 % of all azimuths lie beyond the sensor" in told


def test_the_least_limit_is_told_where_it_is_not_the_designs_own(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "free", designs=(prototype(),))
    with (path / "designs.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    own = float(rows[0]["depth_error_rms"] or 0.0123) / 1.002
    for least, told in ((own, 0), (0.9 * own, 3)):
        where = {"least_limit_baseline_mm": "120", "least_limit_focal_length_mm": "16"}
        with (path / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, fieldnames=[*rows[0], "least_limit_depth_error_rms", *where])
            writer.writeheader()
            writer.writerows(row | where | {"least_limit_depth_error_rms": str(least)} for row in rows)
        text = source(read_study(path), {})
        # In the verdict, beside the winner's drawing and on its page.
        assert text.count("1.10 %") == told
        assert text.count("at b = 120.0 and f = 16.00 mm") == max(told - 1, 0)


def test_figures_of_an_earlier_report_go(tmp_path: Path) -> None:
    path = write_sample_study(tmp_path / "study", designs=())
    stale, foreign = (path / "figures" / name for name in ("resolution-gone.svg", "office.svg"))
    stale.parent.mkdir()
    for file in (stale, foreign):
        file.write_text("<svg/>")
    settle(path, ["figures/resolution-gone.svg"])
    write_pdf(read_study(path), path)
    assert not stale.exists()
    assert foreign.exists()


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("designs.csv", "configuration,family\n", "status"),
        ("requirement.toml", "baseline_mm = = 3", "TOML"),
        ("provenance.json", "[1]", "object"),
        ("fronts.csv", "configuration,swept,limit_mm,status\na,height_mm,tall,feasible\n", "limit_mm"),
    ],
)
def test_a_broken_folder_is_one_line(tmp_path: Path, name: str, content: str, told: str) -> None:
    path = write_sample_study(tmp_path / "broken", designs=())
    (path / name).write_text(content)
    with pytest.raises(InputError) as caught:
        write_pdf(read_study(path), path)
    assert name in str(caught.value)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (path / "study.pdf").exists()


@pytest.mark.parametrize(("count", "pages"), [(0, 3), (1, 7), (3, 12)])
def test_a_study_of_few_configurations_has_no_nearly_empty_page(count: int, pages: int, tmp_path: Path) -> None:
    """Verdict and requirement; the winner; ranking and trade-offs; two pages for each design; two of method."""
    designs = (prototype(), two_direct_mirrors(), prototype(topology="upper_inner"))[:count]
    path = write_sample_study(tmp_path / "few", designs=designs)
    with (path / "designs.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    shown = [row for row in rows if row["status"] == "feasible"] or [row for row in rows if row["closest_constraint"]]
    with (path / "designs.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(shown)
    assert len(re.findall(rb"/Type */Page\b", write_pdf(read_study(path), path).read_bytes())) == pages


def test_a_new_panel_is_one_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    panel = ReportFigure(
        "baseline",
        PAGE_PANEL,
        (82.0, 52.0),
        lambda design, width, height: DrawnFigure(SQUARE),
        lambda design: "Baseline",
    )
    monkeypatch.setattr(registry, "DESIGN_FIGURES", (*registry.DESIGN_FIGURES, panel))
    study = read_study(write_sample_study(tmp_path / "panel", designs=(prototype(), two_direct_mirrors())))
    text = source(study, {})
    for _, design in study.best():
        assert f'panel([Baseline], image("figures/baseline-{design.configuration}.svg"))' in text
    write_pdf(study, tmp_path)
    assert len(list((tmp_path / "figures").glob("baseline-*.svg"))) == 2


def test_the_method_says_what_another_projection_changes(folder: Path) -> None:
    study = read_study(folder)
    assert other_projections(study.requirement.camera.lenses) == ""
    fisheye = set_key(study.requirement, "camera.lens.projection", "equidistant")
    study = replace(study, requirement=set_key(fisheye, "camera.lens.distortion", [0.1]))
    text = source(study, {})
    for words in ("== Other projections", '("projection", "equidistant")', '("distortion", "k1 = 0.1")'):
        assert words in text
    assert typeset(other_projections(study.requirement.camera.lenses), {}).startswith(b"%PDF-")
