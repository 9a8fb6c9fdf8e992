"""The full pupil's light: shares that geometry foretells, blur of the first order, and two views that mix."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import Design
from designer.evaluate.focus import focus_of_design
from designer.optics.focus import chief_ray, light_path_of_design, light_width, reciprocal_along_ray
from designer.optics.view import image_radius_slope
from designer.trace.instrument import build_instrument
from designer.trace.pencils import pupil_places, trace_bundles
from designer.verify.light import arriving_share, other_view_share, view_light
from support.closed_forms import folded_hypl_hy, half_tangent
from support.studied_designs import NAMES, studied_design


def with_camera(design: Design, **changes: float) -> Design:
    return design.model_copy(update={"camera": design.camera.model_copy(update=changes)})


def with_mirror(design: Design, name: str, **changes: float) -> Design:
    mirrors = [m.model_copy(update=changes) if m.name == name else m for m in design.mirrors]
    return design.model_copy(update={"mirrors": tuple(mirrors)})


def disc_share(edge: float) -> float:
    """Share of a disc of radius 1 on one side of a line at a signed distance from its centre."""
    edge = min(max(edge, -1.0), 1.0)
    return 0.5 + (np.arcsin(edge) + edge * np.sqrt(1.0 - edge * edge)) / np.pi


@pytest.mark.parametrize("name", NAMES)
def test_all_light_arrives_through_a_pinhole_and_none_is_mixed(name):
    for light in view_light(with_camera(studied_design(name), f_number=1e4)).values():
        assert light.least_arriving == 1.0
        assert (light.stopped_by == "").all()
        assert light.mixed_at_ends == (0.0, 0.0)
        assert light.mixed_in_zone == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_traced_blur_is_that_of_the_closed_form(name):
    design = studied_design(name)
    expected = focus_of_design(design, elevations=3)
    for view, light in view_light(design).items():
        first = np.abs(getattr(expected, view).blur_px)
        np.testing.assert_allclose(light.blur_px, first, rtol=0.05, atol=0.5)
        assert (np.abs(light.blur_px / first - 1.0)[first > 2.0] < 0.05).all()
        np.testing.assert_allclose(light.elevations_deg, getattr(expected, view).elevations_deg)


@pytest.mark.parametrize("name", NAMES[::3])
def test_a_blur_in_the_scene_is_the_angle_that_it_spans_on_the_sensor(name):
    """Pixels per degree at lowest, middle and highest elevation, by the slope of the gain law's image radius."""
    design = studied_design(name)
    for view_name, light in view_light(design).items():
        view, camera = design.views.by_name[view_name], design.camera
        low, high = view.elevation_deg
        slopes = np.tan(np.radians([low, (low + high) / 2.0, high]))
        per_radian = image_radius_slope(slopes, view.gain, camera.focal_length_mm, view.sense)
        expected = np.abs(np.radians(per_radian)) / camera.pixel_pitch_mm
        np.testing.assert_allclose(light.pixels_per_degree, expected, rtol=1e-6)
        np.testing.assert_allclose(light.blur_deg, light.blur_px / expected[:, None], rtol=1e-6)


@pytest.mark.parametrize("kept", [-0.6, 0.0, 0.4, 0.8])
def test_an_edge_lets_through_the_part_of_the_disc_that_the_width_foretells(kept):
    """The direct mirror cut at its lowest elevation, so many half-widths beyond the chief ray."""
    design = studied_design("sky_watch:folded-ElHy-Hy-upper_inner")
    view, distance = design.views.upper, design.working_volume.distance_mm[1]
    highest = view.elevation_deg[1]
    slope = np.tan(np.radians(highest))
    ray = chief_ray(light_path_of_design(design, "upper"), slope)
    width = light_width(ray, reciprocal_along_ray(slope, distance), design.camera.pupil_radius_mm)
    cut = ray.points[0][0] + kept * abs(width.radial[0])
    # Nothing else may stand in the way.
    mirror = design.mirror("direct").model_copy(update={"outer_radius_mm": float(cut), "inner_radius_mm": 0.0})
    alone = design.model_copy(update={"mirrors": (mirror, *_out_of_the_way(design, "direct"))})
    instrument = build_instrument(alone)
    bundles = trace_bundles(alone, "upper", [highest], [distance], rings=12)
    share, stopped_by = arriving_share(instrument, instrument.path(view.path), bundles)
    assert share[0, 0] == pytest.approx(disc_share(kept), abs=0.02)
    assert stopped_by[0, 0] == "direct"


def _out_of_the_way(design: Design, kept: str) -> list:
    return [
        mirror.model_copy(update={"vertex_mm": mirror.vertex_mm + 1e5})
        for mirror in design.mirrors
        if mirror.name != kept
    ]


def test_a_narrowed_hole_is_found():
    design = studied_design("pipe_inspection:folded-PlHy-El-upper_inner")
    before = view_light(design)["upper"]
    hole = design.mirror("secondary").inner_radius_mm
    after = view_light(with_mirror(design, "secondary", inner_radius_mm=hole - 0.3))["upper"]
    assert after.least_arriving < before.least_arriving - 0.05
    assert any("secondary" in name for name in after.stopped_by.ravel())


