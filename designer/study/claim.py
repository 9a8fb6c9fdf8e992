"""Claiming a folder for a study: it is refused if it is something else's, or if another study works in it."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from designer.files import InputError, check_folder, writing
from designer.study.lock import locked
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
    with writing(folder):
        check_folder(folder)
        _refuse_other_kinds(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    with locked_study(folder):
        manifest = read_manifest(folder) or {}
        figures = [name for name in manifest if name.startswith(f"{FIGURES}/")]
        refuse_others(folder, manifest, [*names, *figures])
        yield files_of_others(folder, manifest)


def locked_study(folder: Path) -> AbstractContextManager[None]:
    """Hold the folder of a study alone, see :func:`designer.study.lock.locked`."""
    return locked(folder / LOCK, "study")


def _refuse_other_kinds(folder: Path) -> None:
    if not folder.is_dir() or read_manifest(folder) is not None:
        return
    if any(path.name != LOCK and not path.name.startswith(f".{MANIFEST}.") for path in folder.iterdir()):
        raise InputError(f"{folder}: not the folder of a study; choose an empty or a new folder with --out")
