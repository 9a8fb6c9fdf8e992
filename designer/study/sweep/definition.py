"""What a sweep asks for: a base requirement, and axes along which its numeric keys vary."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, StrictStr, field_validator, model_validator

from designer.files import InputError, shortened
from designer.requirement import Requirement, index_in, read_named_part, read_requirement, set_key
from designer.requirement.names import nearest
from designer.requirement.part import Part
from designer.requirement.quantity import Quantity, refuse

MOST_POINTS = 100_000
_ANY_NUMBER = Quantity(-1e9, 1e9)


class Axis(Part):
    """One key of the requirement and the values it takes."""

    key: Annotated[
        StrictStr,
        Field(
            description="Dotted name of a numeric key of the requirement, such as envelope.height_mm; a number selects "
            "from a list or a range: working_volume.elevation_deg.1 is the highest elevation."
        ),
    ]
    values: Annotated[
        tuple[float, ...],
        Field(default=(), description="The values, in increasing order. Give either these, or low, high and count."),
    ]
    low: Annotated[float | None, Field(default=None, description="First value of a range, together with high.")]
    high: Annotated[float | None, Field(default=None, description="Last value of a range.")]
    count: Annotated[
        int | None,
        Field(default=None, description="Number of values from low to high; omit for a Latin hypercube."),
    ]
    spacing: Annotated[
        Literal["linear", "logarithmic"],
        Field(default="linear", description="Spacing of the values in a range. Default: linear."),
    ]
    start: Annotated[
        float | None,
        Field(
            default=None,
            description="The value at which the search of a grid begins; the others start from their neighbours. "
            "The loosest value saves time: warm starts follow a requirement as it tightens, but rarely as it loosens. "
            "Default: the middle.",
        ),
    ]

    @field_validator("values", mode="before")
    @classmethod
    def _are_numbers(cls, values: object) -> object:
        if not isinstance(values, list | tuple) or not values:
            refuse("must be an array of at least one number")
        numbers = tuple(_ANY_NUMBER.check(value) for value in values)
        if any(not first < second for first, second in pairwise(numbers)):  # type: ignore[operator]
            refuse("must be increasing numbers without repetition")
        return numbers

    @field_validator("low", "high", "start", mode="before")
    @classmethod
    def _is_number(cls, value: object) -> object:
        return _ANY_NUMBER.check(value)

    @field_validator("count", mode="before")
    @classmethod
    def _is_count(cls, value: object) -> object:
        return Quantity(2, MOST_POINTS, whole=True).check(value)

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Self:
        if self.values:
            if self.low is not None or self.high is not None or self.count is not None:
                refuse("give either values, or low, high and count", "values", list(self.values))
            self._check_start(self.values)
            return self
        if self.low is None or self.high is None:
            refuse("needs values, or low and high", "key", self.key)
        if not self.low < self.high:
            refuse(f"must be less than high ({self.high:g})", "low", self.low)
        if self.spacing == "logarithmic" and self.low <= 0.0:
            refuse("must be above zero for logarithmic spacing", "low", self.low)
        if self.count is None and self.start is not None:
            refuse("applies only to a grid", "start", self.start)
        if self.count is not None:
            self._check_start(self.levels)
        return self

    def _check_start(self, levels: tuple[float, ...]) -> None:
        if self.start is not None and not any(math.isclose(self.start, level) for level in levels):
            refuse(
                f"must be one of the axis's values ({', '.join(f'{level:g}' for level in levels)})", "start", self.start
            )

    @property
    def start_index(self) -> int:
        """Which of the levels a grid starts from."""
        if self.start is None:
            return len(self.levels) // 2
        return next(index for index, level in enumerate(self.levels) if math.isclose(self.start, level))

    @property
    def levels(self) -> tuple[float, ...]:
        """The values of the axis on a grid."""
        if self.values:
            return self.values
        assert self.count is not None
        return tuple(self.at(index / (self.count - 1)) for index in range(self.count))

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest value."""
        if self.values:
            return self.values[0], self.values[-1]
        assert self.low is not None
        assert self.high is not None
        return self.low, self.high

    def at(self, share: float) -> float:
        """The value at a share 0..1 of the way along the axis."""
        if self.values:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        low, high = self.ends
        if share in {0.0, 1.0}:
            return high if share else low
        if self.spacing == "logarithmic":
            value = math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
        else:
            value = low + share * (high - low)
        # Twelve digits are more than anyone asks for, and keep 0.1 from being 0.10000000000000001 in tables.
        return float(f"{value:.12g}")


