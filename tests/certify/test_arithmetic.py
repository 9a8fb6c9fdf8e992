"""Intervals and affine forms hold every value that the operations take, and narrowing loses no design."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.certify import affine, intervals
from designer.optimise.operations import CODES, _operations


def build():
    """Operations of every code that a proof knows, on three variables."""
    x = casadi.SX.sym("x", 3)
    a, b, c = x[0], x[1], x[2]
    rows = [
        a * b - b * b + a,
        a / (2.5 + c * c),
        casadi.sqrt(1.0 + a * a) - casadi.fabs(b),
        casadi.fmax(a, b * c) - casadi.fmin(b, c),
        casadi.exp(-a * b) + casadi.atan(c),
        1.0 / (3.0 + casadi.fabs(a)),
        casadi.if_else(a < b, a * a, c),
        casadi.sqrt(casadi.fmax(a * c, 0.1)) * (a - b) * (a + b),
        -casadi.if_else(casadi.logic_or(casadi.logic_not(a <= c), casadi.logic_and(a < 0, b < 0)), b, 2 * c),
    ]
    return casadi.Function("rows", [x], [casadi.vertcat(*rows)]), _operations(x, rows)


FUNCTION, LISTED = build()
ENDS = st.floats(-2.0, 2.0)


def ranges(least, greatest):
    size = len(LISTED.codes)
    low, high = np.empty(size), np.empty(size)
    steps = (LISTED.codes, LISTED.first, LISTED.second, LISTED.constants)
    intervals.evaluate(*steps, low, high, least, greatest)
    return steps, low, high


def test_codes_are_those_of_the_lists():
    names = {name: getattr(intervals, name) for name in CODES}
    assert [name for name, _ in sorted(names.items(), key=lambda item: item[1])] == list(CODES)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(ENDS, st.floats(0.0, 1.5)), min_size=3, max_size=3), st.integers(0, 2**32 - 1))
def test_every_value_lies_in_its_range_and_in_its_form(box, seed):
    least = np.array([low for low, _ in box])
    greatest = np.array([low + width for low, width in box])
    steps, low, high = ranges(least, greatest)
    size = len(LISTED.codes)
    centres, errors, slopes = np.empty(size), np.empty(size), np.zeros((size, 3))
    before = low[LISTED.results].copy(), high[LISTED.results].copy()
    assert affine.form_all(*steps, low, high, centres, slopes, errors, least, greatest)
    # Forms tighten ranges, and never the other way.
    assert np.all(low[LISTED.results] >= before[0])
    assert np.all(high[LISTED.results] <= before[1])
    random = np.random.default_rng(seed)
    for share in [*random.random((8, 3)), np.zeros(3), np.ones(3)]:
        point = least + share * (greatest - least)
        values = np.array(FUNCTION(point)).ravel()
        # Rounding of the point's own evaluation, which is not outward.
        spare = 1e-13 * (1.0 + np.abs(values))
        assert np.all(low[LISTED.results] <= values + spare)
        assert np.all(high[LISTED.results] >= values - spare)
        e = 2.0 * share - 1.0
        at = centres[LISTED.results] + slopes[LISTED.results] @ e
        assert np.all(np.abs(values - at) <= errors[LISTED.results] + spare)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(ENDS, st.floats(0.0, 1.5)), min_size=3, max_size=3), st.integers(0, 2**32 - 1))
def test_narrowing_keeps_every_point_that_keeps_the_rules(box, seed):
    least = np.array([low for low, _ in box])
    greatest = np.array([low + width for low, width in box])
    random = np.random.default_rng(seed)
    points = [least + share * (greatest - least) for share in random.random((12, 3))]
    values = [np.array(FUNCTION(point)).ravel() for point in points]
    # The rules: every row at least what the first point gives, so that this one keeps them.
    required = values[0] - 1e-9
    steps, low, high = ranges(least, greatest)
    low[LISTED.results] = np.maximum(low[LISTED.results], required)
    narrow, wide = least.copy(), greatest.copy()
    assert intervals.propagate(*steps[:3], low, high, narrow, wide)
    for point, value in zip(points, values, strict=True):
        if np.all(value >= required):
            assert np.all(narrow <= point + 1e-12)
            assert np.all(wide >= point - 1e-12)


def test_forms_converge_faster_than_ranges():
    """Slopes of a b - b^2 + a cancel: halving a box divides the error of a form by four."""
    middle = np.array([0.7, 0.9, 0.4])
    excess = []
    for radius in (0.02, 0.01):
        least, greatest = middle - radius, middle + radius
        steps, low, high = ranges(least, greatest)
        size = len(LISTED.codes)
        centres, errors, slopes = np.empty(size), np.empty(size), np.zeros((size, 3))
        affine.form_all(*steps, low, high, centres, slopes, errors, least, greatest)
        excess.append(errors[LISTED.results[0]])
    assert excess[1] == pytest.approx(excess[0] / 4.0, rel=0.02)
