"""From Typst source to PDF: nothing but what is handed in goes into it, so that the same input gives the same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import typst


def compile_pdf(source: str, files: Mapping[str, bytes]) -> bytes:
    """PDF bytes of a document's source and of the files that it names, by their paths; no font of the machine."""
    # The stubs do not know that the input may be a dict of virtual files.
    compile_files: Any = typst.compile
    everything = {**files, "main.typ": source.encode("utf-8")}
    pdf: bytes = compile_files(everything, format="pdf", ignore_system_fonts=True, font_paths=[], pdf_tags=False)
    return pdf
