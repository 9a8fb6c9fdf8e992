"""``designer order``: all that a workshop needs of a design, in one folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.files import InputError, UnwritableError

if TYPE_CHECKING:
    from designer.as_built.named import NamedTolerances
    from designer.design import Design

REJECTED = 1


@click.command()
@click.argument("source", type=click.Path(path_type=Path), metavar="DESIGN.json|STUDY")
@click.argument("configuration", required=False)
@click.option(
    "--tolerances",
    "named",
    metavar="GRADE|FILE.toml",
    help="Tolerances for the drawing sheets: coarse, standard, precision, or a file such as designer tolerance writes; "
    "by default those of a study with --tolerances.",
)
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Folder of the order.")
def order(source: Path, configuration: str | None, named: str | None, out: Path) -> None:
    """Write everything that a workshop needs for a design into one folder.

    The design is DESIGN.json, or that of CONFIGURATION in a STUDY's folder. The folder holds drawings, sag tables,
    profiles, solids, files for optical programs, a parts list, and a README that says what is not specified yet. Exit
    code 1 if the ray tracer rejects the design: the README says why.
    """
    from designer.export.order.folder import check_order_folder
    from designer.extras import require_extra

    require_extra("drawing", "order")
    check_order_folder(out)
    design, path = _design(source, configuration)
    tolerances = _tolerances(source, design, named)
    from designer.export.order.package import write_order

    try:
        written = write_order(design, out, tolerances)
    except UnwritableError:
        raise
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    click.echo(f"{out} written, {len(written.files)} files; see {out / 'README.md'}")
    if tolerances is None:
        click.echo("the drawings leave tolerances to be agreed; --tolerances precision, or a file, puts them in")
    else:
        click.echo(f"tolerances of the drawings: those of {tolerances.in_words}")
    for name, why in written.left_out.items():
        click.echo(f"left out: {name}: {why}")
    if design.as_built is not None:
        from designer.export.formats import WITHOUT_DEPARTURES

        click.echo(WITHOUT_DEPARTURES)
    if written.problems:
        click.echo(f"rejected by the ray tracer: {'; '.join(written.problems)}", err=True)
        raise SystemExit(REJECTED)


def _tolerances(source: Path, design: Design, named: str | None) -> NamedTolerances | None:
    if named is not None:
        from designer.as_built.named import named_tolerances

        return named_tolerances(named, design)
    if not source.is_dir():
        return None
    from designer.study.tolerances import tolerances_in

    return tolerances_in(source)


def _design(source: Path, configuration: str | None) -> tuple[Design, Path]:
    from designer.design import read_design
    from designer.study.names import DESIGNS, design_path

    if not source.is_dir():
        if configuration is not None:
            raise InputError(f"{source}: is no study's folder; CONFIGURATION goes with one")
        return read_design(source), source
    names = sorted(path.stem for path in (source / DESIGNS).glob("*.json"))
    if configuration not in names:
        said = "CONFIGURATION is missing" if configuration is None else f"has no design of {configuration}"
        raise InputError(f"{source}: {said}; it has {', '.join(names) if names else 'no designs'}")
    path = design_path(source, configuration)
    return read_design(path), path
