"""What a person typed never becomes markup, and numbers keep their decimals."""

from __future__ import annotations

import json
from typing import Any

import typst
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.typesetting.markup import cell, literal, number, plain_number, value_range


def _through_typst(markup: str) -> Any:
    source = f"#metadata({markup}) <probe>".encode()
    return json.loads(typst.query(source, "<probe>", field="value", one=True))


@settings(max_examples=60, deadline=None)
@given(st.text(alphabet=st.characters(codec="utf-8"), max_size=40))
def test_any_text_arrives_as_it_was_typed(text: str) -> None:
    shown = "".join(character if character.isprintable() else " " for character in text)
    assert _through_typst(literal(text)) == shown


def test_markup_characters_are_only_characters() -> None:
    nasty = '#let x = 1; *b* _i_ $m$ <l> @r \\n "q" [c] {d} // /* ~ `raw`'
    assert _through_typst(literal(nasty)) == nasty
    assert cell(nasty).startswith("[#text(")


def test_numbers_have_fixed_decimals_a_true_minus_and_no_negative_zero() -> None:
    assert number(-12.3456, 2) == "−12.35"
    assert number(-0.00001, 2) == "0.00"
    assert number(None, 3) == "–"
    assert plain_number(-0.5) == "−0.5"
    assert plain_number(float("inf")) == "∞"
    assert value_range([-16.0, 16.0], "mm") == "−16 to 16 mm"
