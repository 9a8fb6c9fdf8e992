"""What ``designer study --comparators`` says of other ideas for the same requirement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from designer.comparators.row import ComparatorRow
    from designer.study.comparators import ComparatorProgress
    from designer.study.study import Study


def compare_ideas(found: Study, folder: Path, jobs: int, quiet: bool) -> Study:
    """The study with its comparators; written into its folder, and told as it goes on."""
    from designer.study.comparators import design_comparators, write_comparators

    if not quiet:
        click.echo("Designing what else could be built, some minutes ...", err=True)

    def tell(progress: ComparatorProgress) -> None:
        row = progress.row
        click.echo(f"[{progress.done}/{progress.total}] {row.title}: {row.status.replace('_', ' ')}", err=True)

    rows = design_comparators(found.requirement, jobs=jobs, progress=None if quiet else tell)
    write_comparators(rows, folder)
    return replace(found, comparators=rows)


def other_ideas(found: Study) -> list[str]:
    """The comparators as a table below the winner; nothing if they were not asked for."""
    from designer.cli.table import format_table

    if not found.comparators:
        return []
    header = (
        "what else could be built",
        "cameras",
        "azimuth °",
        "depth error",
        "baseline mm",
        "height mm",
        "diameter mm",
        "largest blur px",
        "caustic mm",
    )
    lines = [_winner(found)] if found.feasible else []
    lines += [_line(row) for row in found.comparators]
    notes = [f"{row.title}: {row.reason}" for row in found.comparators if row.reason]
    return ["", format_table(header, lines, right=header[1:]), *notes]


def _winner(found: Study) -> tuple[str, ...]:
    row = found.feasible[0]
    error, *sizes = (
        row.number(name) for name in ("depth_error_rms", "baseline_mm", "height_mm", "diameter_mm", "largest_blur_px")
    )
    return (row.configuration, "1", "360", _percent(error), *map(_decimal, sizes), "0.0")


def _line(row: ComparatorRow) -> tuple[str, ...]:
    sizes = (row.baseline_mm, row.height_mm, row.diameter_mm, row.largest_blur_px, row.single_viewpoint_error_mm)
    around = "-" if row.azimuth_deg is None else f"{row.azimuth_deg:.0f}"
    star = " *" if row.status == "too_large" else ""
    return (row.title + star, str(row.cameras), around, _percent(row.depth_error_rms), *map(_decimal, sizes))


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.3f} %"


def _decimal(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
