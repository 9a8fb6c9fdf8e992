"""Two stacked cameras: their depth from two elevations, and their errors against the closed form of one view each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.comparators.asked import Asked
from designer.comparators.errors import relative_errors
from designer.comparators.stacked import BODY_LENGTHS, put_together
from designer.design import VIEW_NAMES, Mirror
from designer.evaluate.depth import slope_error, slopes_of_point
from designer.evaluate.scale import slope_shift_per_scale
from designer.optics.view import half_angle_tangent
from support.shipped_problems import requirement_as_shipped

REQUIREMENT = requirement_as_shipped("pipe_inspection")
ASKED = Asked.of(REQUIREMENT, REQUIREMENT.camera.lenses[0])
UNIT = [0.12, 130.0, 12.0, 1.0 / 150.0, 6.0]
BASELINE = 80.0


@pytest.mark.parametrize("is_inverted", [False, True])
def test_two_elevations_give_the_horizontal_distance(is_inverted):
    """D = b cos(phi_l) cos(phi_u) / sin(phi_l - phi_u), as for any two coaxial panoramas (Gluckman et al., 1998)."""
    built = put_together(ASKED, is_inverted, np.array([*UNIT, *UNIT, BASELINE]))
    distances, heights = np.array([130.0, 180.0, 240.0]), built.rig.middle_mm + np.array([-10.0, 3.0, 20.0])
    lower, upper = (view.sight(distances, heights, 0.0) for view in (built.rig.lower, built.rig.upper))
    phi_lower, phi_upper = np.arctan(lower.slope), np.arctan(upper.slope)
    found = BASELINE * np.cos(phi_lower) * np.cos(phi_upper) / np.sin(phi_lower - phi_upper)
    assert found == pytest.approx(distances, rel=1e-9)


@pytest.mark.parametrize("is_inverted", [False, True])
def test_errors_are_those_of_two_views_with_scales_of_their_own(is_inverted):
    built = put_together(ASKED, is_inverted, np.array([*UNIT, *UNIT, BASELINE]))
    slope, distance, noise, scale = 0.05, 200.0, 4e-4, 1e-3
    constant = replace(ASKED.conditions, constant=noise, predicted_share=0.0)
    traced = relative_errors(built.rig, np.array([slope]), np.array([distance]), constant, scale)[0]
    slopes = slopes_of_point(slope, distance, BASELINE)
    variance = 0.0
    for name in VIEW_NAMES:
        seen, placed = slopes[name], built.views[name]
        # A camera that looks down sees the scene upside down.
        own = -seen if placed.view.is_inverted else seen
        psi = placed.view.sight(np.array([distance]), np.array([built.rig.middle_mm + slope * distance]), 0.0).psi[0]
        gain = float(np.tan(psi / 2.0) / half_angle_tangent(own, "direct"))
        camera = placed.view.camera
        variance += float(slope_error(own, gain, "direct", camera.focal_length_mm, noise)) ** 2
        variance += (scale * float(slope_shift_per_scale(own, gain, "direct"))) ** 2
    assert traced == pytest.approx(distance / BASELINE * np.sqrt(variance), rel=1e-7)


def test_a_camera_between_the_mirrors_has_its_room_and_one_above_them_needs_none():
    upright, inverted = (
        put_together(ASKED, is_inverted, np.array([*UNIT, *UNIT, 200.0])) for is_inverted in (False, True)
    )
    camera = upright.heads[0].camera
    lower, upper, lens, body = upright.heads[0].mirrors
    assert isinstance(body, Mirror)
    assert body.thickness_mm == pytest.approx(BODY_LENGTHS * camera.body_radius_mm)
    assert lens.vertex_mm + lens.thickness_mm == pytest.approx(200.0 + camera.lens_front_mm)
    # Equal units stand one baseline apart, upright; looking down, both viewpoints lie between the cameras.
    assert upper.vertex_mm - lower.vertex_mm == pytest.approx(200.0)
    pinhole = inverted.views["upper"].view.pinhole_mm
    assert pinhole == pytest.approx(200.0 + 2.0 * UNIT[1])
    assert inverted.height_mm == pytest.approx(pinhole - 2.0 * camera.lens_front_mm)
