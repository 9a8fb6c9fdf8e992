"""Characters that the fonts of the typesetting do not have: they would be printed as empty boxes."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import typst

ELLIPSIS = "…"


def missing_characters(text: str) -> frozenset[str]:
    """The characters of a text that none of the fonts can print."""
    # ASCII is never missing, and most texts have little else.
    beyond = {character for character in text if not character.isascii() and character.isprintable()}
    return _missing("".join(sorted(beyond)))


def without_characters(text: str, missing: Iterable[str]) -> str:
    """The text with an ellipsis for each run of missing characters, spaces between them included."""
    characters = "".join(map(re.escape, sorted(missing)))
    return re.sub(f"[{characters}](?:[{characters} ]*[{characters}])?", ELLIPSIS, text) if characters else text


@lru_cache
def _missing(characters: str) -> frozenset[str]:
    """Halved until what cannot be printed stands alone."""
    if not characters or _can_be_printed(characters):
        return frozenset()
    if len(characters) == 1:
        return frozenset(characters)
    middle = len(characters) // 2
    return _missing(characters[:middle]) | _missing(characters[middle:])


def _can_be_printed(characters: str) -> bool:
    # One string for each, or marks would be shaped onto their neighbours.
    strings = " ".join(f'#"{character}"' for character in characters)
    source = strings.encode("utf-8")
    # PDF/A forbids what no font can print, and the stubs do not know that the input may be a dict of virtual files.
    compile_files: Any = typst.compile
    try:
        compile_files(
            {"main.typ": source}, format="pdf", ignore_system_fonts=True, font_paths=[], pdf_standards=["a-2b"]
        )
    except typst.TypstError as error:
        if "could not be displayed" in str(error):
            return False
        raise
    return True
