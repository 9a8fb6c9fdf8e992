"""Multipliers against finite differences of whole searches."""

import math

import pytest

from designer.optimise.multipliers import F_NUMBER, first_stage_multipliers
from designer.optimise.search import search
from designer.requirement import set_key
from designer.requirement.design_quantities import number_at
from support.shipped_problems import CONFIGURATIONS, however_blurred, shipped_requirement

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


BLUR_KEYS = ("sharpness.max_blur_deg", "sharpness.max_blur_px")
SHARP = "folded-HyHy-Hy-upper_outer"
"""A configuration whose depth error the limit of the blur holds up, at f/5.6 in the indoor robot's requirement."""


def requirement_of_sharp_design(**changes):
    requirement = set_key(shipped_requirement("indoor_robot"), "solve.starts", 3)
    for key, value in changes.items():
        requirement = set_key(requirement, key.replace("__", "."), value)
    return requirement


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({}, ("sharpness.max_blur_deg", F_NUMBER)),
        ({"sharpness__max_blur_px": 3.0}, (*BLUR_KEYS, F_NUMBER)),
        ({"sharpness__max_blur_deg": math.inf, "sharpness__max_blur_px": 3.0}, ("sharpness.max_blur_px", F_NUMBER)),
        ({"noise_px": "predicted"}, ("sharpness.max_blur_deg", F_NUMBER)),
        (
            {"noise_px": "predicted", "camera__lens__f_number": [2.8, 11]},
            ("sharpness.max_blur_deg", "envelope.height_mm"),
        ),
    ],
    ids=["angle", "angle and sensor", "sensor", "predicted noise", "free stop"],
)
def test_what_blur_and_a_stop_are_worth_agrees_with_finite_differences(changes, keys):
    requirement, chosen = requirement_of_sharp_design(**changes), CONFIGURATIONS[SHARP]
    found = search(requirement, chosen)
    assert found.first is not None
    slopes = first_stage_multipliers(requirement, found.first)
    assert slopes is not None

    def least_error(key, value):
        return search(set_key(requirement, key, value), chosen, found.warm_starts).first.goals["depth_error"]

    for key in keys:
        value = number_at(requirement, key)
        # A stop multiplies the f-number by the root of two.
        low, high = value * (1.0 - STEP), value * (1.0 + STEP)
        unit = 2.0 * math.log2(high / low) if key == F_NUMBER else high - low
        difference = (least_error(key, high) - least_error(key, low)) / unit
        assert abs(difference) * (1.0 if key == F_NUMBER else value) > 1e-3 * found.first.goals["depth_error"]
        assert slopes[key] == pytest.approx(difference, rel=0.02)


def test_what_is_infinite_or_free_has_no_multiplier_and_a_stop_is_that_of_the_chosen_lens():
    requirement, chosen = requirement_of_sharp_design(), CONFIGURATIONS[SHARP]
    found = search(requirement, chosen)
    slopes = first_stage_multipliers(requirement, found.first)
    assert set(BLUR_KEYS) & set(slopes) == {"sharpness.max_blur_deg"}
    lens = requirement.camera.lens
    dark = lens.model_copy(update={"name": "another", "f_number": 16.0})
    catalogue = requirement.model_copy(update={"camera": requirement.camera.model_copy(update={"lens": (dark, lens)})})
    assert first_stage_multipliers(catalogue, found.first)[F_NUMBER] == pytest.approx(slopes[F_NUMBER], rel=1e-6)
    stopped = set_key(requirement, "camera.lens.f_number", [5.6, 5.61])
    assert number_at(stopped, F_NUMBER) is None
    assert F_NUMBER not in first_stage_multipliers(stopped, search(stopped, chosen, found.warm_starts).first)
