"""The report's source with nothing in it that its fonts cannot print, and an honest note of what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from designer.report.content.sections import Drawings, source
from designer.study.study import Study
from designer.typesetting.glyphs import ELLIPSIS, missing_characters, without_characters


def legible_source(study: Study, drawings: Drawings) -> tuple[str, str]:
    """The report as Typst source, and a sentence on what could not be printed (empty if everything could).

    The fonts that come with the typesetting have Latin, Greek, Cyrillic and some other scripts, but not Chinese,
    Japanese or Korean; fonts of the machine are not used, since the report would then differ from one to another.
    """
    whole = source(study, drawings)
    missing = missing_characters(whole)
    if not missing:
        return whole, ""
    keys = [key for key, value in _texts(study.requirement.model_dump()) if missing & set(value)]
    shown = study
    if missing & set(study.title):
        shown = replace(study, requirement=study.requirement.model_copy(update={"title": study.name}))
    named = f" of {' and '.join(filter(None, (', '.join(keys[:-1]), keys[-1])))}" if keys else ""
    instead = ["the study's name replaces the title"] if shown is not study else []
    if keys != ["title"]:
        instead.append(f"{ELLIPSIS} replaces the words concerned")
    note = (
        f"The report fonts do not contain some characters{named}: {', '.join(instead)}; requirement.toml contains the "
        f"original text."
    )
    return without_characters(source(shown, drawings, note), missing), note


def _texts(content: object, key: str = "") -> Iterator[tuple[str, str]]:
    """Every string of a requirement with its dotted key."""
    if isinstance(content, str):
        yield key, content
    elif isinstance(content, Mapping):
        for name, value in content.items():
            yield from _texts(value, f"{key}.{name}" if key else str(name))
    elif isinstance(content, Sequence):
        for index, value in enumerate(content):
            yield from _texts(value, f"{key}.{index}")
