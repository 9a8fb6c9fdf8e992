"""Design parameters that are given instead of optimised."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from designer.configurations import MIRROR_NAMES
from designer.design import VIEW_NAMES
from designer.requirement.coherence import check_fixed_numbers
from designer.requirement.names import nearest
from designer.requirement.part import Part
from designer.requirement.quantity import Quantity, refuse


class FixedMirror(Part):
    """Parameters of a mirror that the optimiser must keep; any subset."""

    radius_mm: Annotated[
        float | None,
        Quantity(-1e6, 1e6, "mm"),
        Field(
            default=None,
            description="Signed radius of curvature at the vertex, positive when the centre of curvature lies above.",
        ),
    ]
    conic: Annotated[
        float | None,
        Quantity(-1e6, 0),
        Field(
            default=None,
            description="Conic constant: below -1 a hyperboloid, -1 a paraboloid, -1 to 0 an ellipsoid.",
        ),
    ]
    vertex_mm: Annotated[
        float | None,
        Quantity(-1e5, 1e5, "mm"),
        Field(default=None, description="Height of the vertex above the entrance pupil."),
    ]

    @model_validator(mode="after")
    def _fixes_something(self) -> Self:
        if self.radius_mm is None and self.conic is None and self.vertex_mm is None:
            refuse("must fix at least one of radius_mm, conic, vertex_mm")
        if self.radius_mm == 0:
            refuse("must not be 0; omit it for a plane", "radius_mm", self.radius_mm)
        if self.conic == 0:
            refuse("must be below 0: a sphere has no pair of foci", "conic", self.conic)
        return self


class FixedView(Part):
    """Parameters of a view that the optimiser must keep; any subset."""

    viewpoint_mm: Annotated[
        float | None,
        Quantity(-1e5, 1e5, "mm"),
        Field(default=None, description="Height of the effective viewpoint above the entrance pupil."),
    ]
    gain: Annotated[
        float | None,
        Quantity(-1e4, 1e4),
        Field(default=None, description="Gain kappa in tan(psi/2) = kappa tan(45 degrees +- elevation/2); signed."),
    ]

    @model_validator(mode="after")
    def _fixes_something(self) -> Self:
        if self.viewpoint_mm is None and self.gain is None:
            refuse("must fix at least one of viewpoint_mm, gain")
        if self.gain == 0:
            refuse("must not be 0", "gain", self.gain)
        return self


class Fixed(Part):
    """Design parameters given instead of optimised, by mirror and by view."""

    mirror: Annotated[
        dict[str, FixedMirror],
        Field(
            default={},
            description="By mirror name: lower and upper in direct configurations, primary, secondary and direct in "
            "folded ones. Default: nothing fixed.",
        ),
    ]
    view: Annotated[
        dict[str, FixedView],
        Field(default={}, description="By view name: upper, lower. Default: nothing fixed."),
    ]

    @model_validator(mode="after")
    def _names_exist(self) -> Self:
        for table, given, known in (("mirror", self.mirror, MIRROR_NAMES), ("view", self.view, VIEW_NAMES)):
            for name in given:
                if name not in known:
                    refuse(f"no such {table}; {nearest(name, known)}", f"{table}.{name}")
        return self

    @model_validator(mode="after")
    def _numbers_agree(self) -> Self:
        mirrors, views = (
            {name: part.model_dump(exclude_none=True) for name, part in table.items()}
            for table in (self.mirror, self.view)
        )
        check_fixed_numbers(mirrors, views)
        return self
