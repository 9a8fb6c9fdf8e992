"""What is made of a finished sweep: designs, tables, report, comparison."""

import doctest
import json
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from designer import api
from designer.cli import cli
from designer.design import Design
from designer.files import InputError
from designer.report.content import sweep as sweep_report
from designer.report.figures.sweep import draw_heat_map, draw_winner_map, letters_of, short
from designer.report.figures.sweep_registry import tables_of
from designer.report.sweep_document import write_sweep_pdf
from designer.requirement import set_key
from designer.study.columns import SWEPT_COLUMNS
from designer.study.compare import compare
from designer.study.sweep.store import FILE_NAME
from designer.study.sweep.tables import pareto, read_sweep_results, requirement_of
from designer.typesetting.glyphs import missing_characters
from designer.verify.judge import judge
from support.sweep_stores import accept_edited_plan, forget_checksums

ROOT = Path(__file__).resolve().parents[3]


def test_designs_come_back_from_the_store_as_they_were_found(finished_folder, undisturbed):
    found = api.read_sweep_folder(finished_folder)
    for _, row in found.winners.iloc[::4].iterrows():
        design = found.design(int(row["point"]))
        assert isinstance(design, Design)
        assert judge(design).passed
        assert design.height_mm == pytest.approx(row["height_mm"], rel=1e-12)
        assert design.baseline_mm == row["asked.baseline_mm"]
        assert design.score["depth_error_rms"] == pytest.approx(row["depth_error_rms"], rel=1e-9)


def test_store_is_readable_by_pandas_and_parquet_says_what_csv_says(finished_folder, undisturbed):
    with sqlite3.connect(finished_folder / FILE_NAME) as connection:
        rows = pd.read_sql("SELECT * FROM results", connection)
    assert len(rows) == len(undisturbed)
    pytest.importorskip("pyarrow")
    parquet = pd.read_parquet(finished_folder / "results.parquet")
    csv = pd.read_csv(finished_folder / "results.csv")
    for name in ("depth_error_rms", "height_mm", "asked.baseline_mm"):
        np.testing.assert_array_equal(parquet[name], csv[name])


def test_ranks_follow_the_rule_of_a_study(undisturbed):
    for _, part in undisturbed[undisturbed["status"] == "feasible"].groupby("point"):
        best = part["first_stage_depth_error_rms"].min()
        near = part[part["first_stage_depth_error_rms"] <= 1.01 * best]
        assert part.loc[part["rank"].idxmin(), "height_mm"] == near["height_mm"].min()
        assert sorted(part["rank"]) == list(range(1, len(part) + 1))


def test_designs_come_back_under_the_defaults_of_their_own_point(quick_sweep, tmp_path):
    path = quick_sweep
    base = tmp_path / "base.toml"
    lines = [line for line in base.read_text().splitlines() if not line.startswith("mirror_diameter_mm")]
    base.write_text("\n".join(lines))  # the widest mirror then follows the envelope
    path.write_text('requirement = "base.toml"\n[[axis]]\nkey = "envelope.diameter_mm"\nvalues = [70, 80, 90]\n')
    found = api.sweep(path, tmp_path / "out", jobs=1)
    assert set(found.winners["point"]) == {0, 1, 2}
    for _, row in found.winners.iterrows():
        design = found.design(row["point"])
        assert design.height_mm == pytest.approx(row["height_mm"], rel=1e-12)
        assert design.score["depth_error_rms"] == pytest.approx(row["depth_error_rms"], rel=1e-9)
    assert "envelope.diameter_mm" in found.sensitivities([0, 1])


def test_each_point_ranks_by_its_own_tolerance(quick_sweep, tmp_path):
    path = quick_sweep
    path.write_text('requirement = "base.toml"\n[[axis]]\nkey = "objective.within_percent"\nvalues = [0, 100]\n')
    found = api.sweep(path, tmp_path / "out", jobs=1)
    strict, lenient = (part.set_index("rank").sort_index() for _, part in found.table.groupby("point"))
    assert strict["first_stage_depth_error_rms"].is_monotonic_increasing
    assert strict["first_stage_depth_error_rms"].max() < 2.0 * strict["first_stage_depth_error_rms"].min()
    assert lenient["height_mm"].is_monotonic_increasing
    assert not strict["height_mm"].is_monotonic_increasing


