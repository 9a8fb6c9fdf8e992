"""``designer init``: a commented requirement to start from."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from designer.files import InputError


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
def init(file: Path) -> None:
    """Write a commented example requirement to FILE, which must not exist yet."""
    from designer.requirement.template import template

    if file.is_dir():
        raise InputError(f"FILE must name a file to write, such as my.toml; {file} is a folder")
    try:
        # Opened for exclusive creation: nothing that exists is overwritten, not even in a race.
        with file.open("x", encoding="utf-8") as stream:
            stream.write(template())
    except FileExistsError:
        raise InputError(f"{file}: already exists; choose another name") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror or error}") from None
    click.echo(f"{file} written; next: designer study {shlex.quote(str(file))}")
