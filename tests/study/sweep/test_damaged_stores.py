"""A store that a disk has damaged gives the same table as an undamaged one, or is refused: never another table."""

import random
import shutil
import sqlite3

import pandas as pd
import pytest
from click.testing import CliRunner

from designer.cli import cli
from designer.files import InputError
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.run import run_sweep
from designer.study.sweep.store import FILE_NAME
from designer.study.sweep.tables import read_sweep_results

FLIPS = range(10)


@pytest.fixture
def damaged(finished_folder, tmp_path):
    """A copy of the finished sweep, to be damaged."""
    return shutil.copytree(finished_folder, tmp_path / "out")


def flip_a_bit(path, seed):
    draw = random.Random(seed)
    data = bytearray(path.read_bytes())
    data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    path.write_bytes(data)


def assert_same_or_refused(function, undisturbed):
    """The table, or one line that says what is wrong and what to do."""
    refusal = ""
    try:
        table = function()
    except InputError as error:
        refusal, table = str(error), undisturbed
    assert not refusal or any(words in refusal for words in ("damaged", "different version", "is empty")), refusal
    assert "\n" not in refusal
    pd.testing.assert_frame_equal(table, undisturbed, check_exact=True)


@pytest.mark.parametrize("seed", FLIPS)
def test_a_flipped_bit_never_gives_another_table(seed, quick_sweep, damaged, undisturbed):
    flip_a_bit(damaged / FILE_NAME, seed)
    assert_same_or_refused(lambda: read_sweep_results(damaged), undisturbed)

    def resumed():
        run_sweep(*read_sweep(quick_sweep), damaged)
        return read_sweep_results(damaged)

    assert_same_or_refused(resumed, undisturbed)


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE results SET height_mm = height_mm + 1 WHERE point = 4 AND round = 0",
        "UPDATE results SET configuration = 'folded-PaPa-Hy-upper_innes' WHERE rowid = 5",
        "UPDATE tasks SET warm_starts = replace(warm_starts, '1', '2') WHERE point = 4 AND round = 0",
        "DELETE FROM results WHERE rowid = 5",
        "DELETE FROM tasks WHERE point = 4 AND round = 0",
        "UPDATE results SET reason = CAST(x'ff00' AS TEXT) WHERE rowid = 5",
    ],
)
def test_a_damaged_task_is_computed_again_which_is_said(damage, quick_sweep, damaged, undisturbed):
    with sqlite3.connect(damaged / FILE_NAME) as connection:
        connection.execute(damage)
    with pytest.raises(InputError, match="1 finished task is damaged; run the sweep again, which computes it anew"):
        read_sweep_results(damaged)
    told, solved = [], []
    definition, base = read_sweep(quick_sweep)
    run_sweep(definition, base, damaged, progress=lambda state: solved.append(state.done), tell=told.append)
    assert told == [f"{damaged / FILE_NAME}: 1 finished task damaged; computing again"]
    assert solved == [9]
    pd.testing.assert_frame_equal(read_sweep_results(damaged), undisturbed, check_exact=True)


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE points SET coordinates = replace(coordinates, '98', '99')",
        "UPDATE about SET value = replace(value, '0.1', '0.3')",
        "DELETE FROM about WHERE key = 'sha256'",
        "UPDATE about SET key = 'sha257' WHERE key = 'sha256'",
        "ALTER TABLE results RENAME COLUMN height_mm TO heighu_mm",
    ],
)
def test_a_damaged_plan_is_refused(damage, quick_sweep, damaged):
    with sqlite3.connect(damaged / FILE_NAME) as connection:
        connection.execute(damage)
    for function in (lambda: read_sweep_results(damaged), lambda: run_sweep(*read_sweep(quick_sweep), damaged)):
        with pytest.raises(InputError, match="is damaged, or is not a sweep store: its plan is not as it was written"):
            function()


@pytest.mark.parametrize("share", [0.001, 0.4, 0.97])
def test_a_truncated_store_is_refused(share, quick_sweep, damaged, undisturbed):
    path = damaged / FILE_NAME
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    before = path.read_bytes()
    for function in (lambda: read_sweep_results(damaged), lambda: run_sweep(*read_sweep(quick_sweep), damaged)):
        with pytest.raises(InputError, match=r"sqlite: is damaged, or is not a sweep store: .*; remove the file"):
            function()
    assert path.read_bytes() == before


def test_an_emptied_store_is_said_and_solved_from_the_start(quick_sweep, damaged, undisturbed):
    (damaged / FILE_NAME).write_bytes(b"")
    with pytest.raises(InputError, match="is empty: either nothing has been solved yet, or the file was truncated"):
        read_sweep_results(damaged)
    told = []
    definition, base = read_sweep(quick_sweep)
    run_sweep(definition, base, damaged, tell=told.append)
    assert told == [f"{damaged / FILE_NAME}: is empty; the sweep starts from the beginning"]
    pd.testing.assert_frame_equal(read_sweep_results(damaged), undisturbed, check_exact=True)


@pytest.mark.parametrize("seed", [*FLIPS, "truncated"])
def test_the_commands_answer_a_damaged_store_without_a_traceback(seed, quick_sweep, damaged, finished_folder):
    path = damaged / FILE_NAME
    if seed == "truncated":
        path.write_bytes(path.read_bytes()[:5000])
    else:
        flip_a_bit(path, seed)
    for words in (("compare", damaged, finished_folder), ("sweep", quick_sweep, "--out", damaged, "--no-pdf")):
        result = CliRunner().invoke(cli, [str(word) for word in words])
        assert result.exit_code in {0, 2}
        assert isinstance(result.exception, SystemExit | None)
