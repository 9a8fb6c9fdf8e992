"""Design files with absurd numbers and missing keys: a verdict or one line, never a traceback."""

from __future__ import annotations

import copy
import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from designer.cli import cli
from designer.design import Design, design_to_json
from designer.evaluate.fabrication import mirror_shape
from designer.export.formats import EXPORTS
from designer.extras import is_installed
from support import DATA
from support.housings import with_struts, with_tube
from support.imaging_designs import prototype

Key = str | int
DESIGNS: list[dict[str, Any]] = [
    json.loads((DATA / "folded_hypl_hy.json").read_text(encoding="utf-8")),
    json.loads((DATA / "jaramillo_2016.json").read_text(encoding="utf-8")),
    *json.loads((DATA / "studied_designs.json").read_text(encoding="utf-8")),
    *(json.loads(design_to_json(housed(prototype()))) for housed in (with_tube, with_struts)),
]
EXTREMES: list[object] = [
    *(
        sign * size
        for size in (0.0, 5e-324, 1e-300, 1e-160, 1e-15, 1e-9, 1.0, 1e9, 1e15, 1e160, 1e300)
        for sign in (1, -1)
    ),
    10**20,
    -(10**20),
    10**400,
    90,
    -90,
    89.9999999,
]
OTHERS: list[object] = [None, True, "12.0", "", [], {}, [1, 2, 3], [0, 0], float("nan"), float("inf"), "plane", "up"]


def places(part: object, above: tuple[Key, ...] = ()) -> Iterator[tuple[Key, ...]]:
    """Where the numbers, words, lists and tables of a record are."""
    if above:
        yield above
    if isinstance(part, dict):
        for key, value in part.items():
            if key != "score":
                yield from places(value, (*above, key))
    elif isinstance(part, list):
        for index, value in enumerate(part):
            yield from places(value, (*above, index))


def numbers(record: dict[str, Any]) -> list[tuple[Key, ...]]:
    return [place for place in places(record) if isinstance(at(record, place), int | float)]


def at(record: Any, place: tuple[Key, ...]) -> Any:
    for key in place:
        record = record[key]
    return record


@st.composite
def spoiled(draw: st.DrawFn) -> dict[str, Any]:
    """A valid design with some numbers extreme or slightly other, and perhaps a key deleted, renamed or misused."""
    design = draw(st.sampled_from(DESIGNS))
    record = copy.deepcopy(design)
    for place in draw(st.lists(st.sampled_from(numbers(record)), min_size=0, max_size=4)):
        factor = draw(st.sampled_from([-1.0, 0.5, 0.999, 1.001, 2.0, 1e3, 1e-3]))
        at(record, place[:-1])[place[-1]] = draw(
            st.sampled_from([*EXTREMES, *[factor * at(design, place)] * len(EXTREMES)])
        )
    for place in draw(st.lists(st.sampled_from(list(places(record))), min_size=0, max_size=1)):
        here, key = at(record, place[:-1]), place[-1]
        match draw(st.sampled_from(["delete", "rename", "misuse"])):
            case "delete":
                del here[key]
            case "rename" if isinstance(key, str):
                here[f"{key}x"] = here.pop(key)
            case _:
                here[key] = draw(st.sampled_from(OTHERS))
    return record


def ends_well(command: str, record: dict[str, Any], folder: Path, *options: str) -> Result:
    path = folder / "design.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = CliRunner().invoke(cli, [command, str(path), *options])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    assert result.exit_code in ({0, 1, 2} if command == "trace" else {0, 2})
    if result.exit_code == 2:
        *said, last = result.stderr.splitlines()
        assert result.stdout == ""
        assert last.startswith(f"designer: {path}: ")
        assert all(line.startswith("designer: warning: ") for line in said)
    return result


@pytest.mark.parametrize("command", ["trace", "evaluate"])
@given(record=spoiled())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_absurd_designs_get_a_verdict_or_one_line(command: str, record: dict[str, Any], tmp_path: Path):
    ends_well(command, record, tmp_path)


@pytest.mark.parametrize("command", ["trace", "evaluate"])
@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("mirrors", 1, "radius_mm"), -1e-300),
        (("mirrors", 2, "radius_mm"), 1e-160),
        (("mirrors", 1, "conic"), -1e300),
        (("mirrors", 0, "vertex_mm"), 0),
        (("camera", "focal_length_mm"), 1e-300),
        (("camera", "pixel_pitch_mm"), 1e300),
        (("views", "upper", "gain"), -0.0),
        (("views", "lower", "elevation_deg"), [-89.9999999, 89.9999999]),
        (("working_volume", "distance_mm"), [1e-300, 1e300]),
    ],
)
def test_one_absurd_number(command: str, place: tuple[Key, ...], value: object, tmp_path: Path):
    record = copy.deepcopy(DESIGNS[0])
    at(record, place[:-1])[place[-1]] = value
    result = ends_well(command, record, tmp_path)
    # A sensor as wide as the sky sees all that is asked; nonsense anywhere else is rejected.
    assert command == "evaluate" or result.exit_code == (0 if place[0] == "camera" else 1)


@pytest.mark.parametrize(
    "name", [name for name, entry in EXPORTS.items() if entry.extra is None or is_installed(entry.extra)]
)
@given(record=spoiled())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_absurd_designs_are_exported_or_refused_in_one_line(name: str, record: dict[str, Any], tmp_path: Path):
    out = tmp_path / f"{name}{EXPORTS[name].suffix if EXPORTS[name].one_file_for == 'design' else ''}"
    ends_well("export", record, tmp_path, "--to", name, "-o", str(out))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        # Each squared or inverted leaves the range of a double.
        (("mirrors", 1, "radius_mm"), 5e-324),
        (("mirrors", 1, "radius_mm"), -1e-160),
        (("mirrors", 1, "conic"), -5e-324),
        (("camera", "focal_length_mm"), 5e-324),
        (("mirrors", 0, "vertex_mm"), 1e160),
        (("views", "upper", "viewpoint_mm"), -1e300),
    ],
)
def test_numbers_of_no_optics_are_not_exported(place: tuple[Key, ...], value: float, tmp_path: Path):
    record = copy.deepcopy(DESIGNS[0])
    at(record, place[:-1])[place[-1]] = value
    if place[-1] == "conic":
        at(record, place[:-1]).update(kind="ellipsoid", radius_mm=1e4)
    result = ends_well("export", record, tmp_path, "--to", "sag", "-o", str(tmp_path / "sag"))
    assert result.exit_code == 2
    assert f"{'.'.join(map(str, place))} = {value:g}: must be zero or from 1e-15 to 1e+15" in result.stderr


def test_the_smallest_conic_constant_let_through_has_tables_and_a_shape(tmp_path: Path):
    """The foci of what is nearer to a sphere fall together."""
    record = copy.deepcopy(DESIGNS[0])
    mirror = next(mirror for mirror in record["mirrors"] if mirror["kind"] != "plane")
    mirror.update(kind="ellipsoid", conic=-1e-15, radius_mm=3.0 * mirror["outer_radius_mm"])
    assert ends_well("export", record, tmp_path, "--to", "sag", "-o", str(tmp_path / "sag")).exit_code == 0
    assert mirror_shape(Design.model_validate(record), mirror["name"]) is not None
