"""Stores of version 0.1: what it found is read, and a sweep that it began is finished."""

import json
import shutil
import sqlite3
from pathlib import Path

import pandas as pd
import pytest

from designer.optimise.search import recall
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.export import read_sweep_results
from designer.study.sweep.point import read_warm_starts
from designer.study.sweep.run import run_sweep
from designer.study.sweep.store import FILE_NAME
from support.shipped_problems import CONFIGURATIONS, shipped_requirement

# The columns of ``results`` then; the table ``tasks`` called warm starts trails.
# fmt: off
COLUMNS_THEN = (
    "configuration", "status", "reason", "depth_error_rms", "depth_error_worst", "first_order_valid", "limit_ratio",
    "baseline_mm", "height_mm", "diameter_mm", "volume_cm3", "first_stage_depth_error_rms", "first_stage_limit_ratio",
    "first_stage_height_mm", "first_stage_diameter_mm", "first_stage_volume_cm3", "principal_distance_mm", "lens",
    "variant", "multipliers", "closest_constraint", "closest_violation", "closest_unit", "solves",
)
# fmt: on
STORED = json.loads((Path(__file__).parents[2] / "data" / "warm_starts_of_version_0_1.json").read_text())


def test_a_warm_start_of_version_0_1_is_the_design_it_was():
    name = STORED["configuration"]
    (warm_start,) = read_warm_starts(json.dumps(STORED["trails"]))[name]
    assert warm_start.second_directions is not None
    _, second = recall(shipped_requirement("indoor_robot"), CONFIGURATIONS[name], warm_start)
    assert second is not None
    assert second.is_feasible
    assert second.goals["depth_error"] == pytest.approx(STORED["depth_error_rms"], rel=1e-12)
    assert second.goals["height"] == pytest.approx(STORED["height_mm"], rel=1e-12)


def as_version_0_1_left_it(folder):
    """Take the layout of a store back, and the names of the warm starts in it."""
    with sqlite3.connect(folder / FILE_NAME) as connection:
        known = [name for _, name, *_ in connection.execute("PRAGMA table_info(results)")]
        for name in set(known) - {"point", *COLUMNS_THEN}:
            connection.execute(f"ALTER TABLE results DROP COLUMN {name}")
        connection.execute("ALTER TABLE results ADD COLUMN multipliers TEXT")
        connection.execute("ALTER TABLE tasks RENAME COLUMN warm_starts TO trails")
        connection.execute("UPDATE tasks SET trails = replace(trails, 'directions\"', 'separators\"')")


def test_a_finished_sweep_of_version_0_1_is_read_and_left_as_it_is(finished_folder, undisturbed, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    as_version_0_1_left_it(folder)
    stored = (folder / FILE_NAME).read_bytes()
    then = ["point", "rank", "family", "topology", *(name for name in COLUMNS_THEN if name != "multipliers")]
    read = read_sweep_results(folder)
    pd.testing.assert_frame_equal(read[then], undisturbed[then], check_exact=True)
    assert read["largest_mirror_diameter_mm"].isna().all()
    assert (folder / FILE_NAME).read_bytes() == stored


def test_a_sweep_that_version_0_1_began_is_finished(quick_sweep, finished_folder, undisturbed, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    with sqlite3.connect(folder / FILE_NAME) as connection:
        # The points that have no children: every parent is one of those that version 0.1 has solved.
        left = "SELECT point FROM points WHERE point NOT IN (SELECT parent FROM points WHERE parent IS NOT NULL)"
        (count,) = connection.execute(f"SELECT COUNT(*) FROM ({left})").fetchone()
        for table in ("results", "tasks"):
            connection.execute(f"DELETE FROM {table} WHERE point IN ({left})")
    as_version_0_1_left_it(folder)
    assert count >= 3
    solved = []
    run_sweep(*read_sweep(quick_sweep), folder, progress=lambda state: solved.append(state.done))
    assert len(solved) == count
    shared = ["point", "rank", *(name for name in COLUMNS_THEN if name != "multipliers")]
    pd.testing.assert_frame_equal(read_sweep_results(folder)[shared], undisturbed[shared], check_exact=True)
