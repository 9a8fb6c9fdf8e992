"""A conic seen from a focus, against the tracer's surfaces: points, reflection, the gain law, both notations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.design import Design, Mirror
from designer.optics.conic import FocalConic, conic_constant
from designer.trace.instrument import build_instrument, sag
from designer.trace.sequential import trace_sequential

# Inverse gains of every kind: convex hyperboloid, plane, concave hyperboloid, paraboloid, and the two ellipsoids.
tangent_ratios = st.one_of(
    st.floats(1.01, 60.0),
    st.just(1.0),
    st.floats(0.02, 0.99),
    st.just(0.0),
    st.floats(-0.97, -0.03),
    st.floats(-60.0, -1.03),
)
# Reach as a share of where the vertex sheet ends for a ray from the focus, abs(mu) t^2 = 1.
reaches = st.floats(0.02, 0.98)


def mirror_of(conic: FocalConic) -> Mirror:
    """The conic as opticians write it, facing its focus; its aperture is left out of account."""
    surface = conic.surface
    is_plane = conic.tangent_ratio == 1.0
    return Mirror(
        name="mirror",
        kind="plane" if is_plane else "hyperboloid",
        vertex_mm=surface.vertex_height,
        radius_mm=None if is_plane else 1.0 / surface.curvature,
        conic=0.0 if is_plane else conic_constant(conic.tangent_ratio),
        inner_radius_mm=0.0,
        outer_radius_mm=1e-3,
        thickness_mm=0.0,
        faces="down" if conic.vertex_distance > 0 else "up",
    )


def half_tangent_at(conic: FocalConic, reach: float) -> float:
    return reach * min(1.0, abs(conic.tangent_ratio) ** -0.5 if conic.tangent_ratio else 1.0)


@given(tangent_ratios, st.floats(-200.0, 200.0), st.floats(5.0, 150.0), st.sampled_from([-1.0, 1.0]), reaches)
def test_points_lie_on_the_surface(tangent_ratio, focus, distance, side, reach):
    conic = FocalConic(focus, side * distance, tangent_ratio)
    radius, height = conic.point(half_tangent_at(conic, reach))
    assert height == pytest.approx(conic.surface.height(radius), rel=1e-9, abs=1e-9)
    mirror = mirror_of(conic)
    assert height == pytest.approx(mirror.vertex_mm + float(sag(mirror, radius)), rel=1e-9, abs=1e-7)


@given(tangent_ratios, st.floats(5.0, 150.0), reaches)
def test_points_lie_on_the_ray_from_the_focus(tangent_ratio, distance, reach):
    conic = FocalConic(-3.0, distance, tangent_ratio)
    tangent = half_tangent_at(conic, reach)
    radius, height = conic.point(tangent)
    assert np.arctan2(abs(radius), height + 3.0) == pytest.approx(2.0 * np.arctan(tangent), abs=1e-12)


@given(tangent_ratios, st.floats(5.0, 150.0), reaches, st.floats(0.0, 6.28))
def test_the_tracer_sends_rays_of_one_focus_through_the_other_with_the_gain(tangent_ratio, distance, reach, azimuth):
    conic = FocalConic(0.0, distance, tangent_ratio)
    tangent = half_tangent_at(conic, reach)
    radius, _ = conic.point(tangent)
    instrument = build_instrument(_design_with(mirror_of(conic)))
    psi = 2.0 * np.arctan(tangent)
    ray = np.array([[np.sin(psi) * np.cos(azimuth), np.sin(psi) * np.sin(azimuth), np.cos(psi)]])
    trace = trace_sequential(instrument, [0], ray, apertures=False)
    point, direction = trace.point[0], trace.direction[0]
    assert np.hypot(point[0], point[1]) == pytest.approx(abs(radius), rel=1e-8, abs=1e-9)
    if tangent_ratio == 0.0:
        assert direction == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)
        return
    other = np.array([0.0, 0.0, conic.other_focus_height])
    miss = np.linalg.norm(np.cross(other - point, direction))
    assert miss == pytest.approx(0.0, abs=1e-8 * max(1.0, float(np.linalg.norm(other - point))))
    # t_A = kappa t_B, with t_B half the angle, at B, between the direction to A and the direction to the world.
    towards_axis = np.sign(radius) * (direction[0] * np.cos(azimuth) + direction[1] * np.sin(azimuth))
    at_other = np.arctan2(towards_axis, -direction[2])
    assert np.tan(at_other / 2.0) / tangent_ratio == pytest.approx(tangent, rel=1e-7, abs=1e-10)


@given(tangent_ratios.filter(lambda value: value not in (0.0,)), st.floats(5.0, 150.0), reaches)
def test_both_foci_tell_the_same_conic(tangent_ratio, distance, reach):
    conic = FocalConic(2.0, distance, tangent_ratio)
    other = conic.other_focus_height
    mirrored = FocalConic(other, conic.surface.vertex_height - other, 1.0 / tangent_ratio)
    for name in ("vertex_height", "curvature", "conic_term"):
        expected = getattr(conic.surface, name)
        assert getattr(mirrored.surface, name) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    tangent = half_tangent_at(conic, reach)
    radius, height = conic.point(tangent)
    assert mirrored.point(-tangent * tangent_ratio) == pytest.approx((radius, height), rel=1e-7, abs=1e-7)


@given(tangent_ratios.filter(lambda value: value != 1.0))
def test_the_conic_constant_is_minus_the_squared_eccentricity(tangent_ratio):
    q = (tangent_ratio - 1.0) / (tangent_ratio + 1.0)
    assert conic_constant(tangent_ratio) == pytest.approx(-1.0 / q**2 if tangent_ratio else -1.0, rel=1e-12)
    surface = FocalConic(0.0, 30.0, tangent_ratio).surface
    assert surface.conic_term == pytest.approx(
        (1.0 + conic_constant(tangent_ratio)) * surface.curvature**2, rel=1e-9, abs=1e-12
    )


def _design_with(mirror: Mirror) -> Design:
    view = {"path": ["mirror"], "viewpoint_mm": 0.0, "gain": 1.0, "sense": "direct", "elevation_deg": [0, 1]}
    return Design.model_validate(
        {
            "configuration": "one mirror",
            "camera": {
                "focal_length_mm": 12.0,
                "pixel_pitch_mm": 0.004,
                "width_px": 1600,
                "height_px": 1200,
                "f_number": 8.0,
                "lens_radius_mm": 7.0,
                "lens_front_mm": 3.0,
                "lens_length_mm": 40.0,
                "body_radius_mm": 20.0,
            },
            "mirrors": [mirror.model_dump()],
            "views": {"upper": view | {"zone": "outer"}, "lower": view | {"zone": "inner"}},
            "baseline_mm": 0.0,
            "height_mm": 1.0,
            "diameter_mm": 1.0,
            "working_volume": {"elevation_deg": [0, 1], "distance_mm": [100, 200]},
            "noise_px": 0.1,
        }
    )
