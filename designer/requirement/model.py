"""What an engineer asks for: baseline, working volume, envelope, camera, manufacture, objective.

Millimetres, degrees and pixels, as the names say; z along the optical axis from the entrance pupil, upwards.
Every model is immutable and refuses unknown keys. What a field means, and why its default is what it is, stands in
the field's description: the reference page is made from them.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, StrictStr, Tag, field_validator, model_validator

from designer.configurations import Configuration
from designer.requirement.quantity import Quantity, refuse
from designer.requirement.selection import nearest, select_configurations

Goal = Literal["depth_error", "height", "diameter", "volume"]
MIRROR_NAMES = ("lower", "upper", "primary", "secondary", "direct")
VIEW_NAMES = ("upper", "lower")

METRES = "is that metres? Lengths are in millimetres"
RADIANS = "is that radians? Angles are in degrees"
NumberOrRange = float | tuple[float, float]


def ends(value: NumberOrRange) -> tuple[float, float]:
    """(low, high) of a number or a range; a number is both its ends."""
    return value if isinstance(value, tuple) else (value, value)


def principal_distance(focal_length_mm: float, focus_distance_mm: float) -> float:
    """Distance of the image plane from the pinhole, mm: f0 u / (u - f0) for a lens f0 focused at u.

    ``focus_distance_mm`` is measured from the entrance pupil and exceeds the focal length; infinity gives f0.
    """
    return focal_length_mm / (1.0 - focal_length_mm / focus_distance_mm)


class Part(BaseModel):
    """Base of every part of a requirement: immutable; a key that does not exist is refused with the nearest name."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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


class WorkingVolume(Part):
    """Where depth is wanted: a range of elevations over a range of distances."""

    elevation_deg: Annotated[
        tuple[float, float],
        Quantity(-89, 89, "degrees", shape="range"),
        Field(description="Lowest and highest elevation, seen from the middle of the baseline; up is positive."),
    ]
    distance_mm: Annotated[
        tuple[float, float],
        Quantity(1e-3, 1e7, "mm", shape="range"),
        Field(description="Nearest and farthest horizontal distance from the optical axis."),
    ]

    @model_validator(mode="after")
    def _is_degrees(self) -> Self:
        low, high = self.elevation_deg
        if high - low < 1:
            refuse(f"must span at least 1 degree; {RADIANS}", "elevation_deg", [low, high])
        return self


class Envelope(Part):
    """The space the mirrors may take."""

    height_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
        Field(
            description="Greatest height: from the lower of lens front and lowest mirror substrate to the top of "
            "the highest substrate."
        ),
    ]
    diameter_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
        Field(description="Greatest diameter over everything, substrates included."),
    ]
    mirror_diameter_mm: Annotated[
        float,
        Quantity(1, 1e5, "mm", if_smaller=METRES),
        Field(
            default_factory=lambda data: data.get("diameter_mm", math.nan),
            description="Largest mirror that can be bought or made. Default: the envelope's diameter, since nothing "
            "else limits it.",
        ),
    ]

    @model_validator(mode="after")
    def _holds_its_mirrors(self) -> Self:
        if self.mirror_diameter_mm > self.diameter_mm:
            refuse(
                f"must be at most envelope.diameter_mm ({self.diameter_mm:g})",
                "mirror_diameter_mm",
                self.mirror_diameter_mm,
            )
        return self


class Lens(Part):
    """One lens, or a zoom or family of lenses between two focal lengths."""

    name: Annotated[StrictStr, Field(default="", description="Maker and model, for the report.")]
    focal_length_mm: Annotated[
        NumberOrRange,
        Quantity(0.2, 2000, "mm", if_smaller=METRES, shape="number or range"),
        Field(description="Focal length engraved on the lens, or the range in which the optimiser may choose."),
    ]
    focus_distance_mm: Annotated[
        float,
        Quantity(0.3, 1e9, "mm", if_smaller=METRES, may_be_infinite=True),
        Field(
            default=math.inf,
            description="Distance from the entrance pupil at which the lens is focused. The image plane then lies at "
            "f u / (u - f). Default: inf, as in the paper; mirrors put virtual images near by, so give the true one.",
        ),
    ]
    f_number: Annotated[
        float,
        Quantity(0.5, 128),
        Field(description="Aperture the lens will be used at; sets the depth of field."),
    ]
    radius_mm: Annotated[
        float,
        Quantity(0.2, 1000, "mm", if_smaller=METRES),
        Field(description="Outer radius (not diameter) of the barrel."),
    ]
    front_mm: Annotated[
        float,
        Quantity(0, 1000, "mm", if_smaller="the barrel's front lies above the entrance pupil"),
        Field(
            description="Height of the barrel's front rim above the entrance pupil: the depth of the pupil inside the "
            "lens, typically some millimetres."
        ),
    ]
    length_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(description="Length of the barrel from its front rim down to the camera body."),
    ]

    @property
    def focal_lengths_mm(self) -> tuple[float, float]:
        """Least and greatest focal length; equal for a fixed lens."""
        return ends(self.focal_length_mm)

    @property
    def principal_distances_mm(self) -> tuple[float, float]:
        """Least and greatest principal distance f0 u / (u - f0); equal for a fixed lens."""
        low, high = self.focal_lengths_mm
        return principal_distance(low, self.focus_distance_mm), principal_distance(high, self.focus_distance_mm)

    @model_validator(mode="after")
    def _can_be_built(self) -> Self:
        shortest, longest = self.focal_lengths_mm
        if self.focus_distance_mm <= 1.001 * longest:
            refuse(
                f"must be greater than the focal length ({longest:g} mm)", "focus_distance_mm", self.focus_distance_mm
            )
        pupil_radius = shortest / (2 * self.f_number)
        if pupil_radius > self.radius_mm:
            refuse(
                f"must be at least the radius of the entrance pupil, focal_length_mm / (2 f_number) = "
                f"{pupil_radius:.4g} mm",
                "radius_mm",
                self.radius_mm,
            )
        return self


