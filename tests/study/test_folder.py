"""A study's folder holds what the contract says, the same for any number of processes."""

from __future__ import annotations

import csv
import json
import math
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from designer.configurations import enumerate_configurations
from designer.design import read_design
from designer.evaluate.depth import Volume
from designer.evaluate.fabrication import overall_diameter_mm, overall_height_mm
from designer.evaluate.limit import ImageBounds, arrangement_of, depth_error_limit
from designer.evaluate.score import evaluate_design
from designer.requirement import read_requirement, set_key
from designer.study.folder import read_study, write_report, write_study
from designer.study.manifest import settle
from designer.study.progress import Progress
from designer.study.record import least_limit_of
from designer.study.row import frame_of
from designer.study.run import run_study
from designer.study.study import Study
from designer.study.task import PARETO_POINTS
from designer.verify.judge import judge
from support.shipped_problems import shipped_requirement, with_thin_light

# Feasible, infeasible and impossible, direct and folded.
ONLY = (
    "direct-HyHy-upper_outer",
    "direct-HyHy-upper_inner",
    "direct-ElEl-upper_outer",
    "folded-HyPl-Hy-upper_outer",
    "folded-PaPa-Hy-upper_inner",
    "folded-PlHy-Hy-upper_outer",
)
FIRST_COLUMNS = [
    "configuration",
    "family",
    "topology",
    "status",
    "reason",
    "depth_error_rms",
    "limit_ratio",
    "baseline_mm",
    "height_mm",
    "diameter_mm",
]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path, list[Progress]]:
    folder = tmp_path_factory.mktemp("study")
    requirement = set_key(with_thin_light(shipped_requirement("indoor_robot")), "solve.starts", 4)
    seen: list[Progress] = []
    return run_study(requirement, folder, jobs=1, only=ONLY, progress=seen.append), folder, seen


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "designs.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_table_begins_as_the_contract_says(study):
    _, folder, _ = study
    rows = rows_of(folder)
    assert list(rows[0])[:10] == FIRST_COLUMNS
    assert {row["configuration"] for row in rows} == set(ONLY)
    assert {row["status"] for row in rows} == {"feasible", "infeasible", "impossible"}
    for row in rows:
        assert row["configuration"].startswith(row["family"])
        assert row["configuration"].endswith(row["topology"])
        numbers = [row[name] for name in FIRST_COLUMNS[5:]]
        if row["status"] == "feasible":
            assert row["reason"] == ""
            assert all(math.isfinite(float(number)) for number in numbers)
        else:
            assert row["reason"]
            assert numbers == [""] * 5
    assert [row["rank"] for row in rows if row["status"] == "feasible"] == ["1", "2", "3"]
    nearest = next(row for row in rows if row["status"] == "infeasible")
    assert nearest["closest_constraint"] in nearest["reason"]
    assert float(nearest["closest_violation"]) > 0.0


def test_a_file_for_each_feasible_design_and_no_other(study):
    _, folder, _ = study
    feasible = [row for row in rows_of(folder) if row["status"] == "feasible"]
    files = sorted(path.name for path in (folder / "designs").iterdir())
    assert files == sorted(f"{row['configuration']}.json" for row in feasible)
    for row in feasible:
        path = folder / "designs" / f"{row['configuration']}.json"
        content = json.loads(path.read_text(encoding="utf-8"))
        design = read_design(path)
        assert content["schema"] == 1
        assert design.configuration == row["configuration"]
        for name in ("baseline_mm", "height_mm", "diameter_mm"):
            assert content[name] == pytest.approx(float(row[name]), rel=1e-12)
        assert content["score"]["depth_error_rms"] == pytest.approx(float(row["depth_error_rms"]), rel=1e-12)
        assert content["score"]["limit_ratio"] == pytest.approx(float(row["limit_ratio"]), rel=1e-12)


