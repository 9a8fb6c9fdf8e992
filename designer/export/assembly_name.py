"""The names of the parts of a design that are no mirrors, among the files of its parts."""

from __future__ import annotations

from designer.design import Design
from designer.files import InputError
from designer.housing import Tube

ASSEMBLY = "assembly"


def housing_parts(design: Design) -> tuple[str, ...]:
    """What a housing's parts are called: the tube, or each of the struts."""
    housing = design.housing
    if housing is None:
        return ()
    return ("tube",) if isinstance(housing, Tube) else tuple(f"strut_{place + 1}" for place in range(housing.number))


def check_names_of_parts(design: Design) -> None:
    """Refuse a mirror whose file would be that of the assembly or of a part of the housing.

    Raises
    ------
    InputError
        A mirror has that name.
    """
    for mirror in design.mirrors:
        if mirror.name.lower() == ASSEMBLY:
            raise InputError(f"mirror {mirror.name!r}: the assembly's file has this name; give the mirror another")
        if mirror.name.lower() in housing_parts(design):
            raise InputError(f"mirror {mirror.name!r}: a part of the housing has this name; give the mirror another")