def _lens_form(value: Any) -> str:
    """One table is one lens; an array of tables is a catalogue. The tags are dropped from messages."""
    if isinstance(value, list | tuple) and value:
        return "(catalogue)"
    if not isinstance(value, dict | Lens):
        refuse("must be a table [camera.lens], or a catalogue of at least one [[camera.lens]]")
    return "(one)"


class Camera(Part):
    """Sensor, body and lens."""

    name: Annotated[StrictStr, Field(default="", description="Maker and model, for the report.")]
    width_px: Annotated[int, Quantity(16, 100_000, "pixels", whole=True), Field(description="Image width.")]
    height_px: Annotated[int, Quantity(16, 100_000, "pixels", whole=True), Field(description="Image height.")]
    pixel_pitch_mm: Annotated[
        float,
        Quantity(0.0003, 0.1, "mm", if_smaller=METRES, if_larger="is that micrometres? 4.4 um is 0.0044"),
        Field(description="Distance between neighbouring pixel centres; pixels are square."),
    ]
    image_circle_radius_px: Annotated[
        float,
        Quantity(4, 100_000, "pixels"),
        Field(
            default_factory=lambda data: min(data.get("width_px", 0), data.get("height_px", 0)) / 2,
            description="Radius of the usable image round its centre. Default: half the smaller image side, so that "
            "every azimuth is seen whole. At most half the diagonal.",
        ),
    ]
    body_radius_mm: Annotated[
        float,
        Quantity(0.5, 1e4, "mm", if_smaller=METRES),
        Field(description="Radius of the cylinder round the optical axis that holds the camera body below the lens."),
    ]
    nearest_mirror_mm: Annotated[
        float,
        Quantity(0, 1e4, "mm"),
        Field(
            default=25.0,
            description="Least axial distance from the entrance pupil to the first mirror of each path. Without it "
            "optima hug the lens, where nothing can be focused. Default: 25, about what a small lens reaches with a "
            "thin spacer.",
        ),
    ]
    lens: Annotated[
        Annotated[Lens, Tag("(one)")] | Annotated[tuple[Lens, ...], Tag("(catalogue)")],
        Discriminator(_lens_form),
        Field(description="The lens, as a table [camera.lens]; or a catalogue to choose from, each [[camera.lens]]."),
    ]

    @property
    def lenses(self) -> tuple[Lens, ...]:
        """The lenses to choose from; one, unless a catalogue was given."""
        return self.lens if isinstance(self.lens, tuple) else (self.lens,)

    @property
    def image_radius_mm(self) -> float:
        """Radius of the usable image circle on the sensor."""
        return self.image_circle_radius_px * self.pixel_pitch_mm

    @model_validator(mode="after")
    def _image_lies_on_the_sensor(self) -> Self:
        half_diagonal = math.hypot(self.width_px, self.height_px) / 2
        if self.image_circle_radius_px > half_diagonal:
            refuse(
                f"must be at most half the sensor's diagonal ({half_diagonal:.4g} px)",
                "image_circle_radius_px",
                self.image_circle_radius_px,
            )
        return self


