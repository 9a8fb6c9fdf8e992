"""The folder of an order: it appears whole, and replaces nothing but an earlier order that nobody has changed."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from designer.files import InputError, read_text, writing
from designer.own_files import refuse_other_files, sha256

LIST = "order.json"
"""The names of an order's files with their SHA-256: by it an order is known, and known to be unchanged."""


def check_order_folder(folder: Path) -> None:
    """Refuse a folder that holds anything but an order as it was written.

    Raises
    ------
    InputError
        It is a file, or holds something else: one line says what.
    """
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise InputError(f"{folder}: is no folder; an order needs one of its own")
    if folder.resolve() == folder.resolve().parent:
        raise InputError(f"{folder}: is the root of all folders; an order needs one of its own")
    if not folder.is_dir():
        return
    refuse_other_files(folder, _digests(folder / LIST), LIST, "an order")


def write_order_folder(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Write all files beside the folder, then put them in its place.

    Raises
    ------
    InputError
        The folder holds something else, see :func:`check_order_folder`, or cannot be written.
    """
    contents = {name: text.encode("utf-8") if isinstance(text, str) else text for name, text in files.items()}
    sums = {name: sha256(content) for name, content in sorted(contents.items())}
    contents[LIST] = (json.dumps({"order": 1, "files": sums}, indent=2) + "\n").encode("utf-8")
    with writing(folder):
        _replace(folder.absolute(), contents)


def _replace(folder: Path, contents: Mapping[str, bytes]) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as beside:
        new, old = Path(beside) / "new", Path(beside) / "old"
        for name, content in contents.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        check_order_folder(folder)
        if folder.exists():
            folder.rename(old)
        try:
            new.rename(folder)
        except BaseException:
            if old.exists() and not folder.exists():
                shutil.move(old, folder)
            raise


def _digests(path: Path) -> dict[str, str]:
    """The files of an order; none where there is no such list."""
    if not path.is_file():
        return {}
    try:
        content = json.loads(read_text(path))
        return {name: str(digest) for name, digest in content["files"].items()} if content["order"] == 1 else {}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError(f"{path}: is damaged; use another folder") from None
