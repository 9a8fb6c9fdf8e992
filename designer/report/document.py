"""From a study to its figures and ``study.pdf``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from designer.report.content.legible import legible_source
from designer.report.figures.registry import Drawing, draw_all
from designer.report.figures.style import report_style
from designer.report.typst.pdf import typeset
from designer.study.folder import write_report
from designer.study.study import Study


def write_pdf(study: Study, folder: Path, tell: Callable[[str], None] | None = None) -> Path:
    """Draw a study's figures, typeset its report, write both into a folder, and return the path of ``study.pdf``.

    The same study gives the same bytes, whether it was found a moment ago or read from its folder. Every file appears
    whole or not at all; figures of an earlier report in the same folder that no longer apply are removed. ``tell`` is
    called with a sentence if some words could not be printed.
    """
    drawings = draw_figures(study)
    text, note = legible_source(study, drawings)
    figures = {name: drawing.svg for name, drawing in drawings.items()}
    pdf = typeset(text, figures)
    if note and tell is not None:
        tell(note)
    return write_report(folder, pdf, figures)


def draw_figures(study: Study) -> dict[str, Drawing]:
    """Every figure of the report by the name of its file."""
    with report_style():
        return dict(draw_all(study))
