"""The store of a sweep: one SQLite file in its folder, written by one process, a task at a time, each whole or absent.

Tables: ``points`` (number, parent, coordinates as JSON), ``tasks`` (one row for each finished task, with the warm
starts of its children), ``results`` (one row for each point and configuration), ``about`` (what the sweep was).
"""

from __future__ import annotations

import errno
import fcntl
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import JsonValue

from designer.files import InputError, check_folder
from designer.requirement import NOT_ASKED
from designer.study.columns import SWEPT_COLUMNS
from designer.study.sweep.plan import Point
from designer.study.sweep.point import TaskResult

FILE_NAME = "sweep.sqlite"
_SQL_TYPES = {str: "TEXT", float: "REAL", int: "INTEGER", bool: "INTEGER"}
RESULT_COLUMNS = {name: _SQL_TYPES[column.kind] for name, column in SWEPT_COLUMNS.items()}
"""Columns of ``results`` beside the point, in order; lengths in mm, errors as shares."""

_COLUMNS_OF_TASKS = ["point", "chunk", "warm_starts", "seconds"]

_SCHEMA = f"""
CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE points (point INTEGER PRIMARY KEY, parent INTEGER, coordinates TEXT NOT NULL);
CREATE TABLE tasks (
    point INTEGER NOT NULL REFERENCES points, chunk INTEGER NOT NULL, warm_starts TEXT NOT NULL, seconds REAL NOT NULL,
    PRIMARY KEY (point, chunk)
);
CREATE TABLE results (
    point INTEGER NOT NULL REFERENCES points, {", ".join(f"{name} {kind}" for name, kind in RESULT_COLUMNS.items())},
    PRIMARY KEY (point, configuration)
);
"""


class StoreError(OSError):
    """The store cannot be written: the disk is full, the folder read-only. What is in it stays whole."""


