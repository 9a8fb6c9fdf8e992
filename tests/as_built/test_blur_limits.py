"""Built sensors that blur: held to the judge's traced light of the full pupil."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.model import measure, perturbable
from designer.as_built.sensitivity import sensitivities
from designer.as_built.study import study_tolerances
from designer.as_built.tolerances import Tolerances, tolerance_values, tolerances_of_grade
from designer.cli.tolerance import describe_tolerances
from designer.design import Sharpness
from designer.verify.light import view_light
from designer.verify.light_verdict import light_problems
from support.studied_designs import SHARP_NAMES, sharp_design
from support.wide_designs import LAWS, wide_design

BLURRING = {
    "mirrors": dict.fromkeys(
        ("decentre_mm", "tilt_deg", "axial_shift_mm", "radius_percent", "conic", "plane_curvature_per_m"), 0.0
    ),
    "camera": {
        **dict.fromkeys(("shift_mm", "tilt_deg", "axial_shift_mm", "radial_distortion"), 0.0),
        "principal_distance_percent": 10.0,
    },
}


def refocused(design, departure_mm):
    """The design of a lens that sits farther from the sensor: the same glass, hence the same pupil."""
    camera = design.camera
    longer = camera.focal_length_mm + departure_mm
    nearness = (1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0) + 1.0 / camera.focal_length_mm
    update = {"focal_length_mm": longer, "focus_distance_mm": 1.0 / (nearness - 1.0 / longer)}
    moved = design.model_copy(update={"camera": camera.model_copy(update=update)})
    assert moved.camera.pupil_radius_mm == pytest.approx(camera.pupil_radius_mm, rel=1e-12)
    return moved


def blurs(design):
    """Whether the judge finds a view too blurred."""
    return any("blur of" in problem for problem in light_problems(design, view_light(design)))


@pytest.mark.parametrize("name", [SHARP_NAMES[place] for place in (0, 4, 13)])
@pytest.mark.parametrize("sharpness", [None, Sharpness(max_blur_px=12.0)])
def test_the_judge_finds_the_same_departure_too_blurred(name, sharpness):
    design = sharp_design(name)
    if sharpness is not None:
        design = design.model_copy(update={"sharpness": sharpness})
    model = perturbable(design)
    tolerances = tolerance_values(design, model.parameters, tolerances_of_grade("standard"))
    impacts = sensitivities(model, tolerances, 0.1)
    impact = next(i for i in impacts if i.parameter.key == "principal_distance_departure_mm")
    assert impact.allowed_by == "blur"
    assert "(blur)" in impact.allowed_in_words(" mm")
    assert not any(blurs(refocused(design, sign * 0.85 * impact.allowed)) for sign in (1.0, -1.0))
    assert any(blurs(refocused(design, sign * 1.15 * impact.allowed)) for sign in (1.0, -1.0))


@pytest.mark.parametrize("law", LAWS)
def test_the_blur_is_that_of_the_judge_for_any_lens(law):
    """The largest ratio to a limit in the scene, from the judge's own pixels per degree and elongation."""
    design = wide_design(law).model_copy(update={"sharpness": Sharpness(max_blur_deg=0.5)})
    model = perturbable(design)
    found = measure(model, np.zeros((1, len(model.parameters)))).blur_of_limit[0]
    ratios = [
        np.max(light.blur_deg / (0.5 * 1.05 + 0.5 / light.pixels_per_degree)[:, None])
        for light in view_light(design).values()
    ]
    assert found == pytest.approx(max(ratios), rel=0.05)


def test_blurred_sensors_are_not_good_and_are_counted():
    design = sharp_design(SHARP_NAMES[0])
    tolerances = Tolerances.model_validate(BLURRING)
    study = study_tolerances(design, tolerances, 200)
    result = study.trials.result
    assert result.blurred is not None
    assert result.blurred > 150
    assert result.passed == 200 - result.blurred
    assert result.first_order == result.value
    assert f"{result.blurred} of them blur by more than 0.5 deg somewhere" in "\n".join(describe_tolerances(study))
    # The same sensors, where nobody asked for sharpness.
    unasked = study_tolerances(design.model_copy(update={"sharpness": None}), tolerances, 200)
    assert unasked.trials.result.blurred is None
    assert unasked.trials.result.value == 1.0
    assert "blur is not judged: the design has no limits of it" in "\n".join(describe_tolerances(unasked))
