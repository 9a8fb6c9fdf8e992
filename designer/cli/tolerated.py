"""What ``designer study --tolerances`` says of sensors built to the best designs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from designer.as_built.named import NamedTolerances
    from designer.study.study import Study
    from designer.study.tolerances import StudyTolerances


def tolerate_best(found: Study, folder: Path, asked: NamedTolerances, jobs: int, quiet: bool) -> Study:
    """The study with what its best designs forgive, and the most forgiving one; written into its folder."""
    from designer.study.tolerances import TRIALS, ToleranceProgress, to_be_built, tolerate_designs

    best, every = len(found.best()), [design for _, design in found.best(len(found.feasible))]
    designs = to_be_built(every, asked.values, best=best, seed=found.requirement.solve.seed)
    if not quiet:
        which = "best design" if best == 1 else f"{best} best designs"
        which += " and of one that forgives more" if len(designs) > best else ""
        click.echo(f"Building {TRIALS} sensors of the {which} within tolerances ({asked.name}) ...", err=True)

    def tell(progress: ToleranceProgress) -> None:
        click.echo(f"[{progress.done}/{progress.total}] {progress.configuration}: sensors built and traced", err=True)

    result = tolerate_designs(
        designs,
        asked.values,
        asked.name,
        folder,
        jobs=jobs,
        seed=found.requirement.solve.seed,
        progress=None if quiet else tell,
    )
    return replace(found, tolerances=result)


def forgiveness(found: Study) -> list[str]:
    """Depth error of built sensors and yield as a table, and the most forgiving design; nothing if not asked for."""
    from designer.cli.table import format_table

    if found.tolerances is None:
        return []
    header = ("rank", "configuration", "as designed", "median", "95th percentile", "good sensors")
    lines: list[tuple[str, ...]] = []
    for each in found.tolerances.designs:
        row = found.row(each.configuration)
        rank = "" if row is None else str(row.rank)
        if each.problem:
            lines.append((rank, each.configuration, "", "", "", each.problem))
            continue
        errors = (each.depth_error_as_designed, each.median, each.high)
        lines.append((rank, each.configuration, *map(_percent, errors), _percent(each.good)))
    growth = 100.0 * found.tolerances.growth
    return [
        "",
        f"sensors built within tolerances ({found.tolerances.name}), calibrated; good: depth error at most "
        f"{growth:g} % larger, blur within its limits:",
        format_table(header, lines, right=("rank", *header[2:])),
        _most_forgiving(found.tolerances),
    ]


def _most_forgiving(found: StudyTolerances) -> str:
    best, first = found.most_forgiving, found.designs[0]
    if best is None:
        return "no design keeps a depth at the 95th percentile"
    if best is first:
        return "the winner is also the most forgiving"
    return (
        f"most forgiving: {best.configuration}, {_percent(best.high)} at the 95th percentile, where the winner has "
        f"{_percent(first.high)}"
    )


def _percent(value: float | None) -> str:
    return "no depth" if value is None else f"{100.0 * value:.4g} %"
