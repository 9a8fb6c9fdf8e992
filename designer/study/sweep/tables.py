"""The tables of a sweep, for people and machines: CSV always, Parquet where pyarrow is installed."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from designer.extras import is_installed
from designer.files import InputError, write_atomically
from designer.requirement import Requirement, requirement_from_json
from designer.study.columns import typed
from designer.study.ranking import best_first, ranking_columns
from designer.study.sweep.definition import requirement_at
from designer.study.sweep.layout import RESULT_COLUMNS
from designer.study.sweep.store import FILE_NAME, read_store

RESULTS, WINNERS = "results", "winners"
ASKED = "asked."
"""How the columns begin that hold the values of the axes."""


def read_sweep_results(folder: Path) -> pd.DataFrame:
    """One row for each finished point and configuration, in the order of points and of the 44.

    Columns: point, one ``asked.KEY`` for each axis, rank (best design of the point 1; empty unless feasible), then
    those of the store.

    Raises
    ------
    InputError
        The folder has no sweep.
    """
    with read_store(folder) as connection:
        coordinates = {
            number: json.loads(text)
            for number, text in connection.execute("SELECT point, coordinates FROM points ORDER BY point")
        }
        # With MAX, SQLite takes the other columns from the same row: what the latest round has found.
        found = connection.execute(
            f"SELECT point, {', '.join(RESULT_COLUMNS)}, MAX(round) FROM results GROUP BY point, configuration"
        )
        rows = [row[:-1] for row in found]
        base = requirement_of(folder)
    frame = pd.DataFrame(rows, columns=["point", *RESULT_COLUMNS])
    order = {configuration.name: place for place, configuration in enumerate(base.configurations)}
    frame = frame.assign(place=frame["configuration"].map(order)).sort_values(["point", "place"], ignore_index=True)
    keys = list(next(iter(coordinates.values())))
    asked = pd.DataFrame({f"{ASKED}{key}": [coordinates[point][key] for point in frame["point"]] for key in keys})
    kinds = {each.name: each for each in base.configurations}
    frame = frame.assign(  # stores of version 0.1 leave them out
        family=[kinds[name].family for name in frame["configuration"]],
        topology=[kinds[name].topology for name in frame["configuration"]],
    )
    frame = typed(frame)
    ranks = _ranks(frame, base, coordinates)
    return pd.concat([frame[["point"]], asked, ranks, frame[list(RESULT_COLUMNS)]], axis=1)


def requirement_of(folder: Path) -> Requirement:
    """The base requirement of a sweep's folder.

    Raises
    ------
    InputError
        The folder has no sweep, or one of a version that kept it otherwise.
    """
    with read_store(folder) as connection:
        text = connection.execute("SELECT value FROM about WHERE key = 'requirement'").fetchone()[0]
    try:
        return requirement_from_json(text)
    except ValueError:
        raise InputError(f"{folder / FILE_NAME}: was written by another version of designer") from None


def axis_columns(frame: pd.DataFrame) -> list[str]:
    """The columns of a sweep's table that hold what was asked."""
    return [name for name in frame.columns if name.startswith(ASKED)]


def winners(frame: pd.DataFrame) -> pd.DataFrame:
    """The best design of each point; points without one are left out."""
    return frame[frame["rank"] == 1].reset_index(drop=True)


def pareto(table: pd.DataFrame, columns: Sequence[str]) -> pd.DataFrame:
    """The rows that no other row beats or equals in every column while beating it in one; smaller is better."""
    ordered = table.sort_values(list(columns), kind="stable")
    values = ordered[list(columns)].to_numpy(dtype=float)
    kept: list[int] = []
    for index, row in enumerate(values):
        front = values[kept]
        # Sorted by the first column, nothing that comes later can beat what is kept.
        if not len(kept) or not (front <= row).all(axis=1).any():
            kept.append(index)
    return ordered.iloc[kept]


def _ranks(frame: pd.DataFrame, base: Requirement, coordinates: dict[int, dict[str, float]]) -> pd.Series[int]:
    """Ranks as a study of each point gives them."""
    first, second = ranking_columns(base.objective)
    is_swept = any(key.startswith("objective.") for key in next(iter(coordinates.values())))
    ranks = pd.Series(pd.NA, index=frame.index, dtype="Int64", name="rank")
    feasible = frame[frame["status"] == "feasible"]
    for point in feasible["point"].unique().tolist():
        designs = feasible[feasible["point"] == point]
        objective = requirement_at(base, coordinates[point]).objective if is_swept else base.objective
        order = best_first(list(designs[first]), list(designs[second]), objective.tolerance)
        ranks[designs.index[order]] = range(1, len(order) + 1)
    return ranks


def write_tables(folder: Path) -> None:
    """Write results.csv and winners.csv, and both as Parquet if pyarrow is installed."""
    frame = read_sweep_results(folder)
    for name, table in ((RESULTS, frame), (WINNERS, winners(frame))):
        write_atomically(folder / f"{name}.csv", table.to_csv(index=False))
        if is_installed("parquet"):
            buffer = io.BytesIO()
            table.to_parquet(buffer, index=False)
            write_atomically(folder / f"{name}.parquet", buffer.getvalue())
