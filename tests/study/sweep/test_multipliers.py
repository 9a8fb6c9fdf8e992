"""Multipliers against finite differences of whole searches, with the baseline free."""

import pytest

from designer.optimise.multipliers import first_stage_multipliers, number_at
from designer.optimise.search import search
from designer.requirement import set_key
from support.shipped_problems import however_blurred, shipped_requirement

# (requirement, height of the envelope, mm; configuration): ten designs that the envelope holds.
DESIGNS = [
    ("indoor_robot", 140, "folded-HyPl-Hy-upper_outer"),
    ("indoor_robot", 140, "folded-PaPa-Hy-upper_inner"),
    ("indoor_robot", 140, "folded-ElEl-Hy-upper_inner"),
    ("indoor_robot", 140, "direct-HyHy-upper_inner"),
    ("indoor_robot", 130, "folded-HyPl-Hy-upper_outer"),
    ("indoor_robot", 130, "folded-PaPa-Hy-upper_inner"),
    ("pipe_inspection", 300, "direct-HyHy-upper_outer"),
    ("pipe_inspection", 300, "folded-HyPl-Hy-upper_outer"),
    ("pipe_inspection", 300, "folded-PaPa-Hy-upper_inner"),
    ("pipe_inspection", 300, "folded-HyPl-Hy-upper_inner"),
]
KEYS = ("envelope.height_mm", "manufacture.substrate_thickness_mm", "camera.nearest_mirror_mm",
        "envelope.mirror_diameter_mm", "manufacture.clearance_mm", "working_volume.elevation_deg.1")  # fmt: skip
STEP = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("name", "height", "configuration"), DESIGNS)
def test_multipliers_agree_with_finite_differences(name, height, configuration):
    requirement = however_blurred(shipped_requirement(name))
    requirement = set_key(set_key(requirement, "envelope.height_mm", height), "baseline_mm", [40, 200])
    requirement = set_key(requirement, "solve.starts", 3)
    (chosen,) = [each for each in requirement.configurations if each.name == configuration]
    found = search(requirement, chosen)
    assert found.first is not None
    slopes = first_stage_multipliers(requirement, found.first, KEYS)
    assert slopes is not None
    weight = max(abs(slope * number_at(requirement, key)) for key, slope in slopes.items())
    checked = 0
    for key, slope in slopes.items():
        value = number_at(requirement, key)
        if abs(slope * value) < 1e-3 * weight:
            continue
        ends = [
            search(set_key(requirement, key, value + sign * STEP * value), chosen, found.warm_starts).first.goals[
                "depth_error"
            ]
            for sign in (-1.0, 1.0)
        ]
        difference = (ends[1] - ends[0]) / (2.0 * STEP * value)
        assert slope == pytest.approx(difference, rel=0.02)
        checked += 1
    assert checked >= 2
