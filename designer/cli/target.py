"""``designer target``: the printed target that ``designer calibrate`` finds."""

from __future__ import annotations

from pathlib import Path

import click

from designer.extras import require_extra
from designer.files import InputError


@click.command()
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="PDF file to write.")
@click.option("--columns", type=int, default=9, show_default=True, help="Squares across.")
@click.option("--rows", type=int, default=6, show_default=True, help="Squares down.")
@click.option("--square-mm", type=float, default=30.0, show_default=True, help="Side of a square.")
def target(out: Path, columns: int, rows: int, square_mm: float) -> None:
    """Write a calibration target as a PDF at true scale, and its file for designer calibrate beside it."""
    require_extra("imaging", "a target")
    require_extra("drawing", "a target's PDF")
    if out.suffix.lower() != ".pdf":
        raise InputError(f"{out}: must end in .pdf")
    from designer.calibration.target import make_target, write_target
    from designer.calibration.target_page import target_pdf
    from designer.files import write_atomically

    made = make_target(columns, rows, square_mm)
    beside = out.with_suffix(".toml")
    write_atomically(out, target_pdf(made))
    write_target(beside, made)
    width, height = made.size_mm
    click.echo(f"{out}: {columns} x {rows} squares of {square_mm:g} mm, {width:g} x {height:g} mm; print at 100 %")
    click.echo(f"{beside}: for designer calibrate --target; correct square_mm there to what the print measures")
