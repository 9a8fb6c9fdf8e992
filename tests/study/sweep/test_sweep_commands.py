"""``designer sweep`` and ``designer compare``: each option, and how they refuse."""

import json
import sqlite3
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from designer.cli import cli
from designer.study.sweep import cluster, run
from designer.study.sweep.store import FILE_NAME, read_store
from designer.study.sweep.tables import read_sweep_results
from designer.study.sweep.workers import local_workers
from support import CONFIGS
from support.shipped_problems import toml_with_constant_noise

TINY = """
requirement = "base.toml"
[[axis]]
key = "baseline_mm"
values = [98, 100]
"""
HYPERCUBE = """
requirement = "base.toml"
plan = "latin_hypercube"
points = 3
seed = 4
[[axis]]
key = "baseline_mm"
low = 96
high = 100
[[axis]]
key = "envelope.height_mm"
low = 136
high = 140
"""


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """A sweep of two points and one configuration, in a folder of its own that is the current one."""
    monkeypatch.chdir(tmp_path)
    base = toml_with_constant_noise((CONFIGS / "indoor_robot.toml").read_text())
    base += '\n[solve]\nstarts = 2\nconfigurations = ["folded-PaPa-Hy-upper_outer"]\n'
    base += "[sharpness]\nmax_blur_deg = inf\n"
    (tmp_path / "base.toml").write_text(base)
    (tmp_path / "tiny.toml").write_text(TINY)
    return "tiny.toml"


def invoke(*words):
    return CliRunner().invoke(cli, [str(word) for word in words])


def refused(*words, code=2):
    """The one line of a refusal, with nothing on stdout."""
    result = invoke(*words)
    assert (result.exit_code, result.stdout) == (code, ""), result.output
    (line,) = result.stderr.splitlines()
    return line


def test_a_sweep_goes_to_reports_says_how_far_it_is_and_ends_with_the_winners(tiny):
    result = invoke("sweep", tiny, "--jobs", 1)
    assert result.exit_code == 0
    assert "[2/2] requirements, 2 feasible designs, 0 s left" in result.stderr
    lines = result.stdout.splitlines()
    assert lines[0] == "2 requirements; most frequent winners:"
    assert lines[1].split() == ["2", "folded-PaPa-Hy-upper_outer"]
    assert lines[-1] == "reports/tiny/sweep.pdf"
    written = {each.name for each in Path("reports/tiny").iterdir()}
    assert written >= {FILE_NAME, "results.csv", "winners.csv", "sweep.pdf", "figures"}


def test_a_finished_sweep_is_not_computed_again(tiny, monkeypatch):
    assert invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--out", "there").exit_code == 0
    before = read_sweep_results(Path("there"))

    def never(*arguments):
        raise AssertionError("nothing is left to solve")

    monkeypatch.setattr(run, "solve_task", never)
    result = invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--out", "there")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1] == "there/results.csv"
    pd.testing.assert_frame_equal(read_sweep_results(Path("there")), before, check_exact=True)


def test_a_quiet_sweep_without_pdf(tiny):
    result = invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--quiet", "--out", "quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert not (Path("quiet") / "sweep.pdf").exists()
    assert not Path("reports").exists()


