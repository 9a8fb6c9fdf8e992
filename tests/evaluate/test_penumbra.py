"""Penumbrae against rays through the whole pupil."""

from __future__ import annotations

import numpy as np
import pytest

from designer.evaluate.penumbra import Rim, mixing_band_px, penumbra_px, share_of_pupil, zone_rims
from designer.optics.focus import lens_of_camera
from designer.trace.instrument import build_instrument
from designer.trace.pencils import pupil_places
from designer.verify.light import other_view_share
from support.studied_designs import NAMES, studied_design

DESIGNS = [studied_design(name) for name in NAMES]


def test_an_edge_in_focus_is_sharp_and_one_at_half_the_distance_is_as_wide_as_the_cone():
    design = DESIGNS[0]
    lens = lens_of_camera(design.camera)
    focus = 1.0 / lens.reciprocal_focus
    assert penumbra_px(design, focus) == pytest.approx(0.0, abs=1e-9)
    # Half way to the focus the cone of a point in focus is p / 2 wide; imaged from there, f / z times that.
    expected = lens.pupil_diameter / 2 * lens.principal_distance / (focus / 2) / design.camera.pixel_pitch_mm
    assert penumbra_px(design, focus / 2) == pytest.approx(expected)


@pytest.mark.parametrize("name", ["inner", "outer"])
def test_the_share_of_the_pupil_is_that_of_rays_past_the_rim(name):
    design = DESIGNS[0]
    lens, pitch = lens_of_camera(design.camera), design.camera.pixel_pitch_mm
    rims = zone_rims(design)["upper"]
    rim: Rim = getattr(rims, name)
    places = pupil_places(lens.pupil_diameter / 2, 40)
    edge_mm = rim.radius_px * pitch / lens.principal_distance * rim.height_mm
    for radius_px in np.linspace(rim.inner_px - 1.0, rim.outer_px + 1.0, 13):
        slope = radius_px * pitch / lens.principal_distance
        # A ray from a place in the pupil heads for the image point's conjugate in the plane of focus.
        along = places[:, 0] * (1.0 - rim.height_mm * lens.reciprocal_focus) + slope * rim.height_mm
        across = places[:, 1] * (1.0 - rim.height_mm * lens.reciprocal_focus)
        outside = np.mean(np.hypot(along, across) > edge_mm)
        assert share_of_pupil(radius_px, rim) == pytest.approx(outside, abs=0.02)


@pytest.mark.parametrize("design", DESIGNS, ids=NAMES)
def test_views_mix_only_in_the_band(design):
    """Rays from image points between the zones, followed to what they meet first."""
    lens, pitch = lens_of_camera(design.camera), design.camera.pixel_pitch_mm
    instrument, views = build_instrument(design), design.views.by_name
    inner, outer = views[design.views.inner], views[design.views.outer]
    rims = zone_rims(design)
    ends, begins = rims[design.views.inner].outer, rims[design.views.outer].inner
    radii = np.linspace(min(ends.inner_px, begins.inner_px) - 3.0, max(ends.outer_px, begins.outer_px) + 3.0, 61)
    signed = radii * pitch / lens.principal_distance
    shares = [
        other_view_share(
            instrument, instrument.path(inner.path), instrument.path(outer.path), signed,
            pupil_places(lens.pupil_diameter / 2, 8), lens.reciprocal_focus,
        )
    ]  # fmt: skip
    own, other = shares[0]
    mixed = radii[(own > 0.0) & (other > 0.0)]
    band = mixing_band_px(design)
    if band is None:
        assert not mixed.size
    else:
        assert (mixed >= band[0] - 0.1).all()
        assert (mixed <= band[1] + 0.1).all()
