"""Searches with lenses that are not r = f tan(psi): the limit holds, the lens's field is kept, the judge agrees."""

from __future__ import annotations

import numpy as np
import pytest

from designer.optics.image_law import ImageLaw
from designer.optimise.branch import problem_of
from designer.optimise.constraints import image_constraints
from designer.optimise.required_numbers import SPECIFICATION_NAMES, specification_of, specification_values
from designer.optimise.screening import draw
from designer.optimise.search import search
from designer.optimise.system import put_together, zone_tangents
from designer.requirement import Requirement, set_key
from designer.study.record import design_of
from designer.verify.judge import judge
from support.shipped_problems import CONFIGURATIONS, VARIANTS, however_blurred, shipped_requirement

LAWS = (
    ImageLaw("equidistant"),
    ImageLaw("equisolid"),
    ImageLaw("stereographic"),
    ImageLaw("equidistant", (-0.05, 0.01, -0.002, 0.0003)),
    ImageLaw("perspective", (-0.12, 0.01)),
)
IDS = [f"{law.projection}{list(law.coefficients) or ''}" for law in LAWS]
NAMES = ("folded-HyHy-Hy-upper_inner", "folded-HyPl-Hy-upper_outer")


def asked_with(law: ImageLaw, **changes: object) -> Requirement:
    requirement = however_blurred(shipped_requirement("indoor_robot"))
    lens = requirement.camera.lenses[0].model_dump(exclude_unset=True)
    lens |= {"projection": law.projection, "distortion": list(law.coefficients), **changes}
    return set_key(requirement, "camera.lens", lens)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(LAWS)), ids=IDS)
def test_no_design_that_is_found_beats_the_limit(number):
    law, random = LAWS[number], np.random.default_rng(number)
    requirement = asked_with(law, focal_length_mm=float(random.uniform(4.0, 7.0)))
    for key, value in (
        ("baseline_mm", [80, float(random.uniform(90.0, 120.0))]),
        ("working_volume.elevation_deg", [-float(random.uniform(5, 15)), float(random.uniform(5, 15))]),
        ("scale_uncertainty_percent", float(random.choice([0.0, 0.02]))),
        ("solve.starts", 4),
    ):
        requirement = set_key(requirement, key, value)
    found = search(requirement, CONFIGURATIONS[NAMES[number % 2]])
    assert found.status == "feasible", found.reason
    assert found.first.goals["depth_error"] >= found.limit_of_first * (1.0 - 1e-9)
    design = design_of(requirement, found)
    assert judge(design).problems == ()
    assert design.score["limit_ratio"] >= 1.0 - 1e-9
    assert design.score["least_limit"]["depth_error_rms"] <= design.score["depth_error_limit"] * (1.0 + 1e-9)
    assert (design.camera.projection, design.camera.distortion) == (law.projection, law.coefficients)


def test_a_program_is_built_for_one_law():
    lens = asked_with(LAWS[0], focal_length_mm=4.0).camera.lenses[0]
    specification = specification_of(asked_with(LAWS[0], focal_length_mm=4.0), lens)
    assert specification.law == LAWS[0]
    assert len(specification_values(specification)) == len(SPECIFICATION_NAMES)
    assert "law" not in SPECIFICATION_NAMES


def test_an_image_that_turns_back_into_the_circle_is_outside_the_field():
    # x - 0.2 x^3 is largest at x = 1.29, 52 degrees; at 60 degrees it is back at 0.69, at 2.35 mm of 2.64.
    requirement = asked_with(ImageLaw("perspective", (-0.2,)), focal_length_mm=3.4, focus_distance_mm=float("inf"))
    lens = requirement.camera.lenses[0]
    variant = next(variant for variant in VARIANTS if variant.configuration.name == "direct-HyHy-upper_outer")
    problem = problem_of(requirement, lens, variant)
    values = draw(problem, 1, np.random.default_rng(0))
    tangent = zone_tangents(variant, "upper", put_together(variant, values, problem.specification).slopes["upper"])[1]
    values["upper_gain"] = np.tan(np.radians(60.0) / 2.0) / tangent
    spare = {
        rule.kind: float(np.ravel(rule.value)[0])
        for rule in image_constraints(put_together(variant, values, problem.specification))
    }
    assert spare["image_circle"] * 0.0044 == pytest.approx(2.64 - 3.4 * (np.sqrt(3.0) - 0.2 * np.sqrt(27.0)))
    assert spare["lens_field"] == pytest.approx(np.degrees(lens.image_law.widest) - 60.0)
    assert spare["lens_field"] < -8.0
