"""The one table of columns: every reader and writer follows it, and a new column is one new entry."""

from __future__ import annotations

import csv
import io

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import read_design
from designer.evaluate.focus import focus_score
from designer.evaluate.score import depth_score
from designer.study.columns import COLUMNS, SCORE_COLUMNS, STATUSES, SWEPT_COLUMNS, Column, Found, FoundDesign, typed
from designer.study.row import Row, frame_of, read_row, row_of
from support import DATA
from support.shipped_problems import CONFIGURATIONS

NAME = "folded-HyPl-Hy-upper_outer"
KINDS = {
    str: st.text(st.characters(codec="utf-8", exclude_categories=["C"]), min_size=1, max_size=20),
    float: st.floats(allow_nan=False, allow_infinity=False),
    int: st.integers(-(10**9), 10**9),
    bool: st.booleans(),
}


def through_csv(rows: list[Row]) -> list[Row]:
    text = frame_of(rows).to_csv(index=False)
    return [read_row(record) for record in csv.DictReader(io.StringIO(text), restval="")]


@st.composite
def rows(draw: st.DrawFn) -> Row:
    names = draw(st.sets(st.sampled_from(sorted(COLUMNS))))
    return Row({name: draw(KINDS[COLUMNS[name].kind]) for name in names})


@settings(deadline=None, max_examples=40)
@given(st.lists(rows(), min_size=1, max_size=4))
def test_a_table_gives_back_every_value_to_the_last_digit(given_rows: list[Row]) -> None:
    assert through_csv(given_rows) == given_rows


def test_a_row_of_a_design_holds_what_the_design_and_its_score_say() -> None:
    design = read_design(DATA / "folded_hypl_hy.json")
    depth = depth_score(design)
    row = row_of(Found(CONFIGURATIONS[NAME], "feasible", "", design=FoundDesign(design, depth, focus_score(design))))
    assert (row.configuration, row.family, row.status, row.reason) == (NAME, "folded", "feasible", "")
    assert row.number("depth_error_rms") == depth.depth_error_rms
    assert row.number("principal_distance_mm") == design.camera.focal_length_mm
    assert row.number("largest_mirror_diameter_mm") == max(2 * mirror.outer_radius_mm for mirror in design.mirrors)
    assert row.is_beyond_first_order == (not depth.first_order_valid)


@pytest.mark.parametrize("status", STATUSES[1:])
def test_a_row_without_a_design_has_no_numbers(status: str) -> None:
    row = row_of(Found(CONFIGURATIONS[NAME], status, "why"))
    assert (row.status, row.reason) == (status, "why")
    assert not [name for name in COLUMNS if row.number(name) is not None]


def test_a_new_column_is_one_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    column = Column("letters", int, lambda found: len(found.configuration.name), "letters")
    monkeypatch.setitem(COLUMNS, "letters", column)
    row = row_of(Found(CONFIGURATIONS[NAME], "impossible", "why"))
    assert row.number("letters") == len(NAME)
    assert through_csv([row]) == [row]
    assert frame_of([row])["letters"].dtype == "Int64"


def test_names_that_no_column_has_are_refused_and_left_out_of_files() -> None:
    with pytest.raises(KeyError, match="hight_mm"):
        Row({}).number("hight_mm")
    assert read_row({"configuration": NAME, "hight_mm": "3"}) == Row({"configuration": NAME})


def test_numbers_that_are_none_are_left_out() -> None:
    texts = {"height_mm": "tall", "diameter_mm": "inf", "rank": "", "first_order_valid": "perhaps"}
    assert read_row(texts) == Row({})


def test_people_read_shares_as_percent_and_units_in_headings() -> None:
    assert [COLUMNS[name].heading for name in SCORE_COLUMNS] == [
        "depth error",
        "limit ratio",
        "baseline mm",
        "height mm",
        "diameter mm",
        "largest blur px",
    ]
    assert COLUMNS["depth_error_rms"].factor == 100.0
    assert COLUMNS["height_mm"].factor == 1.0


def test_a_table_from_a_store_has_the_types_of_a_table_from_rows() -> None:
    """SQLite gives 0 and 1 for truth, and None for what is not there."""
    row = Row({"configuration": NAME, "first_order_valid": False, "solves": 3, "height_mm": 1.5})
    stored = pd.DataFrame([{name: row.values.get(name) for name in SWEPT_COLUMNS}, dict.fromkeys(SWEPT_COLUMNS)])
    pd.testing.assert_frame_equal(typed(stored), frame_of([row, Row({})], SWEPT_COLUMNS))