def test_a_design_that_the_tracer_rejected_is_not_handed_out(finished_folder, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    name = api.read_sweep_folder(folder).winners["configuration"].iloc[0]
    forget_checksums(folder)
    with sqlite3.connect(folder / FILE_NAME) as connection:
        connection.execute("UPDATE results SET status = 'failed' WHERE point = 0 AND configuration = ?", (name,))
    with pytest.raises(InputError, match="no feasible design at point 0"):
        api.read_sweep_folder(folder).design(0, name)


@given(st.lists(st.tuples(*[st.integers(0, 5)] * 3), min_size=1, max_size=40))
def test_pareto_front_is_what_nothing_beats(rows):
    table = pd.DataFrame(rows, columns=["a", "b", "c"])
    front = {tuple(row) for row in pareto(table, ("a", "b", "c")).to_numpy()}
    beaten = {
        one for one in rows if any(other != one and all(np.array(other) <= np.array(one)) for other in rows)
    }  # fmt: skip
    assert front == set(rows) - beaten


def test_letters_are_one_for_each_winner():
    names = [f"configuration {number}" for number in range(30) for _ in range(number + 1)]
    letters = letters_of(pd.DataFrame({"configuration": names}))
    assert letters["configuration 29"] == "A"
    assert len(set(letters.values())) == 30


def test_axis_titles_say_unit_and_end():
    assert short("asked.envelope.height_mm") == "allowed height (mm)"
    assert short("asked.working_volume.elevation_deg.1") == "elevation (high) (deg)"
    assert short("height_mm") == "height (mm)"
    assert short("camera.lens.f_number") == "f-number"


def test_cells_of_a_map_touch_however_uneven_the_levels():
    # 8, 10, 12 and 16 mm lenses: a gap between two cells would say that nothing is feasible there.
    asked = pd.DataFrame([(x, y) for x in (8.0, 10.0, 12.0, 16.0) for y in (1.0, 2.0, 4.0)], columns=["a.x", "a.y"])
    winners = asked.assign(configuration="A")
    (panel,) = draw_winner_map(winners, asked, {"A": "A"}, 160.0).axes
    cells = list(panel.patches)
    assert len(cells) == 12
    areas = [cell.get_width() * cell.get_height() for cell in cells]
    (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
    assert sum(areas) == pytest.approx((right - left) * (high - low))
    for (_, row), cell in zip(asked.iterrows(), cells, strict=True):
        assert cell.get_x() < row["a.x"] < cell.get_x() + cell.get_width()
        assert cell.get_y() < row["a.y"] < cell.get_y() + cell.get_height()


def test_points_without_a_winner_leave_their_cells_empty():
    asked = pd.DataFrame([(x, y) for x in (1.0, 2.0, 3.0) for y in (1.0, 2.0)], columns=["a.x", "a.y"])
    winners = asked[asked["a.x"] != 2.0].assign(configuration="A")
    (panel,) = draw_winner_map(winners, asked, {"A": "A"}, 160.0).axes
    assert sorted({(cell.get_x(), cell.get_width()) for cell in panel.patches}) == [(0.5, 1.0), (2.5, 1.0)]


def test_a_hypercube_is_drawn_as_dots_over_each_pair_of_axes():
    asked = pd.DataFrame(np.random.default_rng(3).random((9, 3)), columns=["a.x", "a.y", "a.z"])
    winners = asked.iloc[:7].assign(configuration="A", height_mm=range(7))
    panels = draw_winner_map(winners, asked, {"A": "A"}, 160.0).axes
    for panel, pair in zip(panels, (["a.x", "a.y"], ["a.x", "a.z"], ["a.y", "a.z"]), strict=True):
        found, missing = (np.asarray(dots.get_offsets()) for dots in panel.collections)
        np.testing.assert_array_equal(found, asked[pair].to_numpy()[:7])
        np.testing.assert_array_equal(missing, asked[pair].to_numpy()[7:])
    assert len(draw_heat_map(winners, asked, "height_mm", "height (mm)", 160.0).axes) == 4


def test_report_has_its_pages(finished_folder):
    path = write_sweep_pdf(finished_folder)
    assert path.read_bytes().startswith(b"%PDF")
    assert {each.name for each in (finished_folder / "figures").iterdir()} >= {"winners.svg", "pareto.svg"}
    assert write_sweep_pdf(finished_folder).read_bytes() == path.read_bytes()


def test_the_report_prints_nothing_its_fonts_lack_and_says_so(finished_folder, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    with sqlite3.connect(folder / FILE_NAME) as connection:
        (definition,) = connection.execute("SELECT value FROM about WHERE key = 'definition'").fetchone()
        changed = json.dumps(json.loads(definition) | {"title": "Sweep 扫描 of two", "description": "Größe, 幅"})
        connection.execute("UPDATE about SET value = ? WHERE key = 'definition'", (changed,))
    accept_edited_plan(folder)
    table = api.read_sweep_folder(folder)
    shown = sweep_report.legible(sweep_report.source(folder, tables_of(table.table, table.winners)))
    assert "Sweep … of two" in shown
    assert "base requirement base.toml" in shown
    assert "Größe, …" in shown
    assert "report fonts do not contain some characters" in shown
    assert not missing_characters(shown)
    assert write_sweep_pdf(folder).read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(("goal", "words"), [("depth_error", "parts per ten thousand"), ("volume", "cm³")])
def test_multipliers_are_shown_in_the_unit_of_the_first_objective(finished_folder, goal, words):
    best = api.read_sweep_folder(finished_folder).winners
    section = sweep_report.sensitivity_section(finished_folder, best, goal)
    assert f"Change of the minimum {goal.replace('_', ' ')}, in {words}" in section
    assert "nan" not in section


def test_a_multiplier_that_does_not_exist_is_a_dash():
    assert sweep_report.slope_words(float("nan")) == sweep_report.slope_words(1e-9) == "–"
    assert sweep_report.slope_words(-0.123456) == "−0.123"


def test_comparing_a_sweep_with_itself_finds_nothing(finished_folder):
    same = compare(finished_folder, finished_folder)
    assert same.asked == ()
    assert same.changed_winners.empty
    assert same.changed_statuses.empty
    assert (same.winners["height_mm_change"] == 0).all()
    result = CliRunner().invoke(cli, ["compare", str(finished_folder), str(finished_folder)])
    assert result.exit_code == 0
    assert "The requirements are identical." in result.output


def test_comparing_says_what_changed(finished_folder, quick_sweep, tmp_path):
    path = quick_sweep
    base = tmp_path / "base.toml"
    base.write_text(base.read_text().replace("noise_px = 0.1 ", "noise_px = 0.2 "))
    path.write_text(path.read_text().replace("[96, 98, 100]", "[98]").replace("[136, 138, 140]", "[138]"))
    other = api.sweep(path, tmp_path / "out", jobs=1)
    found = compare(finished_folder, other.folder)
    assert found.asked == (("noise_px", 0.1, 0.2),)
    assert len(found.winners) == 1
    # Depth error is proportional to noise; geometry is not concerned.
    ratio = found.winners["depth_error_rms_b"] / found.winners["depth_error_rms_a"]
    assert ratio.iloc[0] == pytest.approx(2.0, rel=1e-3)


def test_comparing_with_what_is_no_result_gets_one_line(finished_folder, tmp_path):
    with pytest.raises(InputError, match="contains neither designs"):
        compare(finished_folder, tmp_path)


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("designs.csv", "", "designs.csv: column configuration is missing"),
        ("designs.csv", "a,b\n1,2\n", "designs.csv: column configuration is missing"),
        ("requirement.toml", "name = [", "requirement.toml: not valid TOML"),
    ],
)
def test_comparing_with_a_spoilt_folder_gets_one_line(tmp_path, file, content, words):
    (tmp_path / "designs.csv").write_text("configuration,status\nfolded-HyPl-Hy-upper_outer,infeasible\n")
    (tmp_path / "requirement.toml").write_text((ROOT / "configs/indoor_robot.toml").read_text())
    assert compare(tmp_path, tmp_path).asked == ()
    (tmp_path / file).write_text(content)
    with pytest.raises(InputError, match=words):
        compare(tmp_path, tmp_path)


def test_a_point_that_does_not_exist_is_refused(finished_folder):
    found = api.read_sweep_folder(finished_folder)
    for ask in (lambda: found.design(99), lambda: found.sensitivities([0, 99])):
        with pytest.raises(InputError, match="has no point 99"):
            ask()


def test_examples_of_the_api_run(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert doctest.testmod(api).failed == 0
    assert doctest.testmod(api).attempted >= 4


def test_api_study_is_a_table_with_designs_behind_it():
    asked = api.requirement(ROOT / "configs/indoor_robot.toml", solve__starts=2, sharpness__max_blur_deg=float("inf"))
    found = api.study(asked, only=("folded-PaPa-Hy-*",), jobs=1)
    assert len(found.table) == 2
    assert found.best is not None
    assert api.trace(found.best).passed
    assert "feasible" in found._repr_html_()


SPOILT = {
    "shifted vertex": ("mirrors", 0, "vertex_mm", lambda value: value + 0.01),
    "wrong conic": ("mirrors", 1, "conic", lambda value: value * 1.001),
    "cut rim": ("mirrors", 2, "outer_radius_mm", lambda value: value - 1.0),
    "lens among the mirrors": ("camera", None, "lens_front_mm", lambda value: value + 60.0),
}


@pytest.mark.parametrize("name", SPOILT)
def test_tracing_only_what_is_asked_rejects_spoilt_designs_too(finished_folder, undisturbed, name):
    found = api.read_sweep_folder(finished_folder)
    design = found.design(int(found.winners["point"].iloc[0]))
    assert judge(design, whole_image=False).passed
    part, index, key, change = SPOILT[name]
    content = design.model_dump()
    owner = content[part] if index is None else content[part][index]
    owner[key] = change(owner[key])
    assert not judge(Design.model_validate(content), whole_image=False).passed


def test_a_sweep_and_a_study_say_the_same_of_the_same_designs(finished_folder, undisturbed):
    """Each from its own search of the root, whose optimum is one: columns agree in name, and values to rounding."""
    base = requirement_of(finished_folder)
    asked = set_key(set_key(base, "baseline_mm", 98), "envelope.height_mm", 138)
    studied = api.study(asked, jobs=1).table.set_index("configuration")
    swept = undisturbed[undisturbed["point"] == 4].set_index("configuration")
    assert set(SWEPT_COLUMNS) <= {"configuration", *studied.columns}
    assert list(swept.sort_values("rank").index) == list(studied.index)
    for name, column in SWEPT_COLUMNS.items():
        if name in swept and name != "solves":
            there, here = swept[name], studied[name].reindex(swept.index)
            if column.kind is float:
                np.testing.assert_allclose(there.astype(float), here.astype(float), rtol=1e-9, err_msg=name)
            else:
                assert list(there.fillna("")) == list(here.fillna("")), name


def test_a_store_of_another_layout_is_refused(finished_folder, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    forget_checksums(folder)
    with sqlite3.connect(folder / FILE_NAME) as connection:
        connection.execute("ALTER TABLE results DROP COLUMN status")
    with pytest.raises(InputError, match="another version of designer"):
        read_sweep_results(folder)