class Manufacture(Part):
    """What the workshop needs."""

    substrate_thickness_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(default=2.0, description="Thickness of every mirror along z. Default: 2, common for turned aluminium."),
    ]
    edge_margin_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(
            default=0.5,
            description="Radial width by which a mirror's face reaches beyond its used zone, at the outer and at the "
            "inner edge. Default: 0.5, since diamond turning and polishing lose the last tenths of a millimetre.",
        ),
    ]
    clearance_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(
            default=0.5,
            description="Least distance between any light and any edge, and between any two solids. Default: 0.5, "
            "several times the usual assembly tolerance.",
        ),
    ]
    zone_gap_px: Annotated[
        float,
        Quantity(0, 10_000, "pixels"),
        Field(
            default=4.0,
            description="Radial gap in the image between the zones of the two views. Default: 4, wider than the blur "
            "of a lens in focus.",
        ),
    ]
    smallest_mirror_radius_mm: Annotated[
        float,
        Quantity(0, 1e4, "mm"),
        Field(
            default=4.0,
            description="Least outer radius of a mirror's face. Default: 4; smaller ones are hard to turn and mount.",
        ),
    ]
    largest_slope_deg: Annotated[
        float,
        Quantity(5, 89, "degrees", if_smaller=RADIANS),
        Field(
            default=70.0,
            description="Steepest slope of a mirror's face against the horizontal. Default: 70; beyond it few "
            "machines turn and few instruments measure.",
        ),
    ]


class Objective(Part):
    """What to minimise first, and what then."""

    minimise: Annotated[
        Goal,
        Field(
            default="depth_error",
            description="What to minimise first. depth_error: root mean square of relative depth error over the "
            "working volume; height, diameter: of the mirror system; volume: of the cylinder they span. Default: "
            "depth_error, the purpose of the sensor.",
        ),
    ]
    then: Annotated[
        Goal,
        Field(
            default_factory=lambda data: "depth_error" if data.get("minimise") == "height" else "height",
            description="What to minimise then, with the first kept within a tolerance. Default: height (depth_error "
            "if height comes first), since many designs reach the same depth error and differ in size.",
        ),
    ]
    within_percent: Annotated[
        float,
        Quantity(0, 1000, "percent"),
        Field(
            default=1.0,
            description="How much of the first objective may be given up for the second. Default: 1 percent, far "
            "below what a user of depth notices. At least 0.1, or 0 for none.",
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
            refuse("must not be 0; leave it out for a plane", "radius_mm", self.radius_mm)
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


class Solve(Part):
    """How the study is computed."""

    seed: Annotated[
        int,
        Quantity(0, 2**63 - 1, whole=True),
        Field(default=0, description="Seed of every random choice; the same seed gives the same study."),
    ]
    starts: Annotated[
        int,
        Quantity(1, 10_000, whole=True),
        Field(
            default=8,
            description="Starting points of the optimiser for each variant of a configuration. Default: 8; more "
            "starts cost time and find better optima rarely.",
        ),
    ]
    configurations: Annotated[
        tuple[StrictStr, ...],
        Field(
            default=("*",),
            min_length=1,
            description='Configurations to study, by name or glob pattern such as "folded-*-upper_outer". Default: '
            "all 44.",
        ),
    ]

    @field_validator("configurations")
    @classmethod
    def _match_something(cls, patterns: tuple[str, ...]) -> tuple[str, ...]:
        select_configurations(patterns)
        return patterns


class Requirement(Part):
    """Everything asked of a study."""

    name: Annotated[
        StrictStr,
        Field(
            default="requirement",
            description="Short name, used for folders. Default: the file's name without its ending.",
        ),
    ]
    title: Annotated[StrictStr, Field(default="", description="Heading of the report. Default: the name.")]
    description: Annotated[StrictStr, Field(default="", description="What the sensor is for, in a few sentences.")]
    baseline_mm: Annotated[
        NumberOrRange,
        Quantity(1, 1e5, "mm", if_smaller=METRES, shape="number or range"),
        Field(description="Distance between the two effective viewpoints, or the range in which to choose it."),
    ]
    noise_px: Annotated[
        float,
        Quantity(0.001, 10, "pixels"),
        Field(
            default=0.1,
            description="Standard deviation of an image point's radial position in each view. Default: 0.1, what "
            "subpixel matching reaches on good texture.",
        ),
    ]
    working_volume: WorkingVolume
    envelope: Envelope
    camera: Camera
    manufacture: Annotated[Manufacture, Field(default=Manufacture())]
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
        _check_fixed(self)
        return self


def _check_distances(asked: Requirement) -> None:
    near, far = asked.working_volume.distance_mm
    if near <= asked.envelope.diameter_mm / 2:
        refuse(
            f"must begin outside the envelope (beyond envelope.diameter_mm / 2 = {asked.envelope.diameter_mm / 2:g}); "
            f"{METRES}",
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
                "(camera.nearest_mirror_mm - camera.lens.front_mm), and its substrate",
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


def _check_fixed(asked: Requirement) -> None:
    known = {name for configuration in asked.configurations for name in configuration.mirror_kinds}
    for name in asked.fixed.mirror:
        if name not in known:
            refuse(
                f"no configuration in solve.configurations has this mirror; they have {', '.join(sorted(known))}",
                f"fixed.mirror.{name}",
            )
