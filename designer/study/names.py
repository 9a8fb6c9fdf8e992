"""The names of the files in a study's folder; in the manifest they are relative, with forward slashes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

RESULTS = "designs.csv"
DESIGNS = "designs"
PARETO = "fronts.csv"
LENSES = "lenses.csv"
COMPARATORS_TABLE = "comparators.csv"
REQUIREMENT = "requirement.toml"
PROVENANCE = "provenance.json"
TOLERANCES = "tolerances.json"
CERTIFICATES = "certificates.json"
CERTIFICATES_TABLE = "certificates.csv"
CHECKS = "checks"
UNCHECKED = "unchecked.json"
"""In a check's folder: why a design could not be checked."""
PDF = "study.pdf"
PAGE = "study.html"
FIGURES = "figures"
FIGURE_LIST = "report.json"
"""In the folder of figures: the names of those that the report has drawn, since others may stand beside them."""
FILES_OF_A_CHECK = ("raw.png", "upper.png", "lower.png", "check.npz", "check.json", UNCHECKED)


def design_path(folder: Path, configuration: str) -> Path:
    """Where a configuration's design stands."""
    return folder / design_name(configuration)


def folder_of_check(folder: Path, configuration: str) -> Path:
    """Where the check of a configuration's design stands."""
    return folder / CHECKS / configuration


def design_name(configuration: str) -> str:
    """The name of a configuration's design."""
    return f"{DESIGNS}/{configuration}.json"


def names_of_check(configuration: str) -> tuple[str, ...]:
    """The names of all files that a check of a configuration's design may leave."""
    return tuple(f"{CHECKS}/{configuration}/{file}" for file in FILES_OF_A_CHECK)


def figure_name(file: str) -> str:
    """The name of a figure of the report."""
    return f"{FIGURES}/{file}"


def names_of_study(configurations: Iterable[str]) -> tuple[str, ...]:
    """The names of all files that a study of some configurations may write, but for figures."""
    tables = [RESULTS, PARETO, LENSES, COMPARATORS_TABLE, CERTIFICATES_TABLE, CERTIFICATES]
    names = [REQUIREMENT, *tables, PROVENANCE, TOLERANCES, PDF, PAGE, figure_name(FIGURE_LIST)]
    for configuration in configurations:
        names += [design_name(configuration), *names_of_check(configuration)]
    return tuple(names)
