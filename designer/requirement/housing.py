"""What holds the upper mirrors."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from designer.housing import LEAST_INDEX, MATERIALS, MOST_INDEX
from designer.requirement.part import METRES, Part
from designer.requirement.quantity import Choice, DesignQuantity, Quantity, refuse

_KIND_OF_KEY = {
    "wall_mm": ("tube",),
    "material": ("tube",),
    "refractive_index": ("tube",),
    "number": ("struts",),
    "width_mm": ("struts",),
    "clearance_mm": ("tube", "struts"),
}


class Housing(Part):
    """What holds the upper mirrors. It counts in the head's height and diameter, and its refraction is corrected."""

    kind: Annotated[
        str,
        Choice(("none", "tube", "struts")),
        Field(
            title="housing",
            default="none",
            description="A transparent tube about all mirrors, as tall as the light of both views needs; vertical "
            "struts, which hide some azimuths; or none. Default: none, the mirrors alone.",
        ),
    ]
    wall_mm: Annotated[
        float,
        DesignQuantity(0.1, 100, "mm", if_smaller=METRES),
        Field(
            title="wall of the tube",
            default=3.0,
            description="Thickness of the tube's wall. Default: 3, a common size of extruded and drawn tubes. Each "
            "view's viewpoint is smeared over a part of it.",
        ),
    ]
    material: Annotated[
        str,
        Choice(tuple(MATERIALS)),
        Field(
            title="material of the tube",
            default="acrylic",
            description="Material of the tube, for its refractive index and its mass. "
            + "".join(
                f"{name}: {each.words}, index {each.refractive_index:g}, {each.density_g_per_mm3 * 1000:g} g/cm3. "
                for name, each in MATERIALS.items()
            )
            + "Default: acrylic, which is light and does not splinter.",
        ),
    ]
    refractive_index: Annotated[
        float,
        Quantity(LEAST_INDEX, MOST_INDEX),
        Field(
            title="refractive index of the tube",
            default_factory=lambda data: MATERIALS[data.get("material", "acrylic")].refractive_index,
            description="Refractive index of the tube's wall. Default: the material's at 587.6 nm.",
        ),
    ]
    number: Annotated[
        int,
        Quantity(1, 36, whole=True),
        Field(
            title="struts",
            default=3,
            description="Number of struts, evenly spaced; the first stands in +x. Default: 3, the fewest that are "
            "stiff against twist.",
        ),
    ]
    width_mm: Annotated[
        float,
        DesignQuantity(0.1, 1000, "mm", if_smaller=METRES),
        Field(title="diameter of a strut", default=4.0, description="Diameter of each strut, a round rod. Default: 4."),
    ]
    clearance_mm: Annotated[
        float,
        DesignQuantity(0.001, 1000, "mm"),
        Field(
            title="gap between mirrors and housing",
            default=1.0,
            description="Gap between the widest mirror, or the lens, and the housing; and between the light of both "
            "views and the ends of a tube. Default: 1, for tubes are seldom round to better than half of it.",
        ),
    ]

    @model_validator(mode="after")
    def _keys_belong_to_the_kind(self) -> Self:
        for key, kinds in _KIND_OF_KEY.items():
            # A complete file has the defaults of the other kinds too.
            if self.kind not in kinds and getattr(self, key) != self._default_of(key):
                wanted = " or ".join(f'"{kind}"' for kind in kinds)
                refuse(f'belongs to housing.kind = {wanted}; it is "{self.kind}"', key, getattr(self, key))
        return self

    def _default_of(self, key: str) -> object:
        return type(self).model_fields[key].get_default(call_default_factory=True, validated_data=self.__dict__)

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that mean something for this kind."""
        return ("kind", *(key for key, kinds in _KIND_OF_KEY.items() if self.kind in kinds))

    @property
    def thickness_mm(self) -> float:
        """How far the tube's wall, or a strut, reaches along the radius; 0 for none."""
        return {"none": 0.0, "tube": self.wall_mm, "struts": self.width_mm}[self.kind]

    @property
    def gap_mm(self) -> float:
        """Between mirrors and housing; 0 for none."""
        return 0.0 if self.kind == "none" else self.clearance_mm

    def least_spacing_mm(self, radius_mm: float) -> float:
        """Distance between neighbouring struts whose axes stand so far from the optical axis."""
        return 2.0 * radius_mm * (math.sin(math.pi / self.number) if self.number > 1 else 1.0)
