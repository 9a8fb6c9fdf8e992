"""From a study or a design to one HTML file: style, scripts, three.js and the data inlined, nothing fetched."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from pydantic import JsonValue

from designer.design import Design
from designer.files import write_atomically
from designer.report.html.payload import payload_of_design, payload_of_study
from designer.study.folder import write_page
from designer.study.study import Study

MODULES = (
    "optics",
    "format",
    "state",
    "drawing",
    "table",
    "readings",
    "rays",
    "solids",
    "rig",
    "trade",
    "compare",
    "app",
)
"""The scripts in an order in which each stands below those that it imports."""
_IMPORT = re.compile(r"^import\b[^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)
_PLACE = re.compile(r"\{\{(\w+)\}\}")


def write_html(study: Study, folder: Path) -> Path:
    """Write ``study.html`` into a study's folder and return its path; the same study gives the same bytes.

    Raises
    ------
    InputError
        A file of that name is there that no study wrote, or that has been changed since.
    """
    return write_page(folder, page_of(payload_of_study(study)))


def write_design_html(design: Design, path: Path) -> None:
    """Write the page of a single design.

    Raises
    ------
    InputError
        The design cannot be scored.
    """
    write_atomically(path, page_of(payload_of_design(design)))


def page_of(payload: Mapping[str, JsonValue]) -> str:
    """The page that shows a payload."""
    parts = {
        "title": html.escape(str(payload["title"])),
        "description": html.escape(str(payload["description"])),
        "style": _text("style.css"),
        "payload": embedded_json(payload),
        "script": joined_script(),
        "three": _text("vendor/three.min.js"),
        "licence": html.escape(_text("vendor/LICENSE")),
    }
    # In one pass: what has been put in is not looked at again.
    return _PLACE.sub(lambda place: parts[place[1]], _text("template.html"))


def embedded_json(payload: Mapping[str, JsonValue]) -> str:
    """JSON that may stand inside a script element: no character in it can end the element or begin a comment."""
    text = json.dumps(payload, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    # A half of a surrogate pair is no character, and no file could hold it.
    return re.sub("[\ud800-\udfff]", lambda half: f"\\u{ord(half[0]):04x}", text)


def joined_script() -> str:
    """All scripts as one module: a file opened from disk may not import others."""
    sources = (_text(f"js/{name}.mjs") for name in MODULES)
    return "\n".join(_EXPORT.sub("", _IMPORT.sub("", source)) for source in sources)


def _text(name: str) -> str:
    return resources.files("designer.report.html").joinpath(name).read_text(encoding="utf-8")