def test_a_wider_pupil_loses_more_light_and_blurs_more():
    design = studied_design("indoor_robot:folded-PaPa-Hy-upper_outer")
    lights = [view_light(with_camera(design, f_number=number))["lower"] for number in (11.0, 5.6, 2.8)]
    shares = [light.least_arriving for light in lights]
    assert shares[0] > shares[1] > shares[2]
    blurs = [light.largest_blur_px for light in lights]
    np.testing.assert_allclose([blurs[1] / blurs[0], blurs[2] / blurs[1]], [11.0 / 5.6, 2.0], rtol=0.02)


def test_focus_in_the_wrong_place_blurs():
    design = studied_design("pipe_inspection:folded-HyHy-Hy-upper_outer")
    sharp = view_light(design)["lower"].largest_blur_px
    moved = view_light(with_camera(design, focus_distance_mm=100.0))["lower"].largest_blur_px
    assert moved > 3.0 * sharp


def test_views_mix_where_the_edge_of_the_first_mirror_divides_the_pupil():
    """A flat secondary between the lens and the direct mirror: which of them a ray meets is plane geometry."""
    design = folded_hypl_hy(thickness=0.0)
    # Faces wide enough to lose nothing else.
    design = with_mirror(
        with_mirror(design, "primary", inner_radius_mm=5.0, outer_radius_mm=30.0), "direct", inner_radius_mm=0.0
    )
    secondary, focus = design.mirror("secondary"), 150.0
    instrument = build_instrument(design)
    paths = [instrument.path(view.path) for view in (design.views.upper, design.views.lower)]
    places = pupil_places(3.0, 10)
    edge, height = secondary.outer_radius_mm, secondary.vertex_mm
    slopes = edge / height + np.linspace(-0.02, 0.02, 9)
    own, other = other_view_share(instrument, paths[0], paths[1], slopes, places, 1.0 / focus)
    # Where a ray from a place in the pupil to the image point's conjugate crosses the secondary's plane.
    x = slopes[:, None] * height + places[:, 0] * (1.0 - height / focus)
    y = places[:, 1] * (1.0 - height / focus)
    on_secondary = (np.hypot(x, y) <= edge).mean(axis=1)
    assert on_secondary.min() < 0.05
    assert on_secondary.max() > 0.95
    np.testing.assert_allclose(other, on_secondary, atol=1e-12)
    np.testing.assert_allclose(own, 1.0 - on_secondary, atol=1e-12)


def test_mixing_is_told_at_the_end_and_over_the_zone():
    design = with_camera(folded_hypl_hy(thickness=0.0), f_number=1.4, focus_distance_mm=400.0)
    design = with_mirror(
        with_mirror(design, "primary", inner_radius_mm=5.0, outer_radius_mm=30.0), "direct", inner_radius_mm=0.0
    )
    upper = view_light(design)["upper"]
    # The upper view's zone begins where the secondary ends, at its lowest elevation.
    assert upper.mixed_at_ends[0] > 0.02
    assert upper.mixed_at_ends[1] == 0.0
    assert 0.0 < upper.mixed_in_zone < upper.mixed_at_ends[0]
    # Over the zone, by a thousand rings that are equally wide on the sensor and weigh by their area.
    camera, instrument = design.camera, build_instrument(design)
    paths = [instrument.path(view.path) for view in (design.views.upper, design.views.lower)]
    ends = [
        np.tan(2.0 * np.arctan(design.views.upper.gain * half_tangent(phi, "direct")))
        for phi in design.views.upper.elevation_deg
    ]
    borders = np.linspace(*ends, 1001)
    middles = (borders[1:] + borders[:-1]) / 2.0
    own, other = other_view_share(
        instrument, paths[0], paths[1], middles, pupil_places(camera.pupil_radius_mm, 6), 1.0 / camera.focus_distance_mm
    )
    expected = np.sum(middles * other) / np.sum(middles * (own + other))
    assert upper.mixed_in_zone == pytest.approx(expected, rel=0.03)


def test_a_view_that_its_mirrors_cannot_show_has_no_light():
    design = studied_design("indoor_robot:folded-HyPl-Hy-upper_outer")
    upper = design.views.upper.model_copy(update={"elevation_deg": (0.0, 89.0)})
    design = design.model_copy(update={"views": design.views.model_copy(update={"upper": upper})})
    light = view_light(design)["upper"]
    assert light.arrives[2].tolist() == [0.0, 0.0]
    assert light.stopped_by[2, 0] == "direct"
    assert np.isnan(light.blur_px[2]).all()
    assert np.isnan(light.mixed_in_zone)


def test_light_that_finds_no_way_has_missed_the_first_mirror():
    design = studied_design("indoor_robot:folded-HyPl-Hy-upper_outer")
    lower = design.views.lower.model_copy(update={"elevation_deg": (-89.0, 0.0)})
    light = view_light(design.model_copy(update={"views": design.views.model_copy(update={"lower": lower})}))["lower"]
    assert light.arrives[0].tolist() == [0.0, 0.0]
    assert np.isnan(light.blur_px[0]).all()
    assert (light.stopped_by[0] == "secondary").all()
