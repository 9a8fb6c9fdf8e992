"""Layouts of random designs against the tracer: every leg is where the light goes, every solid where the metal is."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import Design
from designer.optics.layout import Layout
from designer.optimise.variants import Variant
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument, sag
from designer.trace.pencils import trace_bundles
from designer.trace.sequential import trace_sequential
from support.shipped_problems import (
    CHIEF_RAYS_ALONE,
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
# The pupil is then a thousandth of a millimetre wide: light has a width, and it is that of the first order.
NARROW_LIGHT = 1e4


def coherent_designs(variant: Variant, f_number: float = CHIEF_RAYS_ALONE):
    """Random designs whose surfaces are where the formulas say, each with its record and its layout.

    Those with light of some width are narrower than the nearest scene.
    """
    for name in REQUIREMENTS:
        requirement = shipped_requirement(name)
        problem = problem_of(requirement, variant)
        values = random_designs(problem, 4000, seed=1, f_number=f_number)
        sound = is_coherent(put_together(problem, values))
        if f_number != CHIEF_RAYS_ALONE:
            sound &= values["radius"] < problem.specification.distances[0]
        for index in np.flatnonzero(sound)[:DESIGNS]:
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
            world = next(leg for leg in layout.legs if leg.view == name and leg.name.endswith("-> world"))
            far = np.array([[float(np.ravel(number)[0]) for number in point] for point in world.end.points])
            assert np.arctan2(far[:, 1] - view.viewpoint_mm, far[:, 0]) == pytest.approx(ends, abs=1e-9)
    assert tried > 0, "no random design of this variant is coherent under any requirement"


def traced_light(design: Design, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Chief rays of a zone's inner and outer end, and how far the light's edge lies from them, as (R, z) corners.

    Shapes (2, corners, 2) and (2, distances, corners, 2), from the pinhole over the mirrors to the scene.
    """
    view, instrument = design.views.by_name[name], build_instrument(design)
    path = instrument.path(view.path)
    inside_out = view.elevation_deg if view.sense == "direct" else view.elevation_deg[::-1]
    bundles = trace_bundles(design, name, inside_out, design.working_volume.distance_mm)
    shape = bundles.directions.shape
    starts = np.broadcast_to(bundles.places_mm, shape)
    trace = trace_sequential(
        instrument, path, bundles.directions.reshape(-1, 3), starts.reshape(-1, 3), apertures=False
    )
    ends = np.broadcast_to(bundles.points_mm[:, :, None], shape)
    corners = np.stack([starts, *(hit.reshape(shape) for hit in trace.hits), ends], axis=-2)[..., [0, 2]]
    # The traced rays leave the pinhole towards +x; the world side of a layout is R > 0.
    corners = corners * [np.sign(view.gain), 1.0]
    chief, places = corners.mean(axis=2), bundles.places_mm[:, 0]
    edges = np.einsum("p,nkpcx->nkcx", places / (places @ places), corners) * design.camera.pupil_radius_mm
    assert np.isfinite(edges).all()
    return chief[:, 0], edges


def across(ahead: np.ndarray) -> np.ndarray:
    """The unit vector to the left of another vector."""
    return np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)


def points_of(end) -> np.ndarray:
    return np.array([[float(np.ravel(number)[0]) for number in point] for point in end.points])


@pytest.mark.parametrize("variant", VARIANTS[1::5], ids=variant_name)
def test_legs_are_as_wide_as_the_traced_light(variant):
    """On a face along R, beyond the last mirror across the ray: at either end the wider of the light near and far."""
    for design, layout in coherent_designs(variant, NARROW_LIGHT):
        for name, view in design.views.by_name.items():
            chief, edges = traced_light(design, name)
            for place, mirror in enumerate(view.path, start=1):
                side = np.sign(chief[0, place, 0])
                inner, outer = np.abs(edges[:, :, place, 0]).max(axis=1)
                expected = chief[:, place, 0] + side * np.array([-inner, outer])
                found = end_points(layout, name, mirror)[:, 0]
                assert found - chief[:, place, 0] == pytest.approx(expected - chief[:, place, 0], rel=1e-2, abs=1e-7)
                placed, margin = next(one for one in layout.mirrors if one.name == mirror), 1e-9
                radii = [float(np.ravel(radius)[0]) for radius in (placed.inner_radius, placed.outer_radius)]
                assert radii[0] <= abs(found[0]) + margin
                assert radii[1] >= abs(found[1]) - margin
            legs = [leg for leg in layout.legs if leg.view == name]
            half = design.camera.pupil_radius_mm
            side = np.sign(chief[0, 1, 0])
            assert points_of(legs[0].start) == pytest.approx(np.array([[-side * half, 0.0], [side * half, 0.0]]))
            world, last = points_of(legs[-1].end), len(view.path)
            for end, other in ((0, 1), (1, 0)):
                ahead = chief[end, -1] - chief[end, last]
                width = np.abs(edges[end, :, last] @ across(ahead)).max()
                away = np.sign(across(ahead) @ (chief[end, -1] - chief[other, -1]))
                beyond = world[end] - chief[end, last]
                assert away * (across(ahead) @ beyond) == pytest.approx(width, rel=1e-2, abs=1e-7)


CROSSING = [variant for variant in VARIANTS if any(variant.crosses_at_viewpoint(view) for view in ("upper", "lower"))]
CROSSING += [variant for variant in VARIANTS if variant.fold and variant.fold.gain_sign != variant.fold.primary_side]


@pytest.mark.parametrize("variant", CROSSING[::3], ids=variant_name)
def test_legs_that_cross_the_axis_hold_the_traced_light(variant):
    """They end beside the crossing, away from the other end's ray, and leave room for the widest of the light."""
    crossings = 0
    for design, layout in coherent_designs(variant, NARROW_LIGHT):
        for name, view in design.views.by_name.items():
            chief, edges = traced_light(design, name)
            for place, mirror in enumerate(view.path, start=1):
                start, stop = chief[:, place], chief[:, place + 1]
                if start[0, 0] * stop[0, 0] > 0.0:
                    continue
                crossings += 1
                width = 0.0
                for end in (0, 1):
                    share = start[end, 0] / (start[end, 0] - stop[end, 0])
                    at_axis = edges[end, :, place] * (1.0 - share) + edges[end, :, place + 1] * share
                    width = max(width, float(np.abs(at_axis @ across(stop[end] - start[end])).max()))
                focus = start[0] + start[0, 0] / (start[0, 0] - stop[0, 0]) * (stop[0] - start[0])
                legs = {leg.name.partition(" -> ")[::2]: leg for leg in layout.legs if leg.view == name}
                before = next(leg for (_, end), leg in legs.items() if end == f"focus after {mirror}")
                after = next(leg for (begin, _), leg in legs.items() if begin == f"focus after {mirror}")
                for leg_end, far in ((before.end, start), (after.start, stop)):
                    beside = points_of(leg_end) - focus
                    for end, other in ((0, 1), (1, 0)):
                        normal = across(far[end] - focus)
                        away = -np.sign(normal @ (far[other] - focus))
                        assert beside[end] == pytest.approx(away * width * normal, rel=1e-2, abs=1e-2 * width)
    assert crossings > 0


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
