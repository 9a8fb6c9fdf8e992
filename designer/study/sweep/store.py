"""The store of a sweep: one SQLite file in its folder, written by one process, a task at a time, each whole or absent.

Tables: ``points`` (number, parent, coordinates as JSON), ``tasks`` (one row for each finished task, with the warm
starts of its neighbours and the checksum of all that it found), ``results`` (a row for each point and configuration
from round 0, and one more from each later round that has found something better), ``about`` (what the sweep was, and
the checksum of that).
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import JsonValue

from designer.files import InputError
from designer.requirement import NOT_ASKED
from designer.study.lock import locked
from designer.study.sweep.checksums import (
    CHECKSUM,
    damaged_tasks,
    has_checksums,
    is_plan_whole,
    is_truncated,
    plan_checksum,
    readable_text,
    state_of,
    structural_damage,
    task_checksum,
)
from designer.study.sweep.layout import (
    COLUMNS_OF_RESULTS,
    RESULT_COLUMNS,
    SCHEMA,
    columns_of,
    has_other_columns,
    see_as_this_version,
)
from designer.study.sweep.plan import Point
from designer.study.sweep.point import TaskResult

FILE_NAME = "sweep.sqlite"
_TRUNCATED = "the file has been truncated"
_START_AGAIN = "remove the file to start again, or choose another folder with --out"


class StoreError(OSError):
    """The store cannot be written: the disk is full, the folder read-only. What is in it stays whole."""


class Store:
    """An open store. Use :func:`open_store`."""

    def __init__(self, path: Path, connection: sqlite3.Connection, was_emptied: bool) -> None:
        self.path = path
        self.connection = connection
        self.was_emptied = was_emptied
        """Whether the file was there but empty: truncated, or cut off before anything was solved."""

    def finished(self, number: int) -> set[tuple[int, int]]:
        """(point, chunk) of every finished task of a round."""
        return set(self.connection.execute("SELECT point, chunk FROM tasks WHERE round = ?", (number,)))

    def better(self, number: int) -> set[tuple[int, int]]:
        """(point, chunk) of every task of a round with results; from round 1 on it has found something better."""
        return set(self.connection.execute("SELECT DISTINCT point, chunk FROM results WHERE round = ?", (number,)))

    def warm_starts(self, point: int, chunk: int, number: int = 0) -> str:
        """The warm starts that one finished task left, as JSON."""
        found = self.connection.execute(
            "SELECT warm_starts FROM tasks WHERE point = ? AND chunk = ? AND round = ?", (point, chunk, number)
        )
        return str(found.fetchone()[0])

    def warm_starts_before(self, point: int, chunk: int, number: int) -> tuple[str, ...]:
        """The warm starts that a point's tasks left before a round, oldest first."""
        found = self.connection.execute(
            "SELECT warm_starts FROM tasks WHERE point = ? AND chunk = ? AND round < ? ORDER BY round",
            (point, chunk, number),
        )
        return tuple(text for (text,) in found)

    def statuses_before(self, point: int, chunk: int, number: int) -> dict[str, str]:
        """The status of each configuration of one task, as it was before a round."""
        found = self.connection.execute(
            "SELECT configuration, status FROM results WHERE point = ? AND chunk = ? AND round < ? ORDER BY round",
            (point, chunk, number),
        )
        return dict(found)

    def feasible_before(self, number: int, column: str) -> dict[tuple[int, str], float]:
        """One column of each (point, configuration) that was feasible before a round, as it was then."""
        found = self.connection.execute(
            f"SELECT point, configuration, {column} FROM results WHERE round < ? AND status = 'feasible' "
            "ORDER BY point, configuration, round",
            (number,),
        )
        return {(point, name): value for point, name, value in found}

    def impossible_before(self, number: int) -> set[tuple[int, str]]:
        """(point, configuration) of what a rule excluded before a round."""
        return set(
            self.connection.execute(
                "SELECT point, configuration FROM results WHERE round < ? AND status = 'impossible'", (number,)
            )
        )

    def feasible_count(self) -> int:
        """How many designs are feasible so far."""
        found = self.connection.execute(
            "SELECT COUNT(*) FROM (SELECT DISTINCT point, configuration FROM results WHERE status = 'feasible')"
        )
        return int(found.fetchone()[0])

    def remove_damaged(self) -> int:
        """Remove the tasks that are not as they were written, so that they run again; how many there were.

        Raises
        ------
        InputError
            The store is damaged beyond its tasks.
        StoreError
            It cannot be written.
        """
        try:
            damaged = damaged_tasks(self.connection, COLUMNS_OF_RESULTS)
        except sqlite3.DatabaseError as error:
            raise damaged_store(self.path, error) from None
        with self._writing():
            for table in ("results", "tasks") if damaged else ():
                self.connection.executemany(
                    f"DELETE FROM {table} WHERE point IS ? AND chunk IS ? AND round IS ?", damaged
                )
        return len(damaged)

    def add(self, point: int, chunk: int, number: int, result: TaskResult) -> None:
        """Write one finished task of a round, whole or not at all.

        Raises
        ------
        StoreError
            The disk is full or has failed; the task is not in the store.
        """
        columns = COLUMNS_OF_RESULTS
        rows = [[point, chunk, number, *(row.values.get(name) for name in RESULT_COLUMNS)] for row in result.rows]
        with self._writing():
            self.connection.executemany(
                f"INSERT INTO results ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})", rows
            )
            self.connection.execute(
                "INSERT INTO tasks VALUES (?, ?, ?, ?, ?, '')",
                (point, chunk, number, result.warm_starts, result.seconds),
            )
            # Of the values as SQLite returns them, which is how they are verified.
            checksum = task_checksum(self.connection, columns, point, chunk, number)
            self.connection.execute(
                f"UPDATE tasks SET {CHECKSUM} = ? WHERE point = ? AND chunk = ? AND round = ?",
                (checksum, point, chunk, number),
            )

    def create(self, about: dict[str, str], points: tuple[Point, ...]) -> None:
        """Lay out an empty store, or make sure that it holds this very sweep, by whatever name, undamaged.

        Raises
        ------
        InputError
            It holds another sweep, or is damaged beyond its tasks.
        StoreError
            It cannot be written.
        """
        try:
            if self.connection.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
                self._check(about, points)
            else:
                self._lay_out(about, points)
        except StoreError:
            raise
        except (sqlite3.Error, KeyError) as error:
            raise damaged_store(self.path, error) from None

    def _check(self, about: dict[str, str], points: tuple[Point, ...]) -> None:
        self._mend_indices()
        known = dict(self.connection.execute("SELECT key, value FROM about"))
        if has_checksums(self.connection) and not is_plan_whole(self.connection):
            raise damaged_store(self.path, "its plan is not as it was written")
        same = {
            "plan of points": self.connection.execute("SELECT * FROM points ORDER BY point").fetchall()
            == _planned(points),
            "requirement": _asked(known["requirement"]) == _asked(about["requirement"]),
            "version of designer": known["version of designer"] == about["version of designer"]
            and not has_other_columns(self.connection),
        }
        if not all(same.values()):
            changed = " and ".join(key for key, is_same in same.items() if not is_same)
            raise InputError(f"{self.path}: contains a sweep with a different {changed}; {_START_AGAIN}")
        if any(known[key] != value for key, value in about.items()):
            with self._writing():
                self.connection.executemany("UPDATE about SET value = ?2 WHERE key = ?1", about.items())
                self._seal_plan()

    def _mend_indices(self) -> None:
        """Build damaged indices anew; what is wrong in the tables is found by the checksums."""
        if is_truncated(self.path):
            raise damaged_store(self.path, _TRUNCATED)
        if damage := structural_damage(self.connection, with_indices=False):
            raise damaged_store(self.path, damage)
        if not structural_damage(self.connection):
            return
        try:
            self.connection.execute("REINDEX")
        except sqlite3.OperationalError as error:
            raise _not_written(self.path, error) from None
        if damage := structural_damage(self.connection):
            raise damaged_store(self.path, damage)

    def _lay_out(self, about: dict[str, str], points: tuple[Point, ...]) -> None:
        with self._writing():
            # executescript would commit halfway.
            for statement in filter(str.strip, SCHEMA.split(";")):
                self.connection.execute(statement)
            self.connection.executemany("INSERT INTO about VALUES (?, ?)", about.items())
            self.connection.executemany("INSERT INTO points VALUES (?, ?, ?)", _planned(points))
            self._seal_plan()

    def _seal_plan(self) -> None:
        self.connection.execute(
            "INSERT OR REPLACE INTO about VALUES (?, ?)", (CHECKSUM, plan_checksum(self.connection))
        )

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            self.connection.execute("BEGIN IMMEDIATE")
            yield
            self.connection.execute("COMMIT")
        except sqlite3.Error as error:
            if self.connection.in_transaction:
                self.connection.rollback()
            # SQLite calls it an operational error if it is the disk's fault, not the file's.
            if not isinstance(error, sqlite3.OperationalError):
                raise damaged_store(self.path, error) from None
            raise _not_written(self.path, error) from None
        except BaseException:
            if self.connection.in_transaction:
                self.connection.rollback()
            raise


