"""The camera of a design record repeats what was asked for."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.evaluate.depth import depth_error_rms
from designer.goals import GOALS
from designer.requirement import Requirement, set_key
from designer.study.record import _camera, equivalent_noise_px, least_limit_of
from support.shipped_problems import (
    CONFIGURATIONS,
    SHIPPED,
    is_coherent,
    problems_of,
    put_together,
    random_designs,
    requirement_as_shipped,
    shipped_requirement,
    zones_fit,
)

REQUIREMENT = shipped_requirement(SHIPPED[0])


@given(focal_length=st.floats(2, 50), beyond=st.floats(1.01, 1e4))
def test_the_nominal_focal_length_is_the_one_that_was_asked_for(focal_length: float, beyond: float):
    lens = REQUIREMENT.camera.lenses[0].model_copy(
        update={"focal_length_mm": focal_length, "focus_distance_mm": focal_length * beyond}
    )
    values = {"principal_distance": lens.principal_distances_mm[0], "focal_length": focal_length, "f_number": 5.6}
    camera = _camera(REQUIREMENT, lens, values | {"reciprocal_focus": 1.0 / (focal_length * beyond)})
    assert camera.model_extra is not None
    assert camera.model_extra["nominal_focal_length_mm"] == focal_length


def with_lenses(*focal_lengths_mm: float) -> Requirement:
    lens = REQUIREMENT.camera.model_dump(exclude_unset=True)["lens"]
    lenses = [lens | {"focal_length_mm": focal_length} for focal_length in focal_lengths_mm]
    return set_key(set_key(REQUIREMENT, "manufacture.zone_gap_px", 300), "camera.lens", lenses)


def test_the_least_limit_of_a_catalogue_is_that_of_its_lenses_with_room():
    """Half the image goes to the gap: 12 mm leaves room for both zones, 2.5 mm does not."""
    configuration = CONFIGURATIONS["folded-HyPl-Hy-upper_outer"]
    alone = least_limit_of(with_lenses(12.0), configuration)
    for lenses in ((12.0, 2.5), (2.5, 12.0)):
        assert least_limit_of(with_lenses(*lenses), configuration) == alone
    with pytest.raises(ValueError, match="leave no space for the inner zone"):
        least_limit_of(with_lenses(2.5, 2.5), configuration)


def test_the_recorded_noise_and_scale_give_the_depth_error_that_was_minimised():
    """A predicted noise is recorded as one number for both views and all points, the scale as it was asked for."""
    # Drawn at random, designs are blurred: of a scale this uncertain, even their noise leaves a share that shows.
    requirement = set_key(requirement_as_shipped("pipe_inspection"), "scale_uncertainty_percent", 2)
    for problem in problems_of(requirement, CONFIGURATIONS["folded-HyHy-Hy-upper_outer"]):
        drawn = random_designs(problem, 1000, seed=6)
        with np.errstate(all="ignore"):
            kept = np.flatnonzero(is_coherent(system := put_together(problem, drawn)) & zones_fit(system))
        if kept.size:
            break
    values = {name: float(value[kept[0]]) for name, value in drawn.items()}
    system = put_together(problem, values)
    minimised = float(GOALS["depth_error"].expression(system))
    noise_px = equivalent_noise_px(SimpleNamespace(problem=problem, values=values))
    scale = problem.specification.scale_uncertainty
    assert scale == 0.02
    recorded = depth_error_rms(system.pair, system.volume, noise_px * problem.specification.pixel_pitch, scale)
    assert float(recorded) == pytest.approx(minimised, rel=1e-12)
    assert minimised > 1.01 * float(depth_error_rms(system.pair, system.volume, system.noise))
