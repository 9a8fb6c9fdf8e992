"""``designer configurations``: the 44, as a table, as JSON or as CSV."""

from __future__ import annotations

import click

from designer.files import InputError

COLUMNS = ("configuration", "family", "topology", "lower", "upper", "primary", "secondary", "direct")


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--csv", "as_csv", is_flag=True, help="Print CSV.")
def configurations(as_json: bool, as_csv: bool) -> None:
    """List the 44 configurations."""
    if as_json and as_csv:
        raise InputError("--json and --csv: give only one of them")
    from designer.configurations import enumerate_configurations

    rows = [
        {
            "configuration": configuration.name,
            "family": configuration.family,
            "topology": configuration.topology,
            **{name: kind.name.lower() for name, kind in configuration.mirror_kinds.items()},
        }
        for configuration in enumerate_configurations()
    ]
    if as_json:
        import json

        click.echo(json.dumps(rows, indent=2))
    elif as_csv:
        import csv
        import sys

        writer = csv.DictWriter(sys.stdout, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    else:
        from designer.cli.table import format_table

        names = [name for name in COLUMNS if name != "topology"]
        click.echo(format_table(names, [[row.get(name, "") for name in names] for row in rows]))
