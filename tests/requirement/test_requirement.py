"""What a requirement means: defaults that follow from one another, round trips, one changed key."""

import math
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.configurations import enumerate_configurations
from designer.files import InputError
from designer.requirement import Requirement, read_requirement, requirement_to_toml, set_key
from designer.requirement.reference import reference
from designer.requirement.template import template

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "configs").glob("*.toml"))
SAMPLE = tomllib.loads((Path(__file__).parent / "sample.toml").read_text(encoding="utf-8"))


def requirement(**changes: Any) -> Requirement:
    return Requirement.model_validate(SAMPLE | changes)


def least() -> dict[str, Any]:
    """Only the keys that have no default."""
    camera = {key: SAMPLE["camera"][key] for key in ("width_px", "height_px", "pixel_pitch_mm", "body_radius_mm")}
    lens = {key: value for key, value in SAMPLE["camera"]["lens"].items() if key != "focus_distance_mm"}
    return {
        "baseline_mm": 100,
        "working_volume": SAMPLE["working_volume"],
        "envelope": {"height_mm": 140, "diameter_mm": 80},
        "camera": camera | {"lens": lens},
    }


def test_defaults_follow_from_what_is_given() -> None:
    asked = Requirement.model_validate(least())
    assert asked.envelope.mirror_diameter_mm == 80
    assert asked.camera.image_circle_radius_px == 600
    assert asked.camera.image_radius_mm == pytest.approx(2.64)
    # Free from eight focal lengths to infinity: 12 u / (u - 12).
    assert asked.camera.lenses[0].focus_distance_mm == (96, math.inf)
    assert asked.camera.lenses[0].principal_distances_mm == (12, pytest.approx(1152 / 84))
    assert asked.baseline_range_mm == (100, 100)
    assert asked.configurations == enumerate_configurations()
    assert asked.objective.then == "height"


def test_the_second_goal_differs_from_the_first_by_default() -> None:
    asked = requirement(objective={"minimise": "height"})
    assert asked.objective.then == "depth_error"


def test_a_zoom_lens_has_a_range_of_principal_distances() -> None:
    asked = set_key(requirement(), "camera.lens.focal_length_mm", [8, 16])
    low, high = asked.camera.lenses[0].principal_distances_mm
    assert (low, high) == (pytest.approx(800 / 92), pytest.approx(1600 / 84))


def test_every_requirement_is_immutable() -> None:
    with pytest.raises(ValueError, match="frozen"):
        requirement().envelope.height_mm = 1


def test_patterns_choose_configurations_in_the_order_of_the_44() -> None:
    asked = set_key(requirement(fixed={}), "solve.configurations", ["folded-PaPa-*", "direct-*-upper_inner"])
    names = [configuration.name for configuration in asked.configurations]
    assert len(names) == 8
    assert names[0] == "direct-HyHy-upper_inner"
    assert names[-1] == "folded-PaPa-El-upper_inner"


def test_a_catalogue_holds_several_lenses() -> None:
    lens = SAMPLE["camera"]["lens"]
    asked = requirement(camera=SAMPLE["camera"] | {"lens": [lens, lens | {"focal_length_mm": [8, 16]}]})
    assert [each.focal_lengths_mm for each in asked.camera.lenses] == [(12, 12), (8, 16)]
    shorter = set_key(asked, "camera.lens.1.focal_length_mm", 9)
    assert [each.focal_lengths_mm for each in shorter.camera.lenses] == [(12, 12), (9, 9)]


def round_trip(asked: Requirement, folder: Path) -> Requirement:
    path = folder / "again.toml"
    path.write_text(requirement_to_toml(asked), encoding="utf-8")
    return read_requirement(path)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_requirements_are_valid_and_named_like_their_files(path: Path, tmp_path: Path) -> None:
    asked = read_requirement(path)
    assert asked.name == path.stem
    assert round_trip(asked, tmp_path) == asked


def test_the_shipped_requirements_ask_what_was_agreed() -> None:
    """Baseline, elevations, distances, height and diameter of the four; the first is the paper's prototype."""
    agreed = {
        "ceiling_watch": (60, (-50, -10), (1000, 5000), 250, 140),
        "indoor_robot": (100, (-16, 16), (1000, 5000), 140, 80),
        "pipe_inspection": (120, (-8, 8), (120, 250), 420, 200),
        "sky_watch": (60, (10, 50), (1000, 5000), 250, 140),
    }
    for path in SHIPPED:
        asked = read_requirement(path)
        volume, envelope = asked.working_volume, asked.envelope
        found = (
            asked.baseline_mm,
            volume.elevation_deg,
            volume.distance_mm,
            envelope.height_mm,
            envelope.diameter_mm,
        )
        assert found == agreed.pop(asked.name, found)
    assert not agreed
    robot = read_requirement(ROOT / "configs" / "indoor_robot.toml")
    camera = robot.camera
    assert robot.envelope.mirror_diameter_mm == 60
    assert (camera.width_px, camera.height_px, camera.pixel_pitch_mm) == (1600, 1200, 0.0044)
    assert camera.lenses[0].focal_length_mm == 12


positive = st.floats(10, 1e4)


