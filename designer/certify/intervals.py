"""Operations on intervals, outward rounded, in compiled loops: what a list of operations can give over a box.

Forwards from the variables' ranges to every result, and backwards from what results must be to narrower ranges (the
constraint propagation of Benhamou and others, 1999, called HC4). Every bound is moved outward by at least the error
of one rounded operation, so that no bound depends on rounding. ``codes``, ``first``, ``second`` and ``constants`` are
those of :class:`designer.optimise.operations.Operations`; ``low`` and ``high`` hold a range for each operation.
"""

from __future__ import annotations

import math

from numba import njit

# The numbers of designer.optimise.operations.CODES, which a test compares.
CONST, INPUT, ADD, SUB, MUL, DIV, NEG, SQ, SQRT, INV, FABS, FMAX, FMIN, EXP, ATAN = range(15)
LT, LE, NOT, AND, OR, IF_ELSE_ZERO = range(15, 21)

SPACING = 2.0**-52
SMALLEST = 1e-300
INFINITE = math.inf
compiled = njit(cache=True, nogil=True, error_model="numpy")
inlined = njit(inline="always", cache=True, nogil=True, error_model="numpy")


@compiled
def below(value):
    """A number below all that round to a value."""
    return value - abs(value) * SPACING - SMALLEST if abs(value) < 1e308 else value


@compiled
def above(value):
    """A number above all that round to a value."""
    return value + abs(value) * SPACING + SMALLEST if abs(value) < 1e308 else value


@compiled
def product(a, b, c, d):
    """The product of [a, b] and [c, d]; zero times infinity is zero."""
    low, high = INFINITE, -INFINITE
    for x in (a, b):
        for y in (c, d):
            corner = 0.0 if x == 0.0 or y == 0.0 else x * y
            low, high = min(low, corner), max(high, corner)
    return below(low), above(high)


@compiled
def reciprocal(a, b):
    """The reciprocals of [a, b]; everything where it holds zero inside."""
    if a > 0.0 or b < 0.0:
        return below(1.0 / b), above(1.0 / a)
    if a == 0.0 and b > 0.0:
        return below(1.0 / b), INFINITE
    if b == 0.0 and a < 0.0:
        return -INFINITE, above(1.0 / a)
    return -INFINITE, INFINITE


@compiled
def quotient(a, b, c, d):
    """The quotients of [a, b] by [c, d]."""
    low, high = reciprocal(c, d)
    return product(a, b, low, high)


@compiled
def magnitude(a, b):
    """The absolute values of [a, b]."""
    if a >= 0.0:
        return a, b
    if b <= 0.0:
        return -b, -a
    return 0.0, max(-a, b)


@compiled
def _exponential(a, b):
    low, high = math.exp(a), math.exp(b)
    return max(low - 4.0 * SPACING * low, 0.0), high + 4.0 * SPACING * high + SMALLEST


@compiled
def _truth(code, a, b, c, d):
    """Comparisons and logic: 0, 1, or both."""
    if code == LT:
        return (1.0 if b < c else 0.0), (0.0 if a >= d else 1.0)
    if code == LE:
        return (1.0 if b <= c else 0.0), (0.0 if a > d else 1.0)
    if code == NOT:
        return 1.0 - b, 1.0 - a
    if code == AND:
        return min(a, c), min(b, d)
    return max(a, c), max(b, d)


@compiled
def evaluate(codes, first, second, constants, low, high, least, greatest):
    """Fill ``low`` and ``high`` with the range of every operation over the box from ``least`` to ``greatest``."""
    for k in range(codes.size):
        code, i, j = codes[k], first[k], second[k]
        if code == CONST:
            low[k] = high[k] = constants[k]
            continue
        if code == INPUT:
            low[k], high[k] = least[i], greatest[i]
            continue
        a, b, c, d = low[i], high[i], low[j], high[j]
        if code == ADD:
            x, y = below(a + c), above(b + d)
        elif code == SUB:
            x, y = below(a - d), above(b - c)
        elif code == MUL:
            x, y = product(a, b, c, d)
        elif code == DIV:
            x, y = quotient(a, b, c, d)
        elif code == NEG:
            x, y = -b, -a
        elif code == SQ:
            x, y = magnitude(a, b)
            x, y = max(below(x * x), 0.0), above(y * y)
        elif code == SQRT:
            if b < 0.0:
                x, y = -INFINITE, INFINITE
            else:
                x, y = max(below(math.sqrt(max(a, 0.0))), 0.0), above(math.sqrt(b))
        elif code == INV:
            x, y = reciprocal(a, b)
        elif code == FABS:
            x, y = magnitude(a, b)
        elif code == FMAX:
            x, y = max(a, c), max(b, d)
        elif code == FMIN:
            x, y = min(a, c), min(b, d)
        elif code == EXP:
            x, y = _exponential(a, b)
        elif code == ATAN:
            x, y = math.atan(a) - 8.0 * SPACING, math.atan(b) + 8.0 * SPACING
        elif code == IF_ELSE_ZERO:
            if a == 1.0:
                x, y = c, d
            elif b == 0.0:
                x, y = 0.0, 0.0
            else:
                x, y = min(c, 0.0), max(d, 0.0)
        else:
            x, y = _truth(code, a, b, c, d)
        low[k] = -INFINITE if math.isnan(x) else x
        high[k] = INFINITE if math.isnan(y) else y


