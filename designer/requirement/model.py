"""What an engineer asks for: baseline, working volume, envelope, camera, manufacture, objective.

Millimetres, degrees and pixels, as the names say; z along the optical axis from the entrance pupil, upwards.
Every model is immutable and refuses unknown keys. What a field means, and why its default is what it is, stands in
the field's description: the reference page is made from them.
"""

from __future__ import annotations

import re
from typing import Annotated, Self

from pydantic import Field, StrictStr, field_validator, model_validator

from designer.configurations import FLATTEST, MOST_PARABOLIC, Configuration
from designer.goals import GOALS
from designer.requirement.camera import Camera
from designer.requirement.fixed import Fixed
from designer.requirement.housing import Housing
from designer.requirement.light import Light, Matching
from designer.requirement.manufacture import Manufacture
from designer.requirement.names import select_configurations
from designer.requirement.part import METRES, NumberOrRange, Part, ends
from designer.requirement.quantity import Choice, NumberOrWord, Quantity, refuse
from designer.requirement.sharpness import Sharpness
from designer.requirement.space import Envelope, WorkingVolume

# What differs by more cannot be met to the solver's tolerance either.
SAME_LENGTH_MM = 1e-6
# Objectives nearer than this, as a ratio, are the same optimum.
SAME_OBJECTIVE = 1e-7

_GOALS = Choice(tuple(GOALS))
PREDICTED = "predicted"
"""Instead of a noise: that it is to be predicted from the lens, the light and the texture."""


class Objective(Part):
    """What to minimise first, and what second."""

    minimise: Annotated[
        str,
        _GOALS,
        Field(
            default="depth_error",
            description="What to minimise first. "
            + "".join(f"{name}: {goal.description}. " for name, goal in GOALS.items())
            + "Default: depth_error, the purpose of the sensor.",
        ),
    ]
    then: Annotated[
        str,
        _GOALS,
        Field(
            default_factory=lambda data: "depth_error" if data.get("minimise") == "height" else "height",
            description="What to minimise second, with the first objective kept within a tolerance. Default: height "
            "(depth_error "
            "if height comes first), since many designs of different size reach the same depth error.",
        ),
    ]
    within_percent: Annotated[
        float,
        Quantity(0, 1000, "percent"),
        Field(
            default=1.0,
            description="How much the first objective may increase in favour of the second. Default: 1 percent, "
            "which is negligible in practice. At least 0.1, or 0 for none.",
        ),
    ]

    @model_validator(mode="after")
    def _is_sensible(self) -> Self:
        if self.then == self.minimise:
            refuse(f"must differ from objective.minimise ({self.minimise})", "then", self.then)
        if 0 < self.within_percent < 0.1:
            refuse(
                "must be 0 or from 0.1 to 1000; is that a fraction? 1 means 1 percent",
                "within_percent",
                self.within_percent,
            )
        return self

    @property
    def tolerance(self) -> float:
        """How far above the least a first objective may lie to count as equal to it, as a share."""
        return max(self.within_percent / 100.0, SAME_OBJECTIVE)


class Solve(Part):
    """How the study is computed."""

    seed: Annotated[
        int,
        Quantity(0, 2**32 - 1, whole=True),
        Field(title="seed", default=0, description="Seed of every random choice; the same seed gives the same study."),
    ]
    starts: Annotated[
        int,
        Quantity(1, 10_000, whole=True),
        Field(
            title="starts",
            default=16,
            description="Starting points of the optimiser for each variant of a configuration. Default: 16; more "
            "starts cost time and rarely find better optima.",
        ),
    ]
    configurations: Annotated[
        tuple[StrictStr, ...],
        Field(
            default=("*",),
            description='Configurations to study, by name or glob pattern such as "folded-*-upper_outer". In folding '
            "pairs a hyperboloid's inverse eccentricity, and an ellipsoid's eccentricity, is kept between "
            f"{FLATTEST:g} and {MOST_PARABOLIC:g}: below, it is practically a plane (or a sphere), and near 1 a "
            "paraboloid, which are covered by other configurations. Default: all 44.",
        ),
    ]

    @field_validator("configurations", mode="before")
    @classmethod
    def _is_array(cls, value: object) -> object:
        if not isinstance(value, list | tuple) or not value or not all(isinstance(item, str) for item in value):
            refuse('must be an array of at least one name or pattern, such as ["folded-*-upper_outer"]')
        return value

    @field_validator("configurations")
    @classmethod
    def _match_something(cls, patterns: tuple[str, ...]) -> tuple[str, ...]:
        select_configurations(patterns)
        return patterns