def test_a_design_file_has_every_key_of_the_schema(study):
    _, folder, _ = study
    content = json.loads((folder / "designs" / "folded-HyPl-Hy-upper_outer.json").read_text(encoding="utf-8"))
    assert set(content) >= {
        *("schema", "configuration", "variant", "camera", "mirrors", "views", "baseline_mm", "height_mm"),
        *("diameter_mm", "working_volume", "noise_px", "score"),
    }
    assert set(content["camera"]) >= {
        *("focal_length_mm", "pixel_pitch_mm", "width_px", "height_px", "f_number", "lens_radius_mm"),
        *("lens_front_mm", "lens_length_mm", "body_radius_mm"),
    }
    assert [mirror["name"] for mirror in content["mirrors"]] == ["primary", "secondary", "direct"]
    for mirror in content["mirrors"]:
        assert set(mirror) >= {
            *("name", "kind", "vertex_mm", "radius_mm", "conic", "inner_radius_mm", "outer_radius_mm"),
            *("thickness_mm", "faces"),
        }
    assert content["views"]["lower"]["path"] == ["secondary", "primary"]
    assert content["views"]["upper"]["path"] == ["direct"]
    assert (content["views"]["upper"]["zone"], content["views"]["lower"]["zone"]) == ("outer", "inner")
    for view in content["views"].values():
        assert set(view) >= {"path", "viewpoint_mm", "gain", "sense", "elevation_deg", "zone"}
    apart = content["views"]["upper"]["viewpoint_mm"] - content["views"]["lower"]["viewpoint_mm"]
    assert apart == pytest.approx(content["baseline_mm"], abs=1e-9)
    assert content["working_volume"] == {"elevation_deg": [-16.0, 16.0], "distance_mm": [1000.0, 5000.0]}


def test_a_written_design_measures_what_it_says(study):
    """Sizes, scores and verdict from the file alone."""
    _, folder, _ = study
    for path in (folder / "designs").iterdir():
        design = read_design(path)
        assert judge(design).passed
        assert overall_height_mm(design) == pytest.approx(design.height_mm, abs=1e-6)
        assert overall_diameter_mm(design) == pytest.approx(design.diameter_mm, abs=1e-6)
        score = evaluate_design(design).depth
        assert score.depth_error_rms == pytest.approx(design.score["depth_error_rms"], rel=1e-12)
        assert score.limit_ratio == pytest.approx(design.score["limit_ratio"], rel=1e-12)
        assert score.limit_ratio >= 1.0 - 1e-9


def test_the_folder_says_what_was_asked_and_where_it_comes_from(study):
    outcome, folder, _ = study
    assert read_requirement(folder / "requirement.toml") == outcome.requirement
    provenance = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))
    assert provenance["seed"] == outcome.requirement.solve.seed
    assert provenance["starts"] == outcome.requirement.solve.starts == 4
    assert {"python", "numpy", "casadi"} <= set(provenance["versions"])
    assert provenance["elapsed_seconds"] > 0.0
    assert "finished" in provenance
    assert set(provenance["solvers"]) == {"sqpmethod", "ipopt"}


@pytest.mark.parametrize("baseline", [100, [80, 120]])
def test_the_least_limit_is_that_of_the_best_baseline_and_focal_length_allowed(baseline):
    """Against the limit itself on a fine grid; with nothing free, it is the limit."""
    requirement = set_key(shipped_requirement("indoor_robot"), "baseline_mm", baseline)
    if isinstance(baseline, list):
        requirement = set_key(requirement, "camera.lens.focal_length_mm", [10, 12])
    lens = requirement.camera.lenses[0]
    configuration = next(each for each in requirement.configurations if each.name == "folded-HyPl-Hy-upper_outer")
    found = least_limit_of(requirement, configuration)
    baselines, distances = np.meshgrid(
        np.linspace(*requirement.baseline_range_mm, 41), np.linspace(*lens.principal_distances_mm, 41)
    )
    pitch = requirement.camera.pixel_pitch_mm
    limits = depth_error_limit(
        arrangement_of("folded", "upper_outer"),
        Volume((math.radians(-16), math.radians(16)), (1000.0, 5000.0)),
        baselines,
        distances,
        ImageBounds(requirement.camera.image_radius_mm, requirement.manufacture.zone_gap_px * pitch),
        requirement.noise_px * pitch,
    )
    assert found.depth_error_rms == pytest.approx(limits.min(), rel=1e-9)
    where = np.unravel_index(limits.argmin(), limits.shape)
    assert found.baseline_mm == pytest.approx(baselines[where])
    assert found.principal_distance_mm == pytest.approx(distances[where])


