"""Reflections in a tube's inner wall: what a pixel shows by them, and where mirrors stand in their way."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import VIEW_NAMES
from designer.trace.aiming import meridional_rays
from designer.trace.instrument import sag
from designer.verify.wall_reflections import wall_reflections
from support.housings import with_tube
from support.studied_designs import SHARP_NAMES, sharp_design


@pytest.mark.parametrize("name", SHARP_NAMES[::3])
def test_reflections_pass_between_the_mirrors_where_they_are_named(name):
    """Followed here in small steps across the tube, against sampled substrates, barrel and body."""
    design = with_tube(sharp_design(name))
    radius = design.tube.inner_radius_mm
    named = wall_reflections(design)
    for view in VIEW_NAMES:
        viewpoint = design.views.by_name[view].viewpoint_mm
        low, high = design.views.by_name[view].elevation_deg
        elevations = np.linspace(low, high, 60)[1:-1]
        is_named = np.zeros(58, dtype=bool)
        for first, last in named[view]:
            is_named |= (elevations >= first) & (elevations <= last)
        at_edge = np.zeros(58, dtype=bool)
        for end in np.ravel(named[view]):
            at_edge |= np.abs(elevations - end) < (high - low) / 128.0
        slopes = np.tan(np.radians(elevations))[:, None]
        # From the wall at +r inwards and across to -r: the signed distance from the axis falls, the height goes on.
        across = np.linspace(radius, -radius, 4001)
        heights = viewpoint + slopes * (2.0 * radius - across)
        met = np.zeros(heights.shape, dtype=bool)
        for mirror in design.mirrors:
            within = (np.abs(across) >= mirror.inner_radius_mm) & (np.abs(across) <= mirror.outer_radius_mm)
            face = mirror.vertex_mm + sag(mirror, np.abs(across))
            ends = np.sort([face, face + mirror.back_offset_mm], axis=0)
            met |= within & (heights >= ends[0]) & (heights <= ends[1])
        camera = design.camera
        met |= (
            (np.abs(across) <= camera.lens_radius_mm)
            & (heights <= camera.lens_front_mm)
            & (heights >= camera.lens_seat_mm)
        )
        met |= (np.abs(across) <= camera.body_radius_mm) & (heights <= camera.lens_seat_mm)
        np.testing.assert_array_equal(is_named[~at_edge], ~met.any(axis=1)[~at_edge])


def test_some_views_have_them_and_a_design_without_a_tube_has_none():
    found = [wall_reflections(with_tube(sharp_design(name))) for name in SHARP_NAMES]
    assert any(ranges for each in found for ranges in each.values())
    assert any(not ranges for each in found for ranges in each.values())
    assert wall_reflections(sharp_design(SHARP_NAMES[0])) == {"upper": (), "lower": ()}


def test_the_ray_that_is_reflected_is_the_one_that_a_section_draws():
    """At the inner wall a drawn ray has the height of viewpoint and slope."""
    design = with_tube(sharp_design(SHARP_NAMES[2]))
    view = design.views.upper
    elevation = float(np.mean(view.elevation_deg))
    (line,) = meridional_rays(design, "upper", [elevation], 100.0)
    inner, outer, end = line[-3:]
    assert abs(inner[0]) == pytest.approx(design.tube.inner_radius_mm)
    assert abs(outer[0]) == pytest.approx(design.tube.outer_radius_mm)
    slope = np.tan(np.radians(elevation))
    assert inner[1] == pytest.approx(view.viewpoint_mm + slope * abs(inner[0]))
    assert (end[1] - outer[1]) / abs(end[0] - outer[0]) == pytest.approx(slope)
    inside = (outer[1] - inner[1]) / (abs(outer[0]) - abs(inner[0]))
    sine = np.sin(np.arctan(inside)) * design.tube.refractive_index
    assert sine == pytest.approx(np.sin(np.arctan(slope)))
