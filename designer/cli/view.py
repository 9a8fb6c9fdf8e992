"""``designer view``: a study or a design in the browser."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from designer.files import InputError


@click.command()
@click.argument("path", type=click.Path(path_type=Path), metavar="STUDY_FOLDER|DESIGN.json")
def view(path: Path) -> None:
    """Open a study's study.html, or one design, in the browser; without a browser, print where the page is.

    If the folder has no study.html, it is written first. A design in the folder of a study is shown on the study's
    page, any other on a page of its own in the folder for temporary files.
    """
    page, fragment = (_page_of_study(path), "") if path.is_dir() else _page_of_design(path)
    _open(page, fragment)


def _page_of_study(folder: Path) -> Path:
    from designer.study.names import CHECKS, PAGE, RESULTS

    page = folder / PAGE
    if page.is_file():
        return page
    if not (folder / RESULTS).exists():
        raise InputError(f"{folder}: not the folder of a study: it contains neither {PAGE} nor {RESULTS}")
    if (folder / CHECKS).exists():
        from designer.extras import require_extra

        require_extra("imaging", f"reading the end-to-end checks of {folder}")
    from designer.report.html.document import write_html
    from designer.study.claim import locked_study
    from designer.study.folder import read_study

    with locked_study(folder):
        return write_html(read_study(folder), folder)


def _page_of_design(path: Path) -> tuple[Path, str]:
    """The page that shows a design, and the fragment that selects it there."""
    from designer.design import read_design
    from designer.report.html.document import write_design_html
    from designer.report.html.payload import DEPARTURES_LEFT_OUT
    from designer.study.manifest import files_of_others, read_manifest
    from designer.study.names import PAGE, design_name

    design = read_design(path)
    folder, name = path.resolve().parent.parent, design_name(design.configuration)
    is_of_study = (folder / PAGE).is_file() and folder / name == path.resolve()
    # Edited since, a design is no longer the one that the study's page shows.
    if is_of_study and name not in files_of_others(folder, read_manifest(folder) or {}):
        return folder / PAGE, f"#design={design.configuration}"
    page = Path(tempfile.mkdtemp(prefix="designer-")) / f"{path.stem}.html"
    try:
        write_design_html(design, page)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if design.as_built is not None:
        click.echo(DEPARTURES_LEFT_OUT, err=True)
    return page, ""


def _open(page: Path, fragment: str) -> None:
    import webbrowser

    try:
        is_open = webbrowser.open(page.resolve().as_uri() + fragment)
    except webbrowser.Error:
        is_open = False
    if not is_open:
        click.echo(page)
