"""Depth errors from two traced rays, against the closed form of systems with single viewpoints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.comparators.errors import Rig, depth_error_rms, relative_errors
from designer.comparators.sight import CoaxialView
from designer.design import Design, ViewName
from designer.evaluate.depth import (
    depth_error_map,
    noise_mm_of,
    stereo_pair_of,
    volume_of,
)
from designer.evaluate.depth import (
    depth_error_rms as closed_form_rms,
)
from designer.evaluate.predicted_noise import Conditions, noise_model
from designer.optics.focus import lens_of_camera, light_path_of_design
from designer.optimise.limit import conditions_of
from designer.optimise.required_numbers import specification_of
from designer.trace.instrument import build_instrument
from support.shipped_problems import requirement_as_shipped
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design
from support.wide_designs import LAWS, wide_design


def rig_of(design: Design) -> Rig:
    instrument = build_instrument(design)

    def view(name: ViewName) -> CoaxialView:
        seen = design.views.by_name[name]
        return CoaxialView(design.camera, instrument, instrument.path(seen.path), side=float(np.sign(seen.gain)))

    return Rig(view("lower"), view("upper"), design.views.middle_mm)


def conditions_for(requirement_name: str) -> Conditions:
    requirement = requirement_as_shipped(requirement_name)
    return conditions_of(specification_of(requirement, requirement.camera.lenses[0]))


def constant_noise(noise_mm: float) -> Conditions:
    return replace(conditions_for("indoor_robot"), constant=noise_mm, predicted_share=0.0)


@pytest.mark.parametrize("name", NAMES)
def test_two_traced_rays_give_the_score_of_single_viewpoints(name: str) -> None:
    design = studied_design(name)
    pair, volume = stereo_pair_of(design), volume_of(design)
    noise = noise_mm_of(design)
    traced = depth_error_rms(rig_of(design), volume, constant_noise(noise), 2e-4)
    assert traced == pytest.approx(float(closed_form_rms(pair, volume, noise, 2e-4)), rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_the_same_holds_for_lenses_of_other_projections(law: str) -> None:
    design = wide_design(law)
    pair, volume, noise = stereo_pair_of(design), volume_of(design), noise_mm_of(design)
    traced = depth_error_rms(rig_of(design), volume, constant_noise(noise), 2e-4)
    assert traced == pytest.approx(float(closed_form_rms(pair, volume, noise, 2e-4)), rel=1e-6)


@pytest.mark.parametrize("name", SHARP_NAMES[:4])
def test_predicted_noise_needs_no_closed_form_of_the_blur(name: str) -> None:
    design = sharp_design(name)
    pair, volume = stereo_pair_of(design), volume_of(design)
    conditions = conditions_for(name.split(":")[0])
    paths = {view: light_path_of_design(design, view) for view in ("lower", "upper")}
    predicted = noise_model(conditions, pair, lens_of_camera(design.camera), paths)
    traced = depth_error_rms(rig_of(design), volume, conditions, 0.0)
    assert traced == pytest.approx(float(closed_form_rms(pair, volume, predicted)), rel=1e-6)


def test_two_cameras_have_independent_scales() -> None:
    """In a direct design the shifts of one camera's scale nearly cancel; those of two cameras cannot."""
    design = next(studied_design(name) for name in NAMES if "direct-" in name)
    rig = rig_of(design)
    volume = volume_of(design)
    elevation, distance = np.array([np.mean(volume.elevations)]), np.array([volume.distances[1]])
    small = constant_noise(1e-9)
    alone = Rig(rig.lower, rig.upper, rig.middle_mm, has_one_camera=False)
    shared, apart = (relative_errors(each, np.tan(elevation), distance, small, 1e-3)[0] for each in (rig, alone))
    pair = stereo_pair_of(design)
    assert shared == pytest.approx(float(depth_error_map(pair, elevation, distance, 1e-9, 1e-3)[0]), rel=1e-6)
    # Each view alone shifts its slope by epsilon cos(psi) sqrt(1 + m^2): docs/theory.md, section 5.
    sights = [
        view.sight(distance, rig.middle_mm + distance * np.tan(elevation), 0.0) for view in (rig.lower, rig.upper)
    ]
    shifts = [1e-3 * np.cos(sight.psi[0]) * np.sqrt(1.0 + sight.slope[0] ** 2) for sight in sights]
    assert apart == pytest.approx(float(np.hypot(*shifts)) * distance[0] / design.baseline_mm, rel=1e-6)
    assert apart > 5.0 * shared
