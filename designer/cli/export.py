"""``designer export``: a design in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import click

from designer.cli.imaging_options import design_argument
from designer.files import InputError

_HELP = """Write DESIGN.json in a format of another program, lengths in mm.

\b
sag       CSV, a file for each mirror: radius, sag, slope, distance from
          the best-fit sphere
zmx       Zemax OpticStudio, a file for each view
povray    POV-Ray scene with every mirror as an exact quadric
optiland  optiland's JSON, a file for each view
dxf       half-profiles of the mirrors for CAD (needs the extra dxf)

What a format has no place for is printed.
"""


@click.command(help=_HELP)
@design_argument
@click.option("--to", "name", required=True, help="sag, zmx, povray, optiland or dxf.")
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="File to write, or folder for a format that has a file of each mirror or view.",
)
def export(design: Path, name: str, out: Path) -> None:
    """Write a design in a format of another program."""
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
