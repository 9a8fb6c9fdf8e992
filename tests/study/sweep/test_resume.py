import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

import pandas as pd
import pytest

from designer.files import InputError
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.run import run_sweep
from designer.study.sweep.store import FILE_NAME, StoreError, open_store
from designer.study.sweep.tables import read_sweep_results

COMMAND = [sys.executable, "-c", "from designer.cli import main; main()", "sweep"]


class Interruption(Exception):
    pass


def interrupt_after(tasks, number=0):
    def progress(state):
        if state.round == number and state.done >= tasks:
            raise Interruption

    return progress


def test_sweep_finds_designs_and_ranks_them(undisturbed):
    assert len(undisturbed) == 18
    assert (undisturbed["status"] == "feasible").sum() >= 9
    best = undisturbed[undisturbed["rank"] == 1]
    # With a longer baseline allowed to be seen from the same envelope, depth error falls.
    by_baseline = best.groupby("asked.baseline_mm")["first_stage_depth_error_rms"].min()
    assert by_baseline.is_monotonic_decreasing


def test_resumed_equals_undisturbed_and_finished_is_not_computed_twice(quick_sweep, tmp_path, undisturbed):
    definition, base = read_sweep(quick_sweep)
    for stop in ((1, 0), (4, 0), (2, 1), (5, 1)):
        with pytest.raises(Interruption):
            run_sweep(definition, base, tmp_path / "out", progress=interrupt_after(*stop))
    solved = []
    run_sweep(definition, base, tmp_path / "out", progress=lambda state: solved.append((state.round, state.done)))
    assert solved[:4] == [(1, 6), (1, 7), (1, 8), (1, 9)]
    count = len(solved)
    run_sweep(definition, base, tmp_path / "out", progress=lambda state: solved.append(state))
    assert len(solved) == count
    pd.testing.assert_frame_equal(read_sweep_results(tmp_path / "out"), undisturbed, check_exact=True)


def test_full_disk_gives_one_clear_line_and_leaves_the_store_whole(quick_sweep, tmp_path, undisturbed, monkeypatch):
    definition, base = read_sweep(quick_sweep)
    connect = sqlite3.connect

    def connect_to_small_disk(*arguments, **options):
        connection = connect(*arguments, **options)
        connection.execute("PRAGMA max_page_count = 11")
        return connection

    with monkeypatch.context() as patched:
        patched.setattr(sqlite3, "connect", connect_to_small_disk)
        with pytest.raises(StoreError, match="disk is full; finished tasks are kept"):
            run_sweep(definition, base, tmp_path / "out")
    with connect(tmp_path / "out" / FILE_NAME) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        tasks = connection.execute("SELECT COUNT(*) FROM tasks WHERE round = 0").fetchone()[0]
        assert connection.execute("SELECT COUNT(*) FROM results").fetchone()[0] == 2 * tasks
    assert 1 <= tasks < 9
    run_sweep(definition, base, tmp_path / "out")
    pd.testing.assert_frame_equal(read_sweep_results(tmp_path / "out"), undisturbed, check_exact=True)


def test_store_that_cannot_be_written_is_said_at_once(quick_sweep, tmp_path):
    definition, base = read_sweep(quick_sweep)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        run_sweep(definition, base, tmp_path / "file" / "out")


def test_read_only_store_is_said_and_left_whole(quick_sweep, tmp_path, monkeypatch):
    definition, base = read_sweep(quick_sweep)
    with pytest.raises(Interruption):
        run_sweep(definition, base, tmp_path / "out", progress=interrupt_after(1))
    connect = sqlite3.connect
    before = (tmp_path / "out" / FILE_NAME).read_bytes()

    def connect_read_only(path, **options):
        return connect(f"file:{path}?mode=ro", uri=True, **options)

    monkeypatch.setattr(sqlite3, "connect", connect_read_only)
    with pytest.raises(StoreError, match="readonly"):
        run_sweep(definition, base, tmp_path / "out")
    assert (tmp_path / "out" / FILE_NAME).read_bytes() == before


def test_other_sweep_in_the_folder_is_refused(quick_sweep, tmp_path):
    definition, base = read_sweep(quick_sweep)
    with pytest.raises(Interruption):
        run_sweep(definition, base, tmp_path / "out", progress=interrupt_after(1))
    quick_sweep.write_text(quick_sweep.read_text().replace("98", "97"))
    definition, base = read_sweep(quick_sweep)
    with pytest.raises(InputError, match="a different plan of points"):
        run_sweep(definition, base, tmp_path / "out")


INTERRUPTED_WRITE = """
import os, signal, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("PRAGMA cache_size = 1")  # so that pages reach the file before the transaction ends
connection.execute("BEGIN IMMEDIATE")
connection.execute("UPDATE results SET reason = hex(randomblob(3000))")
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_write_that_was_cut_off_is_taken_back_by_the_next_reader(finished_folder, undisturbed, tmp_path):
    folder = shutil.copytree(finished_folder, tmp_path / "out")
    subprocess.run([sys.executable, "-c", INTERRUPTED_WRITE, str(folder / FILE_NAME)])
    assert (folder / f"{FILE_NAME}-journal").exists()
    pd.testing.assert_frame_equal(read_sweep_results(folder), undisturbed, check_exact=True)


def test_a_database_of_something_else_is_refused_and_left_alone(quick_sweep, tmp_path):
    (tmp_path / "out").mkdir()
    with sqlite3.connect(tmp_path / "out" / FILE_NAME) as connection:
        connection.execute("CREATE TABLE photographs (name TEXT)")
    before = (tmp_path / "out" / FILE_NAME).read_bytes()
    with pytest.raises(InputError, match="is not a sweep store"):
        run_sweep(*read_sweep(quick_sweep), tmp_path / "out")
    assert (tmp_path / "out" / FILE_NAME).read_bytes() == before


def test_two_processes_do_not_write_one_store(tmp_path):
    with open_store(tmp_path), pytest.raises(InputError, match="another process"), open_store(tmp_path):
        pass


@pytest.mark.slow
def test_killed_again_and_again_and_resumed_equals_undisturbed(quick_sweep, tmp_path, undisturbed):
    moments = random.Random(5)
    arguments = [*COMMAND, str(quick_sweep), "--out", str(tmp_path / "out"), "--quiet", "--jobs", "2"]
    for _ in range(5):
        process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(moments.uniform(0.5, 4.0))
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(arguments, check=True)
    pd.testing.assert_frame_equal(read_sweep_results(tmp_path / "out"), undisturbed, check_exact=True)
    with sqlite3.connect(tmp_path / "out" / FILE_NAME) as connection:
        counts = "SELECT COUNT(*), COUNT(DISTINCT point) FROM tasks WHERE round = 0"
        assert connection.execute(counts).fetchone() == (9, 9)
