"""Checksums of a sweep's store: one for each finished task, one for the plan, so that damage is never read as a result.

SQLite notices damage to its own structures only; a bit that flips within a number gives another number.
"""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

TaskName = tuple[object, object, object]
"""(point, chunk, round), as the store holds it: whole numbers unless damaged."""

CHECKSUM = "sha256"
TASK_COLUMNS = "point, chunk, round, warm_starts, seconds"


def sha256_of(value: object) -> str:
    """A hash of plain values, which distinguishes any two that SQLite does."""
    return hashlib.sha256(ascii(value).encode("ascii")).hexdigest()


def task_checksum(connection: sqlite3.Connection, columns: Sequence[str], point: int, chunk: int, number: int) -> str:
    """The checksum of a task that is in the store; ``number`` is that of its round."""
    rows = connection.execute(
        f"SELECT {', '.join(columns)} FROM results WHERE point = ? AND chunk = ? AND round = ? ORDER BY configuration",
        (point, chunk, number),
    ).fetchall()
    (task,) = connection.execute(
        f"SELECT {TASK_COLUMNS} FROM tasks WHERE point = ? AND chunk = ? AND round = ?", (point, chunk, number)
    ).fetchall()
    return sha256_of((task, sha256_of(rows)))


def damaged_tasks(connection: sqlite3.Connection, columns: Sequence[str]) -> list[TaskName]:
    """The tasks of which anything in the store is not as it was written; results without their task are among them."""
    keys = [name for name in ("point", "chunk", "round") if name in columns]  # a store of 0.2.0 knows no rounds
    # Not by an index, which may be damaged where the table is not: hence the plus signs.
    order = ", ".join(f"+{name}" for name in (*keys, "configuration"))
    found = connection.execute(f"SELECT {', '.join(columns)} FROM results NOT INDEXED ORDER BY {order}")
    places = [columns.index(name) for name in keys]
    rows = {
        name: sha256_of(list(group))
        for name, group in groupby(found, key=lambda row: _task_name([row[place] for place in places]))
    }
    nothing = sha256_of([])
    names: dict[TaskName, None] = dict.fromkeys(rows)
    whole: set[TaskName] = set()
    task_columns = ", ".join([*keys, "warm_starts", "seconds", CHECKSUM])
    for *task, checksum in connection.execute(f"SELECT {task_columns} FROM tasks NOT INDEXED"):
        name = _task_name(task[: len(keys)])
        names[name] = None
        if checksum == sha256_of((tuple(task), rows.get(name, nothing))):
            whole.add(name)
    return [name for name in names if name not in whole]


def _task_name(keys: Sequence[object]) -> TaskName:
    """A task's name from the keys that its store has."""
    point, chunk, *number = keys
    return point, chunk, number[0] if number else 0


def plan_checksum(connection: sqlite3.Connection) -> str:
    """The checksum of what a store says about its sweep: requirement, points, layout of the tables."""
    about = connection.execute("SELECT key, value FROM about WHERE key <> ? ORDER BY key", (CHECKSUM,)).fetchall()
    points = connection.execute("SELECT point, parent, coordinates FROM points ORDER BY point").fetchall()
    layout = connection.execute("SELECT type, name, sql FROM sqlite_master ORDER BY type, name").fetchall()
    return sha256_of((about, points, layout))


def has_checksums(connection: sqlite3.Connection) -> bool:
    """Whether a store was written with checksums; either trace of them is enough."""
    columns = [name for _, name, *_ in connection.execute("PRAGMA table_info(tasks)")]
    return CHECKSUM in columns or bool(
        connection.execute("SELECT COUNT(*) FROM about WHERE key = ?", (CHECKSUM,)).fetchone()[0]
    )


def is_plan_whole(connection: sqlite3.Connection) -> bool:
    """Whether what a store says about its sweep is as it was written."""
    found = connection.execute("SELECT value FROM about WHERE key = ?", (CHECKSUM,)).fetchone()
    return found is not None and found[0] == plan_checksum(connection)


def structural_damage(connection: sqlite3.Connection, with_indices: bool = True) -> str:
    """What SQLite finds wrong with the structure of a store, in its own words; empty if nothing."""
    check = "integrity_check" if with_indices else "quick_check"
    problems = [str(row[0]) for row in connection.execute(f"PRAGMA {check}(1)")]
    return "" if problems == ["ok"] else " ".join(" ".join(problems).split())


def is_truncated(path: Path) -> bool:
    """Whether a store is shorter than its header says; only while nobody writes to it.

    SQLite reads what is left without complaint where the pages that are missing hold nothing that it looks at.
    """
    with path.open("rb") as stream:
        header = stream.read(100)
    page = int.from_bytes(header[16:18], "big")
    # A page of 65536 bytes is written as 1.
    size = 65536 if page == 1 else page
    return path.stat().st_size < size * int.from_bytes(header[28:32], "big")


def state_of(path: Path) -> tuple[int, int, int]:
    """Inode, size and time of the last change of a store: what differs once it has been written to."""
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def readable_text(data: bytes) -> str:
    """Text of a store, also where damage has left no UTF-8."""
    return data.decode("utf-8", "surrogateescape")
