"""``designer study`` and ``designer report``: from a requirement to a ranked trade study, its page and its PDF."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.cli.comparators import compare_ideas, other_ideas
from designer.cli.tolerated import forgiveness, tolerate_best
from designer.extras import needs, require_extra
from designer.files import InputError

if TYPE_CHECKING:
    from designer.as_built.named import NamedTolerances
    from designer.requirement import Requirement
    from designer.requirement.model import Objective
    from designer.study.columns import Column
    from designer.study.row import Row
    from designer.study.study import Study

SHOWN_DESIGNS = 10
SECONDS_OF_A_CHECK = (15.0, 60.0)
"""For 1600 x 1200 pixels."""


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
@click.option("--no-pdf", is_flag=True, help="Do not write study.pdf and its figures; study.html needs neither.")
@click.option(
    "--only", multiple=True, metavar="NAME...", help="Study only these configurations (names or glob patterns)."
)
@click.option(
    "--checks",
    type=click.IntRange(min=0),
    default=3,
    show_default=True,
    help="Number of best designs to check end to end; 0 for none.",
)
@click.option(
    "--tolerances",
    is_flag=False,
    flag_value="precision",
    metavar="[GRADE|FILE.toml]",
    help="Also build sensors of the best designs within tolerances (docs/tolerances.md): coarse, standard, precision "
    "(if none is named), or a file.",
)
@click.option(
    "--comparators",
    is_flag=True,
    help="Also design what else could be built for the requirement: stacked cameras, a double-lobed mirror, two "
    "spheres, plane mirrors (docs/comparators.md).",
)
@click.option("--jobs", type=click.IntRange(min=1), help="Number of processes.  [default: one per core]")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def study(
    requirement: Path,
    out: Path | None,
    no_pdf: bool,
    only: tuple[str, ...],
    checks: int,
    tolerances: str | None,
    comparators: bool,
    jobs: int | None,
    quiet: bool,
) -> None:
    """Optimise, trace, score and rank every configuration for a requirement; check the best designs end to end."""
    from designer.requirement import read_requirement
    from designer.study.selection import restrict

    asked = read_requirement(requirement)
    if only:
        asked = restrict(asked, only, "--only")
    folder = out or Path("reports") / asked.name
    if not no_pdf:
        require_extra("report", "study.pdf", "or use --no-pdf")
    if checks:
        require_extra("imaging", "checking designs end to end", "or use --checks 0")
        _refuse_too_large(asked)
    tolerated = None if tolerances is None else _tolerances(tolerances)

    from designer.study.claim import claimed
    from designer.study.names import names_of_study

    with claimed(folder, names_of_study(each.name for each in asked.configurations)) as kept:
        if not quiet:
            _tell_beforehand(asked, folder, kept)
        _run(asked, folder, not no_pdf, checks, tolerated, comparators, jobs, quiet)


def _tolerances(named: str) -> NamedTolerances:
    from designer.as_built.named import named_tolerances

    return named_tolerances(named)


def _tell_beforehand(asked: Requirement, folder: Path, kept: list[str]) -> None:
    from designer.own_files import listed
    from designer.requirement.notes import notes_on

    if kept:
        click.echo(f"{folder}: not written by the study, and kept: {listed(kept)}", err=True)
    for note in notes_on(asked):
        click.echo(f"note: {note}", err=True)


def _run(
    asked: Requirement,
    folder: Path,
    with_pdf: bool,
    checks: int,
    tolerated: NamedTolerances | None,
    comparators: bool,
    jobs: int | None,
    quiet: bool,
) -> None:
    from designer.study.process_pool import cores, start_server

    # It imports the solver while this process imports the rest.
    start_server("designer.study.task")

    from designer.cli.progress import show_progress
    from designer.study.folder import with_checks
    from designer.study.run import run_study

    with show_progress(quiet=quiet) as progress:
        found = run_study(asked, folder, jobs=jobs or cores(), progress=progress)
    _check_best(found, folder, checks, jobs or cores(), quiet)
    if tolerated is not None and found.feasible:
        found = tolerate_best(found, folder, tolerated, jobs or cores(), quiet)
    if comparators:
        found = compare_ideas(found, folder, jobs or cores(), quiet)
    whole = with_checks(found, folder)
    page = _write_page(whole, folder)
    pdf = None
    if with_pdf:
        if not quiet:
            click.echo("Typesetting study.pdf ...", err=True)
        pdf = _typeset(whole, folder, jobs or cores(), quiet)
    if not quiet:
        click.echo(f"{_result(found, folder, pdf)}\n{page}")


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="STUDY_FOLDER")
@needs("report")
def report(folder: Path) -> None:
    """Typeset study.pdf and write study.html again from the folder of a study."""
    if not folder.is_dir():
        raise InputError(f"{folder}: must be the folder of a study")
    from designer.study.claim import locked_study
    from designer.study.folder import read_study
    from designer.study.names import REQUIREMENT, RESULTS
    from designer.study.process_pool import cores

    if not (folder / RESULTS).exists() and not (folder / REQUIREMENT).exists():
        raise InputError(f"{folder}: not the folder of a study: it contains neither {RESULTS} nor {REQUIREMENT}")

    with locked_study(folder):
        found = read_study(folder)
        click.echo(_typeset(found, folder, cores()))
        click.echo(_write_page(found, folder))


def _refuse_too_large(asked: Requirement) -> None:
    """Find out now, and not after minutes of work, whether designs can be rendered for their checks."""
    from designer.imaging.render.camera_rays import refuse_too_large

    try:
        refuse_too_large(asked.camera.width_px, asked.camera.height_px)
    except InputError as error:
        raise InputError(f"camera: {error}; use --checks 0 to study it without end-to-end checks") from None


def _check_best(found: Study, folder: Path, count: int, jobs: int, quiet: bool) -> None:
    """Check the best designs end to end; without any to check, only remove the checks of an earlier study."""
    from designer.study.checks import CheckProgress, check_designs

    def tell(progress: CheckProgress) -> None:
        verdict = f"{'passes' if progress.passed else 'fails'} the end-to-end check ({progress.seconds:.0f} s)"
        if progress.problem:
            verdict = f"could not be checked: {progress.problem}"
        click.echo(f"[{progress.done}/{progress.total}] {progress.configuration}: {verdict}", err=True)

    designs = [design for _, design in found.best(count)]
    if designs and not quiet:
        which = "best design" if len(designs) == 1 else f"{len(designs)} best designs"
        click.echo(f"Checking the {which} end to end, {_time_of_a_check(found.requirement)} per design ...", err=True)
    check_designs(designs, folder, jobs=jobs, progress=None if quiet else tell)


def _time_of_a_check(asked: Requirement) -> str:
    """How long a check takes: as long as there are pixels to render."""
    from designer.cli.progress import duration

    share = asked.camera.width_px * asked.camera.height_px / (1600 * 1200)
    least, most = (duration(max(1.0, share * seconds)) for seconds in SECONDS_OF_A_CHECK)
    return (
        f"{least.removesuffix(' s') if most.endswith(' s') else least} to {most}" if least != most else f"about {most}"
    )


def _typeset(found: Study, folder: Path, jobs: int, quiet: bool = False) -> Path:
    from designer.report.document import write_pdf

    def tell(note: str) -> None:
        click.echo(f"study.pdf: {note}", err=True)

    return write_pdf(found, folder, None if quiet else tell, jobs=jobs)


def _write_page(found: Study, folder: Path) -> Path:
    from designer.report.html.document import write_html

    return write_html(found, folder)


def _result(found: Study, folder: Path, pdf: Path | None) -> str:
    """Where the results are, how many configurations came to what, and the best designs."""
    from designer.study.names import RESULTS

    parts = [*_ranking(found), _counts(found)]
    if found.feasible:
        parts += [*_lenses(found), *forgiveness(found), *_notes_on_best(found, folder, pdf)]
    else:
        parts += _why_nothing(found)
    parts += other_ideas(found)
    parts.append(f"{pdf or folder / RESULTS}")
    return "\n".join(parts)


def _ranking(found: Study) -> list[str]:
    """The best designs as a table, and how to read it; nothing if nothing is feasible."""
    from designer.cli.table import format_table
    from designer.study.columns import COLUMNS, SCORE_COLUMNS
    from designer.study.ranking import ties_in_words

    shown = found.feasible[:SHOWN_DESIGNS]
    if not shown:
        return []
    columns = [COLUMNS[name] for name in SCORE_COLUMNS]
    header = ["rank", "configuration", *(column.heading for column in columns)]
    is_starred = any(row.is_beyond_first_order for row in shown)
    lines = []
    for row in shown:
        error, *others = (_cell(row, column) for column in columns)
        star = (" *" if row.is_beyond_first_order else "  ") if is_starred else ""
        lines.append((str(row.rank), row.configuration, error + star, *others))
    parts = [format_table(header, lines, right=(header[0], *header[2:]))]
    if is_starred:
        parts.append("* first order underestimates the worst point; see depth_error_*_second_order in designs.csv")
    if len(shown) > 1:
        objective = found.requirement.objective
        parts += [*filter(None, [ties_in_words(objective, found.feasible)]), _how_ranked(objective)]
    return parts


def _lenses(found: Study) -> list[str]:
    """What each lens of a catalogue gives in the best design's configuration, as a table; nothing with one lens."""
    from designer.cli.table import format_table

    winner = found.feasible[0].configuration
    rows = found.lenses_of(winner)
    if not rows:
        return []
    header = ("lens", "status", "depth error", "height mm", "f-number", "focused at mm", "largest blur px")
    lines = []
    for row in rows:
        is_feasible = row.status == "feasible"
        error = "-" if row.depth_error_rms is None else f"{100 * row.depth_error_rms:.3f} %"
        at = "infinity" if is_feasible and row.focus_distance_mm is None else _decimal(row.focus_distance_mm, 0)
        lines.append(
            (
                row.lens,
                "chosen" if is_feasible and row.is_chosen else row.status,
                error,
                _decimal(row.height_mm, 1),
                _decimal(row.f_number, 2),
                at,
                _decimal(row.largest_blur_px, 1),
            )
        )
    return [
        f"lenses for the best design ({winner}), each as if it were the only one:",
        format_table(header, lines, right=header[2:]),
        *(f"{row.lens}: {row.reason}" for row in rows if row.reason),
    ]


