"""``designer study`` and ``designer report``: from a requirement to a ranked trade study, and its PDF."""

from __future__ import annotations

import tempfile
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.files import InputError, check_folder

if TYPE_CHECKING:
    from designer.requirement.model import Objective

SHOWN_DESIGNS = 10
SECONDS_OF_A_CHECK = "10 to 30 s"


class _WordsAfterOnly(click.Command):
    """Lets ``--only`` take several words: those up to the next option or the requirement file."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Write ``--only A B`` as ``--only A --only B``, which click understands."""
        expanded: list[str] = []
        taking = False
        for word in args:
            if word.startswith("-"):
                taking = word == "--only"
                expanded.append(word)
            elif taking and expanded[-1] != "--only" and not _is_requirement(word):
                expanded += ["--only", word]
            else:
                taking = taking and expanded[-1] == "--only"
                expanded.append(word)
        return super().parse_args(ctx, expanded)


def _is_requirement(word: str) -> bool:
    """Whether a word after ``--only`` is the requirement file and no further name, which may be misspelt."""
    from designer.configurations import enumerate_configurations

    if any(fnmatchcase(configuration.name, word) for configuration in enumerate_configurations()):
        return False
    return word.endswith(".toml") or Path(word).exists()


@click.command(cls=_WordsAfterOnly)
@click.argument("requirement", type=click.Path(path_type=Path), metavar="REQUIREMENT.toml")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results.  [default: reports/NAME]")
@click.option("--no-pdf", is_flag=True, help="Leave out study.pdf and its figures.")
@click.option(
    "--only", multiple=True, metavar="NAME...", help="Only these of its configurations, by name or glob pattern."
)
@click.option(
    "--checks",
    type=click.IntRange(min=0),
    default=3,
    show_default=True,
    help="How many of the best designs to check end to end; 0 for none.",
)
@click.option("--jobs", type=click.IntRange(min=1), help="Processes to work with.  [default: one for each core]")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def study(
    requirement: Path,
    out: Path | None,
    no_pdf: bool,
    only: tuple[str, ...],
    checks: int,
    jobs: int | None,
    quiet: bool,
) -> None:
    """Optimise, trace, score and rank every configuration for a requirement, and check the best end to end."""
    from designer.requirement import read_requirement
    from designer.study.selection import restrict

    asked = read_requirement(requirement)
    if only:
        asked = restrict(asked, only, "--only")
    folder = out or Path("reports") / asked.name
    _make_folder(folder)

    from designer.cli.progress import show_progress
    from designer.study.child import cores
    from designer.study.run import run_study

    with show_progress(quiet=quiet) as progress:
        run_study(asked, folder, jobs=jobs or cores(), progress=progress)
    _check_best(folder, checks, jobs or cores(), quiet)
    if not no_pdf and not quiet:
        click.echo("Typesetting study.pdf ...", err=True)
    pdf = None if no_pdf else _typeset(folder, quiet)
    if not quiet:
        click.echo(_result(folder, pdf, asked.objective))


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="STUDY_FOLDER")
def report(folder: Path) -> None:
    """Typeset study.pdf again from the folder of a study."""
    if not folder.is_dir():
        raise InputError(f"{folder}: must be the folder of a study")
    click.echo(_typeset(folder))


def _check_best(folder: Path, count: int, jobs: int, quiet: bool) -> None:
    """Check the best designs end to end; without any to check, only remove those of an earlier study."""
    from designer.study.checks import CheckProgress, best_designs, check_best

    def tell(progress: CheckProgress) -> None:
        verdict = f"{'passes' if progress.passed else 'fails'} the end-to-end check ({progress.seconds:.0f} s)"
        if progress.problem:
            verdict = f"could not be checked: {progress.problem}"
        click.echo(f"[{progress.done}/{progress.total}] {progress.configuration}: {verdict}", err=True)

    designs = len(best_designs(folder, count))
    if designs and not quiet:
        which = "best design" if designs == 1 else f"{designs} best designs"
        click.echo(f"Checking the {which} end to end, {SECONDS_OF_A_CHECK} a design ...", err=True)
    check_best(folder, count, jobs=jobs, progress=None if quiet else tell)


def _typeset(folder: Path, quiet: bool = False) -> Path:
    from designer.report.document import write_pdf

    def tell(note: str) -> None:
        click.echo(f"study.pdf: {note}", err=True)

    return write_pdf(folder, None if quiet else tell)


def _make_folder(folder: Path) -> None:
    """Find out now, and not after minutes of work, whether results can be written."""
    try:
        check_folder(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written there: {error.strerror or error}") from None


def _result(folder: Path, pdf: Path | None, objective: Objective) -> str:
    """Where the results are, how many configurations came to what, and the best designs."""
    import csv
    import io
    from collections import Counter

    from designer.cli.table import format_table
    from designer.files import read_text

    rows = list(csv.DictReader(io.StringIO(read_text(folder / "designs.csv"))))
    feasible = [row for row in rows if row["status"] == "feasible"]
    counts = ", ".join(f"{count} {status}" for status, count in Counter(row["status"] for row in rows).most_common())
    header = ("rank", "configuration", "depth error", "of limit", "baseline mm", "height mm", "diameter mm")
    beyond = [row for row in feasible[:SHOWN_DESIGNS] if row.get("first_order_valid") == "False"]
    lines = [
        (
            str(rank),
            row["configuration"],
            _cell(row["depth_error_rms"], 100, 3, " %") + (("  ", " *")[row in beyond] if beyond else ""),
            _cell(row["limit_ratio"], 1, 3),
            *(_cell(row[key], 1, 1) for key in ("baseline_mm", "height_mm", "diameter_mm")),
        )
        for rank, row in enumerate(feasible[:SHOWN_DESIGNS], 1)
    ]
    parts = [format_table(header, lines, right=(header[0], *header[2:]))] if lines else []
    if beyond:
        parts.append("* first order, too little at the worst point; see depth_error_*_second_order in designs.csv")
    if len(lines) > 1:
        parts.append(_how_ranked(objective))
    parts.append(f"{len(rows)} configuration{'s' * (len(rows) != 1)}: {counts}")
    if feasible:
        parts += _remarks_on_best(folder / "designs" / f"{feasible[0]['configuration']}.json", pdf)
    parts.append(f"{pdf}" if pdf else f"{folder / 'designs.csv'}")
    return "\n".join(parts)


def _how_ranked(objective: Objective) -> str:
    """Why the order is not that of any column."""
    first, then = (goal.replace("_", " ") for goal in (objective.minimise, objective.then))
    share = f"{objective.within_percent:g} %"
    return (
        f"ranks: by {then} where the least {first} a design reaches is within {share} of the best of all, the others "
        f"by that {first}; shown after up to {share} of it was given up for {then}"
    )


def _remarks_on_best(path: Path, pdf: Path | None) -> list[str]:
    """How many remarks there are on the best design, and where they stand; nothing if there are none."""
    from designer.design import read_design

    count = len(read_design(path).score.get("remarks", [])) if path.exists() else 0
    if not count:
        return []
    where = f"with the winner in {pdf.name}" if pdf else f"score.remarks in {path}"
    return [
        f"before ordering the best design's mirrors, read the {f'{count} remarks' if count > 1 else 'remark'} ({where})"
    ]


def _cell(number: str, factor: float, decimals: int, unit: str = "") -> str:
    return f"{factor * float(number):.{decimals}f}{unit}" if number else "-"
