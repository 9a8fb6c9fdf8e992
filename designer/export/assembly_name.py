"""The name of the assembly among the files of a design's parts."""

from __future__ import annotations

from designer.design import Design
from designer.files import InputError

ASSEMBLY = "assembly"


def check_no_mirror_is_the_assembly(design: Design) -> None:
    """Refuse a mirror whose file would be the assembly's.

    Raises
    ------
    InputError
        A mirror has that name.
    """
    for mirror in design.mirrors:
        if mirror.name.lower() == ASSEMBLY:
            raise InputError(f"mirror {mirror.name!r}: the assembly's file has this name; give the mirror another")