def test_a_latin_hypercube_covers_its_axes(tiny, tmp_path):
    (tmp_path / "cube.toml").write_text(HYPERCUBE)
    assert invoke("sweep", "cube.toml", "--jobs", 1, "--no-pdf", "--quiet").exit_code == 0
    found = read_sweep_results(tmp_path / "reports/cube")
    assert found["point"].tolist() == [0, 1, 2]
    # One value in each third of either axis.
    assert sorted((found["asked.baseline_mm"] - 96) // (4 / 3)) == [0, 1, 2]
    assert sorted((found["asked.envelope.height_mm"] - 136) // (4 / 3)) == [0, 1, 2]
    assert (found["status"] == "feasible").all()


@pytest.mark.parametrize(
    ("words", "asked"),
    [(("--workers", 3), (None, 3)), (("--scheduler", "tcp://head:8786"), ("tcp://head:8786", None))],
)
def test_a_cluster_gets_what_is_asked_and_does_the_work(words, asked, tiny, monkeypatch):
    seen = []

    @contextmanager
    def cluster_workers(scheduler, workers):
        seen.append((scheduler, workers))
        with local_workers(1) as crew:
            yield crew

    monkeypatch.setattr(cluster, "cluster_workers", cluster_workers)
    result = invoke("sweep", tiny, *words, "--no-pdf", "--quiet", "--out", "clustered")
    assert result.exit_code == 0, result.output
    assert seen == [asked]
    assert len(read_sweep_results(Path("clustered"))) == 2


@pytest.mark.parametrize(
    "words",
    [("--jobs", 1, "--workers", 1), ("--jobs", 1, "--scheduler", "tcp://h:1"), ("--workers", 1, "--scheduler", "h:1")],
)
def test_one_place_to_work_at_a_time(words, tiny):
    assert "give only one of --jobs, --workers and --scheduler" in refused("sweep", tiny, *words)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere", "ftp://a:1", "tcp://127.0.0.1:99999", ""])
def test_an_address_without_a_scheduler(address, tiny, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    assert f"--scheduler {address}: no response from this address" in refused("sweep", tiny, "--scheduler", address)


@pytest.mark.parametrize("words", [("--jobs", 0), ("--workers", 0), ("--jobs", "two"), ("--frobnicate",)])
def test_options_that_make_no_sense(words, tiny):
    result = invoke("sweep", tiny, *words)
    assert result.exit_code == 2
    assert words[0] in result.stderr
    assert not isinstance(result.exception, BaseException) or isinstance(result.exception, SystemExit)


def test_files_that_cannot_be_used(tiny, tmp_path):
    assert "absent.toml: cannot be read" in refused("sweep", "absent.toml")
    (tmp_path / "tiny.toml").write_text(TINY.replace("base.toml", "gone.toml"))
    assert "gone.toml: cannot be read" in refused("sweep", tiny)
    (tmp_path / "tiny.toml").write_text(TINY.replace("[98, 100]", "[-5, 100]"))
    line = refused("sweep", tiny)
    assert "baseline_mm" in line
    assert "-5" in line
    assert not (tmp_path / "reports").exists()


def test_a_folder_that_cannot_be_written(tiny, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused("sweep", tiny, "--jobs", 1, "--out", "file/out")


def test_a_folder_with_another_sweep_or_a_broken_store(tiny, tmp_path):
    assert invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--quiet", "--out", "there").exit_code == 0
    (tmp_path / "tiny.toml").write_text(TINY.replace("98", "97"))
    assert "contains a sweep with a different plan of points;" in refused("sweep", tiny, "--jobs", 1, "--out", "there")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / FILE_NAME).write_text("this is no database, but long enough to look like a file" * 20)
    assert "is not a sweep store" in refused("sweep", tiny, "--jobs", 1, "--out", "broken")


def test_another_name_is_the_same_sweep_and_its_report_is_called_by_it(tiny, tmp_path):
    words = ("--jobs", 1, "--no-pdf", "--quiet", "--out", "there")
    assert invoke("sweep", tiny, *words).exit_code == 0
    with read_store(tmp_path / "there") as store:
        times = store.execute("SELECT seconds FROM tasks ORDER BY point").fetchall()
    base = tmp_path / "base.toml"
    (tmp_path / "elsewhere.toml").write_text(base.read_text().replace("Indoor robot:", "Another title:"))
    (tmp_path / "renamed.toml").write_text('title = "Other"\n' + TINY.replace("base.toml", "elsewhere.toml"))
    assert invoke("sweep", "renamed.toml", *words).exit_code == 0
    with read_store(tmp_path / "there") as store:
        assert store.execute("SELECT seconds FROM tasks ORDER BY point").fetchall() == times
        about = dict(store.execute("SELECT key, value FROM about"))
    assert json.loads(about["definition"])["title"] == "Other"
    base.write_text(base.read_text().replace("noise_px = 0.1 ", "noise_px = 0.2 "))
    assert "contains a sweep with a different requirement;" in refused("sweep", tiny, "--jobs", 1, "--out", "there")


def test_a_full_disk_is_one_line(tiny, monkeypatch):
    connect = sqlite3.connect

    def connect_to_small_disk(*arguments, **options):
        connection = connect(*arguments, **options)
        connection.execute("PRAGMA max_page_count = 2")
        return connection

    monkeypatch.setattr(sqlite3, "connect", connect_to_small_disk)
    assert "disk is full" in refused("sweep", tiny, "--jobs", 1, "--out", "small", code=1)


def test_nothing_feasible_is_a_table_without_a_report(tiny, tmp_path):
    (tmp_path / "tiny.toml").write_text(TINY + '[[axis]]\nkey = "envelope.height_mm"\nvalues = [110]\n')
    result = invoke("sweep", tiny, "--jobs", 1)
    assert result.exit_code == 0
    assert "2 configuration problems: 2 infeasible" in result.stdout
    assert "No design is feasible, so there is no report." in result.stdout
    assert result.stdout.splitlines()[-1] == "reports/tiny/results.csv"


def test_comparing_prints_what_was_asked_who_won_and_the_scores(tiny, tmp_path):
    assert invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--quiet", "--out", "a").exit_code == 0
    base = tmp_path / "base.toml"
    base.write_text(base.read_text().replace("noise_px = 0.1 ", "noise_px = 0.2 "))
    assert invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--quiet", "--out", "b").exit_code == 0
    result = invoke("compare", "a", "b")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert next(line for line in lines if line.startswith("noise_px")).split() == ["noise_px", "0.1", "0.2"]
    assert "Winners: 0 of 2 have a different configuration in B." in lines
    first, second = (read_sweep_results(tmp_path / folder)["depth_error_rms"] for folder in "ab")
    median = 100 * (second - first).median()
    changes = next(line for line in lines if line.startswith("depth error"))
    assert changes.split()[2:5] == [f"{median:+.4g}", "percentage", "points"]


def test_comparing_refuses_in_a_line(tiny, tmp_path):
    assert invoke("sweep", tiny, "--jobs", 1, "--no-pdf", "--quiet", "--out", "a").exit_code == 0
    assert "absent: is not a folder; give the folder of a study or of a sweep" in refused("compare", "a", "absent")
    assert "tiny.toml: is not a folder" in refused("compare", "tiny.toml", "a")
    (tmp_path / "other.toml").write_text(
        TINY.replace("baseline_mm", "envelope.height_mm").replace("98, 100", "138, 140")
    )
    assert invoke("sweep", "other.toml", "--jobs", 1, "--no-pdf", "--quiet", "--out", "b").exit_code == 0
    kinds = "a is a sweep over baseline_mm, b is a sweep over envelope.height_mm"
    assert f"cannot be compared: {kinds}" in refused("compare", "a", "b")
    assert invoke("compare", "a").exit_code == 2
