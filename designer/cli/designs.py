"""``designer trace`` and ``designer evaluate``: what the tracer and the score say of one design file."""

from __future__ import annotations

from pathlib import Path

import click

REJECTED = 1


@click.command()
@click.argument("design", type=click.Path(path_type=Path))
def trace(design: Path) -> None:
    """Print the ray tracer's verdict on DESIGN.json; exit code 1 if it rejects the design."""
    from designer.design import read_design

    record = read_design(design)
    from designer.verify.verdict import describe, judge

    verdict = judge(record)
    click.echo(describe(verdict))
    if not verdict.passed:
        raise SystemExit(REJECTED)


@click.command()
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def evaluate(design: Path, as_json: bool) -> None:
    """Score and trace DESIGN.json, an existing or hand-edited design."""
    from designer.design import read_design

    record = read_design(design)
    from designer.evaluate.summary import evaluate_design
    from designer.verify.verdict import describe, judge

    summary = evaluate_design(record, record.zone_gap_px)
    verdict = judge(record)
    if as_json:
        import json
        from dataclasses import asdict

        click.echo(json.dumps(_plain({"evaluation": summary, "trace": asdict(verdict)}), indent=2))
    else:
        click.echo("\n".join(_outline(_plain(summary))))
        click.echo()
        click.echo(describe(verdict))


def _plain(value: object) -> object:
    """The value in JSON's own types; numbers that JSON does not know become null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # NumPy arrays and scalars
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def _outline(value: object, indent: str = "") -> list[str]:
    """Lines of ``key: value``, tables indented; a list of tables has a row for each key, a column for each table."""
    if not isinstance(value, dict):
        return [f"{indent}{_text(value)}"]
    lines = []
    for key, item in value.items():
        if isinstance(item, dict):
            lines += [f"{indent}{key}:", *_outline(item, indent + "  ")]
        elif isinstance(item, list) and item and all(isinstance(entry, dict) for entry in item):
            lines += [f"{indent}{key}:", *(f"{indent}  {line}" for line in _columns(item))]
        else:
            lines.append(f"{indent}{key}: {_text(item)}")
    return lines


def _columns(tables: list[dict[str, object]]) -> list[str]:
    keys = list(dict.fromkeys(key for table in tables for key in table))
    rows = [[key, *(_text(table.get(key)) for table in tables)] for key in keys]
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if value is None:
        return "none"
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    return str(value)
