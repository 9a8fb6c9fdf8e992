"""Files that the designer wrote itself: known by their SHA-256, and replaced only while they are unchanged."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from pathlib import Path

from designer.files import InputError

Digests = Mapping[str, str | None]
"""SHA-256 by a file's name in its folder; None while it is being written: what is there after a crash is ours."""

_MOST_NAMED = 10


def sha256(content: bytes) -> str:
    """The digest of a file's content, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def is_as_written(path: Path, digests: Digests, name: str) -> bool:
    """Whether a file is listed under a name and has not been changed since."""
    if name not in digests or path.is_symlink():
        return False
    digest = digests[name]
    return digest is None or digest == sha256(path.read_bytes())


def refuse_other_files(folder: Path, digests: Digests, list_name: str, writer: str) -> None:
    """Refuse a folder with any file but those listed, unchanged, and the list itself; ``writer`` names who writes it.

    Raises
    ------
    InputError
        There are others: one line names them.
    """
    found = sorted(path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    names = {path.relative_to(folder).as_posix(): path for path in found}
    others = [name for name, path in names.items() if name != list_name and not is_as_written(path, digests, name)]
    if others:
        raise InputError(f"{folder}: {listed(others)}: not written by {writer}, or changed since; use another folder")


def listed(names: Collection[str]) -> str:
    """Names in one line, the first few of many."""
    shown = ", ".join(list(names)[:_MOST_NAMED])
    return shown if len(names) <= _MOST_NAMED else f"{shown} and {len(names) - _MOST_NAMED} others"
