"""Rays aimed at elevations and points, against the rays themselves."""

from __future__ import annotations

import numpy as np
import pytest

from designer.trace.aiming import meridional_rays, pinhole_angles
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.closed_forms import folded_hypl_hy


def test_pinhole_angles_invert_the_trace_and_say_what_is_out_of_reach():
    design = folded_hypl_hy()
    instrument = build_instrument(design)
    for view in (design.views.upper, design.views.lower):
        path = instrument.path(view.path)
        wanted = np.radians(np.linspace(*view.elevation_deg, 40))
        psi = pinhole_angles(instrument, path, wanted, 0.25)
        trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
        np.testing.assert_allclose(elevation_angles(trace.direction), wanted, atol=1e-13)
        reached = elevation_angles(
            trace_sequential(
                instrument, path, pinhole_directions(np.linspace(0.0, 0.25, 1025)), apertures=False
            ).direction
        )
        beyond = np.radians([80.0, -80.0])
        out_of_reach = (beyond > np.nanmax(reached)) | (beyond < np.nanmin(reached))
        assert out_of_reach.any()
        np.testing.assert_array_equal(np.isnan(pinhole_angles(instrument, path, beyond, 0.25)), out_of_reach)


def test_meridional_rays_end_where_they_should():
    design = folded_hypl_hy()
    lines = meridional_rays(design, "lower", [-10.0, 0.0, 10.0, -89.9], 50.0)
    assert [line.shape for line in lines] == [(4, 2), (4, 2), (4, 2), (0, 2)]
    for line, elevation in zip(lines, (-10.0, 0.0, 10.0), strict=False):
        np.testing.assert_array_equal(line[0], [0.0, 0.0])
        leaving = line[3] - line[2]
        assert np.hypot(*leaving) == pytest.approx(50.0, abs=1e-12)
        assert np.degrees(np.arctan2(leaving[1], leaving[0])) == pytest.approx(elevation, abs=1e-10)
        # The line runs through the viewpoint.
        assert line[2, 1] - line[2, 0] * leaving[1] / leaving[0] == pytest.approx(0.0, abs=1e-11)
