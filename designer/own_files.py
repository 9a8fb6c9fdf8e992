"""Files known by their SHA-256: those that the designer wrote, replaced only while unchanged, and inputs of results."""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Collection, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from designer import __version__
from designer.files import InputError

if TYPE_CHECKING:
    from pydantic import JsonValue

Digests = Mapping[str, str | None]
"""SHA-256 by a file's name in its folder; None while it is being written: what is there after a crash is ours."""

_MOST_NAMED = 10


def sha256(content: bytes) -> str:
    """The digest of a file's content, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def described_run(libraries: Mapping[str, str]) -> dict[str, JsonValue]:
    """The run that makes a result, for its provenance: versions of the designer and of ``libraries``, command, time."""
    return {
        "designer": __version__,
        "versions": {"python": platform.python_version(), **libraries},
        "command": " ".join(["designer", *sys.argv[1:]]),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def described_inputs(inputs: Mapping[str, Path]) -> dict[str, JsonValue]:
    """The files that went into a result, for its provenance: the name and the digest of each."""
    return {name: {"file": path.name, "sha256": sha256(path.read_bytes())} for name, path in inputs.items()}


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
