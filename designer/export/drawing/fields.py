"""Fields of a sheet: groups of names and what they say, as Typst; numbers with all their digits."""

from __future__ import annotations

from designer.typesetting.markup import cell, literal

Groups = list[tuple[str, list[tuple[str, str]]]]

OPEN = "to be agreed"
"""What nobody has decided: the sheet says so and does not invent a number."""


def exactly(value: float) -> str:
    """A number with all its digits, with a true minus sign: reading it gives the same number again."""
    return repr(float(value)).replace("-", "−")


def fields(groups: Groups) -> str:
    """Groups of fields as Typst."""
    rows = "".join(
        f"({literal(title)}, ({''.join(f'({cell(name)}, {cell(value)}), ' for name, value in group)})), "
        for title, group in groups
    )
    return f"#fields(({rows}))\n"
