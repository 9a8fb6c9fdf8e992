"""``designer compare``: two studies or sweeps side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from designer.study.compare import StudyComparison

SHOWN = 20


@click.command()
@click.argument("first", type=click.Path(path_type=Path), metavar="A")
@click.argument("second", type=click.Path(path_type=Path), metavar="B")
def compare(first: Path, second: Path) -> None:
    """Compare two folders of studies or sweeps: requirements, winners, scores."""
    from designer.study.compare import compare as compare_folders

    found = compare_folders(first, second)
    click.echo("\n\n".join(filter(None, (_asked(found), _winners(found), _statuses(found), _scores(found)))))


def _asked(found: StudyComparison) -> str:
    from designer.cli.table import format_table

    if not found.asked:
        return "The requirements are identical."
    rows = [(key, _shown(a), _shown(b)) for key, a, b in found.asked]
    return "Requirements:\n" + format_table(("key", "A", "B"), rows)


def _winners(found: StudyComparison) -> str:
    from designer.cli.table import format_table
    from designer.study.sweep.tables import ASKED

    changed = found.changed_winners
    if found.winners.empty:
        return "No requirement has a winner in both A and B."
    text = f"Winners: {len(changed)} of {len(found.winners)} have a different configuration in B."
    axes = [name for name in found.winners.columns if name.startswith(ASKED)]
    header = (*(axis.removeprefix(ASKED) for axis in axes), "A", "B", "depth error A", "depth error B")
    rows = [
        (
            *(f"{row[axis]:g}" for axis in axes),
            row["configuration_a"],
            row["configuration_b"],
            f"{100 * row['depth_error_rms_a']:.3f} %",
            f"{100 * row['depth_error_rms_b']:.3f} %",
        )
        for _, row in changed.head(SHOWN).iterrows()
    ]
    return text + ("\n" + format_table(header, rows) if rows else "")


def _statuses(found: StudyComparison) -> str:
    from designer.cli.table import format_counts

    changed = found.changed_statuses
    if changed.empty:
        return ""
    lost = (changed["status_a"] == "feasible").sum()
    names = changed["configuration"].value_counts().head(SHOWN)
    counts = format_counts({str(name): int(count) for name, count in names.items()})
    return f"Feasible in A only: {lost}; in B only: {len(changed) - lost}. By configuration:\n{counts}"


def _scores(found: StudyComparison) -> str:
    from designer.cli.table import format_table
    from designer.study.columns import COLUMNS

    both = found.configurations.dropna(subset=["depth_error_rms_change"])
    if both.empty:
        return ""
    rows = []
    for column in (COLUMNS[name] for name in ("depth_error_rms", "height_mm", "diameter_mm")):
        changes = column.factor * both[f"{column.name}_change"]
        values = (changes.median(), changes.min(), changes.max())
        # A difference of percentages is no percentage of either.
        unit = "percentage points" if column.unit == "%" else column.unit
        rows.append((column.label, *(f"{value:+.4g} {unit}" for value in values)))
    header = ("B minus A", "median", "least", "most")
    return f"Scores of {len(both)} designs feasible in both:\n" + format_table(header, rows, right=header[1:])


def _shown(value: object) -> str:
    return "-" if value is None else str(value)
