"""What all parts of a requirement share: the base model, common hints, numbers that may be ranges."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from designer.requirement.names import nearest
from designer.requirement.quantity import refuse

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
                below = cls._table_with(key)
                advice = f"did you mean {below}.{key}?" if below else nearest(key, tuple(cls.model_fields))
                refuse(f"no such key; {advice}", key, data[key])
        return data

    @classmethod
    def _table_with(cls, key: object) -> str | None:
        """The table, one level down, that has a key."""
        for name, field in cls.model_fields.items():
            kind = field.annotation
            if isinstance(kind, type) and issubclass(kind, Part) and key in kind.model_fields:
                return name
        return None


def given(value: object) -> Any:
    """A part of a requirement as plain tables, arrays and values: what was given, without the defaults.

    Pydantic's own dump takes a Ctrl-C that arrives in the middle of a union for a value of another kind, warns and goes
    on; a sweep dumps its requirement thousands of times.
    """
    if isinstance(value, BaseModel):
        names = (name for name in type(value).model_fields if name in value.model_fields_set)
        return {name: given(getattr(value, name)) for name in names}
    if isinstance(value, dict):
        return {key: given(element) for key, element in value.items()}
    return [given(element) for element in value] if isinstance(value, tuple | list) else value
