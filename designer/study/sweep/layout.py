"""The tables of a sweep's store: their columns in this version, and those of other versions seen as these."""

from __future__ import annotations

import sqlite3

from designer.study.columns import SWEPT_COLUMNS
from designer.study.sweep.checksums import CHECKSUM

_SQL_TYPES = {str: "TEXT", float: "REAL", int: "INTEGER", bool: "INTEGER"}
RESULT_COLUMNS = {name: _SQL_TYPES[column.kind] for name, column in SWEPT_COLUMNS.items()}
"""Columns of ``results`` beside the point, in order; lengths in mm, errors as shares."""

COLUMNS_OF_TASKS = ["point", "chunk", "round", "warm_starts", "seconds", CHECKSUM]
COLUMNS_OF_RESULTS = ["point", "chunk", "round", *RESULT_COLUMNS]

SCHEMA = f"""
CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE points (point INTEGER PRIMARY KEY, parent INTEGER, coordinates TEXT NOT NULL);
CREATE TABLE tasks (
    point INTEGER NOT NULL REFERENCES points, chunk INTEGER NOT NULL, round INTEGER NOT NULL, warm_starts TEXT NOT NULL,
    seconds REAL NOT NULL, {CHECKSUM} TEXT NOT NULL, PRIMARY KEY (point, chunk, round)
);
CREATE TABLE results (
    point INTEGER NOT NULL REFERENCES points, chunk INTEGER NOT NULL, round INTEGER NOT NULL,
    {", ".join(f"{name} {kind}" for name, kind in RESULT_COLUMNS.items())},
    PRIMARY KEY (point, configuration, round)
);
"""


def columns_of(connection: sqlite3.Connection, table: str) -> list[str]:
    """The columns of a table, in order."""
    return [name for _, name, *_ in connection.execute(f"PRAGMA table_info({table})")]


def has_other_columns(connection: sqlite3.Connection) -> bool:
    """Whether the tables are not those that this version writes."""
    return columns_of(connection, "results") != COLUMNS_OF_RESULTS or (
        columns_of(connection, "tasks") != COLUMNS_OF_TASKS
    )


def see_as_this_version(connection: sqlite3.Connection) -> None:
    """Let one connection see the results of another version as this one names them; the file stays as it is.

    What that version did not know is NULL, and there are no tasks: its warm starts are no designs of this version.
    """
    known = columns_of(connection, "results")
    columns = ", ".join(name if name in known else f"NULL AS {name}" for name in COLUMNS_OF_RESULTS)
    connection.execute(f"CREATE TEMP VIEW results AS SELECT {columns} FROM main.results")
    nothing = ", ".join(f"NULL AS {name}" for name in COLUMNS_OF_TASKS)
    connection.execute(f"CREATE TEMP VIEW tasks AS SELECT {nothing} WHERE 0")
