"""Two studies or two sweeps side by side: what changed in the requirement, in the winners, in the scores."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from designer.files import InputError
from designer.notebook_html import html_table
from designer.requirement import NOT_ASKED, Requirement, requirement_to_toml
from designer.study.columns import SCORE_COLUMNS
from designer.study.folder import read_rows, read_stored_requirement
from designer.study.names import RESULTS
from designer.study.row import frame_of
from designer.study.sweep.store import FILE_NAME
from designer.study.sweep.tables import axis_columns, read_sweep_results, requirement_of


@dataclass(frozen=True, slots=True)
class StudyComparison:
    """What differs between two results.

    Attributes
    ----------
    asked
        (key, value in A, value in B) of every key of the requirement that differs; None where it is not given.
    winners
        One row for each requirement that both have: its axes (sweeps), the winners and their scores, ``_a`` and
        ``_b``.
    configurations
        One row for each requirement and configuration in both: status and scores, ``_a`` and ``_b``.
    """

    asked: tuple[tuple[str, object, object], ...]
    winners: pd.DataFrame
    configurations: pd.DataFrame

    @property
    def changed_winners(self) -> pd.DataFrame:
        """Requirements whose winner is another configuration in B."""
        return self.winners[self.winners["configuration_a"] != self.winners["configuration_b"]]

    @property
    def changed_statuses(self) -> pd.DataFrame:
        """Configurations that are feasible in one and not in the other."""
        feasible = self.configurations[["status_a", "status_b"]] == "feasible"
        return self.configurations[feasible["status_a"] != feasible["status_b"]]

    def _repr_html_(self) -> str:
        title = (
            f"requirements in both: {len(self.winners)}; winners changed: {len(self.changed_winners)}; "
            f"configurations changed in feasibility: {len(self.changed_statuses)}"
        )
        return html_table(title, ("key of the requirement", "A", "B"), self.asked)


def compare(first: Path, second: Path) -> StudyComparison:
    """Compare two folders, both of studies or both of sweeps.

    Sweeps are compared where they asked the same of the same axes.

    Raises
    ------
    InputError
        A folder holds neither, they are of different kinds, or the sweeps have other axes.
    """
    asked_a, table_a = _read(first)
    asked_b, table_b = _read(second)
    axes = axis_columns(table_a)
    if axes != axis_columns(table_b):
        raise InputError(f"cannot be compared: {first} is {_kind(axes)}, {second} is {_kind(axis_columns(table_b))}")
    swept = {axis.partition(".")[2] for axis in axes}
    flat_a, flat_b = (dict(_flat(tomllib.loads(requirement_to_toml(asked)))) for asked in (asked_a, asked_b))
    keys = [key for key in {**flat_a, **flat_b} if key not in NOT_ASKED and key not in swept]
    changes = tuple((key, flat_a.get(key), flat_b.get(key)) for key in keys if flat_a.get(key) != flat_b.get(key))
    return StudyComparison(
        changes,
        _joined(table_a[table_a["rank"] == 1], table_b[table_b["rank"] == 1], axes, ["configuration", *SCORE_COLUMNS]),
        _joined(table_a, table_b, [*axes, "configuration"], ["status", "rank", *SCORE_COLUMNS]),
    )


def _kind(axes: list[str]) -> str:
    return f"a sweep over {', '.join(axis.partition('.')[2] for axis in axes)}" if axes else "a study"


def _read(folder: Path) -> tuple[Requirement, pd.DataFrame]:
    """What was asked, and the table of results."""
    if (folder / FILE_NAME).is_file():
        return requirement_of(folder), read_sweep_results(folder)
    if not (folder / RESULTS).is_file():
        holds = f"contains neither {RESULTS} nor {FILE_NAME}" if folder.is_dir() else "is not a folder"
        raise InputError(f"{folder}: {holds}; give the folder of a study or of a sweep")
    return read_stored_requirement(folder), frame_of(read_rows(folder))


def _joined(first: pd.DataFrame, second: pd.DataFrame, on: list[str], columns: list[str]) -> pd.DataFrame:
    if not on:
        pairs = pd.merge(first[columns], second[columns], how="cross", suffixes=("_a", "_b"))
    else:
        pairs = pd.merge(first[[*on, *columns]], second[[*on, *columns]], on=on, suffixes=("_a", "_b"))
    scores = {suffix: pairs[[f"{score}_{suffix}" for score in SCORE_COLUMNS]].astype(float) for suffix in ("a", "b")}
    changes = {f"{score}_change": scores["b"][f"{score}_b"] - scores["a"][f"{score}_a"] for score in SCORE_COLUMNS}
    return pairs.assign(**changes)


def _flat(content: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Every value of a requirement with its dotted key."""
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
