"""From a sweep's folder to its figures and ``sweep.pdf``."""

from __future__ import annotations

from pathlib import Path

from designer.files import InputError, write_atomically
from designer.report.content.sweep import legible, source
from designer.report.figures.sweep_registry import draw_sweep, tables_of
from designer.report.typst.pdf import typeset
from designer.study.sweep.tables import read_sweep_results, winners


def write_sweep_pdf(folder: Path) -> Path:
    """Draw a sweep's figures, typeset its report, and return the path of ``sweep.pdf``.

    Raises
    ------
    InputError
        The folder holds no sweep, or nothing in it is feasible.
    """
    table = read_sweep_results(folder)
    best = winners(table)
    if best.empty:
        raise InputError(f"{folder}: this sweep has no feasible design, so there is nothing to draw")
    tables = tables_of(table, best)
    figures = draw_sweep(tables)
    for name, svg in figures.items():
        write_atomically(folder / "figures" / name, svg)
    path = folder / "sweep.pdf"
    write_atomically(path, typeset(legible(source(folder, tables)), figures))
    return path
