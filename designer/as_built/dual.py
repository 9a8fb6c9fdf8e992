"""Numbers that carry their derivatives: a value, and how it changes with each of a few variables.

Arithmetic applies the rules of differentiation (forward mode), so whatever is computed from such numbers has exact
derivatives. What is written for them works on plain arrays as well.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Number = Any
"""A float, an array or a :class:`Dual`; all broadcast."""


class Dual:
    """A value and, for each of k variables, its derivative: arrays of some shape and of (k, that shape)."""

    __slots__ = ("slopes", "value")
    # NumPy leaves arithmetic of arrays and duals to the methods below.
    __array_ufunc__ = None

    def __init__(self, value: Array, slopes: Array) -> None:
        self.value, self.slopes = value, slopes

    def __add__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slopes + other.slopes)
        value = self.value + other
        return Dual(value, _spread(self.slopes, value))

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slopes)

    def __sub__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value - other.value, self.slopes - other.slopes)
        value = self.value - other
        return Dual(value, _spread(self.slopes, value))

    def __rsub__(self, other: Number) -> Dual:
        value = other - self.value
        return Dual(value, -_spread(self.slopes, value))

    def __mul__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, self.slopes * other.value + other.slopes * self.value)
        return Dual(self.value * other, self.slopes * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            value = self.value / other.value
            return Dual(value, (self.slopes - other.slopes * value) / other.value)
        return Dual(self.value / other, self.slopes / other)

    def __rtruediv__(self, other: Number) -> Dual:
        value = other / self.value
        return Dual(value, self.slopes * (-value / self.value))


def variables(values: list[Array]) -> list[Dual]:
    """Variables with respect to which everything computed from them is differentiated, in this order."""
    shape = np.broadcast_shapes(*(np.shape(value) for value in values))
    duals = []
    for place, value in enumerate(values):
        slopes = np.zeros((len(values), *shape))
        slopes[place] = 1.0
        duals.append(Dual(np.broadcast_to(value, shape), slopes))
    return duals


def value_of(number: Number) -> Array:
    """The value without its derivatives."""
    return np.asarray(number.value if isinstance(number, Dual) else number)


def slopes_of(number: Number, count: int) -> Array:
    """The derivatives (count, ...) of a number; zero for a plain one."""
    return number.slopes if isinstance(number, Dual) else np.zeros((count, *np.shape(number)))


def sqrt(number: Number) -> Number:
    """Square root."""
    if isinstance(number, Dual):
        root = np.sqrt(number.value)
        return Dual(root, number.slopes * (0.5 / root))
    return np.sqrt(number)


def sine(number: Number) -> Number:
    """Sine of an angle in radians."""
    if isinstance(number, Dual):
        return Dual(np.sin(number.value), number.slopes * np.cos(number.value))
    return np.sin(number)


def cosine(number: Number) -> Number:
    """Cosine of an angle in radians."""
    if isinstance(number, Dual):
        return Dual(np.cos(number.value), number.slopes * -np.sin(number.value))
    return np.cos(number)


def applied(number: Number, value: Array, derivative: Array) -> Number:
    """A function of a number, given as its value and its derivative there."""
    return Dual(value, number.slopes * derivative) if isinstance(number, Dual) else value


def where(condition: NDArray[np.bool_], first: Number, second: Number) -> Number:
    """The first number where the condition holds, else the second; both dual or both plain."""
    if isinstance(first, Dual) and isinstance(second, Dual):
        value = np.where(condition, first.value, second.value)
        return Dual(value, np.where(condition, first.slopes, second.slopes))
    return np.where(condition, first, second)


def _spread(slopes: Array, value: Array) -> Array:
    """The derivatives of a sum with a plain number, in the shape of its value."""
    return slopes if slopes.shape[1:] == np.shape(value) else np.broadcast_to(slopes, (len(slopes), *np.shape(value)))
