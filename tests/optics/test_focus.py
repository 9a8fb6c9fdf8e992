"""Focus in closed form: proofs of the power, widths against traced rays, one formula for arrays and symbols."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import fsolve
from scipy.spatial import ConvexHull

from designer.optics.conic import FocalConic
from designer.optics.focus import (
    FocusedLens,
    FocusingMirror,
    LightPath,
    chief_ray,
    focal_distances,
    image_conjugates,
    lens_of_camera,
    light_path_of_design,
    light_path_of_layout,
    light_width,
    mirror_power,
    reciprocal_along_ray,
    reciprocal_image_depth,
    reciprocal_image_distance,
)
from designer.optics.layout import OpticalPath, Reflection
from designer.trace.instrument import build_instrument
from designer.trace.pencils import trace_bundles
from designer.trace.sequential import trace_sequential
from support.closed_forms import convex_ellipsoid_pair, direct_ellipsoid_pair, paraboloid_pair
from support.studied_designs import NAMES, studied_design

DESIGNS = [studied_design(name) for name in NAMES]
DESIGNS += [convex_ellipsoid_pair(), paraboloid_pair(), direct_ellipsoid_pair()]
VIEWS = ("upper", "lower")

v, mu, t = sp.symbols("v mu t", real=True)


def is_zero(expression: sp.Expr) -> bool:
    return sp.cancel(sp.together(expression)) == 0


# --- the power of a mirror along a chief ray ---


def test_both_forms_of_the_power_are_one():
    distance, reciprocal = focal_distances(v, mu, t)
    assert is_zero(mirror_power(v, mu, t) - (1 / distance - reciprocal))


def test_the_focal_distances_reach_from_both_foci_to_the_mirror():
    radius, height = FocalConic(0, v, mu).point(t)
    distance, reciprocal = focal_distances(v, mu, t)
    other_focus = v * (1 + 1 / mu)
    assert is_zero(distance**2 - radius**2 - height**2)
    assert is_zero(1 / reciprocal**2 - radius**2 - (height - other_focus) ** 2)


def test_the_power_follows_from_the_curvature_tangentially_and_sagittally():
    """2 k_t / cos i and 2 k_s cos i (Coddington), with curvatures k and incidence i from the surface itself."""
    radius, height = FocalConic(0, v, mu).point(t)
    radius_1, height_1 = sp.diff(radius, t), sp.diff(height, t)
    squared = radius_1**2 + height_1**2
    # Positive for a face that looks down and is hollow; the normal is (-z', R') / sqrt(squared).
    tangential = -(radius_1 * sp.diff(height, t, 2) - height_1 * sp.diff(radius, t, 2)) / squared
    sagittal = -height_1 / radius
    facing = (-2 * t * height_1 + (1 - t**2) * radius_1) / (1 + t**2)
    assert is_zero(mirror_power(v, mu, t) - 2 * tangential / facing)
    assert is_zero(mirror_power(v, mu, t) - 2 * sagittal * facing / squared)


def test_a_plane_has_no_power_and_a_paraboloid_a_finite_one():
    assert mirror_power(50.0, 1.0, np.array([0.0, 0.3])).tolist() == [0.0, 0.0]
    # From the focus of a paraboloid: 1/rho, and the other focus at infinity.
    tangents = np.array([0.0, 0.2, 0.5])
    distance, reciprocal = focal_distances(50.0, 0.0, tangents)
    np.testing.assert_allclose(distance, 50.0 * (1.0 + tangents**2), rtol=1e-15)
    assert not reciprocal.any()
    np.testing.assert_allclose(mirror_power(50.0, 0.0, tangents), 1.0 / distance, rtol=1e-15)


@given(
    distance=st.floats(10.0, 200.0),
    gain=st.floats(0.03, 0.4) | st.floats(-0.4, -0.03),
    half_tangent=st.floats(0.0, 1.2),
)
def test_seen_from_the_other_focus_the_power_changes_its_sign(distance, gain, half_tangent):
    # The same ellipsoid or hyperboloid: v mu^-1 = v / mu, and the tangent at the other focus is mu t.
    ratio = 1.0 / gain
    here = mirror_power(distance, ratio, gain * half_tangent)
    there = mirror_power(distance / ratio, 1.0 / ratio, half_tangent)
    assert there == pytest.approx(-here, rel=1e-9, abs=1e-15)


# --- a view's chain ---


def test_a_flat_mirror_moves_nothing():
    # A plane halfway between pinhole and viewpoint: the image lies as far from the pinhole as the object from there.
    path = LightPath((FocusingMirror(FocalConic(0.0, 40.0, 1.0)),), 80.0, 1.0, "direct")
    ray = chief_ray(path, np.tan(np.radians([-80.0, -70.0])))
    np.testing.assert_allclose(reciprocal_image_distance(ray, 1.0 / 500.0), 1.0 / 500.0, rtol=1e-13)
    assert (reciprocal_image_distance(ray, 0.0) == 0.0).all()


@pytest.mark.parametrize("design", DESIGNS)
def test_all_distances_follow_from_two(design):
    for view in VIEWS:
        slope = np.tan(np.radians(np.linspace(*getattr(design.views, view).elevation_deg, 5)))[:, None]
        ray = chief_ray(light_path_of_design(design, view), slope)
        a, b, c, d = image_conjugates(ray)
        reciprocal = np.array([0.0, 1e-4, 1e-3, 5e-3])
        np.testing.assert_allclose(
            (c + d * reciprocal) / (a + b * reciprocal), reciprocal_image_depth(ray, reciprocal), rtol=1e-9, atol=1e-12
        )


def test_a_single_mirror_obeys_the_equation_of_mirrors():
    # On the axis: 1 / object + 1 / image = 2 / radius, for a hyperboloid that shows a point 300 mm from its vertex.
    gain, viewpoint = 0.1, 110.0
    vertex = viewpoint / (1.0 + gain)
    power = mirror_power(vertex, 1.0 / gain, 0.0)
    radius = 2.0 * vertex / (1.0 / gain - 1.0)
    assert power == pytest.approx(-2.0 / radius, rel=1e-14)
    path = LightPath((FocusingMirror(FocalConic(0.0, vertex, 1.0 / gain)),), viewpoint, gain, "direct")
    # Straight down is out of any float's reach; close to it the chief ray is all but the axis.
    slope = -1e7
    found = reciprocal_image_distance(chief_ray(path, slope), 1.0 / (300.0 + (viewpoint - vertex)))
    assert found == pytest.approx(1.0 / (vertex + 1.0 / (1.0 / 300.0 + 2.0 / radius)), rel=1e-6)


def test_a_mirror_may_be_written_from_either_focus():
    gain, viewpoint = -0.1, 110.0
    vertex = viewpoint / (1.0 + gain)
    slope = np.tan(np.radians([-20.0, 5.0, 30.0]))
    views = [
        chief_ray(LightPath((mirror,), viewpoint, gain, "direct"), slope)
        for mirror in (
            FocusingMirror(FocalConic(0.0, vertex, 1.0 / gain)),
            FocusingMirror(FocalConic(viewpoint, vertex - viewpoint, gain), from_world=True),
        )
    ]
    np.testing.assert_allclose(views[0].points, views[1].points, rtol=1e-12)
    np.testing.assert_allclose(views[0].powers, views[1].powers, rtol=1e-12)


@pytest.mark.parametrize(
    "design",
    [design for design in DESIGNS if design.configuration.startswith("folded") and "Pa" not in design.configuration],
)
def test_a_folded_pair_may_be_written_from_the_world_side_alone(design):
    # The secondary's focus on its world side is the one that it shares with the primary.
    path = light_path_of_design(design, "lower")
    secondary, primary = path.mirrors
    shared, vertex = secondary.conic.other_focus_height, secondary.conic.surface.vertex_height
    turned = FocusingMirror(FocalConic(shared, vertex - shared, 1.0 / _ratio(secondary.conic)), from_world=True)
    slope = np.tan(np.radians(design.views.lower.elevation_deg))
    once = chief_ray(path, slope)
    again = chief_ray(LightPath((turned, primary), path.viewpoint, path.gain, path.sense), slope)
    for name in ("points", "powers", "legs", "directions", "viewpoint_distance"):
        np.testing.assert_allclose(getattr(again, name), getattr(once, name), rtol=1e-6, atol=1e-7)


def test_a_layout_and_a_finished_design_give_one_path():
    design = studied_design("indoor_robot:folded-HyPl-Hy-upper_outer")
    for view in VIEWS:
        recorded, path = getattr(design.views, view), light_path_of_design(design, view)
        reflections = tuple(
            Reflection(name, -1 if mirror.from_world else 1, mirror.conic, (0.1, 0.2), None)
            for name, mirror in zip(recorded.path, path.mirrors, strict=True)
        )
        laid_out = OpticalPath(view, recorded.viewpoint_mm, (0.0, 0.1), reflections)
        assert light_path_of_layout(laid_out, recorded.gain, recorded.sense) == path


def test_a_view_of_three_mirrors_is_a_folded_pair_behind_a_plane():
    # A flat mirror in front of a folded pair, which then stands upside down below it: the light does not notice.
    pair = light_path_of_design(studied_design("indoor_robot:folded-HyPl-Hy-upper_outer"), "lower")
    height = 10.0
    flat = FocusingMirror(FocalConic(0.0, height, 1.0))
    turned = tuple(
        FocusingMirror(
            FocalConic(2.0 * height - m.conic.focus_height, -m.conic.vertex_distance, _ratio(m.conic)), m.from_world
        )
        for m in pair.mirrors
    )
    slope = 0.1
    once = chief_ray(pair, slope)
    # Upside down, elevations change their sign and so does the sense; powers and legs are those of the pair.
    other = LightPath((flat, *turned), 2.0 * height - pair.viewpoint, pair.gain, "direct")
    thrice = chief_ray(other, -slope)
    assert thrice.legs[0] + thrice.legs[1] == pytest.approx(once.legs[0], rel=1e-12)
    assert thrice.legs[2] == pytest.approx(once.legs[1], rel=1e-12)
    assert thrice.viewpoint_distance == pytest.approx(once.viewpoint_distance, rel=1e-12)
    found = reciprocal_image_distance(thrice, 1.0 / 800.0)
    assert found == pytest.approx(reciprocal_image_distance(once, 1.0 / 800.0), rel=1e-12)


def _ratio(conic: FocalConic) -> float:
    """The third number of a conic, whatever its name."""
    return getattr(conic, FocalConic.__slots__[2])


def test_the_lens_keeps_its_pupil():
    camera = studied_design("indoor_robot:folded-HyPl-Hy-upper_outer").camera
    lens = lens_of_camera(camera)
    assert lens.pupil_diameter == pytest.approx(2.0 * camera.pupil_radius_mm, rel=1e-14)
    nominal = 1.0 / (1.0 / camera.focal_length_mm + 1.0 / camera.focus_distance_mm)
    assert lens.pupil_diameter == pytest.approx(nominal / camera.f_number, rel=1e-14)
    assert lens_of_camera(camera.model_copy(update={"focus_distance_mm": None})).reciprocal_focus == 0.0


def test_blur_is_that_of_similar_triangles():
    # The cone of a pupil of 2 mm that is focused at 100 mm is 1 mm wide at 50 mm; seen through f = 12 mm from there.
    lens = FocusedLens(12.0, 12.0 / (1.0 + 12.0 / 100.0) / 2.0, 1.0 / 100.0)
    assert lens.pupil_diameter == pytest.approx(2.0)
    assert abs(lens.blur(1.0 / 50.0)) == pytest.approx(12.0 / 50.0 * 1.0)
    assert lens.blur(1.0 / 100.0) == 0.0


# --- a published example ---


def test_baker_and_nayars_hyperboloid_is_focused_where_they_say_and_nowhere_perfectly():
    """S. Baker and S. K. Nayar, IJCV 35 (1999), the defocus of a hyperboloid: c = 1 m between the foci, k = 4.

    The scene point lies 5 m from the viewpoint in the direction of the mirror's point (0.125, 0, 0.125) m, and the
    lens has a radius of 5 cm. They find the best focus between 1.05 and 1.2 m, and a blur that nowhere vanishes. Here
    every ray obeys Fermat's principle on their surface, in their frame: viewpoint at the origin, pinhole at z = c.
    """
    between_foci, k, distance, radius = 1000.0, 4.0, 5000.0, 50.0
    inverse_eccentricity = math.sqrt((k - 2.0) / k)
    gain = (1.0 - inverse_eccentricity) / (1.0 + inverse_eccentricity)
    conic = FocalConic(0.0, between_foci / (1.0 + gain), 1.0 / gain)
    # At the elevation -45 degrees: their axis points from the viewpoint to the pinhole, that is down.
    ray = chief_ray(LightPath((FocusingMirror(conic),), between_foci, gain, "direct"), -1.0)
    assert ray.points[0] == pytest.approx((125.0, between_foci - 125.0))
    closed_form = 1.0 / reciprocal_image_depth(ray, 1.0 / distance)

    scene_point = distance * np.array([math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    angles = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    rim = radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    slopes = np.array([_slopes_by_fermat(place, scene_point, between_foci, k) for place in rim])
    focused = np.linspace(1000.0, 1300.0, 601)
    areas = np.array([ConvexHull(rim + slopes * at).volume for at in focused])
    best = focused[np.argmin(areas)]
    assert 1050.0 < best < 1200.0
    assert best == pytest.approx(closed_form, abs=1.0)
    # About 0.3 mm across at best, of a lens of 100 mm: first order is right to that, and no more.
    across = 2.0 * math.sqrt(areas.min() / np.pi)
    assert 0.1 < across < 0.5


def _slopes_by_fermat(place, scene_point, between_foci, k):
    """Slopes dx, dy per mm towards the mirror of the ray from a place of the lens that ends in the scene point."""
    start = np.array([*place, between_foci])

    def hit(across):
        depth = between_foci**2 / 4.0 * (k - 2.0) / k + (across @ across) * (k / 2.0 - 1.0)
        return np.array([*across, between_foci / 2.0 - math.sqrt(depth)])

    def turn(across):
        point = hit(across)
        pull = sum((point - end) / np.linalg.norm(point - end) for end in (start, scene_point))
        steepness = -(k / 2.0 - 1.0) * across / (between_foci / 2.0 - point[2])
        return pull[:2] + pull[2] * steepness

    point = hit(fsolve(turn, [125.0, 0.0], xtol=1e-13))
    return (point - start)[:2] / (start - point)[2]


# --- how wide the light is ---


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("view", VIEWS)
def test_width_of_the_light_is_that_of_a_traced_bundle(design, view):
    """Close bundles: how fast hits move with the place in the pupil, across the ray and along R on the face."""
    recorded = getattr(design.views, view)
    instrument = build_instrument(design)
    path = instrument.path(recorded.path)
    elevations = np.linspace(*recorded.elevation_deg, 3)
    distance = design.working_volume.distance_mm[0]
    bundles = trace_bundles(design, view, elevations, [distance], pupil_radius_mm=1e-3)
    slopes = np.tan(np.radians(elevations))
    ray = chief_ray(light_path_of_design(design, view), slopes)
    width = light_width(ray, reciprocal_along_ray(slopes, distance), 1.0)
    shape = bundles.directions.shape
    starts = np.broadcast_to(bundles.places_mm, shape)
    trace = trace_sequential(
        instrument, path, bundles.directions.reshape(-1, 3), starts.reshape(-1, 3), apertures=False
    )
    corners = [starts, *(hit.reshape(shape) for hit in trace.hits)]
    corners.append(np.broadcast_to(bundles.points_mm[:, :, None], shape))
    places = bundles.places_mm[:, 0]
    per_place = places / (places @ places)
    # The traced ray leaves towards +x: the closed form's R, whose world side is positive, up to a sign.
    for place in range(len(path)):
        moved = np.abs(corners[place + 1][:, 0, :, 0] @ per_place)
        np.testing.assert_allclose(np.abs(width.radial[place]), moved, rtol=1e-4, atol=1e-7)
    for leg in range(len(path) + 1):
        start, end = corners[leg][:, 0], corners[leg + 1][:, 0]
        middle = start + 0.37 * (end - start)
        ahead = np.mean(end - start, axis=1)
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        aside = np.stack([-ahead[:, 2], np.zeros(3), ahead[:, 0]], axis=-1)
        # Each ray where it crosses the plane across the chief ray through the middle of the leg.
        heading = (end - start) / np.linalg.norm(end - start, axis=-1, keepdims=True)
        off = middle - middle.mean(axis=1, keepdims=True)
        along = np.einsum("npi,ni->np", off, ahead) / np.einsum("npi,ni->np", heading, ahead)
        across = np.einsum("npi,ni->np", off - along[..., None] * heading, aside)
        share = 0.37
        if leg == len(path):
            share = 0.37 * np.linalg.norm(np.mean(end - start, axis=1), axis=1)
        np.testing.assert_allclose(width.along_leg(leg, share), np.abs(across @ per_place), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("design", DESIGNS[:16])
def test_edges_of_the_full_light_lie_where_the_width_says(design):
    """Through the whole pupil: the mean of both sides within 0.01 mm, either within a twentieth and 0.05 mm."""
    radius = design.camera.pupil_radius_mm
    for view in VIEWS:
        recorded = getattr(design.views, view)
        instrument = build_instrument(design)
        path = instrument.path(recorded.path)
        elevations = np.array(recorded.elevation_deg)
        distance = design.working_volume.distance_mm[1]
        bundles = trace_bundles(design, view, elevations, [distance], rings=8)
        slopes = np.tan(np.radians(elevations))
        ray = chief_ray(light_path_of_design(design, view), slopes)
        width = light_width(ray, reciprocal_along_ray(slopes, distance), radius)
        shape = bundles.directions.shape
        starts = np.broadcast_to(bundles.places_mm, shape).reshape(-1, 3)
        trace = trace_sequential(instrument, path, bundles.directions.reshape(-1, 3), starts, apertures=False)
        outermost = np.abs(bundles.places_mm[:, 0]).max() / radius
        for place, hits in enumerate(trace.hits):
            across = np.hypot(*np.moveaxis(hits.reshape(shape)[:, 0, :, :2], -1, 0))
            middle = np.abs(ray.points[place][0])
            sides = np.stack([across.max(axis=1) - middle, middle - across.min(axis=1)]) / outermost
            expected = np.abs(width.radial[place])
            assert (np.abs(sides.mean(axis=0) - expected) < 0.01).all()
            assert (np.abs(sides - expected) < 0.05 + 0.05 * expected).all()


# --- one formula for arrays and symbols ---

VALUES = {
    "height": 90.0,
    "ratio": 0.4,
    "gain": 0.07,
    "viewpoint": -5.0,
    "slope": 0.2,
    "distance": 800.0,
    "principal": 13.0,
    "focus": 1.0 / 150.0,
}


def folded_numbers(height, ratio, gain, viewpoint, slope, distance, principal, focus):
    """Blur, widths and image of a folded view as an optimiser builds them, from floats, arrays or symbols."""
    below = gain * (height * (1.0 + ratio) - ratio * viewpoint) / (1.0 + gain * ratio)
    mirrors = (
        FocusingMirror(FocalConic(0.0, height, ratio)),
        FocusingMirror(FocalConic(viewpoint, below, gain * ratio), from_world=True),
    )
    ray = chief_ray(LightPath(mirrors, viewpoint, gain, "folded"), slope)
    reciprocal = reciprocal_along_ray(slope, distance)
    lens = FocusedLens(principal, 5.6, focus)
    width = light_width(ray, reciprocal, lens.pupil_diameter / 2.0)
    blur = lens.blur(reciprocal_image_depth(ray, reciprocal))
    return [blur, *width.across, *width.radial, width.along_leg(1, 0.3), width.along_leg(2, 5.0)]


def test_symbols_and_arrays_give_the_same_numbers_and_slopes():
    symbols = [ca.SX.sym(name) for name in VALUES]
    numbers = ca.vertcat(*folded_numbers(*symbols))
    given_values = np.array(list(VALUES.values()))
    evaluate = ca.Function("numbers", [ca.vertcat(*symbols)], [numbers, ca.jacobian(numbers, ca.vertcat(*symbols))])
    found, slopes = (np.array(part) for part in evaluate(given_values))
    np.testing.assert_allclose(found[:, 0], folded_numbers(*given_values), rtol=1e-13)
    for column, value in enumerate(given_values):
        step = 1e-5 * abs(value)
        ahead, behind = (
            np.array(folded_numbers(*(given_values + sign * step * np.eye(len(VALUES))[column]))) for sign in (1, -1)
        )
        np.testing.assert_allclose(slopes[:, column], (ahead - behind) / (2.0 * step), rtol=1e-6, atol=1e-8)
