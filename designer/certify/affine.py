"""Affine forms (Comba and Stolfi, 1993) of a list of operations over a box, in compiled loops.

Each operation is held as centre + sum of coefficient e + error, with one e in -1..1 for each variable of the box: two
quantities that move together then cancel where they are subtracted, which plain intervals do not know. What is not
linear, and rounding, goes into the error. Forms and ranges tighten each other. Shapes as in
:mod:`designer.certify.intervals`; ``centres`` and ``errors`` have a number for each operation, ``slopes`` a row.
"""

from __future__ import annotations

import math

from designer.certify.intervals import (
    ADD,
    ATAN,
    CONST,
    DIV,
    EXP,
    FABS,
    FMAX,
    FMIN,
    IF_ELSE_ZERO,
    INFINITE,
    INPUT,
    INV,
    MUL,
    NEG,
    SQ,
    SQRT,
    SUB,
    above,
    compiled,
    inlined,
)

# More than all rounding errors of one operation on a form of a dozen numbers, relative.
ROUNDING = 2.0**-46
HUGE = 1e300


@compiled
def _enclosed(function, slope, a, b, touch):
    """The range of f(x) - slope x over [a, b], for a convex or concave f of that slope at ``touch``."""
    value_a, value_b = _value(function, a), _value(function, b)
    at_a, at_b, between = value_a - slope * a, value_b - slope * b, _value(function, touch) - slope * touch
    padding = ROUNDING * (abs(value_a) + abs(value_b) + abs(slope) * max(abs(a), abs(b)))
    return min(at_a, at_b, between) - padding, max(at_a, at_b, between) + padding


@compiled
def _value(function, x):
    if function == INV:
        return 1.0 / x
    if function == SQ:
        return x * x
    if function == SQRT:
        return math.sqrt(x)
    return math.exp(x)


@compiled
def _line(function, a, b):
    """Slope and range of the rest of a straight line beside a function over [a, b]; False where there is none."""
    if function == INV:
        if not (a > 0.0 or b < 0.0):
            return False, 0.0, 0.0, 0.0
        slope = -1.0 / (a * b)
        touch = math.copysign(math.sqrt(abs(a)) * math.sqrt(abs(b)), a)
    elif function == SQ:
        slope = a + b
        touch = 0.5 * slope
    elif function == SQRT:
        if b <= 0.0:
            return False, 0.0, 0.0, 0.0
        a = max(a, 0.0)
        slope = 1.0 / (math.sqrt(a) + math.sqrt(b))
        touch = 0.25 / (slope * slope)
    elif function == EXP:
        slope = (math.exp(b) - math.exp(a)) / (b - a) if b > a else math.exp(a)
        if not 0.0 < slope < HUGE:
            return False, 0.0, 0.0, 0.0
        touch = math.log(slope)
    elif function == FABS:
        if a >= 0.0:
            return True, 1.0, 0.0, 0.0
        if b <= 0.0:
            return True, -1.0, 0.0, 0.0
        slope = (b + a) / (b - a)
        rest = max(-a - slope * a, b - slope * b) + ROUNDING * max(-a, b)
        return True, slope, 0.0, rest
    else:
        nearest = 0.0 if a <= 0.0 <= b else min(abs(a), abs(b))
        farthest = max(abs(a), abs(b))
        least = (1.0 - ROUNDING) / (1.0 + farthest * farthest)
        greatest = (1.0 + ROUNDING) / (1.0 + nearest * nearest)
        slope, middle = 0.5 * (least + greatest), 0.5 * a + 0.5 * b
        rest = math.atan(middle) - slope * middle
        spread = 0.5 * (greatest - least) * max(b - middle, middle - a) * (1.0 + ROUNDING)
        spread += ROUNDING * (2.0 + slope * farthest)
        return True, slope, rest - spread, rest + spread
    least, greatest = _enclosed(function, slope, a, b, min(max(touch, a), b))
    return True, slope, least, greatest


@inlined
def _sum(centres, slopes, errors, k, i, j, sign):
    centre = centres[i] + sign * centres[j]
    size = abs(centre)
    for t in range(slopes.shape[1]):
        slopes[k, t] = slopes[i, t] + sign * slopes[j, t]
        size += abs(slopes[k, t])
    return centre, (errors[i] + errors[j]) * (1.0 + ROUNDING) + ROUNDING * size


@inlined
def _product(centres, slopes, errors, k, i, j, factor, centre, error):
    """The product of form i with the form of given centre and error whose slopes are ``factor`` times those of j."""
    reach_i, reach_j, both, size = errors[i], error, 0.0, 0.0
    for t in range(slopes.shape[1]):
        x, y = slopes[i, t], factor * slopes[j, t]
        reach_i += abs(x)
        reach_j += abs(y)
        # e times itself is in 0..1, not in -1..1.
        both += x * y
        size += abs(x * y)
        slopes[k, t] = centres[i] * y + centre * x
    rest = abs(centres[i]) * error + abs(centre) * errors[i] + max(reach_i * reach_j - 0.5 * size, 0.0)
    rounding = ROUNDING * (abs(centres[i]) + reach_i) * (abs(centre) + reach_j)
    return centres[i] * centre + 0.5 * both, rest * (1.0 + ROUNDING) + rounding


