"""What all parts of a requirement share: the base model, common hints, numbers that may be ranges."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from designer.requirement.quantity import refuse
from designer.requirement.selection import nearest

METRES = "is that metres? Lengths are in millimetres"
RADIANS = "is that radians? Angles are in degrees"
NumberOrRange = float | tuple[float, float]


def ends(value: NumberOrRange) -> tuple[float, float]:
    """(low, high) of a number or a range; a number is both its ends."""
    return value if isinstance(value, tuple) else (value, value)


class Part(BaseModel):
    """Base of every part of a requirement: immutable; a key that does not exist is refused with the nearest name."""

    # An infinite number stays one in the JSON that a sweep's store keeps.
    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, data: Any) -> Any:
        if isinstance(data, cls):
            return data
        if not isinstance(data, dict):
            refuse(f"must be a table with the keys {', '.join(cls.model_fields)}")
        for key in data:
            if key not in cls.model_fields:
                refuse(f"no such key; {nearest(key, tuple(cls.model_fields))}", key, data[key])
        return data