class Requirement(Part):
    """The complete requirement of a study."""

    name: Annotated[
        StrictStr,
        Field(
            default_factory=lambda: "requirement",
            description="Short name, used for folders. Default: the file name without its extension.",
        ),
    ]
    title: Annotated[
        StrictStr,
        Field(
            default_factory=lambda data: data.get("name", ""),
            description="Heading of the report. Default: the name.",
        ),
    ]
    description: Annotated[StrictStr, Field(default="", description="What the sensor is for, in a few sentences.")]
    baseline_mm: Annotated[
        NumberOrRange,
        Quantity(1, 1e5, "mm", if_smaller=METRES, shape="number or range"),
        Field(
            title="baseline",
            description="Distance between the two effective viewpoints, or the range in which it is optimised.",
        ),
    ]
    noise_px: Annotated[
        float | str,
        NumberOrWord(Quantity(0.001, 10, "pixels"), PREDICTED),
        Field(
            title="image noise, each view",
            default=0.1,
            description="Standard deviation of an image point's radial position in each view. Default: 0.1, which "
            'subpixel matching reaches on good texture. Or "predicted": from texture, blur, light and the matcher\'s '
            "window ([light], [matching]).",
        ),
    ]
    scale_uncertainty_percent: Annotated[
        float,
        Quantity(0, 5, "percent"),
        Field(
            title="scale uncertainty",
            default=0.02,
            description="Relative standard uncertainty of the image's scale (principal distance, focus, temperature, "
            "pixel pitch). The systematic depth error that it causes is added to that of the noise in quadrature. It "
            "is large in folded designs, where the shifts of the two views add up, and small in direct ones, where "
            "they nearly cancel. Default: 0.02, which a careful calibration reaches. 0: not counted.",
        ),
    ]
    working_volume: WorkingVolume
    envelope: Envelope
    camera: Camera
    sharpness: Annotated[Sharpness, Field(default=Sharpness())]
    light: Annotated[Light, Field(default=Light.model_validate({}))]
    matching: Annotated[Matching, Field(default=Matching.model_validate({}))]
    manufacture: Annotated[Manufacture, Field(default=Manufacture())]
    housing: Annotated[Housing, Field(default=Housing.model_validate({}))]
    objective: Annotated[Objective, Field(default=Objective())]
    fixed: Annotated[Fixed, Field(default=Fixed())]
    solve: Annotated[Solve, Field(default=Solve())]

    @field_validator("name")
    @classmethod
    def _names_a_folder(cls, name: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", name):
            refuse("must be letters, digits, '_', '-' and '.' only (it names a folder), at most 100")
        return name

    @property
    def baseline_range_mm(self) -> tuple[float, float]:
        """Least and greatest baseline; equal if it is given."""
        return ends(self.baseline_mm)

    @property
    def configurations(self) -> tuple[Configuration, ...]:
        """The configurations to study, in the order of the 44."""
        return select_configurations(self.solve.configurations)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        _check_distances(self)
        _check_lens_fits(self)
        _check_manufacture(self)
        _check_housing(self)
        _check_fixed(self)
        return self


def _check_distances(asked: Requirement) -> None:
    near, far = asked.working_volume.distance_mm
    if near <= asked.envelope.diameter_mm / 2:
        refuse(
            f"must begin outside the envelope (beyond envelope.diameter_mm / 2 = {asked.envelope.diameter_mm / 2:g})"
            + (f"; {METRES}" if far <= 100 else ""),
            "working_volume.distance_mm",
            [near, far],
        )


def _check_lens_fits(asked: Requirement) -> None:
    envelope, camera, manufacture = asked.envelope, asked.camera, asked.manufacture
    for number, lens in enumerate(camera.lenses, 1):
        which = f"lens {number} ({lens.name or 'unnamed'})" if len(camera.lenses) > 1 else "the lens"
        if envelope.diameter_mm < 2 * lens.radius_mm:
            refuse(
                f"must be at least the diameter of {which}, 2 camera.lens.radius_mm = {2 * lens.radius_mm:g}",
                "envelope.diameter_mm",
                envelope.diameter_mm,
            )
        least_height = camera.nearest_mirror_mm - lens.front_mm + manufacture.substrate_thickness_mm
        if envelope.height_mm < least_height:
            refuse(
                f"must be at least {least_height:g}: from the front of {which} to the nearest mirror allowed "
                "(camera.nearest_mirror_mm - camera.lens.front_mm), plus its substrate",
                "envelope.height_mm",
                envelope.height_mm,
            )


def _check_manufacture(asked: Requirement) -> None:
    largest_radius = asked.envelope.mirror_diameter_mm / 2
    smallest_radius = asked.manufacture.smallest_mirror_radius_mm
    if smallest_radius > largest_radius:
        refuse(
            f"must be at most envelope.mirror_diameter_mm / 2 = {largest_radius:g}",
            "manufacture.smallest_mirror_radius_mm",
            smallest_radius,
        )
    image_circle = asked.camera.image_circle_radius_px
    if asked.manufacture.zone_gap_px >= image_circle:
        refuse(
            f"must be smaller than camera.image_circle_radius_px ({image_circle:g})",
            "manufacture.zone_gap_px",
            asked.manufacture.zone_gap_px,
        )


def _check_housing(asked: Requirement) -> None:
    housing, envelope = asked.housing, asked.envelope
    if housing.kind == "none":
        return
    beyond = housing.gap_mm + housing.thickness_mm
    widest = max(asked.manufacture.smallest_mirror_radius_mm, *(lens.radius_mm for lens in asked.camera.lenses))
    if envelope.diameter_mm < 2 * (widest + beyond):
        refuse(
            f"must be at least {2 * (widest + beyond):g}: the lens, or the smallest mirror allowed, in its housing",
            "envelope.diameter_mm",
            envelope.diameter_mm,
        )
    narrowest = min(lens.radius_mm for lens in asked.camera.lenses) + housing.gap_mm + housing.width_mm / 2
    if housing.kind == "struts" and housing.width_mm >= housing.least_spacing_mm(narrowest):
        refuse(
            f"must be less than {housing.least_spacing_mm(narrowest):.4g}, the distance between {housing.number} "
            "struts close about the lens",
            "housing.width_mm",
            housing.width_mm,
        )


def _check_fixed(asked: Requirement) -> None:
    known = {name for configuration in asked.configurations for name in configuration.mirror_kinds}
    for name in asked.fixed.mirror:
        if name not in known:
            refuse(
                f"no configuration in solve.configurations has this mirror; they have {', '.join(sorted(known))}",
                f"fixed.mirror.{name}",
            )
    view = asked.fixed.view
    ends_mm = [view[name].viewpoint_mm for name in ("lower", "upper") if name in view]
    if len(ends_mm) == 2 and ends_mm[0] is not None and ends_mm[1] is not None:
        apart, (least, greatest) = ends_mm[1] - ends_mm[0], asked.baseline_range_mm
        if not least - SAME_LENGTH_MM <= apart <= greatest + SAME_LENGTH_MM:
            allowed = f"{least:g}" if least == greatest else f"from {least:g} to {greatest:g}"
            refuse(
                f"less fixed.view.lower.viewpoint_mm ({ends_mm[0]:g}) must be the baseline, baseline_mm = {allowed}; "
                f"it is {apart:g}",
                "fixed.view.upper.viewpoint_mm",
                ends_mm[1],
            )
