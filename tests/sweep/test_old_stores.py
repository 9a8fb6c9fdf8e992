"""Warm starts that version 0.1 stored are still designs: put together anew they have the values that it recorded."""

import json
from pathlib import Path

import pytest

from designer.optimise.search import recall
from designer.study.sweep.point import read_warm_starts
from support.shipped_problems import CONFIGURATIONS, shipped_requirement

STORED = json.loads((Path(__file__).parents[1] / "data" / "warm_starts_of_version_0_1.json").read_text())


def test_a_warm_start_of_version_0_1_is_the_design_it_was():
    name = STORED["configuration"]
    (warm_start,) = read_warm_starts(json.dumps(STORED["trails"]))[name]
    assert warm_start.second_directions is not None
    _, second = recall(shipped_requirement("indoor_robot"), CONFIGURATIONS[name], warm_start)
    assert second is not None
    assert second.is_feasible
    assert second.goals["depth_error"] == pytest.approx(STORED["depth_error_rms"], rel=1e-12)
    assert second.goals["height"] == pytest.approx(STORED["height_mm"], rel=1e-12)
