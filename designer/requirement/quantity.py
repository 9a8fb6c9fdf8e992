"""Numbers as an engineer types them: what is allowed, in which unit, and which mistake a wild value suggests."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, Literal, NoReturn

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

_NO_VALUE = object()


def refuse(allowed: str, key: str = "", value: object = _NO_VALUE) -> NoReturn:
    """Refuse what was typed: say what is allowed, and below which key of the model at hand.

    Raises
    ------
    PydanticCustomError
        Always; :func:`designer.files.describe_validation_error` turns it into the one line that people read.
    """
    context: dict[str, object] = {"allowed": allowed, "key": key}
    if value is not _NO_VALUE:
        context["value"] = value
    raise PydanticCustomError("refused", "{allowed}", context)


class CheckedAnnotation:
    """Base of pydantic type annotations that validate with their own :meth:`check` alone, whatever the type."""

    __slots__ = ()

    def check(self, value: object) -> object:
        """Return the value to keep, or refuse it."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Validate with :meth:`check`."""
        return core_schema.no_info_plain_validator_function(self.check)


@dataclass(frozen=True, slots=True)
class Quantity(CheckedAnnotation):
    """A pydantic type annotation: a number within limits, a range [low, high] of two, or either.

    Finite numbers only, unless ``may_be_infinite``; no strings and no booleans. The hints name the likely mistake
    behind a value outside the limits, usually a wrong unit.
    """

    low: float
    high: float
    unit: str = ""
    if_smaller: str = ""
    if_larger: str = ""
    shape: Literal["number", "range", "number or range"] = "number"
    whole: bool = False
    may_be_infinite: bool = False

    @property
    def allowed(self) -> str:
        """What may be written, in words."""
        noun = "a whole number" if self.whole else "a number"
        unit = f" ({self.unit})" if self.unit else ""
        limits = f"from {self.low:.15g} to {self.high:.15g}{unit}"
        infinite = ", or inf" if self.may_be_infinite else ""
        return {
            "number": f"{noun} {limits}{infinite}",
            "range": f"a range [low, high] of two numbers, low < high, {limits}",
            "number or range": f"{noun} or a range [low, high], low < high, {limits}{infinite}",
        }[self.shape]

    def check(self, value: object) -> float | tuple[float, float]:
        """Return the number or the range, or refuse it."""
        if isinstance(value, list | tuple) and self.shape != "number":
            if len(value) != 2:
                refuse(f"must be {self.allowed}")
            low, high = self._checked_number(value[0]), self._checked_number(value[1])
            if low >= high:
                refuse(f"must be {self.allowed}; {_order_hint(low, high, self.shape)}")
            return low, high
        if self.shape == "range":
            refuse(f"must be {self.allowed}")
        return self._checked_number(value)

    def _checked_number(self, value: Any) -> float:
        # The abstract kinds hold NumPy's numbers too.
        kind: type[Any] = Integral if self.whole else Real
        if isinstance(value, bool) or not isinstance(value, kind):
            hint = "; write it without quotes and without a unit" if isinstance(value, str) else ""
            refuse(f"must be {self.allowed}{hint}")
        if value == math.inf and self.may_be_infinite:
            return math.inf
        # Written so that NaN fails too; whole numbers of any size compare exactly with floats.
        if not self.low <= value <= self.high:
            # A negative length is no length in another unit.
            mistaken = value < self.low and (value > 0 or self.low <= 0)
            hint = self.if_smaller if mistaken else self.if_larger if value > self.high else ""
            refuse(f"must be {self.allowed}{'; ' if hint else ''}{hint}")
        return int(value) if self.whole else float(value)


@dataclass(frozen=True, slots=True)
class DesignQuantity(Quantity):
    """A number, or a range of two, that shapes designs: geometry reads it, and a design can be held by it.

    Constraints read it from :attr:`designer.optimise.required_numbers.Specification.asked`, and reports say what one
    unit more of it is worth; ``shown_step`` is the step to say it for, where one unit would be a large one.
    """

    shown_step: float = 1.0


@dataclass(frozen=True, slots=True)
class Coefficients(CheckedAnnotation):
    """A pydantic type annotation: an array of numbers without a unit, at most so many, each at most so large."""

    most: int
    largest: float

    @property
    def allowed(self) -> str:
        """What may be written, in words."""
        return f"an array of at most {self.most} numbers from {-self.largest:g} to {self.largest:g}"

    def check(self, value: object) -> tuple[float, ...]:
        """Return the numbers, or refuse them."""
        if not isinstance(value, list | tuple) or len(value) > self.most:
            refuse(f"must be {self.allowed}")
        if any(isinstance(item, bool) or not isinstance(item, Real) for item in value):
            refuse(f"must be {self.allowed}")
        numbers = tuple(float(item) for item in value)
        # Written so that NaN fails too.
        if not all(abs(item) <= self.largest for item in numbers):
            refuse(f"must be {self.allowed}")
        return numbers


@dataclass(frozen=True, slots=True)
class Choice(CheckedAnnotation):
    """A pydantic type annotation: one of some words."""

    words: tuple[str, ...]

    @property
    def allowed(self) -> str:
        """What may be written, as a cell of the reference."""
        return ", ".join(f'`"{word}"`' for word in self.words)

    def check(self, value: object) -> str:
        """Return the word, or refuse it with the nearest one."""
        if not isinstance(value, str) or value not in self.words:
            close = difflib.get_close_matches(value, self.words, n=1) if isinstance(value, str) else []
            hint = f"; did you mean {close[0]}?" if close else ""
            refuse(f"must be one of {', '.join(self.words)}{hint}")
        return value


@dataclass(frozen=True, slots=True)
class NumberOrWord(CheckedAnnotation):
    """A pydantic type annotation: a quantity, or one word instead."""

    quantity: Quantity
    word: str

    @property
    def unit(self) -> str:
        """Unit of the number."""
        return self.quantity.unit

    @property
    def allowed(self) -> str:
        """What may be written, in words."""
        return f'{self.quantity.allowed}, or "{self.word}"'

    def check(self, value: object) -> float | tuple[float, float] | str:
        """Return the number or the word, or refuse it."""
        if value == self.word:
            return self.word
        if isinstance(value, str):
            refuse(f"must be {self.allowed}")
        return self.quantity.check(value)


def _order_hint(low: float, high: float, shape: str) -> str:
    if low > high:
        return f"swap the two: [{high:g}, {low:g}]"
    return "write the number alone" if shape == "number or range" else "the two are equal"
