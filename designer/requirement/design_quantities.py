"""The numbers of a requirement that shape designs: every key that is a :class:`DesignQuantity` in its model."""

from __future__ import annotations

from functools import cache

from designer.requirement.model import Requirement
from designer.requirement.part import Part
from designer.requirement.quantity import DesignQuantity


@cache
def design_quantities() -> dict[str, DesignQuantity]:
    """What may be typed for each number that shapes designs, by its dotted key, in the order of the models.

    A range is two numbers, such as ``working_volume.elevation_deg.0`` and ``.1``.
    """
    return _design_quantities_of(Requirement, "")


def _design_quantities_of(model: type[Part], path: str) -> dict[str, DesignQuantity]:
    found: dict[str, DesignQuantity] = {}
    for name, field in model.model_fields.items():
        key = f"{path}{name}"
        if isinstance(field.annotation, type) and issubclass(field.annotation, Part):
            found |= _design_quantities_of(field.annotation, f"{key}.")
        for quantity in field.metadata:
            if isinstance(quantity, DesignQuantity):
                found |= dict.fromkeys([f"{key}.0", f"{key}.1"] if quantity.shape == "range" else [key], quantity)
    return found


def number_at(requirement: Requirement, key: str) -> float | None:
    """The number a key holds, defaults included; None if it holds none."""
    value: object = requirement
    for part in key.split("."):
        if isinstance(value, list | tuple):
            value = value[int(part)] if part.isdecimal() and int(part) < len(value) else None
        else:
            value = getattr(value, part, None)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
