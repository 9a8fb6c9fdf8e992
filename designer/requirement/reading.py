"""A requirement and its TOML file: reading, writing, and changing one key."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import tomli_w
from pydantic import ValidationError

from designer.files import InputError, describe_validation_error, read_toml
from designer.requirement.model import Requirement
from designer.requirement.part import Part, given

LARGEST_FILE_BYTES = 1_000_000
NamedPart = TypeVar("NamedPart", bound=Part)

NOT_ASKED = ("name", "title", "description")
"""Keys that name a requirement and say nothing of what it asks."""


def read_requirement(path: Path) -> Requirement:
    """Read and validate a requirement file. Without a ``name`` it is called after the file.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or asks for something that cannot be: one line says what is allowed.
    """
    return read_named_part(path, Requirement)


def read_named_part(path: Path, kind: type[NamedPart]) -> NamedPart:
    """Read and validate a TOML file of a part that has a name. Without a ``name`` it is called after the file.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or holds something that cannot be: one line says what is allowed.
    """
    content = read_toml(path, LARGEST_FILE_BYTES)
    content.setdefault("name", _name_from(path))
    return _validated(content, path, kind)


def requirement_to_toml(requirement: Requirement) -> str:
    """The complete requirement, defaults included, as TOML; reading it gives the same requirement."""
    return tomli_w.dumps(requirement.model_dump(exclude_none=True), multiline_strings=False)


def requirement_to_json(requirement: Requirement) -> str:
    """What was given, as JSON: defaults are left out, so that they still follow other keys when one is set."""
    return json.dumps(given(requirement))


def requirement_from_json(text: str) -> Requirement:
    """The requirement that :func:`requirement_to_json` wrote."""
    return Requirement.model_validate(json.loads(text))


def set_key(requirement: Requirement, key: str, value: object) -> Requirement:
    """The requirement with one key changed and everything checked again.

    Defaults that follow from another key (the mirror diameter from the envelope's) follow the change.

    Parameters
    ----------
    requirement
        The requirement to start from; it stays as it is.
    key
        Dotted name, such as ``envelope.height_mm``; a number selects from a catalogue: ``camera.lens.0.f_number``.
    value
        The new value, as TOML would hold it.

    Raises
    ------
    InputError
        There is no such key, or the value is not allowed.
    """
    content = given(requirement)
    *parents, last = key.split(".")
    target: Any = content
    for part in parents:
        target = _child(target, part, key)
    if isinstance(target, list):
        target[_index(target, last, key)] = value
    else:
        target[last] = value
    return _validated(content, requirement.name, Requirement)


def _child(target: Any, part: str, key: str) -> Any:
    place: Any = _index(target, part, key) if isinstance(target, list) else part
    child = target[place] if isinstance(target, list) else target.setdefault(place, {})
    if not isinstance(child, dict | list):
        raise InputError(f"{key}: {part} holds no further keys")
    return child


def _index(target: list[Any], part: str, key: str) -> int:
    index = index_in(target, part)
    if index is None:
        raise InputError(f"{key}: {part} must be a number from 0 to {len(target) - 1}")
    return index


def index_in(values: Sequence[object], part: str) -> int | None:
    """The place in a list that part of a dotted name selects; None if it is no number, or too large."""
    is_short = part.isdecimal() and len(part) <= len(str(len(values)))
    return int(part) if is_short and int(part) < len(values) else None


def _validated(content: dict[str, Any], source: Path | str, kind: type[NamedPart]) -> NamedPart:
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(source, error)) from None


def _name_from(path: Path) -> str:
    """A name that may name a folder, made of a file's."""
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem)[:100].lstrip(".-")
    return name or "requirement"
