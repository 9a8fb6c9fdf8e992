"""Claiming a folder for a study: it is refused if it is something else's, or if another study works in it."""

from __future__ import annotations

import errno
import fcntl
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from designer.files import InputError, check_folder
from designer.study.manifest import MANIFEST, files_of_others, read_manifest, refuse_others
from designer.study.names import FIGURES

LOCK = ".study.lock"


@contextmanager
def claimed(folder: Path, names: Collection[str]) -> Iterator[list[str]]:
    """Hold a folder for a study that may write these names; yields what others have put there, which stays.

    Raises
    ------
    InputError
        The folder cannot be written, holds something that is no study, or a file in the way that the study did not
        write as it is; or another process holds it.
    """
    try:
        check_folder(folder)
        _refuse_other_kinds(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written there: {error.strerror or error}") from None
    with locked(folder):
        manifest = read_manifest(folder) or {}
        figures = [name for name in manifest if name.startswith(f"{FIGURES}/")]
        refuse_others(folder, manifest, [*names, *figures])
        yield files_of_others(folder, manifest)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder alone; the lock goes with the process, however that ends.

    Raises
    ------
    InputError
        Another process holds it, or the folder cannot be written.
    """
    try:
        lock = (folder / LOCK).open("w")
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written there: {error.strerror or error}") from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in {errno.EAGAIN, errno.EACCES}:
                raise
            raise InputError(f"{folder}: another process is working on the study in this folder") from None
        yield


def _refuse_other_kinds(folder: Path) -> None:
    if not folder.is_dir() or read_manifest(folder) is not None:
        return
    if any(path.name != LOCK and not path.name.startswith(f".{MANIFEST}.") for path in folder.iterdir()):
        raise InputError(f"{folder}: not the folder of a study; choose an empty or a new folder with --out")
