"""Stores of earlier versions: results are read; designs and unfinished sweeps are refused in a line."""

import hashlib
import shutil
import sqlite3

import pandas as pd
import pytest

from designer.files import InputError
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.designs import design_at
from designer.study.sweep.run import run_sweep
from designer.study.sweep.store import FILE_NAME
from designer.study.sweep.tables import read_sweep_results
from support.sweep_stores import forget_checksums

# The columns of ``results`` then; the table ``tasks`` called warm starts trails.
# fmt: off
COLUMNS_THEN = (
    "configuration", "status", "reason", "depth_error_rms", "depth_error_worst", "first_order_valid", "limit_ratio",
    "baseline_mm", "height_mm", "diameter_mm", "volume_cm3", "first_stage_depth_error_rms", "first_stage_limit_ratio",
    "first_stage_height_mm", "first_stage_diameter_mm", "first_stage_volume_cm3", "principal_distance_mm", "lens",
    "variant", "multipliers", "closest_constraint", "closest_violation", "closest_unit", "solves",
)
# fmt: on


def as_version_0_1_left_it(folder):
    """Take the layout of a store back."""
    forget_checksums(folder)
    with sqlite3.connect(folder / FILE_NAME) as connection:
        # Without rounds, and so without a key that names them.
        connection.execute("CREATE TABLE latest AS SELECT *, MAX(round) FROM results GROUP BY point, configuration")
        connection.execute("DROP TABLE results")
        connection.execute("ALTER TABLE latest RENAME TO results")
        known = [name for _, name, *_ in connection.execute("PRAGMA table_info(results)")]
        for name in set(known) - {"point", *COLUMNS_THEN}:
            connection.execute(f'ALTER TABLE results DROP COLUMN "{name}"')
        connection.execute("ALTER TABLE results ADD COLUMN multipliers TEXT")
        connection.execute("ALTER TABLE tasks RENAME COLUMN warm_starts TO trails")


def test_a_finished_sweep_of_version_0_1_is_read_and_left_as_it_is(finished_folder, undisturbed, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    as_version_0_1_left_it(folder)
    stored = (folder / FILE_NAME).read_bytes()
    then = ["point", "rank", "family", "topology", *(name for name in COLUMNS_THEN if name != "multipliers")]
    read = read_sweep_results(folder)
    pd.testing.assert_frame_equal(read[then], undisturbed[then], check_exact=True)
    assert read["largest_mirror_diameter_mm"].isna().all()
    assert (folder / FILE_NAME).read_bytes() == stored


@pytest.mark.parametrize("change", ["as version 0.1 left it", "one column less"])
def test_designs_of_another_version_are_refused(finished_folder, undisturbed, tmp_path, change):
    """They were found by other rules; the table says so no more than it did."""
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    if change == "one column less":
        forget_checksums(folder)
        with sqlite3.connect(folder / FILE_NAME) as connection:
            connection.execute("ALTER TABLE results DROP COLUMN largest_blur_px")
    else:
        as_version_0_1_left_it(folder)
    winner = undisturbed[undisturbed["rank"] == 1].iloc[0]
    with pytest.raises(InputError, match="another version of designer: its tables can be read"):
        design_at(folder, int(winner["point"]), str(winner["configuration"]))


def test_a_sweep_that_version_0_1_began_is_not_gone_on_with(quick_sweep, finished_folder, tmp_path):
    """The same requirement has other designs now."""
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    as_version_0_1_left_it(folder)
    with pytest.raises(InputError, match="different version of designer"):
        run_sweep(*read_sweep(quick_sweep), folder)


def as_version_0_2_left_it(folder):
    """Take the rounds out of a store, with the checksums that it had then."""
    with sqlite3.connect(folder / FILE_NAME) as connection:
        for table, key in (("results", "point, configuration"), ("tasks", "point, chunk")):
            connection.execute(f"CREATE TABLE latest AS SELECT *, MAX(round) FROM {table} GROUP BY {key}")
            connection.execute(f"DROP TABLE {table}")
            connection.execute(f"ALTER TABLE latest RENAME TO {table}")
            connection.execute(f'ALTER TABLE {table} DROP COLUMN "MAX(round)"')
            connection.execute(f"ALTER TABLE {table} DROP COLUMN round")
        tasks = connection.execute("SELECT point, chunk, warm_starts, seconds FROM tasks").fetchall()
        for task in tasks:
            rows = connection.execute(
                "SELECT * FROM results WHERE point = ? AND chunk = ? ORDER BY configuration", task[:2]
            ).fetchall()
            connection.execute(
                "UPDATE tasks SET sha256 = ? WHERE point = ? AND chunk = ?", (hashed((task, hashed(rows))), *task[:2])
            )
        about = connection.execute("SELECT key, value FROM about WHERE key <> 'sha256' ORDER BY key").fetchall()
        points = connection.execute("SELECT point, parent, coordinates FROM points ORDER BY point").fetchall()
        layout = connection.execute("SELECT type, name, sql FROM sqlite_master ORDER BY type, name").fetchall()
        connection.execute("UPDATE about SET value = ? WHERE key = 'sha256'", (hashed((about, points, layout)),))


def hashed(value):
    return hashlib.sha256(ascii(value).encode("ascii")).hexdigest()


def test_a_finished_sweep_without_rounds_is_verified_and_read(finished_folder, undisturbed, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    as_version_0_2_left_it(folder)
    read = read_sweep_results(folder)
    shared = [name for name in undisturbed.columns if name in read.columns]
    pd.testing.assert_frame_equal(read[shared], undisturbed[shared], check_exact=True)
    with sqlite3.connect(folder / FILE_NAME) as connection:
        connection.execute("UPDATE results SET depth_error_rms = 2 * depth_error_rms WHERE point = 0")
    with pytest.raises(InputError, match="damaged"):
        read_sweep_results(folder)
