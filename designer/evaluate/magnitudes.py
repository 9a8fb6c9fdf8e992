"""Numbers so large or small that no optics has them."""

from __future__ import annotations

from pydantic import BaseModel

from designer.files import InputError

# Powers and products of numbers within these sizes stay finite.
SMALLEST_NUMBER, LARGEST_NUMBER = 1e-15, 1e15


def check_magnitudes(part: object, key: str = "") -> None:
    """Refuse the first number of a record, the score and unknown keys aside, that no optics has.

    Raises
    ------
    InputError
        There is one; its place starts with ``key``.
    """
    if isinstance(part, BaseModel):
        for name in type(part).model_fields:
            check_magnitudes(getattr(part, name), f"{key}.{name}" if key else name)
    elif isinstance(part, tuple):
        for index, entry in enumerate(part):
            check_magnitudes(entry, f"{key}.{index}")
    elif isinstance(part, float) and part and not SMALLEST_NUMBER <= abs(part) <= LARGEST_NUMBER:
        raise InputError(
            f"{key} = {part:g}: must be zero or from {SMALLEST_NUMBER:g} to {LARGEST_NUMBER:g} in magnitude"
        )
