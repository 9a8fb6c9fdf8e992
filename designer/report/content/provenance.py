"""How a study was made, as a table of the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pydantic import JsonValue

from designer.study.study import Study
from designer.typesetting.markup import call, cells, number, plain_number


def provenance(study: Study) -> str:
    """How the study was made: versions, seed, command, times, machine, solver options."""
    rows = list(_flattened(study.provenance))
    if not rows:
        return ""
    table = call(
        "ruled",
        columns="(auto, 1fr)",
        align="(left, left)",
        header="([item], [value])",
        rows=cells(rows),
        size="7.6pt",
        inset="(x: 1.4mm, y: 0.7mm)",
    )
    return f"= Provenance <provenance>\n{table}"


def _flattened(content: Mapping[str, JsonValue], prefix: str = "") -> Iterable[tuple[str, str]]:
    """Rows of name and value; a table within a table is one row."""
    for key, value in content.items():
        name = f"{prefix}{key}".replace("_", " ")
        if isinstance(value, dict) and not prefix and any(isinstance(entry, dict) for entry in value.values()):
            yield from _flattened(value, f"{name}: ")
        else:
            yield name, _seconds(value) if key.endswith("seconds") else _in_one_line(value)


def _seconds(value: JsonValue) -> str:
    return number(float(value), 1) if isinstance(value, int | float) else _in_one_line(value)


def _in_one_line(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {_in_one_line(entry)}" for key, entry in value.items())
    if isinstance(value, list):
        return ", ".join(plain_number(entry) for entry in value)
    return plain_number(value)
