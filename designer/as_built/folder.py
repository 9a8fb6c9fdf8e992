"""The folder of a tolerance study: it replaces nothing but what an earlier one wrote and nobody has changed since.

``tolerance.json`` names the other files with their SHA-256, or null for files that are being written: what stands there
after a crash is the study's own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import JsonValue

from designer.files import InputError, check_folder, read_text, write_atomically
from designer.own_files import refuse_other_files, sha256

SUMMARY = "tolerance.json"
FILES = "files"


def check_tolerance_folder(folder: Path) -> None:
    """Refuse a folder that holds anything but a tolerance study as it was written.

    Raises
    ------
    InputError
        It is a file, or holds something else: one line says what.
    """
    check_folder(folder)
    if not folder.is_dir():
        return
    digests = _digests(folder / SUMMARY)
    # A summary that lists nothing is something else's.
    refuse_other_files(folder, digests, SUMMARY if digests else "", "designer tolerance")


def write_tolerance_folder(folder: Path, files: Mapping[str, str], summary: Mapping[str, JsonValue]) -> list[Path]:
    """Write files and then the summary, and remove what only an earlier study wrote; returns what was written.

    Raises
    ------
    InputError
        The folder holds something else, see :func:`check_tolerance_folder`.
    """
    check_tolerance_folder(folder)
    earlier = _digests(folder / SUMMARY)
    being_written: dict[str, JsonValue] = dict.fromkeys({**earlier, **files})
    _write_summary(folder, {FILES: being_written})
    for name in earlier:
        if name not in files:
            (folder / name).unlink(missing_ok=True)
    for name, text in files.items():
        write_atomically(folder / name, text)
    _write_summary(folder, {**summary, FILES: {name: sha256(text.encode()) for name, text in files.items()}})
    return [folder / name for name in (*files, SUMMARY)]


def _write_summary(folder: Path, content: Mapping[str, JsonValue]) -> None:
    write_atomically(folder / SUMMARY, json.dumps(content, indent=2, allow_nan=False) + "\n")


def _digests(path: Path) -> dict[str, str | None]:
    """The files that a study wrote; none where there is no such list. A name with a folder is nobody's."""
    if path.is_symlink() or not path.is_file():
        return {}
    try:
        files = json.loads(read_text(path))[FILES]
        return {name: digest for name, digest in files.items() if Path(name).name == name}
    except (InputError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}
