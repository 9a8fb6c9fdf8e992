"""The ``as_built`` table of a design file: read, written, refused, and absent from files that never had one."""

from __future__ import annotations

import json
from typing import Any

import pytest

from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import Design, design_to_json, read_design, write_design
from designer.files import InputError
from designer.trace.built import build_as_built
from support import DATA
from support.imaging_designs import prototype


def written(tmp_path, as_built: Any):
    content = json.loads((DATA / "folded_hypl_hy.json").read_text(encoding="utf-8"))
    path = tmp_path / "built.json"
    path.write_text(json.dumps({**content, "as_built": as_built}), encoding="utf-8")
    return path


def test_files_without_departures_do_not_change():
    assert "as_built" not in design_to_json(prototype())
    assert prototype().as_built is None


def test_departures_survive_a_file(tmp_path):
    record = AsBuilt(
        mirrors={
            "direct": MirrorDeparture(decentre_x_mm=0.1, tilt_y_deg=-0.05, radius_departure_mm=0.02),
            "secondary": MirrorDeparture(curvature_per_m=0.01),
        },
        camera=CameraDeparture(shift_x_mm=0.05, radial_distortion=-1e-3),
    )
    design = Design.model_validate({**prototype().model_dump(by_alias=True), "as_built": record.model_dump()})
    write_design(design, tmp_path / "built.json")
    assert read_design(tmp_path / "built.json") == design


@pytest.mark.parametrize(
    ("as_built", "said"),
    [
        ({"mirrors": {"third": {}}}, "as_built.mirrors names 'third'; the mirrors are"),
        ({"mirrors": {"direct": {"tilt_x": 0.1}}}, "as_built.mirrors.direct.tilt_x: Extra inputs are not permitted"),
        ({"mirrors": {"direct": {"tilt_x_deg": "0.1"}}}, "as_built.mirrors.direct.tilt_x_deg = '0.1': must be"),
        ({"mirrors": {"direct": {"tilt_x_deg": 30.0}}}, "less than or equal to 20"),
        ({"mirrors": {"direct": {"radius_departure_mm": -1e3}}}, "must leave the sign of the radius"),
        ({"mirrors": {"direct": {"conic_departure": 5.0}}}, "lies beyond the equator"),
        ({"mirrors": {"direct": {"curvature_per_m": 1.0}}}, "belongs to planes"),
        ({"mirrors": {"secondary": {"radius_departure_mm": 1.0}}}, "use curvature_per_m"),
        ({"mirrors": {"secondary": {"curvature_per_m": 500.0}}}, "lies beyond the equator"),
        ({"camera": {"principal_distance_departure_mm": -20.0}}, "leaves no principal distance"),
        ({"camera": {"shift_x_mm": float("nan")}}, "finite number"),
        ({"mirrors": {"direct": {"radius_departure_mm": 1e300}}}, "less than or equal to 10000"),
        ({"mirrors": {"direct": {"conic_departure": -1e300}}}, "greater than or equal to -10"),
        ({"mirrors": {"secondary": {"curvature_per_m": -2000.0}}}, "greater than or equal to -1000"),
        ({"camera": {"principal_distance_departure_mm": 1e300}}, "less than or equal to 1000"),
    ],
)
def test_departures_that_cannot_be_are_refused_in_one_line(tmp_path, as_built, said):
    path = written(tmp_path, as_built)
    with pytest.raises(InputError) as refused:
        read_design(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: ")
    assert said in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("distortion", "said"),
    [
        ([1e300], "camera.distortion.0 = 1e+300: must be less than or equal to 1000"),
        (0.1, "camera.distortion = 0.1: must be a list of numbers"),
        ({"k1": 0.1}, "camera.distortion: must be a list of numbers"),
    ],
)
def test_distortions_that_cannot_be_are_refused_in_one_line(tmp_path, distortion, said):
    content = json.loads((DATA / "folded_hypl_hy.json").read_text(encoding="utf-8"))
    path = tmp_path / "design.json"
    path.write_text(json.dumps({**content, "camera": {**content["camera"], "distortion": distortion}}), "utf-8")
    with pytest.raises(InputError) as refused:
        read_design(path)
    assert str(refused.value) == f"{path}: {said}"


def test_a_plane_of_hardly_any_curvature_is_flat(tmp_path):
    design = read_design(written(tmp_path, {"mirrors": {"secondary": {"curvature_per_m": 1e-320}}}))
    built = build_as_built(design).instrument
    assert built.conics.curvature[built.mirrors.index("secondary")] == 0.0


def test_a_plane_that_is_curved_has_that_curvature():
    design = prototype().model_copy(
        update={"as_built": AsBuilt(mirrors={"secondary": MirrorDeparture(curvature_per_m=-0.5)})}
    )
    built = build_as_built(design).instrument
    assert built.conics.curvature[built.mirrors.index("secondary")] == pytest.approx(-0.5e-3, rel=1e-15)
