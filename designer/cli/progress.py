"""How a running study shows itself: a live bar on a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from designer.study.progress import Progress

Listener = Callable[[Progress], None]


@contextmanager
def show_progress(*, quiet: bool) -> Iterator[Listener | None]:
    """Yield what a study calls after each configuration; None when quiet. Writes to stderr."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _live_bar() as listener:
            yield listener
    else:
        yield _print_line


def _print_line(progress: Progress) -> None:
    width = len(str(progress.total))
    click.echo(
        f"[{progress.done:{width}d}/{progress.total}] {progress.configuration}: {progress.status} "
        f"({progress.feasible} feasible so far, {duration(progress.remaining_seconds)} left)",
        err=True,
    )


@contextmanager
def _live_bar() -> Iterator[Listener]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[feasible]} feasible, {task.fields[left]} left"),
        TextColumn("[dim]{task.description}"),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=None, feasible=0, left="?")

        def update(progress: Progress) -> None:
            bar.update(
                task,
                total=progress.total,
                completed=progress.done,
                description=f"{progress.configuration} {progress.status}",
                feasible=progress.feasible,
                left=duration(progress.remaining_seconds),
            )

        yield update


def duration(seconds: float) -> str:
    """Seconds as a person reads them."""
    if not seconds < 1e6:  # unknown yet
        return "?"
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