@inlined
def _larger(centres, slopes, errors, low, high, k, i, j, sign):
    """The larger (sign +1) or the smaller (-1) of two forms."""
    count = slopes.shape[1]
    reach, size = errors[i] + errors[j], abs(centres[i]) + abs(centres[j])
    for t in range(count):
        reach += abs(slopes[i, t] - slopes[j, t])
        size += abs(slopes[i, t]) + abs(slopes[j, t])
    reach = reach * (1.0 + ROUNDING) + ROUNDING * size
    # s (i - j): i counts where it is positive.
    apart = sign * (centres[i] - centres[j])
    least = max(apart - reach, low[i] - high[j] if sign > 0.0 else low[j] - high[i])
    greatest = min(apart + reach, high[i] - low[j] if sign > 0.0 else high[j] - low[i])
    if least >= 0.0 or greatest <= 0.0:
        winner = i if least >= 0.0 else j
        for t in range(count):
            slopes[k, t] = slopes[winner, t]
        return centres[winner], errors[winner]
    if not greatest - least < HUGE:
        return 0.0, INFINITE
    share = greatest / (greatest - least)
    rest = max(-share * least, (1.0 - share) * greatest) * (1.0 + ROUNDING) + ROUNDING * size
    centre = centres[j] + share * (centres[i] - centres[j]) + sign * 0.5 * rest
    for t in range(count):
        slopes[k, t] = slopes[j, t] + share * (slopes[i, t] - slopes[j, t])
    error = (share * errors[i] + (1.0 - share) * errors[j]) * (1.0 + ROUNDING)
    return centre, error + 0.5 * rest * (1.0 + ROUNDING) + 2.0 * ROUNDING * size


@inlined
def _bent(code, centres, slopes, errors, low, high, k, i, j):
    """A function of one form, or the quotient of two."""
    of = j if code == DIV else i
    exists, slope, least, greatest = _line(INV if code == DIV else code, low[of], high[of])
    if not exists:
        return 0.0, INFINITE
    size = abs(centres[of]) + errors[of]
    for t in range(slopes.shape[1]):
        size += abs(slopes[of, t])
    centre = slope * centres[of] + 0.5 * (least + greatest)
    error = (abs(slope) * errors[of] + 0.5 * (greatest - least)) * (1.0 + ROUNDING)
    error += ROUNDING * (abs(slope) * size + abs(least) + abs(greatest))
    if code == DIV:
        return _product(centres, slopes, errors, k, i, j, slope, centre, error)
    for t in range(slopes.shape[1]):
        slopes[k, t] = slope * slopes[of, t]
    return centre, error


@inlined
def _form(code, centres, slopes, errors, low, high, k, i, j):
    """Centre and error of one operation, its slopes put in place; an infinite error where there is no form."""
    if code in (ADD, SUB):
        return _sum(centres, slopes, errors, k, i, j, 1.0 if code == ADD else -1.0)
    if code == MUL:
        return _product(centres, slopes, errors, k, i, j, 1.0, centres[j], errors[j])
    if code in (FMAX, FMIN):
        return _larger(centres, slopes, errors, low, high, k, i, j, 1.0 if code == FMAX else -1.0)
    if code in (DIV, INV, SQ, SQRT, EXP, FABS, ATAN):
        return _bent(code, centres, slopes, errors, low, high, k, i, j)
    if code == NEG:
        for t in range(slopes.shape[1]):
            slopes[k, t] = -slopes[i, t]
        return -centres[i], errors[i]
    if code == IF_ELSE_ZERO and low[i] == 1.0:
        for t in range(slopes.shape[1]):
            slopes[k, t] = slopes[j, t]
        return centres[j], errors[j]
    return 0.0, INFINITE  # comparisons, and what they leave open


@inlined
def _settle(centres, slopes, errors, low, high, k):
    """Let form and range of one operation tighten each other; False if nothing is left."""
    count = slopes.shape[1]
    reach = errors[k]
    for t in range(count):
        reach += abs(slopes[k, t])
    reach = reach * (1.0 + ROUNDING) + ROUNDING * abs(centres[k])
    if abs(centres[k]) + reach < HUGE:
        low[k], high[k] = max(low[k], centres[k] - reach), min(high[k], centres[k] + reach)
        if 0.5 * (high[k] - low[k]) >= 0.5 * reach:
            return low[k] <= high[k]
    # The range alone says more.
    for t in range(count):
        slopes[k, t] = 0.0
    if low[k] > -HUGE and high[k] < HUGE:
        middle = 0.5 * low[k] + 0.5 * high[k]
        centres[k], errors[k] = middle, above(max(high[k] - middle, middle - low[k]))
    else:
        centres[k], errors[k] = 0.0, INFINITE
    return low[k] <= high[k]


@compiled
def form_all(codes, first, second, constants, low, high, centres, slopes, errors, least, greatest):
    """Find the form of every operation over a box; ``low`` and ``high`` hold ranges, and are tightened.

    False if nothing is left of the box.
    """
    for k in range(codes.size):
        code, i, j = codes[k], first[k], second[k]
        if code in (CONST, INPUT):
            for t in range(slopes.shape[1]):
                slopes[k, t] = 0.0
            errors[k] = 0.0
            if code == CONST:
                centres[k] = constants[k]
            else:
                middle = 0.5 * least[i] + 0.5 * greatest[i]
                centres[k] = middle
                slopes[k, i] = above(max(greatest[i] - middle, middle - least[i]))
            continue
        centres[k], errors[k] = _form(code, centres, slopes, errors, low, high, k, i, j)
        if not _settle(centres, slopes, errors, low, high, k):
            return False
    return True
