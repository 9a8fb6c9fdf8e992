"""``designer export``: a design in the formats of other programs."""

from __future__ import annotations

from pathlib import Path

import click

from designer.cli.imaging_options import design_argument
from designer.files import InputError, UnwritableError


class _ListsFormats(click.Command):
    """A command whose help ends with the table of formats, which is imported only when the help is asked for."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from designer.export.formats import EXPORTS

        with formatter.section("Formats"):
            formatter.write_dl(
                [
                    (name, f"{entry.description}; {entry.written_as}; without {entry.leaves_out}")
                    for name, entry in EXPORTS.items()
                ]
            )


@click.command(cls=_ListsFormats)
@design_argument
@click.option("--to", "name", metavar="NAME", required=True, help="Format, one of those below.")
@click.option(
    "--tolerances",
    "named",
    metavar="GRADE|FILE.toml",
    help="Tolerances for the drawing sheets: coarse, standard, precision, or a file such as designer tolerance writes.",
)
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="File or folder to write.")
def export(design: Path, name: str, named: str | None, out: Path) -> None:
    """Write DESIGN.json in a format of another program, lengths in mm."""
    from designer.export.formats import EXPORTS, WITHOUT_DEPARTURES, check_target, export_design

    check_target(name, out)
    from designer.as_built.named import named_tolerances
    from designer.design import read_design

    record = read_design(design)
    tolerances = None if named is None else named_tolerances(named, record)
    try:
        written = export_design(record, name, out, tolerances)
    except UnwritableError:
        raise
    except InputError as error:
        raise InputError(f"{design}: {error}") from None
    for path in written:
        click.echo(f"{path} written")
    click.echo(f"not in this format: {EXPORTS[name].leaves_out}")
    if record.as_built is not None:
        click.echo(WITHOUT_DEPARTURES)
