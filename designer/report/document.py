"""From a study to its figures and ``study.pdf``."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from designer.report.content.legible import legible_source
from designer.report.figures.registry import DrawnFigure, drawings_of
from designer.report.figures.style import report_style
from designer.report.typst.pdf import typeset
from designer.study.folder import read_study, write_report
from designer.study.processes import local_processes, run_each
from designer.study.study import Study


def write_pdf(study: Study, folder: Path, tell: Callable[[str], None] | None = None, *, jobs: int = 1) -> Path:
    """Draw a study's figures, typeset its report, write both into a folder, and return the path of ``study.pdf``.

    The same study gives the same bytes, whether it was found a moment ago or read from its folder. Every file appears
    whole or not at all; figures of an earlier report in the same folder that no longer apply are removed. ``tell`` is
    called with a sentence if some words could not be printed. More ``jobs`` than one draw in so many processes, which
    read the study from the folder: it must be there, with its checks.
    """
    drawings = draw_figures(study) if jobs == 1 else _draw_in_processes(study, folder, jobs)
    text, note = legible_source(study, drawings)
    figures = {name: drawing.svg for name, drawing in drawings.items()}
    pdf = typeset(text, figures)
    if note and tell is not None:
        tell(note)
    return write_report(folder, pdf, figures)


def draw_figures(study: Study) -> dict[str, DrawnFigure]:
    """Every figure of the report by the name of its file."""
    with report_style():
        drawn = {name: draw() for name, draw in drawings_of(study)}
    return {name: drawing for name, drawing in drawn.items() if drawing is not None}


def _draw_in_processes(study: Study, folder: Path, jobs: int) -> dict[str, DrawnFigure]:
    names = [name for name, _ in drawings_of(study)]
    with local_processes(jobs, "designer.report.document") as processes:
        tasks = [(folder, number) for number in range(len(names))]
        drawn = {number: future.result() for number, future in run_each(processes, _draw, tasks)}
    return {name: drawn[number] for number, name in enumerate(names) if drawn[number] is not None}


def _draw(folder: Path, number: int) -> DrawnFigure | None:
    _, draw = _read_drawings(folder)[number]
    with report_style():
        return draw()


@lru_cache(maxsize=1)
def _read_drawings(folder: Path) -> list[tuple[str, Callable[[], DrawnFigure | None]]]:
    """The drawings of the study in a folder; read once by each process that draws, which lives no longer than that."""
    return drawings_of(read_study(folder))
