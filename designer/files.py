"""Reading and writing files: one-line errors for what a person typed, and writes that are whole or absent."""

from __future__ import annotations

import errno
import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import JsonValue, ValidationError
    from pydantic_core import ErrorDetails


_IN_THE_WAY = frozenset({errno.EEXIST, errno.ENOTDIR})
UNUSABLE = _IN_THE_WAY | {
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.EISDIR,
    errno.ENOENT,
    errno.EINVAL,
    errno.ENAMETOOLONG,
    errno.ELOOP,
    errno.ENOTEMPTY,
    errno.EBUSY,
}
"""What the system says of a path that was badly chosen; a full disk or a failing one is nobody's choice."""


class InputError(Exception):
    """Something a person typed cannot be used. The message is one line that names file, key, value and remedy."""


class UnwritableError(InputError):
    """A place that a person chose for results cannot be written; the message is one line that names it."""


def read_bytes(path: Path, largest_bytes: int, kind: str = "such file") -> bytes:
    """Return the content of a file, which is no larger than any ``kind`` needs to be.

    Raises
    ------
    InputError
        The file is absent, is a folder, cannot be read, or is larger than ``largest_bytes``.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(largest_bytes + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"{str(path)!r}: no file can have this name: it contains a NUL character") from None
    if len(data) > largest_bytes:
        raise InputError(f"{path}: larger than {largest_bytes / 1e6:g} MB, too large for this kind of file ({kind})")
    return data


def read_text(path: Path, largest_bytes: int = 64_000_000) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError
        As for :func:`read_bytes`; or the file is not UTF-8, or begins with a byte-order mark.
    """
    data = read_bytes(path, largest_bytes)
    if data.startswith(b"\xef\xbb\xbf"):
        raise InputError(f"{path}: begins with a byte-order mark; save it as UTF-8 without one")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start})") from None


def read_toml(path: Path, largest_bytes: int = 1_000_000) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises
    ------
    InputError
        As for :func:`read_text`; or the file is not TOML, nested too deeply, or holds a number or date out of range.
    """
    import tomllib

    text = read_text(path, largest_bytes)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: nested too deeply to be read") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    except ValueError:  # Python refuses to read a whole number of thousands of digits, or a 13th month
        raise InputError(f"{path}: not valid TOML: a number or date is out of range") from None


def check_folder(folder: Path) -> None:
    """Raise InputError if results cannot go there because it is a file."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; --out needs a folder for the results")


@contextmanager
def writing(target: Path) -> Iterator[None]:
    """Name the target of what is written in here, in words, where it cannot be written.

    Raises
    ------
    UnwritableError
        The system refuses the path. Other errors, such as that of a full disk, pass through.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in UNUSABLE:
            raise
        raise UnwritableError(f"{target}: cannot be written: {in_words(error)}") from None


def in_words(error: OSError) -> str:
    """What the system says, without its number and without the name of a temporary file."""
    return "a file is in the place of a folder" if error.errno in _IN_THE_WAY else error.strerror or str(error)


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where they are absent.

    Raises
    ------
    UnwritableError
        It cannot be made, see :func:`writing`.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write a file under a temporary name in the same folder, then rename it: a reader never sees half of it.

    Raises
    ------
    UnwritableError
        The file cannot be written there, see :func:`writing`.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise


def as_json(value: object) -> JsonValue:
    """A value in JSON's own types: dataclasses and mappings as objects, sequences as lists.

    Raises
    ------
    TypeError
        JSON has no such type.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: as_json(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): as_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(item) for item in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"JSON has no {type(value).__name__}")


def finite(number: Any) -> float | None:
    """A number as JSON holds it: None if it is not finite."""
    value = float(number)
    return value if math.isfinite(value) else None


# How keys of lists of numbers end.
_NUMBERS = ("_deg", "_mm", "distortion")


def describe_validation_error(path: Path | str, error: ValidationError) -> str:
    """One line for all problems of a pydantic validation: file; key, value and what is allowed of each.

    A validator that raises ``PydanticCustomError`` with a context of ``key`` and ``value`` names them below the place
    where it was raised; location parts in parentheses are tags of a union, not keys, and are dropped.
    """
    described = dict.fromkeys(_described(problem) for problem in error.errors(include_url=False))
    return f"{path}: {'; '.join(described)}"


def _described(problem: ErrorDetails) -> str:
    context = problem.get("ctx", {})
    parts = [str(part) for part in problem["loc"] if not str(part).startswith("(")]
    if context.get("key"):
        parts.append(str(context["key"]))
    key = " ".join(".".join(parts).split()) or "(whole file)"
    shown = context.get("value") if context.get("key") else problem["input"]
    has_value = problem["type"] not in {"missing", "extra_forbidden"} and ("value" in context or not context.get("key"))
    is_table = isinstance(shown, Mapping) or hasattr(shown, "model_fields_set")
    value = f" = {_shortened(shown)}" if has_value and not is_table else ""
    message = problem["msg"].removeprefix("Value error, ").replace("Input should be", "must be", 1)
    if problem["type"] == "tuple_type":
        message = "must be a list of numbers" if key.endswith(_NUMBERS) else "must be a list"
    message = message.replace("Field required", "is required but missing", 1)
    return f"{shortened(key)}{value}: {message}"


def _shortened(value: object) -> str:
    try:
        return shortened(repr(value))
    except ValueError:  # an integer of more digits than Python prints
        return "(a number with thousands of digits)"


def shortened(text: str, longest: int = 60) -> str:
    """Text in one line of at most so many characters."""
    text = " ".join(text.split())
    return text if len(text) <= longest else text[: longest - 1] + "…"