@inlined
def _meet(low, high, k, x, y):
    if x > low[k]:
        low[k] = x
    if y < high[k]:
        high[k] = y


@inlined
def _narrow_square(low, high, i, x, y):
    """Narrow an operand from the range of its square."""
    root, least = above(math.sqrt(y)), max(below(math.sqrt(max(x, 0.0))), 0.0)
    if low[i] >= 0.0:
        _meet(low, high, i, least, root)
    elif high[i] <= 0.0:
        _meet(low, high, i, -root, -least)
    else:
        _meet(low, high, i, -root, root)


@inlined
def _narrow_factors(low, high, i, j, x, y):
    """Narrow both factors from the range of their product."""
    if low[j] > 0.0 or high[j] < 0.0:
        u, v = quotient(x, y, low[j], high[j])
        _meet(low, high, i, u, v)
    if low[i] > 0.0 or high[i] < 0.0:
        u, v = quotient(x, y, low[i], high[i])
        _meet(low, high, j, u, v)


@inlined
def _narrow_ratio(low, high, i, j, x, y):
    """Narrow dividend and divisor from the range of their quotient."""
    if low[j] > 0.0 or high[j] < 0.0:
        u, v = product(x, y, low[j], high[j])
        _meet(low, high, i, u, v)
    if x > 0.0 or y < 0.0:
        u, v = quotient(low[i], high[i], x, y)
        _meet(low, high, j, u, v)


@compiled
def _narrow_one(code, low, high, i, x, y):
    """Narrow the operand of an operation on one; whether anything is left."""
    if code == NEG:
        _meet(low, high, i, -y, -x)
    elif code == SQ:
        if y < 0.0:
            return False
        _narrow_square(low, high, i, x, y)
    elif code == SQRT:
        if y < 0.0:
            return False
        _meet(low, high, i, below(x * x) if x > 0.0 else -INFINITE, above(y * y))
    elif code == INV:
        if x > 0.0 or y < 0.0:
            u, v = reciprocal(x, y)
            _meet(low, high, i, u, v)
    elif code == FABS:
        if low[i] >= 0.0:
            _meet(low, high, i, x, y)
        elif high[i] <= 0.0:
            _meet(low, high, i, -y, -x)
        else:
            _meet(low, high, i, -y, y)
    return True


@compiled
def propagate(codes, first, second, low, high, least, greatest):
    """Narrow the box to what the ranges of the operations leave of it; False if nothing is left."""
    for k in range(codes.size - 1, -1, -1):
        x, y = low[k], high[k]
        if not x <= y:
            return False
        code, i, j = codes[k], first[k], second[k]
        if code == INPUT:
            least[i], greatest[i] = max(least[i], x), min(greatest[i], y)
            if not least[i] <= greatest[i]:
                return False
        elif code == CONST or (x == -INFINITE and y == INFINITE):
            continue
        elif code == ADD:
            _meet(low, high, i, below(x - high[j]), above(y - low[j]))
            _meet(low, high, j, below(x - high[i]), above(y - low[i]))
        elif code == SUB:
            _meet(low, high, i, below(x + low[j]), above(y + high[j]))
            _meet(low, high, j, below(low[i] - y), above(high[i] - x))
        elif code == MUL:
            _narrow_factors(low, high, i, j, x, y)
        elif code == DIV:
            _narrow_ratio(low, high, i, j, x, y)
        elif code == FMAX:
            _meet(low, high, i, x if high[j] < x else -INFINITE, y)
            _meet(low, high, j, x if high[i] < x else -INFINITE, y)
        elif code == FMIN:
            _meet(low, high, i, x, y if low[j] > y else INFINITE)
            _meet(low, high, j, x, y if low[i] > y else INFINITE)
        elif code == IF_ELSE_ZERO:
            if low[i] == 1.0:
                _meet(low, high, j, x, y)
        elif not _narrow_one(code, low, high, i, x, y):
            return False
    return True
