"""A housing in one line of plain text, for files of formats that draw it and of those that cannot hold it."""

from __future__ import annotations

from designer.design import Design
from designer.housing import MATERIALS, Tube


def housing_words(design: Design) -> tuple[str, ...]:
    """The tube or the struts, with every dimension; nothing for a design without a housing."""
    housing = design.housing
    if housing is None:
        return ()
    ends = f"from height {housing.low_mm!r} to {housing.high_mm!r}"
    if isinstance(housing, Tube):
        return (
            f"tube: {housing_material(design)}, refractive index {housing.refractive_index!r}, "
            f"inner radius {housing.inner_radius_mm!r}, wall {housing.wall_mm!r}, {ends}",
        )
    return (
        f"struts: {housing.number} round rods, diameter {housing.width_mm!r}, axes at radius {housing.radius_mm!r}, "
        f"the first in +x, {ends}",
    )


def housing_material(design: Design) -> str:
    """What the housing is made of, in words."""
    housing = design.housing
    if not isinstance(housing, Tube):
        return "aluminium"
    return MATERIALS[housing.material].words if housing.material in MATERIALS else "material to be agreed"


def without_the_housing(design: Design) -> tuple[str, ...]:
    """What to say in a file that holds none."""
    words = housing_words(design)
    if not words:
        return ()
    effect = "its wall shifts every ray along the axis" if design.tube else "they hide some azimuths"
    return (f"Not in this file: the {words[0]}; {effect}.",)
