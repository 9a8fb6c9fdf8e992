"""The commands: what they print, what they write, with which exit code they end."""

import csv
import io
import json
import re
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from recorded_calls import Calls

from designer.cli import cli
from designer.configurations import enumerate_configurations
from designer.design import read_design, write_design
from designer.requirement import read_requirement
from designer.study.study import LensRow
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.plan import check_points, plan_points
from support import DATA

NAMES = [configuration.name for configuration in enumerate_configurations()]


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


def refused(*words: object) -> str:
    """The one line with which a command refuses, with exit code 2 and nothing on stdout."""
    result = run(*words)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    (line,) = result.stderr.splitlines()
    return line


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A valid requirement file, in a folder of its own that is the current one."""
    monkeypatch.chdir(tmp_path)
    assert run("init", "my.toml").exit_code == 0
    return Path("my.toml")


def test_the_44_as_table_json_and_csv() -> None:
    assert [line.split()[0] for line in run("configurations").stdout.splitlines()[2:]] == NAMES
    rows = json.loads(run("configurations", "--json").stdout)
    assert [row["configuration"] for row in rows] == NAMES
    table = list(csv.DictReader(io.StringIO(run("configurations", "--csv").stdout)))
    assert [row["configuration"] for row in table] == NAMES
    prototype = next(row for row in table if row["configuration"] == "folded-HyPl-Hy-upper_outer")
    assert (prototype["primary"], prototype["secondary"], prototype["direct"]) == (
        "hyperboloid",
        "plane",
        "hyperboloid",
    )


def test_json_or_csv_but_not_both() -> None:
    assert refused("configurations", "--json", "--csv") == "designer: --json and --csv: give only one of them"


@pytest.mark.parametrize("folder", ["", "."])
def test_init_needs_the_name_of_a_file(folder: str, asked: Path) -> None:
    assert refused("init", folder) == "designer: FILE must name a file to write, such as my.toml; . is a folder"


def test_init_prints_a_command_that_a_shell_understands(asked: Path) -> None:
    assert run("init", "a b.toml").stdout == "a b.toml written; next: designer study 'a b.toml'\n"


def test_init_writes_a_valid_requirement_and_overwrites_nothing(asked: Path) -> None:
    assert read_requirement(asked).name == "my"
    asked.write_text("mine", encoding="utf-8")
    assert "my.toml: already exists" in refused("init", asked)
    assert asked.read_text(encoding="utf-8") == "mine"
    assert "cannot be written" in refused("init", "absent/my.toml")


def test_a_study_goes_to_reports_and_ends_with_the_ranking(asked: Path, calls: Calls) -> None:
    result = run("study", asked)
    assert result.exit_code == 0
    assert calls.folders == calls.pages == calls.reports == [Path("reports/my")]
    assert calls.only == [("*",)]
    assert calls.jobs[0] >= 1
    assert calls.requirements == [read_requirement(asked)]
    table = result.stdout.splitlines()
    assert table[2].split() == ["1", "folded-HyPl-Hy-upper_outer", "1.230", "%", "1.004", "100.0", "118.2", "61.5", "-"]
    assert table[3] == "3 configurations: 1 feasible, 1 infeasible, 1 impossible"
    assert table[4:] == ["reports/my/study.pdf", "reports/my/study.html"]
    assert result.stderr.splitlines() == [
        "[1/2] direct-HyHy-upper_outer: infeasible (0 feasible so far, 2 s left)",
        "[2/2] folded-HyPl-Hy-upper_outer: feasible (1 feasible so far, 0 s left)",
        "Checking the best design end to end, 15 to 60 s per design ...",
        "[1/1] folded-HyPl-Hy-upper_outer: passes the end-to-end check (12 s)",
        "Typesetting study.pdf ...",
        "study.pdf: the fonts lack characters of title",
    ]


def test_depth_errors_beyond_first_order_carry_a_star(
    asked: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch
) -> None:
    head, first, *others = calls.designs.splitlines()
    second = first.replace("upper_outer", "upper_inner")
    rows = [f"{head},first_order_valid", f"{first},True", f"{second},False", *(f"{row}," for row in others)]
    calls.designs = "\n".join(rows) + "\n"
    table = run("study", asked).stdout.splitlines()
    assert table[2].split("%")[1].split()[0] == "1.004"
    assert "1.230 % *" in table[3]
    assert table[2].index("1.230") == table[3].index("1.230")
    assert table[4].startswith("* first order")


def test_a_ranking_of_several_says_how_it_was_made(asked: Path, calls: Calls) -> None:
    first = next(line for line in calls.designs.splitlines() if "feasible" in line)
    calls.designs += first.replace("folded-HyPl-Hy", "folded-HyHy-Hy").replace("0.0123", "0.0122") + "\n"
    lines = run("study", asked).stdout.splitlines()
    assert lines[4] == "ranks 1 and 2 are tied within 1 % in depth error; height decides their order"
    assert lines[5] == (
        "ranking: designs whose lowest depth error is within 1 % of the best are ranked by height, the others by depth "
        "error; values are shown after trading up to 1 % of depth error for height"
    )


def test_designs_that_are_not_tied_are_not_called_so(asked: Path, calls: Calls) -> None:
    first = next(line for line in calls.designs.splitlines() if "feasible" in line)
    calls.designs += first.replace("folded-HyPl-Hy", "folded-HyHy-Hy").replace("0.0123", "0.0125") + "\n"
    lines = run("study", asked).stdout.splitlines()
    assert lines[4].startswith("ranking: ")


def test_a_study_of_several_lenses_says_what_each_reaches(asked: Path, calls: Calls) -> None:
    winner, other = "folded-HyPl-Hy-upper_outer", "folded-HyPl-Hy-upper_inner"
    calls.lenses = (
        LensRow(winner, 1, "8 mm", False, "feasible", 0.0157, 121.3, 60.0, 5.6, None, 4.2, 0.5),
        LensRow(winner, 2, "12 mm", True, "feasible", 0.0123, 118.2, 61.5, 5.6, 145.3, 5.54, 0.5),
        LensRow(winner, 3, "25 mm", False, "infeasible", reason="blur of the upper view by 33.7 px"),
        LensRow(other, 1, "8 mm", False, "impossible", reason="no room"),
    )
    lines = run("study", asked).stdout.splitlines()
    assert lines[4] == f"lenses for the best design ({winner}), each as if it were the only one:"
    assert lines[7].split() == ["8", "mm", "feasible", "1.570", "%", "121.3", "5.60", "infinity", "4.2"]
    assert lines[8].split() == ["12", "mm", "chosen", "1.230", "%", "118.2", "5.60", "145", "5.5"]
    assert lines[9].split() == ["25", "mm", "infeasible", "-", "-", "-", "-", "-"]
    assert lines[10] == "25 mm: blur of the upper view by 33.7 px"
    assert lines[11] == "reports/my/study.pdf"


def test_fabrication_notes_on_the_best_design_are_pointed_at(asked: Path, calls: Calls) -> None:
    calls.notes = ["a", "b"]
    told = "before ordering mirrors for the best design, read the"
    assert f"{told} 2 fabrication notes (with the winner in study.pdf)" in run("study", asked).stdout.splitlines()
    calls.notes = ["a"]
    path = Path("reports/my/designs/folded-HyPl-Hy-upper_outer.json")
    assert (
        f"{told} fabrication note (score.fabrication_notes in {path})"
        in run("study", asked, "--no-pdf").stdout.splitlines()
    )


def test_a_quiet_study_without_pdf_elsewhere(asked: Path, calls: Calls) -> None:
    result = run("study", "--quiet", "--no-pdf", "--jobs", 3, "--out", "else/where", asked)
    assert (result.exit_code, result.output) == (0, "")
    assert (calls.folders, calls.jobs, calls.reports) == ([Path("else/where")], [3], [])
    assert calls.pages == [Path("else/where")]


def test_as_many_designs_are_checked_as_asked(asked: Path, calls: Calls) -> None:
    for words in ((), ("--checks", "1"), ("--checks", "0")):
        assert run("study", *words, asked).exit_code == 0
    best = "folded-HyPl-Hy-upper_outer"
    assert calls.checks == [[best], [best], []]
    assert run("study", "--checks", "-1", asked).exit_code == 2


@pytest.mark.parametrize(
    "words",
    [
        ("--only", NAMES[0], NAMES[9], "my.toml"),
        ("--only", NAMES[9], "--only", NAMES[0], "my.toml"),
        ("my.toml", "--only", NAMES[0], NAMES[9]),
        ("my.toml", "--only", NAMES[0], NAMES[9], "--quiet"),
    ],
)
def test_some_configurations_only(words: tuple[str, ...], asked: Path, calls: Calls) -> None:
    assert run("study", *words).exit_code == 0
    assert calls.only == [(NAMES[0], NAMES[9])]
    assert set(calls.requirements[0].solve.configurations) == {NAMES[0], NAMES[9]}


@pytest.mark.parametrize("name", ["my", "my.txt", "folded", "below/my", "direct-HyHy-upper_outr"])
def test_only_leaves_a_requirement_file_of_any_name(name: str, asked: Path, calls: Calls) -> None:
    Path("below").mkdir()
    asked.rename(name)
    assert run("study", "--only", NAMES[0], "direct-*-upper_inner", name).exit_code == 0
    assert calls.only == [(NAMES[0], *NAMES[1:8:2])]


def test_only_takes_patterns(asked: Path, calls: Calls) -> None:
    assert run("study", asked, "--only", "direct-*-upper_inner").exit_code == 0
    assert calls.only == [tuple(NAMES[1:8:2])]


def test_only_names_what_does_not_exist(asked: Path, calls: Calls) -> None:
    line = refused("study", asked, "--only", "folded-HyPl-Hy-upper_outr")
    assert line.startswith("designer: --only: 'folded-HyPl-Hy-upper_outr' matches none of the 44 configurations")
    assert line.endswith("did you mean folded-HyPl-Hy-upper_outer?")
    assert not Path("reports").exists()


def test_a_folder_that_cannot_be_written_is_found_out_before_the_work(asked: Path, calls: Calls) -> None:
    Path("taken").write_text("a file", encoding="utf-8")
    assert (
        refused("study", asked, "--out", "taken") == "designer: taken: is a file; --out needs a folder for the results"
    )
    assert "cannot be written" in refused("study", asked, "--out", "taken/below")
    assert "cannot be written" in refused("study", asked, "--out", "/proc/nowhere")
    assert not calls.requirements


def test_a_folder_that_is_no_study_is_refused_before_the_work(asked: Path, calls: Calls) -> None:
    Path("project/designs").mkdir(parents=True)
    Path("project/designs/package.json").write_text("{}", encoding="utf-8")
    line = refused("study", asked, "--out", "project")
    assert line == "designer: project: not the folder of a study; choose an empty or a new folder with --out"
    assert not calls.requirements
    assert [path.name for path in Path("project").rglob("*")] == ["designs", "package.json"]


def test_what_a_study_keeps_is_named_in_one_line(asked: Path, calls: Calls) -> None:
    assert run("study", asked).exit_code == 0
    Path("reports/my/notes.txt").write_text("mine", encoding="utf-8")
    assert run("study", asked).stderr.startswith("reports/my: not written by the study, and kept: notes.txt\n[1/2]")
    Path("reports/my/designs.csv").write_text("mine", encoding="utf-8")
    assert refused("study", asked) == (
        "designer: reports/my: designs.csv: not written by the study, or changed since; move it away, or use "
        "another folder"
    )


def test_a_full_disk_is_one_line(asked: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(28, "No space left on device", "reports/my/designs.csv")

    monkeypatch.setattr(sys.modules["designer.study.run"], "run_study", full)
    result = run("study", asked)
    assert result.exit_code == 1
    assert result.stderr == "designer: [Errno 28] No space left on device: 'reports/my/designs.csv'\n"


def test_a_report_is_typeset_again(asked: Path, calls: Calls) -> None:
    Path("folder").mkdir()
    assert refused("report", "folder") == (
        "designer: folder: not the folder of a study: it contains neither designs.csv nor requirement.toml"
    )
    Path("folder/designs.csv").write_text(calls.designs, encoding="utf-8")
    assert run("report", "folder").stdout == "folder/study.pdf\nfolder/study.html\n"
    assert "absent: must be the folder of a study" in refused("report", "absent")


def test_nothing_feasible_ends_with_what_stood_in_the_way(asked: Path, calls: Calls) -> None:
    head, *_ = calls.designs.splitlines()
    row = "infeasible,x,,,,,,{},{},mm"
    lines = [
        f"{NAMES[0]},direct,upper_outer,{row.format('height of the mirror system', 7.25)}",
        f"{NAMES[1]},direct,upper_outer,{row.format('height of the mirror system', 3.5)}",
        f"{NAMES[2]},direct,upper_outer,{row.format('image circle', 1.0)}",
    ]
    calls.designs = "\n".join([f"{head},closest_constraint,closest_violation,closest_unit", *lines]) + "\n"
    assert run("study", asked).stdout.splitlines()[:2] == [
        "3 configurations: 3 infeasible",
        "most frequent limiting constraint (2 of 3): height of the mirror system; least violated by "
        f"{NAMES[1]}: 3.5 mm",
    ]
    calls.designs = f"{head}\n{NAMES[0]},direct,upper_outer,impossible,no mirror can,,,,,\n"
    Path("reports/my/designs.csv").unlink()
    assert "most frequent reason (1 of 1): no mirror can" in run("study", asked).stdout


def test_an_image_circle_beyond_the_sensor_is_noted_with_what_it_loses(asked: Path, calls: Calls) -> None:
    text = asked.read_text(encoding="utf-8")
    wider = re.sub(r"(?m)^width_px = .*", "width_px = 1600\nimage_circle_radius_px = 800", text)
    wider = re.sub(r"(?m)^height_px = .*", "height_px = 1200", wider)
    asked.write_text(wider, encoding="utf-8")
    assert run("study", asked).stderr.splitlines()[0] == (
        "note: camera.image_circle_radius_px = 800 is greater than half the shorter image side (600 px): at the rim of "
        "the image circle 46 % of all azimuths lie beyond the sensor"
    )


def test_the_time_of_checks_follows_the_number_of_pixels(asked: Path, calls: Calls) -> None:
    text = asked.read_text(encoding="utf-8")
    for width, height, told in ((1600, 1200, "15 to 60 s"), (6400, 4800, "4 min to 16 min"), (160, 120, "about 1 s")):
        camera = re.sub(r"(?m)^width_px = .*", f"width_px = {width}", text)
        asked.write_text(re.sub(r"(?m)^height_px = .*", f"height_px = {height}", camera), encoding="utf-8")
        assert f"Checking the best design end to end, {told} per design ..." in run("study", asked).stderr


def test_a_table_at_the_wrong_place_is_pointed_at(asked: Path) -> None:
    asked.write_text(asked.read_text(encoding="utf-8").replace("[camera.lens]", "[lens]"), encoding="utf-8")
    assert "lens: no such key; did you mean camera.lens?" in refused("study", asked)


def test_every_error_of_a_requirement_is_named(asked: Path) -> None:
    text = re.sub(r"(?m)^height_mm = .*", 'height_mm = "a"', asked.read_text(encoding="utf-8"))
    asked.write_text(re.sub(r"(?m)^baseline_mm = .*", "baseline_mm = -1", text), encoding="utf-8")
    line = refused("study", asked)
    assert "baseline_mm = -1: must be" in line
    assert "envelope.height_mm = 'a': must be" in line
    assert "more)" not in line


def test_init_writes_a_valid_sweep_over_a_requirement(asked: Path) -> None:
    Path("sweeps").mkdir()
    path = Path("sweeps/heights.toml")
    assert run("init", path, "--sweep", asked).stdout == f"{path} written; next: designer sweep {path}\n"
    definition, base = read_sweep(path)
    assert definition.requirement == "../my.toml"
    points = plan_points(definition)
    assert len(points) == 9
    check_points(definition, base, points)
    assert "absent.toml: cannot be read" in refused("init", "other.toml", "--sweep", "absent.toml")
    assert not Path("other.toml").exists()


def test_the_tracers_verdict_decides_the_exit_code(tmp_path: Path) -> None:
    good = DATA / "folded_hypl_hy.json"
    result = run("trace", good)
    assert result.exit_code == 0
    assert "passed" in result.stdout.splitlines()[0]
    design = read_design(good)
    shifted = tuple(
        mirror.model_copy(update={"vertex_mm": mirror.vertex_mm + 0.01}) if mirror.name == "primary" else mirror
        for mirror in design.mirrors
    )
    spoiled = tmp_path / "spoiled.json"
    write_design(design.model_copy(update={"mirrors": shifted}), spoiled)
    result = run("trace", spoiled)
    assert result.exit_code == 1
    assert "NOT passed" in result.stdout


def test_a_design_is_scored_and_traced() -> None:
    result = run("evaluate", DATA / "jaramillo_2016.json")
    assert result.exit_code == 0
    assert "depth_error_rms: " in result.stdout
    assert "baseline 131.607 mm" in result.stdout
    assert "before ordering" not in result.stdout
    content = json.loads(run("evaluate", "--json", DATA / "jaramillo_2016.json").stdout, parse_constant=pytest.fail)
    assert content["evaluation"]["fabrication_notes"] == []
    assert content["evaluation"]["limit_ratio"] >= 1
    assert content["trace"]["passed"] is False
    assert content["focus"]["focus_distance_mm"] is None
    assert content["focus"]["best_focus_distance_mm"] == pytest.approx(190.3, abs=0.1)
    assert f"the blur is at most {content['focus']['largest_blur_px']:.1f} px" in result.stdout


@pytest.mark.parametrize("command", ["trace", "evaluate"])
@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not JSON"),
        (b"{}", "is required but missing"),
        (b"\xff\xfe", "not UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"schema": 2}', "schema"),
    ],
)
def test_a_file_that_is_no_design(command: str, content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "design.json"
    path.write_bytes(content)
    line = refused(command, path)
    assert "design.json" in line
    assert message in line


def test_the_help_names_every_scene_and_texture() -> None:
    from designer.imaging.render.scenes.library import SCENE_NAMES
    from designer.imaging.render.textures import TEXTURE_KINDS

    shown = " ".join(run("render", "--help").stdout.split())
    assert all(name in shown for name in (*SCENE_NAMES, *TEXTURE_KINDS))
