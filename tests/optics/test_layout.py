"""Layouts of random designs against the tracer: every leg is where the light goes, every solid where the metal is."""

from __future__ import annotations

import numpy as np
import pytest

from designer.optics.layout import Layout
from designer.optimise.variants import Variant
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument, sag
from designer.trace.sequential import trace_sequential
from support.shipped_problems import (
    VARIANTS,
    at,
    design_record,
    is_coherent,
    problem_of,
    put_together,
    random_designs,
    shipped_requirement,
    variant_name,
)

# The near field lets most ellipsoids be laid out; the other two look far below and far above the horizon.
REQUIREMENTS = ("pipe_inspection", "ceiling_watch", "sky_watch")
DESIGNS = 2


def coherent_designs(variant: Variant):
    """Random designs whose surfaces are where the formulas say, each with its record and its layout."""
    for name in REQUIREMENTS:
        requirement = shipped_requirement(name)
        problem = problem_of(requirement, variant)
        values = random_designs(problem, 4000, seed=1)
        for index in np.flatnonzero(is_coherent(put_together(problem, values)))[:DESIGNS]:
            one = at(values, index)
            yield design_record(requirement, problem, one), put_together(problem, one).layout


def end_points(layout: Layout, view: str, mirror: str) -> np.ndarray:
    """The points (2, 2) of a view's two end rays on a mirror, from the leg that arrives there."""
    leg = next(leg for leg in layout.legs if leg.view == view and leg.end.mirror == mirror)
    return np.array([[float(np.ravel(number)[0]) for number in point] for point in leg.end.points])


@pytest.mark.parametrize("variant", VARIANTS, ids=variant_name)
def test_legs_are_where_the_tracer_sends_the_light(variant):
    tried = 0
    for design, layout in coherent_designs(variant):
        tried += 1
        instrument = build_instrument(design)
        for name, view in (("upper", design.views.upper), ("lower", design.views.lower)):
            ends = np.radians(view.elevation_deg if view.sense == "direct" else view.elevation_deg[::-1])
            sign = 1.0 if view.sense == "direct" else -1.0
            psi = 2.0 * np.arctan(view.gain * np.tan(np.pi / 4 + sign * ends / 2))
            path = instrument.path(view.path)
            trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
            assert (trace.missed < 0).all()
            for mirror, hit in zip(view.path, trace.hits, strict=True):
                expected = end_points(layout, name, mirror)
                assert hit[:, [0, 2]] == pytest.approx(expected, rel=1e-7, abs=1e-7)
                radii = np.abs(hit[:, 0])
                used = next(item for item in layout.mirrors if item.name == mirror).used_radii
                assert [float(np.ravel(radius)[0]) for radius in used] == pytest.approx(radii, rel=1e-7, abs=1e-7)
            # The world side is R > 0, and the exit line passes through the viewpoint at the asked elevation.
            assert (trace.direction[:, 0] > 0).all()
            assert elevation_angles(trace.direction) == pytest.approx(ends, abs=1e-8)
            at_axis = trace.point[:, 2] - trace.point[:, 0] * trace.direction[:, 2] / trace.direction[:, 0]
            assert at_axis == pytest.approx(view.viewpoint_mm, abs=1e-6)
            world = next(
                leg for leg in layout.legs if leg.view == name and leg.end.mirror is None and leg.end.points[0][0] > 0
            )
            far = np.array([[float(np.ravel(number)[0]) for number in point] for point in world.end.points])
            assert np.arctan2(far[:, 1] - view.viewpoint_mm, far[:, 0]) == pytest.approx(ends, abs=1e-9)
    assert tried > 0, "no random design of this variant is coherent under any requirement"


@pytest.mark.parametrize("variant", VARIANTS[::3], ids=variant_name)
def test_solids_are_the_mirrors_and_the_camera_of_the_record(variant):
    for design, layout in coherent_designs(variant):
        for mirror in design.mirrors:
            solids = [solid for solid in layout.mirror_solids if solid.name == mirror.name]
            assert sorted(solid.side for solid in solids) == [-1, 1]
            for solid in solids:
                inner, outer = (float(np.ravel(radius)[0]) for radius in (solid.inner_radius, solid.outer_radius))
                assert (inner, outer) == (mirror.inner_radius_mm, mirror.outer_radius_mm)
                assert float(solid.depth) == mirror.thickness_mm * (1.0 if mirror.faces == "down" else -1.0)
                radii = np.linspace(inner, outer, 9)
                heights = mirror.vertex_mm + sag(mirror, radii)
                assert [float(np.ravel(solid.surface.height(radius))[0]) for radius in radii] == pytest.approx(
                    heights, rel=1e-9, abs=1e-7
                )
        camera = design.camera
        lens, body = layout.camera_solids
        assert (lens.outer_radius, lens.surface.vertex_height) == (camera.lens_radius_mm, camera.lens_front_mm)
        assert (body.outer_radius, body.surface.vertex_height) == (
            camera.body_radius_mm,
            camera.lens_front_mm - camera.lens_length_mm,
        )
        assert lens.depth == -camera.lens_length_mm