class SweepDefinition(Part):
    """A sweep as its file says it."""

    name: Annotated[StrictStr, Field(description="Short name, used for folders. Default: the file name.")]
    title: Annotated[StrictStr, Field(default_factory=lambda data: data.get("name", ""), description="Heading.")]
    description: Annotated[StrictStr, Field(default="", description="Purpose of the sweep.")]
    requirement: Annotated[StrictStr, Field(description="Path of the base requirement, relative to the sweep file.")]
    plan: Annotated[
        Literal["grid", "latin_hypercube"],
        Field(
            default="grid",
            description="grid: every combination of the axes' values. latin_hypercube: a given number of points, "
            "spread so that each axis is covered evenly. Default: grid.",
        ),
    ]
    points: Annotated[int | None, Field(default=None, description="Number of points, for a Latin hypercube only.")]
    seed: Annotated[int, Quantity(0, 2**32 - 1, whole=True), Field(default=0, description="Seed of the hypercube.")]
    axis: Annotated[tuple[Axis, ...], Field(description="The axes: one [[axis]] table for each.")]

    @field_validator("points", mode="before")
    @classmethod
    def _is_count(cls, value: object) -> object:
        return Quantity(2, MOST_POINTS, whole=True).check(value)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        keys = [axis.key for axis in self.axis]
        if not keys:
            refuse("needs at least one axis", "axis")
        for key in keys:
            if keys.count(key) > 1:
                refuse("two axes have this key", "axis.key", key)
        if self.plan == "grid":
            if self.points is not None:
                refuse("the axes determine the number of points of a grid; omit it", "points", self.points)
            for axis in self.axis:
                if not axis.values and axis.count is None:
                    refuse("needs a count on a grid", "axis.key", axis.key)
            if (count := math.prod(axis.count or len(axis.values) for axis in self.axis)) > MOST_POINTS:
                refuse(f"give {count} points; at most {MOST_POINTS} are allowed", "axis")
        elif self.points is None:
            refuse("is needed for a Latin hypercube", "points")
        elif any(axis.count is not None for axis in self.axis):
            refuse("the points of a Latin hypercube determine the number of values; omit it", "axis.count")
        return self


def read_sweep(path: Path) -> tuple[SweepDefinition, Requirement]:
    """Read and validate a sweep's file and its base requirement.

    Raises
    ------
    InputError
        The file, the requirement or a key of an axis cannot be used: one line says why.
    """
    definition = read_named_part(path, SweepDefinition)
    base = read_requirement(path.parent / definition.requirement)
    try:
        base = set_key(base, "name", definition.name)
    except InputError as error:
        raise InputError(f"{path}: {str(error).removeprefix(f'{base.name}: ')}") from None
    for axis in definition.axis:
        _check_key(path, base, axis.key)
    return definition, base


def requirement_at(base: Requirement, coordinates: dict[str, float]) -> Requirement:
    """The base requirement with the keys of all axes set.

    Raises
    ------
    InputError
        The combination is not allowed.
    """
    changed = base
    for key, value in coordinates.items():
        # Whole numbers stay whole, so that counts such as pixels can be swept.
        changed = set_key(changed, key, int(value) if value == int(value) else value)
    return changed


def _check_key(path: Path, base: Requirement, key: str) -> None:
    value: Any = base.model_dump()
    named = f"{path}: axis.key = {shortened(repr(key))}"
    for part in key.split("."):
        if isinstance(value, dict) and part in value:
            value = value[part]
        elif isinstance(value, list | tuple) and (index := index_in(value, part)) is not None:
            value = value[index]
        else:
            advice = f"; {nearest(part, tuple(value))}" if isinstance(value, dict) else ""
            raise InputError(f"{named}: the requirement has no such key ({shortened(repr(part)[1:-1])}){advice}")
    if key.partition(".")[0] == "solve":
        raise InputError(f"{named}: controls the computation and is not part of the requirement")
    if isinstance(value, bool) or not isinstance(value, int | float | tuple):
        raise InputError(f"{named}: not a numeric key")