def test_a_design_tells_the_least_limit(study):
    """In its file and in the table; here nothing is free, so it is the limit at the design's own baseline."""
    _, folder, _ = study
    for row in rows_of(folder):
        if row["status"] == "feasible":
            content = json.loads((folder / "designs" / f"{row['configuration']}.json").read_text(encoding="utf-8"))
            least = content["score"]["least_limit"]
            assert least["depth_error_rms"] == pytest.approx(content["score"]["depth_error_limit"], rel=1e-9)
            assert least["baseline_mm"] == content["baseline_mm"]
            assert float(row["least_limit_depth_error_rms"]) == least["depth_error_rms"]


def fronts_of(folder: Path) -> dict[tuple[str, str], list[dict[str, str]]]:
    """Points of each configuration and swept size, tightest first."""
    fronts: dict[tuple[str, str], list[dict[str, str]]] = {}
    with (folder / "fronts.csv").open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            fronts.setdefault((row["configuration"], row["swept"]), []).append(row)
    return {key: sorted(rows, key=lambda row: float(row["limit_mm"])) for key, rows in fronts.items()}


def assert_fronts_fall(folder: Path) -> None:
    fronts = fronts_of(folder)
    assert {swept for _, swept in fronts} == {"height_mm", "diameter_mm"}
    for (_, swept), points in fronts.items():
        assert len(points) == PARETO_POINTS
        assert len({row["limit_mm"] for row in points}) == PARETO_POINTS
        for row in points:
            assert row["status"] == "feasible"
            assert float(row[swept]) <= float(row["limit_mm"]) * (1.0 + 1e-5)
        errors = [float(row["depth_error_rms"]) for row in points]
        assert all(loose <= tight for tight, loose in pairwise(errors))
        # How good the tight end is, is tested where fronts are traced (tests/optimise/test_pareto_fronts.py).
        assert errors[-1] < 0.99 * errors[0]


def test_fronts_fall_as_the_envelope_is_loosened(study):
    _, folder, _ = study
    assert_fronts_fall(folder)


def test_fronts_are_of_depth_error_whatever_is_minimised_first(study, tmp_path):
    """From the lowest design up to about the least depth error: one descent comes near what a whole search finds."""
    outcome, folder, _ = study
    name = "folded-HyPl-Hy-upper_outer"
    lowest = set_key(set_key(outcome.requirement, "objective.then", "diameter"), "objective.minimise", "height")
    found = run_study(lowest, tmp_path, only=(name,))
    assert_fronts_fall(tmp_path)
    heights, asked = fronts_of(tmp_path)[name, "height_mm"], fronts_of(folder)[name, "height_mm"]
    (row,) = found.rows
    assert float(heights[0]["height_mm"]) == pytest.approx(row.number("first_stage_height_mm"), rel=1e-5)
    assert float(heights[-1]["depth_error_rms"]) == pytest.approx(float(asked[-1]["depth_error_rms"]), rel=0.05)


def test_progress_tells_of_every_configuration(study):
    _, _, seen = study
    assert [step.done for step in seen] == list(range(1, len(ONLY) + 1))
    assert {step.configuration for step in seen} == set(ONLY)
    assert seen[-1].feasible == 3
    assert seen[-1].remaining_seconds == 0.0
    assert all(step.total == len(ONLY) for step in seen)


