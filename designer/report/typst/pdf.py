"""From Typst source to PDF."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from typing import Any

import typst


def typeset(source: str, figures: Mapping[str, bytes]) -> bytes:
    """A report as PDF bytes from its Typst source and its figures, SVG by file name; the same give the same bytes."""
    texts = resources.files("designer.report.typst")
    files = {name: texts.joinpath(name).read_bytes() for name in ("style.typ", "method.typ")}
    files |= {f"figures/{name}": svg for name, svg in figures.items()}
    files["main.typ"] = source.encode("utf-8")
    # The stubs do not know that the input may be a dict of virtual files.
    compile_files: Any = typst.compile
    pdf: bytes = compile_files(files, format="pdf", ignore_system_fonts=True, font_paths=[], pdf_tags=False)
    return pdf
