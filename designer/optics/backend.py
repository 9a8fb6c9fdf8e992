"""The few functions that NumPy arrays and CasADi symbols do not share under one name.

Arithmetic works on both as it is. CasADi is imported only when a symbol comes in, so that evaluating a finished
design never loads the solver.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

_PLAIN = (float, int, np.ndarray, np.generic)

Scalar = Any
"""A float, a NumPy array (broadcast) or a CasADi symbol."""


def is_symbolic(value: Scalar) -> bool:
    """Whether a value is a CasADi symbol or expression."""
    return not isinstance(value, _PLAIN) and type(value).__module__.startswith("casadi")


def sqrt(value: Scalar) -> Scalar:
    """Square root."""
    return _casadi().sqrt(value) if is_symbolic(value) else np.sqrt(value)


def exp(value: Scalar) -> Scalar:
    """Exponential function."""
    return _casadi().exp(value) if is_symbolic(value) else np.exp(value)


def tan(value: Scalar) -> Scalar:
    """Tangent of an angle in radians."""
    return _casadi().tan(value) if is_symbolic(value) else np.tan(value)


def arctan(value: Scalar) -> Scalar:
    """Angle in radians, between -pi/2 and pi/2, whose tangent is given."""
    return _casadi().atan(value) if is_symbolic(value) else np.arctan(value)


def absolute(value: Scalar) -> Scalar:
    """Absolute value."""
    return _casadi().fabs(value) if is_symbolic(value) else np.abs(value)


def degrees(radians: Scalar) -> Scalar:
    """Radians as degrees."""
    return radians * (180.0 / np.pi)


def radians(degrees: Scalar) -> Scalar:
    """Degrees as radians."""
    return degrees * (np.pi / 180.0)


def maximum(first: Scalar, second: Scalar) -> Scalar:
    """The larger of two values, element by element."""
    if is_symbolic(first) or is_symbolic(second):
        return _casadi().fmax(first, second)
    return np.maximum(first, second)


def minimum(first: Scalar, second: Scalar) -> Scalar:
    """The smaller of two values, element by element."""
    if is_symbolic(first) or is_symbolic(second):
        return _casadi().fmin(first, second)
    return np.minimum(first, second)


def where(condition: Scalar, if_true: Scalar, if_false: Scalar) -> Scalar:
    """``if_true`` where the condition holds, else ``if_false``; both must be finite."""
    if is_symbolic(condition) or is_symbolic(if_true) or is_symbolic(if_false):
        return _casadi().if_else(condition, if_true, if_false)
    return np.where(condition, if_true, if_false)


def stack(values: Sequence[Scalar]) -> Scalar:
    """Stack floats or arrays of shape (n,) into rows of shape (rows, n or 1); symbols into a column vector."""
    if any(is_symbolic(value) for value in values):
        return _casadi().vertcat(*values)
    rows = [np.atleast_1d(value) for value in values]
    if any(row.shape != rows[0].shape for row in rows):
        rows = list(np.broadcast_arrays(*rows))
    return np.stack(rows)


def take(rows: Scalar, indices: Sequence[int]) -> Scalar:
    """The given rows of what :func:`stack` returned, in that order."""
    return rows[list(indices)]


def total(rows: Scalar) -> Scalar:
    """The sum of the rows of what :func:`stack` returned."""
    return _casadi().sum1(rows) if is_symbolic(rows) else np.sum(rows, axis=0)


def row_by_row(function: Callable[..., Scalar], *rows: Scalar) -> Scalar:
    """What a function makes of columns of the same length, row by row.

    Where it depends on CasADi's matrix symbols, its expression is built once for one row, and mapped over the rows.
    """
    if not all(type(column).__name__ == "MX" for column in rows):
        return function(*rows)
    casadi = _casadi()
    single = [casadi.MX.sym("row") for _ in rows]
    value = function(*single)
    own = {symbol.__hash__() for symbol in single}
    others = [symbol for symbol in casadi.symvar(value) if symbol.__hash__() not in own]
    one = casadi.Function("one_row", [*others, *single], [value]).expand("one_row", {"cse": True})
    return one.map("rows", "serial", rows[0].shape[0], list(range(len(others))), [])(*others, *(r.T for r in rows)).T


def _casadi() -> Any:
    import casadi

    return casadi
