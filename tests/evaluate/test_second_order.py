"""The second order of the depth error: derived in symbols, integrated numerically, and over a working volume."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from designer.evaluate.depth import (
    FIRST_ORDER_BOUND,
    SECOND_ORDER_BOUND,
    StereoPair,
    Volume,
    depth_error_map,
    depth_error_rms,
    depth_error_rms_second_order,
    second_order,
    slopes_of_point,
)
from designer.optics.view import elevation_tangent, image_half_tangent, image_radius

CEILING = StereoPair(-0.05, "folded", 0.12, "direct", 60.0, 8.0)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)
CEILING_VOLUME = Volume((np.radians(-50.0), np.radians(-10.0)), (1000.0, 5000.0))


def moment(power: int) -> int:
    """E[z^n] of a standard normal z."""
    return 0 if power % 2 else int(sympy.factorial2(power - 1)) if power else 1


def test_the_mean_square_of_a_reciprocal_in_symbols():
    s, z = sympy.symbols("s z", positive=True)
    relative = sympy.series(1 / (1 + s * z) - 1, s, 0, 6).removeO()

    def mean(expression: sympy.Expr) -> sympy.Expr:
        terms = sympy.Poly(sympy.expand(expression), z).terms()
        return sympy.expand(sum(value * moment(power) for (power,), value in terms))

    def up_to(expression: sympy.Expr, order: int) -> sympy.Expr:
        return sympy.series(expression, s, 0, order + 1).removeO()

    bias, mean_square = mean(relative), mean(relative**2)
    assert up_to(bias, 2) == s**2
    assert sympy.expand(up_to(mean_square - bias**2, 4) - s**2 * (1 + 8 * s**2)) == 0
    assert sympy.expand(up_to(mean_square, 6) - s**2 * (1 + 9 * s**2 + 75 * s**4)) == 0
    assert second_order(0.1) == pytest.approx(float(sympy.sqrt(up_to(mean_square, 4).subs(s, sympy.Rational(1, 10)))))


def mean_square_of_two_noises(derivatives: dict[tuple[int, int], sympy.Expr], sigma: sympy.Expr) -> sympy.Expr:
    """E[f^2] to sigma^4 for f(0) = 0 and two independent Gaussians: the heat kernel exp(sigma^2 Laplace / 2) on f^2."""

    def at(i: int, j: int) -> sympy.Expr:
        return derivatives[i, j]

    gradient = at(1, 0) ** 2 + at(0, 1) ** 2
    bend = at(2, 0) ** 2 + 2 * at(1, 1) ** 2 + at(0, 2) ** 2
    laplace = at(2, 0) + at(0, 2)
    drift = at(1, 0) * (at(3, 0) + at(1, 2)) + at(0, 1) * (at(2, 1) + at(0, 3))
    return sigma**2 * gradient + sigma**4 * (bend / 2 + drift + laplace**2 / 4)


def test_two_noisy_slopes_give_the_same_as_one_noisy_disparity():
    x, y, lower, upper, disparity, sigma = sympy.symbols("x y lower upper disparity sigma", positive=True)
    error = disparity / (disparity + lower * x - upper * y) - 1
    derivatives = {
        (i, j): sympy.diff(error, x, i, y, j).subs({x: 0, y: 0}) for i in range(4) for j in range(4) if 0 < i + j <= 3
    }
    first = sigma**2 * (lower**2 + upper**2) / disparity**2
    assert sympy.simplify(mean_square_of_two_noises(derivatives, sigma) - first * (1 + 9 * first)) == 0


def true_error(first_order: float) -> float:
    """Root mean square of 1/(1 + x) - 1 for Gaussian x, by quadrature over nine tenths of the way to the pole."""
    reach = min(9.0, 0.9 / first_order)
    z = reach * NODES
    density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) * reach * WEIGHTS
    return float(np.sqrt(np.sum(density * (1 / (1 + first_order * z) - 1) ** 2)))


def test_the_bounds_are_where_the_orders_are_two_percent_off():
    for bound, said in ((FIRST_ORDER_BOUND, lambda s: s), (SECOND_ORDER_BOUND, second_order)):
        assert true_error(bound) / said(bound) - 1 == pytest.approx(0.02, abs=6e-4)
        assert true_error(bound) / said(bound) < 1.02
        assert true_error(bound + 0.002) / said(bound + 0.002) > 1.02


@given(st.floats(1e-6, SECOND_ORDER_BOUND))
def test_second_order_lies_between_first_order_and_the_truth(error):
    assert error < second_order(error) <= true_error(error) * (1 + 1e-9)


def test_over_a_volume_against_noisy_image_radii():
    """No derivative: radii with noise, back through the gain law; worst points beyond where first order holds."""
    noise, count = 7.5e-4, 300_000
    generator = np.random.default_rng(11)
    elevations = generator.uniform(*CEILING_VOLUME.elevations, count)
    distances = np.exp(generator.uniform(*np.log(CEILING_VOLUME.distances), count))
    assert FIRST_ORDER_BOUND < np.max(depth_error_map(CEILING, elevations, distances, noise)) < SECOND_ORDER_BOUND
    slopes = []
    true_slopes = slopes_of_point(np.tan(elevations), distances, CEILING.baseline)
    for gain, sense, slope in (
        (CEILING.gain_lower, CEILING.sense_lower, true_slopes.lower),
        (CEILING.gain_upper, CEILING.sense_upper, true_slopes.upper),
    ):
        radius = image_radius(slope, gain, CEILING.principal_distance, sense) + noise * generator.normal(size=count)
        slopes.append(elevation_tangent(image_half_tangent(radius, CEILING.principal_distance) / gain, sense))
    errors = CEILING.baseline / (slopes[0] - slopes[1]) / distances - 1
    measured = float(np.sqrt(np.mean(errors**2)))
    corrected = depth_error_rms_second_order(CEILING, CEILING_VOLUME, noise)
    assert measured == pytest.approx(corrected, rel=0.006)
    assert depth_error_rms(CEILING, CEILING_VOLUME, noise) < 0.986 * measured


@pytest.mark.parametrize("noise", [1e-6, 2e-4, 6e-4])
def test_quadrature_over_a_volume(noise):
    elevations = np.linspace(*CEILING_VOLUME.elevations, 501)
    distances = np.geomspace(*CEILING_VOLUME.distances, 501)
    squares = second_order(depth_error_map(CEILING, elevations[:, None], distances, noise)) ** 2
    mean = np.trapezoid(np.trapezoid(squares, axis=1), axis=0) / 500**2
    assert depth_error_rms_second_order(CEILING, CEILING_VOLUME, noise) == pytest.approx(float(np.sqrt(mean)), rel=1e-4)
