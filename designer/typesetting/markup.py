"""Small pieces of Typst. Whatever comes from a file goes in as a string literal, so that no character has a meaning."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

DASH = "–"


def literal(text: object) -> str:
    """A Typst string literal; control characters become spaces."""
    cleaned = "".join(character if character.isprintable() else " " for character in str(text))
    escaped = cleaned.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def text(value: object) -> str:
    """Literal text inside markup."""
    return f"#text({literal(value)})"


def cell(value: object) -> str:
    """Literal text as a table cell."""
    return f"[#text({literal(value)})]"


def number(value: float | None, decimals: int) -> str:
    """A number with fixed decimals and a true minus sign; a dash if there is none."""
    if value is None:
        return DASH
    rounded = f"{value:.{decimals}f}"
    if rounded.startswith("-"):
        rounded = rounded[1:] if float(rounded) == 0 else "−" + rounded[1:]
    return rounded


def plain_number(value: object) -> str:
    """A number as a person typed it, with a true minus sign; anything else as text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:.10g}".replace("-", "−").replace("inf", "∞")


def typographic(sentence: str) -> str:
    """A sentence of the program's with true minus signs and arrows, as print wants them."""
    return re.sub(r"(?<![\w-])-(?=\d)", "−", sentence).replace("->", "→")


def value_range(values: Sequence[object] | object, unit: str = "") -> str:
    """A number, or 'low to high', with its unit."""
    suffix = f" {unit}" if unit else ""
    if isinstance(values, list | tuple):
        return " to ".join(plain_number(value) for value in values) + suffix
    return plain_number(values) + suffix


def call(function: str, *arguments: str, **named: str) -> str:
    """A call of a Typst function from markup, on lines of its own."""
    parts = [*arguments, *(f"{name.replace('_', '-')}: {value}" for name, value in named.items())]
    return f"#{function}(\n  " + ",\n  ".join(parts) + ",\n)\n"


def cells(rows: Iterable[Iterable[object]]) -> str:
    """Rows of literal cells as one Typst array."""
    return "(" + "".join(f"({''.join(cell(value) + ', ' for value in row)}), " for row in rows) + ")"