@settings(max_examples=50, deadline=None)
@given(
    baseline=st.one_of(positive, st.tuples(st.floats(10, 100), st.floats(101, 1000))),
    height=st.floats(100, 1e5),
    conic=st.floats(-1e5, -1e-300),
    title=st.text(st.characters(codec="utf-8"), max_size=40),
    focus=st.one_of(st.just(math.inf), st.floats(20, 1e9)),
)
def test_writing_and_reading_gives_the_same_requirement(
    tmp_path_factory: pytest.TempPathFactory,
    baseline: float | tuple[float, float],
    height: float,
    conic: float,
    title: str,
    focus: float,
) -> None:
    asked = requirement(
        baseline_mm=baseline,
        title=title,
        envelope=SAMPLE["envelope"] | {"height_mm": height},
        fixed={"mirror": {"primary": {"conic": conic}}},
        camera=SAMPLE["camera"] | {"lens": SAMPLE["camera"]["lens"] | {"focus_distance_mm": focus}},
    )
    assert round_trip(asked, tmp_path_factory.getbasetemp()) == asked


def test_the_name_comes_from_the_file_unless_given(tmp_path: Path) -> None:
    content = (Path(__file__).parent / "sample.toml").read_text(encoding="utf-8")
    path = tmp_path / "my first (one).toml"
    path.write_text(content, encoding="utf-8")
    assert read_requirement(path).name == "my_first_one_"
    path.write_text(f'name = "given"\n{content}', encoding="utf-8")
    assert read_requirement(path).name == "given"


def test_setting_a_key_changes_that_key_and_what_follows_from_it() -> None:
    asked = Requirement.model_validate(least())
    wider = set_key(asked, "envelope.diameter_mm", 90)
    assert (wider.envelope.diameter_mm, wider.envelope.mirror_diameter_mm) == (90, 90)
    assert asked.envelope.diameter_mm == 80
    assert set_key(wider, "envelope.diameter_mm", 80) == asked
    fixed = set_key(asked, "fixed.mirror.primary.conic", -1.3)
    assert fixed.fixed.mirror["primary"].conic == -1.3
    assert set_key(asked, "manufacture.clearance_mm", 1).manufacture.clearance_mm == 1


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("envelope.hight_mm", 1, "did you mean height_mm"),
        ("envelope.height_mm", 0.1, "is that metres?"),
        ("camera.lens.radius_mm", 41, "at least the diameter of the lens"),
        ("envelope.height_mm.more", 1, "height_mm holds no further keys"),
        ("working_volume.elevation_deg.1.more", 3, "1 holds no further keys"),
        ("working_volume.elevation_deg.2", 3, "2 must be a number from 0 to 1"),
        ("envelop.height_mm", 1, "did you mean envelope"),
        ("nothing", 1, "no such key"),
        ("", 1, "no such key"),
        ("envelope", 5, "must be a table"),
    ],
)
def test_setting_a_key_checks_everything_again(key: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message.replace("?", r"\?")):
        set_key(requirement(), key, value)


def test_numbers_of_numpy_are_numbers() -> None:
    """A sweep is often a np.arange; what it sets is kept as Python's own, which TOML can hold."""
    asked = requirement()
    for key, values in (
        ("baseline_mm", np.arange(100, 200, 50)),
        ("envelope.height_mm", np.arange(140.0, 150.0, 5.0, dtype=np.float32)),
        ("camera.width_px", np.arange(1600, 1800, 100)),
    ):
        for value in values:
            assert set_key(asked, key, value) == set_key(asked, key, value.item())
            assert requirement_to_toml(set_key(asked, key, value)) == requirement_to_toml(
                set_key(asked, key, value.item())
            )
    assert set_key(asked, "baseline_mm", list(np.array([80, 120]))).baseline_range_mm == (80, 120)
    for key, value in (
        ("baseline_mm", np.float64(math.nan)),
        ("baseline_mm", np.float64(math.inf)),
        ("baseline_mm", np.bool_(True)),
        ("camera.width_px", np.float64(1600)),
    ):
        with pytest.raises(InputError, match="must be a"):
            set_key(asked, key, value)


def test_the_template_is_valid_and_asks_for_nothing_but_its_comments(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(template(), encoding="utf-8")
    asked = read_requirement(path)
    uncommented = tmp_path / "all.toml"
    uncommented.write_text(
        "\n".join(line.removeprefix("# ") if _is_key_or_table(line) else line for line in template().splitlines()),
        encoding="utf-8",
    )
    everything = read_requirement(uncommented)
    assert everything.manufacture == asked.manufacture
    assert everything.objective == asked.objective
    assert set(everything.fixed.mirror) == {"primary"}


def _is_key_or_table(line: str) -> bool:
    words = line.split()
    return line.startswith("# ") and (line.startswith("# [") or (len(words) > 2 and words[2] == "="))


def test_the_reference_page_is_current() -> None:
    page = (ROOT / "docs" / "requirement_reference.md").read_text(encoding="utf-8")
    assert page == reference(), "run `make reference`"


def test_the_reference_page_travels_with_the_package(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as content:
        (name,) = (name for name in content.namelist() if name.endswith("requirement_reference.md"))
        page = content.read(name).decode()
    assert name.endswith("data/share/doc/catadioptric-designer/requirement_reference.md")
    assert page == reference()
    assert "python -m designer.requirement.reference" in template()


def test_every_default_is_explained_and_every_key_described() -> None:
    rows = [line.split(" | ") for line in reference().splitlines() if line.startswith("| `")]
    assert len(rows) > 40
    for key, _, default, meaning in rows:
        assert len(meaning) > 12, key
        if default == "see meaning" or default[1].isdigit():
            assert "Default" in meaning or key == "| `seed`", key
