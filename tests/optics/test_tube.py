"""A tube's wall in closed form: against rays traced through it, and against Fresnel's equations as angles."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import View
from designer.housing import Tube
from designer.optics.tube import (
    Wall,
    distance_of,
    index_in_projection,
    shift_along_axis,
    shift_along_radius,
    transmitted,
    turn_in_projection,
    uncorrected_bias,
    wall_of,
)
from designer.trace.bundles import pinhole_directions
from designer.trace.housing import refract
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.housings import with_tube
from support.studied_designs import SHARP_NAMES, sharp_design

indices, walls, elevations = st.floats(1.2, 2.5), st.floats(0.2, 20.0), st.floats(-1.4, 1.4)


def asked_angles(view: View, count: int) -> np.ndarray:
    """Pinhole angles (n,) of rays over the elevations asked of a view, evenly spaced in slope, by the gain law."""
    slopes = np.linspace(*np.tan(np.radians(view.elevation_deg)), count)
    turned = np.arctan(slopes) if view.sense == "direct" else -np.arctan(slopes)
    return 2.0 * np.arctan(view.gain * np.tan(np.pi / 4.0 + turned / 2.0))


@given(indices, walls, elevations)
def test_the_shift_is_that_of_a_plate_by_its_angles(index, thickness, elevation):
    """Within the plate the ray is less steep: it gains less height over the same thickness."""
    inside = math.asin(math.sin(elevation) / index)
    rise = thickness * (math.tan(inside) - math.tan(elevation))
    wall = Wall(thickness, index)
    assert shift_along_axis(math.tan(elevation), wall) == pytest.approx(rise, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", SHARP_NAMES[::3])
@pytest.mark.parametrize("index", [1.49, 1.8])
def test_the_distance_is_exact_in_the_meridional_plane(name, index):
    """Where rays of the two views, traced through mirrors and wall, cross, against the closed form: 2e-8 mm."""
    design = with_tube(sharp_design(name), wall_mm=4.0, refractive_index=index)
    instrument = build_instrument(design)
    feet, slopes = {}, {}
    for view, recorded in design.views.by_name.items():
        ahead = pinhole_directions(asked_angles(recorded, 7))
        trace = trace_sequential(instrument, instrument.path(recorded.path), ahead, apertures=False)
        through = refract(design.tube, trace.point, trace.direction)
        radial = np.hypot(through.direction[:, 0], through.direction[:, 1])
        slopes[view] = through.direction[:, 2] / radial
        feet[view] = through.at_outer[:, 2] - slopes[view] * np.hypot(through.at_outer[:, 0], through.at_outer[:, 1])
    lower, upper = np.meshgrid(slopes["lower"], slopes["upper"])
    foot_lower, foot_upper = np.meshgrid(feet["lower"], feet["upper"])
    crosses = lower - upper > design.baseline_mm / 2e4
    crossing = (foot_upper - foot_lower)[crosses] / (lower - upper)[crosses]
    predicted = distance_of(lower[crosses], upper[crosses], design.baseline_mm, wall_of(design))
    near = crossing < 1000.0
    assert near.sum() >= 3
    assert np.abs(predicted - crossing)[near].max() < 2e-8
    np.testing.assert_allclose(predicted, crossing, rtol=2e-11)
    # What a rig that does not know the tube would say.
    plain = distance_of(lower[crosses], upper[crosses], design.baseline_mm)
    bias = uncorrected_bias(lower[crosses], upper[crosses], wall_of(design))
    np.testing.assert_allclose(plain - crossing, bias, atol=1e-6)
    assert (bias < 0.0).all()
    assert (bias > -4.0).all()


@settings(deadline=None)
@given(indices, st.floats(0.5, 8.0), elevations, st.floats(-0.9, 0.9), st.floats(8.0, 200.0))
def test_a_skew_ray_is_turned_as_its_projection_is(index, thickness, elevation, share, inner):
    tube = Tube(kind="tube", inner_radius_mm=inner, wall_mm=thickness, refractive_index=index, low_mm=-1e5, high_mm=1e5)
    offset = share * inner
    ahead = np.array([[math.cos(elevation), 0.0, math.sin(elevation)]])
    through = refract(tube, np.array([[0.0, offset, 0.0]]), ahead)
    turned = math.atan2(through.direction[0, 1], through.direction[0, 0])
    wall = Wall(thickness, index)
    assert turned == pytest.approx(turn_in_projection(offset, math.tan(elevation), inner, wall), abs=1e-9)
    # A thin lens of the power that the docstring gives, near the axis.
    small = turn_in_projection(1e-4 * inner, math.tan(elevation), inner, wall)
    power = shift_along_radius(math.tan(elevation), wall) / (inner * tube.outer_radius_mm)
    assert small == pytest.approx(1e-4 * inner * power, rel=1e-6)


def test_the_chief_rays_of_a_coaxial_tube_keep_their_column():
    """Epipolar geometry is untouched: every ray through the pinhole leaves in its own meridional plane."""
    design = with_tube(sharp_design(SHARP_NAMES[3]), wall_mm=5.0)
    instrument = build_instrument(design)
    random = np.random.default_rng(5)
    for view in design.views.by_name.values():
        azimuth = random.uniform(-np.pi, np.pi, 200)
        ahead = pinhole_directions(asked_angles(view, 200), azimuth)
        trace = trace_sequential(instrument, instrument.path(view.path), ahead, apertures=False)
        through = refract(design.tube, trace.point, trace.direction)
        across = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros(200)], axis=-1)
        assert np.abs(np.einsum("ni,ni->n", through.direction, across)).max() < 1e-12
        assert np.abs(np.einsum("ni,ni->n", through.at_outer, across)).max() < 1e-10


@given(indices, st.floats(-1.5, 1.5))
def test_transmission_is_fresnels(index, elevation):
    angle = abs(elevation)
    inside = math.asin(math.sin(angle) / index)
    if angle < 1e-6:
        across = along = ((index - 1.0) / (index + 1.0)) ** 2
    else:
        across = (math.sin(angle - inside) / math.sin(angle + inside)) ** 2
        along = (math.tan(angle - inside) / math.tan(angle + inside)) ** 2
    # Light that goes to and fro within the wall, summed reflection by reflection.
    expected = np.mean([sum((1.0 - r) ** 2 * r ** (2 * bounce) for bounce in range(400)) for r in (across, along)])
    assert transmitted(math.tan(elevation), index) == pytest.approx(expected, rel=1e-6)


def test_symbols_give_what_numbers_give():
    slope, other, index, thickness = (casadi.SX.sym(name) for name in ("slope", "other", "index", "thickness"))
    values = (0.3, -0.2, 1.52, 2.5)
    wall, numbers = Wall(thickness, index), Wall(values[3], values[2])
    for symbolic, plain in (
        (distance_of(slope, other, 80.0, wall), distance_of(values[0], values[1], 80.0, numbers)),
        (turn_in_projection(2.0, slope, 20.0, wall), turn_in_projection(2.0, values[0], 20.0, numbers)),
        (transmitted(slope, index), transmitted(values[0], values[2])),
        (index_in_projection(slope, index), index_in_projection(values[0], values[2])),
    ):
        function = casadi.Function("f", [slope, other, index, thickness], [symbolic])
        assert float(function(*values)) == pytest.approx(float(plain), rel=1e-14)
