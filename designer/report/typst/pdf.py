"""From a report's Typst source to PDF."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources

from designer.typesetting.pdf import compile_pdf


def typeset(source: str, figures: Mapping[str, bytes]) -> bytes:
    """A report as PDF bytes from its Typst source and its figures, SVG by file name; the same give the same bytes."""
    texts = resources.files("designer.report.typst")
    files = {name: texts.joinpath(name).read_bytes() for name in ("style.typ", "method.typ")}
    files |= {f"figures/{name}": svg for name, svg in figures.items()}
    return compile_pdf(source, files)
