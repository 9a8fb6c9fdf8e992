"""The files of an order: every format that can hold the design, a parts list, and words about all of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from designer.as_built.named import NamedTolerances
from designer.as_built.tolerances import tolerances_to_toml
from designer.design import Design, design_to_json
from designer.export.formats import EXPORTS, export_format, exported_files
from designer.export.order.folder import check_order_folder, write_order_folder
from designer.export.order.words import parts_list, read_me
from designer.files import InputError

README, PARTS, DESIGN, TOLERANCES = "README.md", "parts.csv", "design.json", "tolerances.toml"
_NEEDED = "drawing"


@dataclass(frozen=True, slots=True)
class Order:
    """What was written.

    Attributes
    ----------
    folder
        The folder of the order.
    files
        The names of its files, with forward slashes.
    left_out
        A sentence for each format that is not in the folder, by its name: what it needs, or why it cannot hold the
        design.
    problems
        Why the ray tracer rejects the design; empty if it accepts it.
    """

    folder: Path
    files: tuple[str, ...]
    left_out: dict[str, str]
    problems: tuple[str, ...]


def write_order(design: Design, folder: Path, tolerances: NamedTolerances | None = None) -> Order:
    """Write a design as one package: drawings, tables, solids, optical files, parts list, and a README.

    Without tolerances the drawings leave these to be agreed. The folder appears whole or not at all. An earlier order
    in its place is replaced if it is as it was written.

    Raises
    ------
    InputError
        The folder holds something else, there is nothing to typeset the drawings with, or the design cannot be drawn.
    """
    check_order_folder(folder)
    export_format(_NEEDED)
    from designer.verify.judge import judge

    files: dict[str, str | bytes] = {DESIGN: design_to_json(design)}
    left_out = {}
    for name in EXPORTS:
        held = tolerances if EXPORTS[name].toleranced is not None else None
        try:
            files |= {f"{name}/{file}": content for file, content in exported_files(design, name, held).items()}
        except InputError as error:
            if name == _NEEDED:
                raise
            left_out[name] = str(error)
    problems = judge(design, whole_image=False).problems
    files[PARTS] = parts_list(design)
    if tolerances is not None:
        files[TOLERANCES] = tolerances_to_toml(tolerances.values)
    files[README] = read_me(design, [name for name in EXPORTS if name not in left_out], left_out, problems, tolerances)
    write_order_folder(folder, files)
    return Order(folder, tuple(sorted(files)), left_out, problems)