def test_stale_designs_are_removed(study, tmp_path):
    outcome, _, _ = study
    designs = tmp_path / "designs"
    designs.mkdir()
    (designs / "folded-ElEl-El-upper_outer.json").write_text("{}", encoding="utf-8")
    settle(tmp_path, ["designs/folded-ElEl-El-upper_outer.json"])
    run_study(outcome.requirement, tmp_path, only=("direct-ElEl-upper_outer",))
    assert not list(tmp_path.glob("designs/*"))
    assert [row["status"] for row in rows_of(tmp_path)] == ["impossible"]


def test_figures_that_a_report_listed_go_with_it_and_no_others(study, tmp_path):
    outcome, _, _ = study
    write_report(tmp_path, b"%PDF-", {"new-kind.svg": b"<svg/>", "trade-height.svg": b"<svg/>"})
    foreign = tmp_path / "figures" / "trade-mine.svg"
    foreign.write_text("mine", encoding="utf-8")
    write_study(outcome, tmp_path)
    assert [path.name for path in (tmp_path / "figures").iterdir()] == [foreign.name]


def test_what_was_written_is_read_back_as_it_was_found(study):
    outcome, folder, _ = study
    back = read_study(folder)
    assert back.rows == outcome.rows
    assert back.pareto == outcome.pareto
    assert back.provenance == outcome.provenance
    assert list(back.designs) == list(outcome.designs)
    assert [design.model_dump(mode="json") for design in back.designs.values()] == [
        design.model_dump(mode="json") for design in outcome.designs.values()
    ]


def test_a_folder_of_version_0_1_is_understood(study, tmp_path):
    """Its columns of the principal distance had other names."""
    outcome, folder, _ = study
    shutil.copytree(folder, tmp_path / "old")
    table = tmp_path / "old" / "designs.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("principal_distance_mm", "focal_length_mm"))
    assert "principal" not in table.read_text(encoding="utf-8").splitlines()[0]
    pd.testing.assert_frame_equal(frame_of(read_study(tmp_path / "old").rows), frame_of(outcome.rows))


def test_a_folder_that_does_not_tell_of_the_scale_did_not_count_it(study, tmp_path):
    _, folder, _ = study
    older = tmp_path / "older"
    shutil.copytree(folder, older)
    text = (older / "requirement.toml").read_text(encoding="utf-8")
    assert "scale_uncertainty_percent = 0.0\n" in text
    (older / "requirement.toml").write_text(text.replace("scale_uncertainty_percent = 0.0\n", ""), encoding="utf-8")
    assert read_study(older).requirement.scale_uncertainty_percent == 0.0
    assert read_requirement(older / "requirement.toml").scale_uncertainty_percent == 0.02


@pytest.mark.slow
def test_two_processes_give_the_same_files_as_one(study, tmp_path):
    outcome, folder, _ = study
    run_study(outcome.requirement, tmp_path, jobs=2, only=ONLY)
    alone, together = rows_of(folder), rows_of(tmp_path)
    for row in (*alone, *together):
        del row["seconds"]
    assert together == alone
    for name in (
        "requirement.toml",
        "fronts.csv",
        *(f"designs/{path.name}" for path in (folder / "designs").iterdir()),
    ):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_without_a_choice_all_44_are_listed(tmp_path):
    """Under a hopeless envelope nothing takes long, and every configuration still has its row and its reason."""
    requirement = shipped_requirement("indoor_robot")
    for key, value in (("manufacture.zone_gap_px", 590), ("solve.starts", 1)):
        requirement = set_key(requirement, key, value)
    run_study(requirement, tmp_path)
    rows = rows_of(tmp_path)
    assert {row["configuration"] for row in rows} == {item.name for item in enumerate_configurations()}
    assert len(rows) == 44
    assert all(row["status"] == "impossible" and row["reason"] for row in rows)
