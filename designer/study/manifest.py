"""The manifest of a study's folder: which files the study wrote, and their content, so that it replaces no others.

``manifest.json`` holds the name and the SHA-256 of each file. A name without a hash belongs to a file that is being
written: whatever stands there after a crash is the study's own.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath

from designer.files import InputError, read_text, write_atomically
from designer.own_files import listed, sha256
from designer.study.names import (
    COMPARATORS_TABLE,
    FIGURE_LIST,
    FIGURES,
    LENSES,
    PAGE,
    PROVENANCE,
    RESULTS,
    figure_name,
    names_of_study,
)

MANIFEST = "manifest.json"
Manifest = dict[str, str | None]
"""SHA-256 by name; None while the file is being written."""

_FIGURES_OF_VERSION_0_1 = (
    "cross-section",
    "image-layout",
    "resolution",
    "depth-resolution",
    "depth-error",
    "check-raw",
    "check-maps",
    "check-errors",
    "check-plan",
)
"""How the figures begin that a report of version 0.1, which lists none, drew of each configuration."""
_PLOTS_OF_VERSION_0_1 = ("trade-height.svg", "trade-diameter.svg", "fronts-height.svg", "fronts-diameter.svg")


def read_manifest(folder: Path) -> Manifest | None:
    """The files that the study in a folder wrote; None if the folder is not a study's.

    A folder of version 0.1 or 0.2 has no manifest. It is known by its provenance.json, and the files are those whose
    names follow from its tables.

    Raises
    ------
    InputError
        The manifest cannot be understood.
    """
    path = folder / MANIFEST
    if not path.exists():
        return _manifest_of_tables(folder)
    try:
        content = json.loads(read_text(path))
        return {_inside(name): None if digest is None else str(digest) for name, digest in content["files"].items()}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError(f"{path}: is damaged; use another folder, or remove it if no file here is needed") from None


def announce(folder: Path, names: Collection[str]) -> None:
    """Note in the manifest that these files are about to be written.

    Raises
    ------
    InputError
        A file of that name is there that the study did not write, or that has been changed since.
    """
    manifest = read_manifest(folder) or {}
    refuse_others(folder, manifest, names)
    _write(folder, manifest | dict.fromkeys(names))


def settle(folder: Path, names: Iterable[str]) -> None:
    """Note in the manifest what has been written under these names; those that are absent leave it."""
    manifest = read_manifest(folder) or {}
    for name in names:
        if (folder / name).is_file():
            manifest[name] = sha256((folder / name).read_bytes())
        else:
            manifest.pop(name, None)
    _write(folder, manifest)


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files that the study wrote, and folders that this leaves empty; what has been changed since stays."""
    manifest = read_manifest(folder) or {}
    removed = [name for name in names if name in manifest]
    for name in removed:
        path = folder / name
        if _is_own(folder, manifest, name):
            path.unlink(missing_ok=True)
            with suppress(OSError):  # not empty, or gone
                if path.parent != folder:
                    path.parent.rmdir()
    for name in removed:
        del manifest[name]
    if removed:
        _write(folder, manifest)


def refuse_others(folder: Path, manifest: Manifest, names: Iterable[str]) -> None:
    """Raise InputError if a file of one of these names is there that the study did not write as it is."""
    others = [name for name in names if not _is_own(folder, manifest, name)]
    if others:
        raise InputError(
            f"{folder}: {listed(others)}: not written by the study, or changed since; move "
            f"{'it' if len(others) == 1 else 'them'} away, or use another folder"
        )


def files_of_others(folder: Path, manifest: Manifest) -> list[str]:
    """What stands in a study's folder that the study did not write as it is; a folder of such files is one name."""
    return list(_others(folder, folder, manifest))


def _others(folder: Path, inside: Path, manifest: Manifest) -> Iterator[str]:
    own_folders = {str(parent) for name in manifest for parent in PurePosixPath(name).parents}
    for path in sorted(inside.iterdir()):
        name = path.relative_to(folder).as_posix()
        if path.is_dir() and not path.is_symlink():
            if name in own_folders:
                yield from _others(folder, path, manifest)
            else:
                yield f"{name}/"
        # Names that begin with a dot are the lock, and what a write left that was cut off.
        elif name != MANIFEST and not path.name.startswith(".") and not _is_listed_unchanged(folder, manifest, name):
            yield name


def _is_listed_unchanged(folder: Path, manifest: Manifest, name: str) -> bool:
    return name in manifest and _is_own(folder, manifest, name)


def _is_own(folder: Path, manifest: Manifest, name: str) -> bool:
    """Whether a file is absent, or as the study wrote it."""
    path = folder / name
    if not path.is_file():
        return not path.exists()
    if name not in manifest:
        return False
    digest = manifest[name]
    return digest is None or digest == sha256(path.read_bytes())


def _manifest_of_tables(folder: Path) -> Manifest | None:
    try:
        provenance = json.loads(read_text(folder / PROVENANCE))
        table = list(csv.DictReader(io.StringIO(read_text(folder / RESULTS))))
        configurations = [row["configuration"] for row in table]
    except (InputError, ValueError, KeyError, csv.Error, RecursionError):
        return None
    if not isinstance(provenance, dict) or not {"designer", "solvers"} <= provenance.keys():
        return None
    # Those versions wrote neither a table of lenses or of comparators nor a page.
    of_study = [name for name in names_of_study(configurations) if name not in (LENSES, COMPARATORS_TABLE, PAGE)]
    names = [*of_study, *map(figure_name, _figures_of_tables(folder, configurations))]
    present = [name for name in names if _is_inside(name) and (folder / name).is_file()]
    return {name: sha256((folder / name).read_bytes()) for name in present}


def _figures_of_tables(folder: Path, configurations: list[str]) -> list[str]:
    path = folder / FIGURES / FIGURE_LIST
    if not path.exists():
        of_designs = (f"{kind}-{name}.svg" for kind in _FIGURES_OF_VERSION_0_1 for name in configurations)
        return [*_PLOTS_OF_VERSION_0_1, *of_designs]
    try:
        return [name for name in json.loads(read_text(path)) if isinstance(name, str)]
    except (InputError, ValueError, TypeError, RecursionError):
        return []


def _write(folder: Path, manifest: Manifest) -> None:
    content = {"files": dict(sorted(manifest.items()))}
    write_atomically(folder / MANIFEST, json.dumps(content, indent=2) + "\n")


def _inside(name: str) -> str:
    if not _is_inside(name):
        raise ValueError(name)
    return name


def _is_inside(name: str) -> bool:
    """Whether a name leads to a place in the folder: nothing outside is ever replaced or removed."""
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts and "\0" not in name and str(path) == name
