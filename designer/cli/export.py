"""``designer export``: a design in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import click

from designer.cli.imaging_options import design_argument
from designer.files import InputError


@click.command()
@design_argument
@click.option("--to", "name", required=True, help="Format: sag.")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="File to write, or folder for a format that has a file of each mirror or view.",
)
def export(design: Path, name: str, out: Path) -> None:
    """Write DESIGN.json in a format of another program, lengths in mm.

    Formats: sag (a table of each mirror's face).
    """
    from designer.export.formats import EXPORTS, check_target, export_design

    check_target(name, out)
    from designer.design import read_design

    record = read_design(design)
    try:
        written = export_design(record, name, out)
    except InputError as error:
        raise InputError(f"{design}: {error}") from None
    for path in written:
        click.echo(f"{path} written")
    if EXPORTS[name].leaves_out:
        click.echo(f"not in this format: {EXPORTS[name].leaves_out}")
