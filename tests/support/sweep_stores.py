"""Stores of sweeps, edited as no version of designer edits them."""

import sqlite3
from pathlib import Path

from designer.study.sweep.checksums import plan_checksum
from designer.study.sweep.store import FILE_NAME


def forget_checksums(folder: Path) -> None:
    """Take back what tells an edit from damage."""
    with sqlite3.connect(folder / FILE_NAME) as connection:
        connection.execute("ALTER TABLE tasks DROP COLUMN sha256")
        connection.execute("DELETE FROM about WHERE key = 'sha256'")


def accept_edited_plan(folder: Path) -> None:
    """Let what the store says about its sweep count as written by designer."""
    with sqlite3.connect(folder / FILE_NAME) as connection:
        connection.execute("UPDATE about SET value = ? WHERE key = 'sha256'", (plan_checksum(connection),))
