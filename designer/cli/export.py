"""``designer export``: a design in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import click

from designer.cli.imaging_options import design_argument


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
    from designer.design import read_design
    from designer.export.formats import export_design, export_format

    chosen = export_format(name)
    for path in export_design(read_design(design), name, out):
        click.echo(f"{path} written")
    if chosen.leaves_out:
        click.echo(f"not in this format: {chosen.leaves_out}")
