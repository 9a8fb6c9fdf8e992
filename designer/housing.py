"""What holds the upper mirrors: the optional table ``housing`` of a design file.

A housing is round about the optical axis: a transparent tube, through which both views look, or vertical struts, the
first of them in the direction of +x. Heights are over the pinhole.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Strict, Tag, model_validator

# Strict: neither "2.0" nor true is a number.
Height = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Length = Annotated[float, Strict(), Field(allow_inf_nan=False, gt=0, le=1e6)]
# Glass and plastics for visible light lie between these.
LEAST_INDEX, MOST_INDEX = 1.2, 2.5


@dataclass(frozen=True, slots=True)
class TubeMaterial:
    """What tubes are drawn or extruded from: refractive index at 587.6 nm, density in g/mm3."""

    words: str
    refractive_index: float
    density_g_per_mm3: float


# Data sheets: PLEXIGLAS XT (Röhm) and DURAN borosilicate glass 3.3 (DWK).
MATERIALS: dict[str, TubeMaterial] = {
    "acrylic": TubeMaterial("acrylic (PMMA)", 1.491, 1.19e-3),
    "glass": TubeMaterial("borosilicate glass 3.3", 1.473, 2.23e-3),
}


class HousingPart(BaseModel):
    """Immutable, and strict about keys: a misspelt one would else be a housing that is not there."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    low_mm: Height
    high_mm: Height

    @model_validator(mode="after")
    def _stands_upright(self) -> Self:
        if not self.low_mm < self.high_mm:
            raise ValueError(f"high_mm ({self.high_mm:g}) must lie above low_mm ({self.low_mm:g})")
        return self

    @property
    def length_mm(self) -> float:
        """From its foot to its upper end."""
        return self.high_mm - self.low_mm


class Tube(HousingPart):
    """A transparent tube about the optical axis, from ``low_mm`` to ``high_mm``."""

    kind: Literal["tube"]
    inner_radius_mm: Length
    wall_mm: Length
    refractive_index: Annotated[float, Strict(), Field(allow_inf_nan=False, ge=LEAST_INDEX, le=MOST_INDEX)]
    material: str = ""

    @property
    def outer_radius_mm(self) -> float:
        """Radius of the outer wall."""
        return self.inner_radius_mm + self.wall_mm

    @property
    def volume_mm3(self) -> float:
        """Volume of its material."""
        return math.pi * (self.outer_radius_mm**2 - self.inner_radius_mm**2) * self.length_mm


class Struts(HousingPart):
    """Round vertical rods, ``number`` of them evenly spaced, ``width_mm`` thick; the first stands in +x.

    ``radius_mm`` is the distance of their own axes from the optical axis.
    """

    kind: Literal["struts"]
    number: Annotated[int, Strict(), Field(ge=1, le=36)]
    width_mm: Length
    radius_mm: Length

    @model_validator(mode="after")
    def _stand_apart(self) -> Self:
        apart = 2.0 * self.radius_mm * (math.sin(math.pi / self.number) if self.number > 1 else 1.0)
        if self.width_mm >= apart:
            raise ValueError(
                f"width_mm ({self.width_mm:g}) must be less than {apart:.4g}, the distance between neighbouring struts"
            )
        return self

    @property
    def outer_radius_mm(self) -> float:
        """Radius about the optical axis that encloses them."""
        return self.radius_mm + self.width_mm / 2.0

    @property
    def inner_radius_mm(self) -> float:
        """Radius about the optical axis within which nothing of them stands."""
        return self.radius_mm - self.width_mm / 2.0

    @property
    def azimuths_deg(self) -> tuple[float, ...]:
        """Azimuths of their axes, from +x towards +y."""
        return tuple(360.0 * place / self.number for place in range(self.number))

    @property
    def half_width_deg(self) -> float:
        """Half the range of azimuths that each of them hides from the optical axis."""
        return math.degrees(math.asin(self.width_mm / 2.0 / self.radius_mm))

    @property
    def blocked_share(self) -> float:
        """The share of all azimuths that they hide."""
        return 2.0 * self.number * self.half_width_deg / 360.0

    @property
    def volume_mm3(self) -> float:
        """Volume of all of them."""
        return self.number * math.pi * (self.width_mm / 2.0) ** 2 * self.length_mm


def _kind(value: object) -> str | None:
    kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
    # In parentheses: a tag, and no key of the file.
    return f"({kind})" if kind in {"tube", "struts"} else None


Housing = Annotated[
    Annotated[Tube, Tag("(tube)")] | Annotated[Struts, Tag("(struts)")],
    Discriminator(
        _kind,
        custom_error_type="housing_kind",
        custom_error_message='must be a table whose kind is "tube" or "struts"; leave it out for none',
    ),
]
