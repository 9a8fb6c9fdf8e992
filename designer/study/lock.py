"""A folder that one process holds alone, as long as it lives."""

from __future__ import annotations

import errno
import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from designer.files import InputError, check_folder, make_folder, writing


@contextmanager
def locked(file: Path, work: str) -> Iterator[None]:
    """Hold the folder of a lock file alone, and make it where it is absent.

    The lock goes with the process, however that ends; the file stays. ``work`` names what two processes must not do
    at the same time.

    Raises
    ------
    InputError
        Another process holds it, the folder is a file, or it cannot be written.
    """
    check_folder(file.parent)
    make_folder(file.parent)
    with writing(file.parent):
        lock = file.open("w")
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in {errno.EAGAIN, errno.EACCES}:
                raise
            raise InputError(f"{file.parent}: another process is working on the {work} in this folder") from None
        yield