def _decimal(value: float | None, decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"


def _counts(found: Study) -> str:
    from collections import Counter

    counts = Counter(row.status for row in found.rows).most_common()
    listed = ", ".join(f"{count} {status}" for status, count in counts)
    return f"{len(found.rows)} configuration{'s' * (len(found.rows) != 1)}: {listed}"


def _why_nothing(found: Study) -> list[str]:
    """What stood in the way most often if nothing is feasible."""
    from collections import Counter

    limits = Counter(row.text("closest_constraint") for row in found.rows if row.text("closest_constraint"))
    if limits:
        (constraint, times), *_ = limits.most_common(1)
        near = [row for row in found.rows if row.text("closest_constraint") == constraint]
        nearest = min(near, key=lambda row: row.number("closest_violation") or 0.0)
        return [
            f"most frequent limiting constraint ({times} of {len(found.with_status('infeasible'))}): {constraint}; "
            f"least violated by {nearest.configuration}: {nearest.number('closest_violation'):.3g} "
            f"{nearest.text('closest_unit')}"
        ]
    reasons = Counter(row.text("reason") for row in found.rows if row.text("reason"))
    return [
        f"most frequent reason ({times} of {len(found.rows)}): {reason}" for reason, times in reasons.most_common(1)
    ]


def _how_ranked(objective: Objective) -> str:
    """Why the order is not that of any column."""
    first, then = (goal.replace("_", " ") for goal in (objective.minimise, objective.then))
    share = f"{objective.within_percent:g} %"
    return (
        f"ranking: designs whose lowest {first} is within {share} of the best are ranked by {then}, the others by "
        f"{first}; values are shown after trading up to {share} of {first} for {then}"
    )


def _notes_on_best(found: Study, folder: Path, pdf: Path | None) -> list[str]:
    """How many fabrication notes there are on the best design, and where they stand; nothing if there are none."""
    from designer.evaluate.score import recorded_fabrication_notes
    from designer.study.names import design_path

    (row, design), *_ = found.best(1)
    count = len(recorded_fabrication_notes(design))
    if not count:
        return []
    where = (
        f"with the winner in {pdf.name}"
        if pdf
        else f"score.fabrication_notes in {design_path(folder, row.configuration)}"
    )
    notes = f"{count} fabrication notes" if count > 1 else "fabrication note"
    return [f"before ordering mirrors for the best design, read the {notes} ({where})"]


def _cell(row: Row, column: Column) -> str:
    """A value for people: shares as percent with three decimals, ratios with three, lengths and pixels with one."""
    value = row.number(column.name)
    decimals = 1 if column.unit in {"mm", "px"} else 3
    return "-" if value is None else f"{column.factor * value:.{decimals}f}{' %' if column.unit == '%' else ''}"