class Store:
    """An open store. Use :func:`open_store`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self.connection = connection

    def finished(self) -> set[tuple[int, int]]:
        """(point, chunk) of every finished task."""
        return set(self.connection.execute("SELECT point, chunk FROM tasks"))

    def warm_starts(self, point: int, chunk: int) -> str:
        """The warm starts that one finished task left, as JSON."""
        found = self.connection.execute("SELECT warm_starts FROM tasks WHERE point = ? AND chunk = ?", (point, chunk))
        return str(found.fetchone()[0])

    def feasible_count(self) -> int:
        """How many designs are feasible so far."""
        found = self.connection.execute("SELECT COUNT(*) FROM results WHERE status = 'feasible'")
        return int(found.fetchone()[0])

    def add(self, point: int, chunk: int, result: TaskResult) -> None:
        """Write one finished task, whole or not at all.

        Raises
        ------
        StoreError
            The disk is full or has failed; the task is not in the store.
        """
        columns = ["point", *RESULT_COLUMNS]
        rows = [[point, *(row.values.get(name) for name in RESULT_COLUMNS)] for row in result.rows]
        with self._writing():
            self.connection.executemany(
                f"INSERT INTO results ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})", rows
            )
            self.connection.execute(
                "INSERT INTO tasks VALUES (?, ?, ?, ?)", (point, chunk, result.warm_starts, result.seconds)
            )

    def create(self, about: dict[str, str], points: tuple[Point, ...]) -> None:
        """Lay out an empty store, or make sure that it holds this very sweep, by whatever name.

        Raises
        ------
        InputError
            It holds another sweep.
        StoreError
            It cannot be written.
        """
        try:
            self._create(about, points)
        except sqlite3.Error as error:
            raise InputError(f"{self.path}: is not a sweep store: {error}") from None

    def _create(self, about: dict[str, str], points: tuple[Point, ...]) -> None:
        planned = [(point.number, point.parent, json.dumps(point.coordinates)) for point in points]
        if self.connection.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
            known = dict(self.connection.execute("SELECT key, value FROM about"))
            same = {
                "plan of points": self.connection.execute("SELECT * FROM points ORDER BY point").fetchall() == planned,
                "requirement": _asked(known["requirement"]) == _asked(about["requirement"]),
                "version of designer": known["version of designer"] == about["version of designer"]
                and not _has_other_columns(self.connection),
            }
            if not all(same.values()):
                changed = " and ".join(key for key, is_same in same.items() if not is_same)
                raise InputError(
                    f"{self.path}: contains a sweep with a different {changed}; choose another folder with --out, or "
                    f"remove the file to start again"
                )
            if known != about:
                with self._writing():
                    self.connection.executemany("UPDATE about SET value = ?2 WHERE key = ?1", about.items())
            return
        with self._writing():
            # executescript would commit halfway.
            for statement in filter(str.strip, _SCHEMA.split(";")):
                self.connection.execute(statement)
            self.connection.executemany("INSERT INTO about VALUES (?, ?)", about.items())
            self.connection.executemany("INSERT INTO points VALUES (?, ?, ?)", planned)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            self.connection.execute("BEGIN IMMEDIATE")
            yield
            self.connection.execute("COMMIT")
        except sqlite3.Error as error:
            if self.connection.in_transaction:
                self.connection.rollback()
            raise StoreError(
                f"{self.path}: cannot be written: {error}; finished tasks are kept, and the same command resumes the "
                f"sweep"
            ) from None
        except BaseException:
            if self.connection.in_transaction:
                self.connection.rollback()
            raise


def _asked(requirement: str) -> dict[str, JsonValue]:
    try:
        content = json.loads(requirement)
    except ValueError:  # of a version that kept it otherwise
        return {}
    return {key: value for key, value in content.items() if key not in NOT_ASKED}


def _columns_of(connection: sqlite3.Connection, table: str) -> list[str]:
    return [name for _, name, *_ in connection.execute(f"PRAGMA table_info({table})")]


def _has_other_columns(connection: sqlite3.Connection) -> bool:
    """Whether the tables are not those that this version writes."""
    return _columns_of(connection, "results") != ["point", *RESULT_COLUMNS] or (
        _columns_of(connection, "tasks") != _COLUMNS_OF_TASKS
    )


def _see_as_this_version(connection: sqlite3.Connection) -> None:
    """Let one connection see the results of another version as this one names them; the file stays as it is.

    What that version did not know is NULL, and there are no tasks: its warm starts are no designs of this version.
    """
    known = _columns_of(connection, "results")
    columns = ", ".join(name if name in known else f"NULL AS {name}" for name in RESULT_COLUMNS)
    connection.execute(f"CREATE TEMP VIEW results AS SELECT point, {columns} FROM main.results")
    nothing = ", ".join(f"NULL AS {name}" for name in _COLUMNS_OF_TASKS)
    connection.execute(f"CREATE TEMP VIEW tasks AS SELECT {nothing} WHERE 0")


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the store of a folder for writing; one process at a time.

    Raises
    ------
    InputError
        Another process writes it, the file is no store, or the folder is a file.
    StoreError
        The folder cannot be written.
    """
    path = folder / FILE_NAME
    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / f".{FILE_NAME}.lock").open("w")
    except OSError as error:
        raise StoreError(f"{folder}: results cannot be written there: {error.strerror or error}") from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in {errno.EAGAIN, errno.EACCES}:
                raise
            raise InputError(f"{path}: another process is working on this sweep") from None
        try:
            connection = sqlite3.connect(path, isolation_level=None, timeout=30.0)
            connection.execute("SELECT COUNT(*) FROM sqlite_master")
        except sqlite3.DatabaseError as error:
            raise InputError(f"{path}: is not a sweep store: {error}") from None
        try:
            yield Store(path, connection)
        finally:
            connection.close()


@contextmanager
def read_store(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the store of a folder for reading, also while another process writes it.

    Raises
    ------
    InputError
        There is none.
    """
    path = folder / FILE_NAME
    if not path.is_file():
        raise InputError(f"{path}: there is no such sweep")
    # Not read-only: a write that was cut off is taken back first, by whoever opens the store next.
    connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=rw", uri=True, timeout=30.0)
    try:
        connection.execute("SELECT COUNT(*) FROM points")
        if not {"point", "configuration", "status"} <= set(_columns_of(connection, "results")):
            raise InputError(f"{path}: was written by another version of designer")
        if _has_other_columns(connection):
            _see_as_this_version(connection)
        yield connection
    except sqlite3.DatabaseError as error:
        raise InputError(f"{path}: is not a sweep store: {error}") from None
    finally:
        connection.close()
