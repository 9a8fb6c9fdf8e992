"""``designer sweep``: many requirements, resumable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.extras import require_extra
from designer.files import InputError

if TYPE_CHECKING:
    from designer.study.sweep.cluster import Cluster
    from designer.study.sweep.run import SweepProgress

# Without a terminal a line for each task would be thousands.
LINES_WITHOUT_TERMINAL = 100


@click.command()
@click.argument("sweep", type=click.Path(path_type=Path), metavar="SWEEP.toml")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results.  [default: reports/NAME]")
@click.option("--jobs", type=click.IntRange(min=1), help="Number of processes.  [default: one per core]")
@click.option("--scheduler", metavar="ADDRESS", help="Use the Dask cluster with its scheduler at ADDRESS.")
@click.option("--workers", type=click.IntRange(min=1), help="Use a local Dask cluster with this number of workers.")
@click.option("--no-pdf", is_flag=True, help="Do not write sweep.pdf and its figures.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def sweep(
    sweep: Path,
    out: Path | None,
    jobs: int | None,
    scheduler: str | None,
    workers: int | None,
    no_pdf: bool,
    quiet: bool,
) -> None:
    """Optimise every configuration for many requirements; after an interruption the same command resumes."""
    from designer.study.process_pool import cores
    from designer.study.sweep.definition import read_sweep

    definition, base = read_sweep(sweep)
    if not no_pdf:
        require_extra("report", "sweep.pdf", "or use --no-pdf")
    folder = out or Path("reports") / definition.name
    if not quiet:
        from designer.requirement.notes import notes_on

        for note in notes_on(base):
            click.echo(f"note: {note}", err=True)

    from designer.study.sweep.run import run_sweep

    def tell(note: str) -> None:
        if not quiet:
            click.echo(note, err=True)

    cluster = _cluster(jobs, scheduler, workers)
    with _show_progress(quiet) as progress:
        run_sweep(definition, base, folder, jobs=jobs or cores(), workers=cluster, progress=progress, tell=tell)
    pdf = None if no_pdf else _typeset(folder)
    if not quiet:
        click.echo(_result(folder, pdf))


def _cluster(jobs: int | None, scheduler: str | None, workers: int | None) -> AbstractContextManager[Cluster] | None:
    """The cluster to work on; None for this machine."""
    if scheduler is None and workers is None:
        return None
    if jobs is not None or (scheduler is not None and workers is not None):
        raise InputError("give only one of --jobs, --workers and --scheduler")
    from designer.study.sweep.cluster import cluster_workers

    return cluster_workers(scheduler, workers)


def _typeset(folder: Path) -> Path | None:
    """The report; None if nothing is feasible."""
    from designer.report.sweep_document import write_sweep_pdf
    from designer.study.sweep.tables import read_sweep_results

    has_designs = (read_sweep_results(folder)["status"] == "feasible").any()
    return write_sweep_pdf(folder) if has_designs else None


@contextmanager
def _show_progress(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    import sys

    from designer.cli.progress import duration

    if quiet:
        yield None
        return
    is_live = sys.stderr.isatty()
    last_line = -1

    def show(progress: SweepProgress) -> None:
        nonlocal last_line
        share = LINES_WITHOUT_TERMINAL * progress.done // progress.total
        if not is_live and share == last_line and progress.done < progress.total:
            return
        last_line = share
        points = progress.done * progress.points_per_task
        total = progress.total * progress.points_per_task
        text = (
            (f"comparing neighbours, round {progress.round}: " if progress.round else "")
            + f"[{points:.0f}/{total:.0f}] requirements, {progress.feasible} feasible designs, "
            f"{duration(progress.remaining_seconds)} left"
        )
        click.echo(f"\r{text}\x1b[K" if is_live else text, err=True, nl=not is_live)

    try:
        yield show
    finally:
        if is_live and last_line >= 0:
            click.echo("", err=True)


def _result(folder: Path, pdf: Path | None) -> str:
    from designer.cli.table import format_counts
    from designer.study.sweep.tables import read_sweep_results, winners

    frame = read_sweep_results(folder)
    best = winners(frame)
    counts = ", ".join(f"{count} {status}" for status, count in frame["status"].value_counts().items())
    wins = {str(name): int(count) for name, count in best["configuration"].value_counts().head(5).items()}
    header = [f"{frame['point'].nunique()} requirements; most frequent winners:", format_counts(wins)] if wins else []
    problems = f"{len(frame)} configuration problems: {counts}"
    report = ["No design is feasible, so there is no report."] if best.empty else []
    return "\n".join([*header, problems, *report, str(pdf or folder / "results.csv")])
