"""The formats to which a design can be exported: one table, for the command and the Python interface."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.evaluate.magnitudes import check_magnitudes
from designer.export.drawing.dxf_sheets import dxf_sheets
from designer.export.drawing.sheets import drawing_sheets
from designer.export.dxf import dxf_drawing
from designer.export.optiland import optiland_files
from designer.export.povray import povray_scene
from designer.export.sag import sag_tables
from designer.export.step import step_solids
from designer.export.stl import stl_solids
from designer.export.zmx import zmx_files
from designer.extras import require_extra
from designer.files import InputError, write_atomically

WITHOUT_DEPARTURES = (
    "the departures of the sensor as built (as_built) are in no drawing and no format: this is the design without them"
)
"""What to say of the files of a design that has departures."""
_FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


@dataclass(frozen=True, slots=True)
class ExportFormat:
    """A format of another program.

    Attributes
    ----------
    description
        What the files hold and who reads them, for people.
    suffix
        How the file's name ends, with its dot.
    one_file_for
        What has a file of its own: each mirror, view, sheet or solid, in a folder, or the whole design.
    contents
        The text or bytes of each file, by the name of its mirror, view, sheet or solid, or the design's configuration.
        Raises InputError for a design that the format cannot hold, with the reason.
    leaves_out
        What the format has no place for in any design, and is therefore not in the files.
    extra
        The optional part of the installation (:mod:`designer.extras`) that ``contents`` needs; None if it needs
        no more than the designer itself.
    toleranced
        The contents with tolerances; None if the format has no place for them.
    """

    description: str
    suffix: str
    one_file_for: Literal["mirror", "view", "sheet", "solid", "design"]
    contents: Callable[[Design], Mapping[str, str | bytes]]
    leaves_out: str
    extra: str | None = None
    toleranced: Callable[[Design, NamedTolerances], Mapping[str, str | bytes]] | None = None

    @property
    def written_as(self) -> str:
        """What ``designer export`` writes, in words."""
        if self.one_file_for == "design":
            return f"a file that ends in {self.suffix}"
        return f"a folder with a {self.suffix} file for each {self.one_file_for}"


EXPORTS: dict[str, ExportFormat] = {
    "sag": ExportFormat(
        description="table of radius, sag, slope and distance from the best-fit sphere, for the workshop",
        suffix=".csv",
        one_file_for="mirror",
        contents=sag_tables,
        leaves_out="the camera, the substrates, the housing and the light",
    ),
    "zmx": ExportFormat(
        description="Zemax OpticStudio, sequential mode: sensor, ideal lens, mirrors and a wall in the scene",
        suffix=".zmx",
        one_file_for="view",
        contents=zmx_files,
        leaves_out="substrates, lens barrel, camera body and struts, which can block light, and a tube, which refracts",
    ),
    "povray": ExportFormat(
        description="POV-Ray scene: mirrors as exact quadrics, the camera in the pinhole, and a wall",
        suffix=".pov",
        one_file_for="design",
        contents=povray_scene,
        leaves_out="the lens (focus, blur and lost light): the camera is a pinhole; and the housing",
    ),
    "optiland": ExportFormat(
        description="optiland's JSON: the same system as zmx",
        suffix=".json",
        one_file_for="view",
        contents=optiland_files,
        leaves_out="substrates, lens barrel, camera body and struts, which can block light, and a tube, which refracts",
    ),
    "dxf": ExportFormat(
        description="half-profiles of mirrors, as exact conics, and housing for CAD",
        suffix=".dxf",
        one_file_for="design",
        contents=dxf_drawing,
        leaves_out="the camera and the light",
        extra="dxf",
    ),
    "stl": ExportFormat(
        description="solids of mirrors and housing as triangles, within 1 µm of the surfaces, in their places",
        suffix=".stl",
        one_file_for="solid",
        contents=stl_solids,
        leaves_out="the camera, the light and the seats that hold the mirrors",
    ),
    "step": ExportFormat(
        description="solids of mirrors and housing for CAD, exact surfaces, in place; the assembly with lens barrel",
        suffix=".step",
        one_file_for="solid",
        contents=step_solids,
        leaves_out="the camera's body, the light and the seats that hold the mirrors",
        extra="step",
    ),
    "drawing": ExportFormat(
        description="dimensioned drawing sheets of each mirror and of the assembly, in the style of ISO 10110",
        suffix=".pdf",
        one_file_for="sheet",
        contents=drawing_sheets,
        leaves_out="seats of the mirrors and, unless given, tolerances, which the sheets leave to be agreed",
        extra="drawing",
        toleranced=drawing_sheets,
    ),
    "drawing-dxf": ExportFormat(
        description="the same sheets for CAD, in true millimetres, with dimensions that a program measures",
        suffix=".dxf",
        one_file_for="sheet",
        contents=dxf_sheets,
        leaves_out="seats of the mirrors and, unless given, tolerances, which the sheets leave to be agreed",
        extra="dxf",
        toleranced=dxf_sheets,
    ),
}
"""Every format by its name on the command line."""


def export_format(name: str) -> ExportFormat:
    """The format of that name.

    Raises
    ------
    InputError
        There is none, or the package that it needs is not installed.
    """
    if name not in EXPORTS:
        raise InputError(f"format {name!r}: must be one of {', '.join(EXPORTS)}")
    found = EXPORTS[name]
    if found.extra is not None:
        require_extra(found.extra, f"format {name!r}")
    return found


def export_design(
    design: Design, name: str, target: Path, tolerances: NamedTolerances | None = None
) -> tuple[Path, ...]:
    """Write a design in one of the formats; every file is complete, and none is written unless all can be.

    Parameters
    ----------
    name
        One of ``EXPORTS``.
    target
        A file for a format that holds the whole design in one, else a folder, in which each mirror or view has a
        file of its name. It is made if it is absent; files that are already there are replaced.
    tolerances
        What the parts may depart by, for a format that has a place for it.

    Returns
    -------
    The files written.

    Raises
    ------
    InputError
        There is no such format, the format cannot hold the design or the tolerances, or the target does not fit the
        format.
    """
    check_target(name, target)
    chosen = export_format(name)
    if chosen.one_file_for == "design":
        files = dict.fromkeys([target], *_contents(name, design, tolerances).values())
    else:
        files = {target / file: content for file, content in exported_files(design, name, tolerances).items()}
        for path in files:
            if path.is_dir():
                raise InputError(f"{path}: is a folder; a file of this name is to be written")
    for path, content in files.items():
        write_atomically(path, content)
    return tuple(files)


def exported_files(design: Design, name: str, tolerances: NamedTolerances | None = None) -> dict[str, str | bytes]:
    """What a format makes of a design, by names of files that are safe to write into one folder.

    Raises
    ------
    InputError
        There is no such format, it cannot hold the design or the tolerances, or a part's name cannot name a file.
    """
    chosen = export_format(name)
    contents = _contents(name, design, tolerances)
    _check_names(chosen, contents)
    return {f"{part}{chosen.suffix}": content for part, content in contents.items()}


def _contents(name: str, design: Design, tolerances: NamedTolerances | None) -> Mapping[str, str | bytes]:
    chosen = EXPORTS[name]
    check_magnitudes(design)
    if tolerances is None:
        return chosen.contents(design)
    if chosen.toleranced is None:
        holding = ", ".join(other for other, entry in EXPORTS.items() if entry.toleranced is not None)
        raise InputError(f"tolerances {tolerances.name}: {name} has no place for them; these have: {holding}")
    return chosen.toleranced(design, tolerances)


def check_target(name: str, target: Path) -> None:
    """Refuse a target to which a format cannot be written, before any work.

    Raises
    ------
    InputError
        There is no such format, or the target does not fit it.
    """
    chosen = export_format(name)
    if chosen.one_file_for == "design":
        if target.is_dir():
            raise InputError(f"{target}: is a folder; {name} needs a file that ends in {chosen.suffix}")
        if target.suffix.lower() != chosen.suffix:
            raise InputError(f"{target}: must end in {chosen.suffix} for {name}")
    elif target.exists() and not target.is_dir():
        raise InputError(f"{target}: is a file; {name} needs a folder, for a file of each {chosen.one_file_for}")


def _check_names(chosen: ExportFormat, contents: Mapping[str, str | bytes]) -> None:
    """Names come from the design file: none may lead out of the folder, nor two to one file on any system."""
    for part in contents:
        if not _FILE_NAME.fullmatch(part):
            raise InputError(
                f"{chosen.one_file_for} {part!r}: cannot name a file; use letters, digits, _, - and full stops"
            )
    if len({part.lower() for part in contents}) < len(contents):
        raise InputError(f"two names of a {chosen.one_file_for} differ only in case and would name one file")
