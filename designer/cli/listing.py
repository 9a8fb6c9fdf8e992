"""``designer configurations``: the 44, as a table, as JSON or as CSV."""

from __future__ import annotations

import click

COLUMNS = ("configuration", "family", "topology", "lower", "upper", "primary", "secondary", "direct")


@click.command()
@click.option("--json", "form", flag_value="json", help="Print JSON.")
@click.option("--csv", "form", flag_value="csv", help="Print CSV.")
def configurations(form: str | None) -> None:
    """List the 44 configurations."""
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
    if form == "json":
        import json

        click.echo(json.dumps(rows, indent=2))
    elif form == "csv":
        import csv
        import sys

        writer = csv.DictWriter(sys.stdout, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    else:
        from designer.cli.table import format_table

        names = [name for name in COLUMNS if name != "topology"]
        click.echo(format_table(names, [[row.get(name, "") for name in names] for row in rows]))
