"""A system's symbols, taken out of it and put back: so that what is measured on it can be an expression of its own.

A system put together holds expressions of the variables that are thousands of operations long. Goals need few of its
numbers; seen from them, each is a symbol.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import TypeVar

from designer.optics.backend import Scalar, is_symbolic

Structure = TypeVar("Structure")


def symbolic_numbers(structure: object) -> list[Scalar]:
    """The numbers in nested dataclasses, tuples and mappings that are symbols or expressions of symbols, in order."""
    found: list[Scalar] = []

    def note(number: Scalar) -> Scalar:
        found.append(number)
        return number

    _replaced(structure, note)
    return found


def with_numbers(structure: Structure, numbers: list[Scalar]) -> Structure:
    """The same structure with other numbers in the place of :func:`symbolic_numbers`."""
    remaining = iter(numbers)
    replaced: Structure = _replaced(structure, lambda number: next(remaining))
    return replaced


def _replaced(structure: Scalar, new: Callable[[Scalar], Scalar]) -> Scalar:
    if is_symbolic(structure):
        # A constant need not stay a symbol: symbols of two kinds cannot meet.
        return float(structure) if structure.is_constant() else new(structure)
    if is_dataclass(structure) and not isinstance(structure, type):
        parts = {field.name: getattr(structure, field.name) for field in fields(structure)}
        moved = {name: _replaced(part, new) for name, part in parts.items()}
        return replace(structure, **{name: part for name, part in moved.items() if part is not parts[name]})
    if isinstance(structure, Mapping):
        return {name: _replaced(part, new) for name, part in structure.items()}
    if isinstance(structure, tuple):
        return tuple(_replaced(part, new) for part in structure)
    return structure
