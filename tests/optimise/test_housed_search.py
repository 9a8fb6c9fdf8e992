"""Searches for heads in a housing: it counts in height and diameter, and the judge finds the light within its ends."""

from __future__ import annotations

import numpy as np
import pytest

from designer.housing import Struts, Tube
from designer.optics.overall_size import OverallSize, Sight, housing_about
from designer.optics.tube import Wall, shift_along_axis
from designer.optimise.required_numbers import SPECIFICATION_NAMES, specification_of
from designer.optimise.search import search
from designer.requirement import Requirement, set_key
from designer.study.record import design_of
from designer.trace.housing import refract
from designer.verify.judge import judge
from support.shipped_problems import CONFIGURATIONS, however_blurred, shipped_requirement

TUBE = {"kind": "tube", "wall_mm": 4.0, "material": "glass", "clearance_mm": 1.5}


def asked(name: str, **keys: object) -> Requirement:
    requirement = set_key(however_blurred(shipped_requirement(name)), "solve.starts", 4)
    for key, value in keys.items():
        requirement = set_key(requirement, key.replace("__", "."), value)
    return requirement


@pytest.mark.slow
@pytest.mark.parametrize(
    ("requirement", "name"),
    [
        # The envelope holds mirrors of 60 mm alone: the tube takes 11 of them.
        (asked("indoor_robot", housing=TUBE, objective__then="diameter"), "folded-HyPl-Hy-upper_outer"),
        # It looks up by 50 degrees: the tube is taller than its mirrors.
        (asked("sky_watch", housing=TUBE), "folded-ElHy-Hy-upper_outer"),
        (asked("pipe_inspection", housing={**TUBE, "wall_mm": 6.0}), "direct-HyEl-upper_inner"),
    ],
    ids=["robot", "sky", "pipe"],
)
def test_a_tube_fits_the_envelope_and_lets_the_light_through(requirement, name):
    result = search(requirement, CONFIGURATIONS[name])
    assert result.status == "feasible", result.reason
    design = design_of(requirement, result)
    tube = design.housing
    assert isinstance(tube, Tube)
    assert judge(design).problems == ()
    assert design.diameter_mm <= requirement.envelope.diameter_mm + 1e-6
    assert design.height_mm <= requirement.envelope.height_mm + 1e-6
    widest = max(*(mirror.outer_radius_mm for mirror in design.mirrors), design.camera.lens_radius_mm)
    assert tube.inner_radius_mm == pytest.approx(widest + 1.5, abs=1e-6)
    assert design.diameter_mm == pytest.approx(2.0 * tube.outer_radius_mm, abs=1e-9)
    assert design.height_mm == pytest.approx(tube.length_mm, abs=1e-9)
    assert (tube.material, tube.refractive_index) == ("glass", 1.473)
    assert design.score["housing"]["outer_diameter_mm"] == pytest.approx(design.diameter_mm)


@pytest.mark.slow
def test_struts_stand_about_the_mirrors():
    requirement = asked("indoor_robot", housing={"kind": "struts", "number": 4, "width_mm": 3.0})
    design = design_of(requirement, search(requirement, CONFIGURATIONS["folded-HyPl-Hy-upper_outer"]))
    assert isinstance(design.housing, Struts)
    assert judge(design).problems == ()
    widest = max(*(mirror.outer_radius_mm for mirror in design.mirrors), design.camera.lens_radius_mm)
    assert design.housing.inner_radius_mm == pytest.approx(widest + 1.0, abs=1e-6)
    assert design.diameter_mm == pytest.approx(2.0 * (widest + 1.0 + 3.0), abs=1e-6)


def test_a_tube_is_as_tall_as_refracted_light_needs_and_not_much_taller():
    """The closed form ignores the wall's shift, which brings light nearer to the viewpoint's height: at most by it."""
    size, sight = OverallSize(20.0, 0.0, 15.0), Sight(12.0, (-0.6, 1.4))
    ring = housing_about(size, 7.0, 1.0, 3.0, [sight])
    assert ring.outer_radius == 19.0
    tube = Tube(
        kind="tube", inner_radius_mm=16.0, wall_mm=3.0, refractive_index=1.5, low_mm=ring.low, high_mm=ring.high
    )
    slopes = np.linspace(*sight.slopes, 50)
    ahead = np.stack([np.ones(50), np.zeros(50), slopes], axis=-1) / np.hypot(1.0, slopes)[:, None]
    through = refract(tube, np.tile([0.0, 0.0, 12.0], (50, 1)), ahead)
    assert through.meets(tube).all()
    spare = tube.high_mm - through.at_outer[:, 2].max(), through.at_outer[:, 2].min() - tube.low_mm
    shifts = [abs(shift_along_axis(slope, Wall(3.0, 1.5))) for slope in (1.4, -0.6)]
    np.testing.assert_allclose(spare, [1.0 + shift for shift in shifts], atol=1e-9)
    # Light within the mirrors' height needs no more than they do, and a wide lens a wider tube.
    low = housing_about(size, 17.0, 1.0, 3.0, [Sight(12.0, (-0.1, 0.1))])
    assert (low.low, low.high, low.outer_radius) == (0.0, 20.0, 21.0)


def test_a_requirement_without_a_housing_asks_for_none():
    specification = specification_of(asked("pipe_inspection"), asked("pipe_inspection").camera.lenses[0])
    assert (specification.housing, specification.housing_gap, specification.housing_thickness) == ("none", 0.0, 0.0)
    assert "housing" not in SPECIFICATION_NAMES