def damaged_store(path: Path, why: object) -> InputError:
    """What to say of a store that cannot be read."""
    return InputError(f"{path}: is damaged, or is not a sweep store: {why}; {_START_AGAIN}")


def _not_written(path: Path, error: sqlite3.Error) -> StoreError:
    return StoreError(
        f"{path}: cannot be written: {error}; finished tasks are kept, and the same command resumes the sweep"
    )


def _planned(points: tuple[Point, ...]) -> list[tuple[int, int | None, str]]:
    return [(point.number, point.parent, json.dumps(point.coordinates)) for point in points]


def _asked(requirement: str) -> dict[str, JsonValue]:
    try:
        content = json.loads(requirement)
    except ValueError:  # of a version that kept it otherwise
        return {}
    return {key: value for key, value in content.items() if key not in NOT_ASKED}


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the store of a folder for writing; one process at a time.

    Raises
    ------
    InputError
        Another process writes it, the file is no store, the folder is a file or cannot be written.
    """
    path = folder / FILE_NAME
    with locked(folder / f".{FILE_NAME}.lock", "sweep"):
        try:
            was_emptied = path.is_file() and not path.stat().st_size
            connection = sqlite3.connect(path, isolation_level=None, timeout=30.0)
            connection.text_factory = readable_text
            connection.execute("SELECT COUNT(*) FROM sqlite_master")
        except sqlite3.DatabaseError as error:
            raise damaged_store(path, error) from None
        try:
            yield Store(path, connection, was_emptied)
        finally:
            connection.close()


@contextmanager
def read_store(folder: Path) -> Iterator[sqlite3.Connection]:
    """Open the store of a folder for reading, also while another process writes it.

    Raises
    ------
    InputError
        There is none, it is damaged, or some of its tasks are.
    """
    path = folder / FILE_NAME
    if not path.is_file():
        raise InputError(f"{path}: there is no such sweep")
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty: either nothing has been solved yet, or the file was truncated")
    # Not read-only: a write that was cut off is taken back first, by whoever opens the store next.
    connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=rw", uri=True, timeout=30.0)
    connection.text_factory = readable_text
    try:
        connection.execute("SELECT COUNT(*) FROM points")
        _verify(connection, path)
        if not {"point", "configuration", "status"} <= set(columns_of(connection, "results")):
            raise InputError(f"{path}: was written by another version of designer")
        if has_other_columns(connection):
            see_as_this_version(connection)
        yield connection
    except sqlite3.DatabaseError as error:
        raise damaged_store(path, error) from None
    finally:
        connection.close()


_verified: dict[Path, tuple[int, int, int]] = {}
"""The states in which stores were found undamaged: one read sentence by sentence is verified once."""


def _verify(connection: sqlite3.Connection, path: Path) -> None:
    state = state_of(path)
    if _verified.get(path) == state or not has_checksums(connection):
        return
    connection.execute("BEGIN")  # so that tasks and results are of one moment
    try:
        if not is_plan_whole(connection):
            raise damaged_store(path, "its plan is not as it was written")
        if is_truncated(path):  # seen from within a transaction, during which nobody writes
            raise damaged_store(path, _TRUNCATED)
        damaged = damaged_tasks(connection, columns_of(connection, "results"))
        damage = structural_damage(connection, with_indices=False) if damaged else ""
    finally:
        connection.rollback()
    if damage:
        raise damaged_store(path, damage)
    if damaged:
        raise InputError(
            f"{path}: {len(damaged)} finished task{'s are' if len(damaged) > 1 else ' is'} damaged; run the sweep "
            f"again, which computes {'them' if len(damaged) > 1 else 'it'} anew"
        )
    _verified[path] = state
