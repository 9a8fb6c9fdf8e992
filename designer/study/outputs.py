"""The names of what a study's folder holds beside its tables and designs, for those who write it and who read it."""

from __future__ import annotations

from pathlib import Path

PDF = "study.pdf"
FIGURES = "figures"
FIGURE_PREFIXES = (
    "cross-section-",
    "trade-",
    "fronts-",
    "check-",
    "image-layout-",
    "resolution-",
    "depth-resolution-",
    "depth-error-",
)
CHECKS = "checks"
UNCHECKED = "unchecked.json"


def report_figures(folder: Path) -> list[Path]:
    """The figures of a report in a study's folder; what someone else put beside them is not among them."""
    return [path for path in (folder / FIGURES).glob("*.svg") if path.name.startswith(FIGURE_PREFIXES)]


def remove_report(folder: Path) -> None:
    """Remove a report and its figures, which describe other results than those about to be written."""
    (folder / PDF).unlink(missing_ok=True)
    for figure in report_figures(folder):
        figure.unlink()
