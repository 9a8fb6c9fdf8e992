"""``designer certify``: how good a study's designs can be at most, and which configurations have none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.extras import needs
from designer.files import InputError

if TYPE_CHECKING:
    from designer.certify.certificate import Certificate

WORDS = {
    "optimal": "optimal within 1 %",
    "gap": "bounded",
    "infeasible": "proven infeasible",
    "not proven": "not proven",
}


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="STUDY_FOLDER")
@click.option("--only", multiple=True, metavar="NAME", help="Certify only this configuration (name or glob pattern).")
@click.option(
    "--seconds",
    type=click.FloatRange(min=1, max=1e6),
    default=60.0,
    show_default=True,
    help="Processor time for each configuration.",
)
@click.option("--quiet", is_flag=True, help="Print nothing.")
@needs("certify")
def certify(folder: Path, only: tuple[str, ...], seconds: float, quiet: bool) -> None:
    """Prove how far a study's designs are from the best possible, and which configurations have no design.

    Writes certificates.csv and certificates.json into STUDY_FOLDER (docs/certify.md).
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: must be the folder of a study")
    from designer.certify.certify import certify_study
    from designer.study.names import CERTIFICATES_TABLE

    def tell(done: int, total: int, certificate: Certificate) -> None:
        words = f"{WORDS[certificate.status]} ({certificate.seconds:.0f} s)"
        click.echo(f"[{done:{len(str(total))}d}/{total}] {certificate.configuration}: {words}", err=True)

    found = certify_study(folder, seconds, only, None if quiet else tell)
    if not quiet:
        click.echo(_summary(found))
        click.echo(folder / CERTIFICATES_TABLE)


def _summary(found: list[Certificate]) -> str:
    """The certificates as tables, feasible configurations first, and how to read them."""
    from designer.certify.certificate import KNOWN_RULES, UNKNOWN_RULES
    from designer.cli.table import format_table

    parts = []
    bounded = [each for each in found if each.depth_error_bound is not None]
    if bounded:
        header = ("configuration", "certificate", "bound %", "found %", "gap %", "gap of the design %")
        rows = [
            (
                each.configuration,
                WORDS[each.status],
                _percent(each.depth_error_bound),
                _percent(each.least_depth_error),
                _decimals(each.gap_percent),
                _decimals(each.design_gap_percent),
            )
            for each in bounded
        ]
        parts += [
            format_table(header, rows, right=header[2:]),
            f"no design has a smaller depth error than the bound; it knows: {KNOWN_RULES}",
            f"not known: {UNKNOWN_RULES}",
        ]
    others = [each for each in found if each.depth_error_bound is None]
    if others:
        lines = [(each.configuration, WORDS[each.status], _why(each)) for each in others]
        parts.append(format_table(("configuration", "certificate", "conflicting keys, or why not"), lines))
    return "\n".join(parts) if parts else "no configuration to certify: rules exclude them all"


def _why(certificate: Certificate) -> str:
    keys = ", ".join(certificate.conflicting_keys) or "none can be met, whatever these keys are"
    if certificate.status != "infeasible":
        return certificate.why_not_proven
    return keys if certificate.is_smallest else f"{keys} (not all of them may be needed)"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.4g}"


def _decimals(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
