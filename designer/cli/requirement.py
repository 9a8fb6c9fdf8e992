"""``designer init``: a commented requirement, or sweep over one, to start from."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from designer.files import InputError, in_words


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--sweep",
    "requirement",
    type=click.Path(path_type=Path),
    metavar="REQUIREMENT.toml",
    help="Write a sweep over this requirement instead.",
)
def init(file: Path, requirement: Path | None) -> None:
    """Write a commented example requirement to FILE, which must not exist yet."""
    if file.is_dir():
        raise InputError(f"FILE must name a file to write, such as my.toml; {file} is a folder")
    if requirement is None:
        from designer.requirement.template import template

        command, content = "study", template()
    else:
        from designer.study.sweep.template import sweep_template

        command, content = "sweep", sweep_template(requirement, file.parent)
    try:
        # Opened for exclusive creation: nothing that exists is overwritten, not even in a race.
        with file.open("x", encoding="utf-8") as stream:
            stream.write(content)
    except FileExistsError:
        raise InputError(f"{file}: already exists; choose another name") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {in_words(error)}") from None
    click.echo(f"{file} written; next: designer {command} {shlex.quote(str(file))}")
