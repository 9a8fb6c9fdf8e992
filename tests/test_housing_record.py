"""The table ``housing`` of a design file: what it may hold, and what is said of what it may not."""

import json

import pytest

from designer.design import design_to_json, read_design
from designer.files import InputError
from support.housings import with_struts, with_tube
from support.imaging_designs import prototype

TUBE = {"kind": "tube", "inner_radius_mm": 25.0, "wall_mm": 3.0, "refractive_index": 1.49, "low_mm": 0, "high_mm": 9}
STRUTS = {"kind": "struts", "number": 3, "width_mm": 4.0, "radius_mm": 30.0, "low_mm": 0.0, "high_mm": 90.0}


@pytest.mark.parametrize("design", [prototype(), with_tube(prototype()), with_struts(prototype())])
def test_a_file_reads_back(design, tmp_path):
    (tmp_path / "design.json").write_text(design_to_json(design))
    assert read_design(tmp_path / "design.json") == design


def test_a_file_without_a_housing_stays_as_it_was():
    assert "housing" not in json.loads(design_to_json(prototype()))


@pytest.mark.parametrize(
    ("housing", "said"),
    [
        ({**TUBE, "kind": "glass"}, 'housing: must be a table whose kind is "tube" or "struts"'),
        ("tube", "housing = 'tube': must be a table"),
        ({**TUBE, "wall_mm": 0.0}, "housing.wall_mm = 0.0: must be greater than 0"),
        ({**TUBE, "wall_mm": "3"}, "housing.wall_mm = '3'"),
        ({**TUBE, "refractive_index": 15.0}, "housing.refractive_index = 15.0: must be less than or equal to 2.5"),
        ({**TUBE, "high_mm": -1.0}, "housing: high_mm (-1) must lie above low_mm (0)"),
        ({**TUBE, "wal_mm": 1.0}, "housing.wal_mm"),
        ({key: value for key, value in TUBE.items() if key != "wall_mm"}, "housing.wall_mm: is required but missing"),
        ({**STRUTS, "number": 0}, "housing.number = 0"),
        ({**STRUTS, "width_mm": 52.0}, "width_mm (52) must be less than 51.96"),
    ],
)
def test_what_a_housing_cannot_be_is_said_in_one_line(housing, said, tmp_path):
    content = {**json.loads(design_to_json(prototype())), "housing": housing}
    (tmp_path / "design.json").write_text(json.dumps(content))
    with pytest.raises(InputError) as failure:
        read_design(tmp_path / "design.json")
    assert said in str(failure.value)
    assert "\n" not in str(failure.value)
