"""The reference page of every key, made from the models: ``python -m designer.requirement.reference``."""

from __future__ import annotations

import math
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from designer.requirement.camera import Lens
from designer.requirement.fixed import FixedMirror, FixedView
from designer.requirement.model import Requirement
from designer.requirement.part import Part
from designer.requirement.quantity import Choice, Coefficients, NumberOrWord, Quantity

_HEAD = """\
# Requirement reference

Every key of a requirement file (TOML), generated from the code by `make reference`. `designer init FILE` writes a
commented example file.

Lengths are in millimetres, angles in degrees and image lengths in pixels, as the names say. The origin is the centre
of the lens's entrance pupil; z runs along the optical axis, upwards, and radii are measured from it. Keys without a
default are mandatory. An unknown key, a wrong type, a value outside its limits or inconsistent values produce a
one-line error message that states what is allowed, and nothing is written.
"""

# Tables that are not fields of one model: the heading under which their keys are listed, where they may stand in the
# file, and their model.
_NAMED_TABLES: dict[str, tuple[str, type[Part]]] = {
    "camera.lens": ("`[camera.lens]`, or `[[camera.lens]]` for each lens of a catalogue", Lens),
    "fixed.mirror": ("`[fixed.mirror.NAME]`", FixedMirror),
    "fixed.view": ("`[fixed.view.NAME]`", FixedView),
}


def reference() -> str:
    """The whole page, as Markdown."""
    return "\n".join([_HEAD, *_sections(Requirement, "")])


def _sections(model: type[Part], path: str) -> list[str]:
    heading = _NAMED_TABLES[path][0] if path in _NAMED_TABLES else f"`[{path}]`" if path else "Top level"
    lines = [f"## {heading}", "", _sentence(model), ""]
    tables: list[tuple[type[Part], str]] = []
    rows = []
    for name, field in model.model_fields.items():
        below = f"{path}.{name}" if path else name
        if below in _NAMED_TABLES:
            tables.append((_NAMED_TABLES[below][1], below))
        elif isinstance(field.annotation, type) and issubclass(field.annotation, Part):
            tables.append((field.annotation, below))
            continue
        rows.append(f"| `{name}` | {_allowed(field)} | {_default(field)} | {_in_cell(field.description or '')} |")
    if rows:
        lines += ["| key | allowed | default | meaning |", "|---|---|---|---|", *rows, ""]
    for table, below in tables:
        lines += _sections(table, below)
    return lines


def _sentence(model: type[Part]) -> str:
    return " ".join((model.__doc__ or "").split())


def _allowed(field: FieldInfo) -> str:
    quantity = next(
        (item for item in field.metadata if isinstance(item, Quantity | Choice | Coefficients | NumberOrWord)), None
    )
    if quantity is not None:
        return quantity.allowed
    if get_origin(field.annotation) is Literal:
        return ", ".join(f'`"{choice}"`' for choice in get_args(field.annotation))
    if field.annotation is str:
        return "text"
    if get_origin(field.annotation) is tuple:
        return "an array of strings"
    return "table"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    if field.default_factory is not None:
        return "see meaning"
    return _written(field.default)


def _written(value: Any) -> str:
    """The default as TOML would hold it."""
    if value is None or value in ({}, ()):
        return "none"
    if isinstance(value, str):
        return f'`"{value}"`'
    if isinstance(value, tuple):
        return "`[" + ", ".join(f'"{item}"' for item in value) + "]`"
    return "`inf`" if value == math.inf else f"`{value}`"


def _in_cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    import sys

    sys.stdout.write(reference())
