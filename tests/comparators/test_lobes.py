"""The double-lobed mirror: what its border makes of the baseline, and a finished one against the closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from designer.comparators.asked import Asked
from designer.comparators.coaxial import view_by
from designer.comparators.head import gain_for, hyperboloid
from designer.comparators.lobes import spaces, viewpoint_through
from designer.comparators.search import KEPT, search
from designer.comparators.table import COMPARATORS
from designer.evaluate.depth import StereoPair, depth_error_rms
from designer.evaluate.predicted_noise import noise_model
from designer.optics.conic import FocalConic
from designer.optics.focus import FocusingMirror, LightPath, lens_of_camera
from designer.trace.aiming import exit_lines
from support.shipped_problems import requirement_as_shipped

REQUIREMENT = requirement_as_shipped("indoor_robot")
ASKED = Asked.of(REQUIREMENT, REQUIREMENT.camera.lenses[0])


def test_the_border_fixes_the_baseline():
    """Both lobes reflect the ray to their common border; their viewpoints lie where the reflected rays cross the axis.

    So b = R0 (m_inner - m_outer), whatever the lobes.
    """
    camera = ASKED.camera((12.0, 0.01, 5.6))
    psi, viewpoint = 0.11, 120.0
    gains = [gain_for(0.08, 0.0), gain_for(0.15, 0.0)]
    radius, height = FocalConic(0.0, viewpoint / (1.0 + gains[0]), 1.0 / gains[0]).point(np.tan(psi / 2.0))
    viewpoints = [viewpoint, viewpoint_through(gains[1], psi, radius)]
    slopes = []
    for gain, focus in zip(gains, viewpoints, strict=True):
        face = hyperboloid(gain, focus)
        assert face.height(radius) == pytest.approx(height, rel=1e-12)
        view = view_by(camera, face)
        (start_r, start_z), (ahead_r, ahead_z) = exit_lines(view.instrument, view.path, np.array([psi]))
        assert (start_r[0], start_z[0]) == pytest.approx((radius, height), rel=1e-12)
        slopes.append(float(ahead_z[0] / ahead_r[0]))
    assert viewpoints[1] - viewpoints[0] == pytest.approx(radius * (slopes[0] - slopes[1]), rel=1e-10)


@pytest.mark.slow
def test_a_finished_one_scores_as_its_two_hyperboloids_do_in_closed_form():
    (space,) = spaces(ASKED)
    best, *others = search(space, REQUIREMENT.solve.seed, REQUIREMENT.objective.tolerance)
    built = best.built
    assert best.violation <= KEPT
    assert COMPARATORS["double_lobed_mirror"].problems(ASKED, built) == []
    # Every start that ends inside the constraints ends in the same optimum.
    inside = [other.error for other in others if other.violation <= KEPT]
    assert len(inside) >= 2
    assert max(inside) == pytest.approx(min(inside), rel=1e-3)
    camera = built.heads[0].camera
    viewpoints = [float(np.mean(built.views[name].zone.crossing)) for name in ("lower", "upper")]
    zones = [built.views[name].zone for name in ("lower", "upper")]
    gains = [gain_for(float(zone.psi[0]), float(zone.slope[0])) for zone in zones]
    pair = StereoPair(gains[0], "direct", gains[1], "direct", built.baseline_mm, camera.focal_length_mm)
    conics = [FocalConic(0.0, focus / (1.0 + gain), 1.0 / gain) for focus, gain in zip(viewpoints, gains, strict=True)]
    paths = {
        name: LightPath((FocusingMirror(conic, from_world=False),), focus, gain, "direct")
        for name, conic, focus, gain in zip(("lower", "upper"), conics, viewpoints, gains, strict=True)
    }
    noise = noise_model(ASKED.conditions, pair, lens_of_camera(camera), paths)
    scale = ASKED.scale_uncertainty
    assert best.error == pytest.approx(float(depth_error_rms(pair, ASKED.volume, noise, scale)), rel=1e-6)
    assert viewpoints[1] - viewpoints[0] == pytest.approx(built.baseline_mm, rel=1e-9)
