"""The design record: one finished mirror system, and its file (``designs/<configuration>.json``, schema 1).

Frame: the pinhole (centre of the entrance pupil) is the origin and the optical axis is +z. Lengths are in
millimetres and angles in degrees, as the field names say. Keys that this version does not know are kept.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)

from designer.departures import AsBuilt, MirrorDeparture
from designer.files import InputError, describe_validation_error, read_text, write_atomically
from designer.housing import Housing, Tube

# Strict: neither "12.0" nor true is a number.
Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Coefficient = Annotated[Number, Field(ge=-1000.0, le=1000.0)]
Pixels = Annotated[int, Strict(), Field(gt=0, le=1_000_000)]
Interval = tuple[Number, Number]

ViewName = Literal["upper", "lower"]
VIEW_NAMES: tuple[ViewName, ViewName] = ("upper", "lower")
Each = TypeVar("Each", covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class PerView(Generic[Each]):
    """One thing for each view, by the view's name: a pair without an order, so that nothing is taken for the other."""

    lower: Each
    upper: Each

    def __getitem__(self, view: ViewName) -> Each:
        """What belongs to the view of that name."""
        return {"lower": self.lower, "upper": self.upper}[view]


ConicKind = Literal["plane", "hyperboloid", "ellipsoid", "paraboloid"]
Sense = Literal["direct", "folded"]
"""Which way the image of a view runs: tan(psi/2) = kappa tan(pi/4 + phi/2), or minus phi when folded."""
Zone = Literal["outer", "inner"]
"""The part of the image that a view takes: the ring at its edge, or what lies within."""
Projection = Literal["perspective", "equidistant", "equisolid", "stereographic"]
"""How the lens images the angle psi: r = f tan(psi), f psi, 2 f sin(psi/2) or 2 f tan(psi/2)."""
MOST_COEFFICIENTS: dict[Projection, int] = {"perspective": 3, "equidistant": 4, "equisolid": 0, "stereographic": 0}
"""Distortion coefficients of each projection: OpenCV's pinhole model has three radial ones, its fisheye model four."""


class Record(BaseModel):
    """Base of every part of a design: immutable, strict about types, tolerant of further keys."""

    model_config = ConfigDict(frozen=True, extra="allow")


class Camera(Record):
    """Sensor, principal distance and lens barrel.

    ``focal_length_mm`` is the principal distance f in r = f tan(psi), or in the law of another ``projection``: the
    distance of the image plane from the pinhole once the lens is focused, not the number engraved on the lens.
    """

    focal_length_mm: Positive
    pixel_pitch_mm: Positive
    width_px: Pixels
    height_px: Pixels
    f_number: Positive
    lens_radius_mm: Positive
    lens_front_mm: Number
    lens_length_mm: NonNegative
    body_radius_mm: NonNegative
    image_circle_radius_px: Positive | None = None
    """Radius of the usable image; half the smaller image side if absent."""
    focus_distance_mm: Positive | None = None
    """Distance from the pinhole at which the lens is focused; infinity if absent."""
    projection: Projection = "perspective"
    """Law of the lens from angle to image radius; r = f tan(psi) if absent."""
    distortion: tuple[Coefficient, ...] = ()
    """Radial distortion k1, k2, ... as in OpenCV's pinhole (perspective) or fisheye (equidistant) model."""

    @model_validator(mode="after")
    def _projection_has_its_coefficients(self) -> Self:
        most = MOST_COEFFICIENTS[self.projection]
        if len(self.distortion) > most:
            allowed = f"at most {most} coefficients" if most else "no coefficients"
            raise ValueError(f"distortion: {self.projection} takes {allowed}, not {len(self.distortion)}")
        return self

    @model_serializer(mode="wrap")
    def _without_a_default_law(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Files of perspective lenses stay as they were, and so do their hashes."""
        content: dict[str, Any] = write(self)
        if self.projection == "perspective":
            del content["projection"]
        if not self.distortion:
            del content["distortion"]
        return content

    @property
    def image_radius_mm(self) -> float:
        """Radius of the usable image on the sensor; an image circle beyond the sensor's corners ends there."""
        radius_px = self.image_circle_radius_px or min(self.width_px, self.height_px) / 2
        return min(radius_px, math.hypot(self.width_px, self.height_px) / 2) * self.pixel_pitch_mm

    @property
    def pupil_radius_mm(self) -> float:
        """Radius of the entrance pupil: half of nominal focal length / f-number, where 1/f0 = 1/f + 1/u."""
        nearness = 1.0 / self.focus_distance_mm if self.focus_distance_mm else 0.0
        return 1.0 / (1.0 / self.focal_length_mm + nearness) / self.f_number / 2.0

    @property
    def lens_seat_mm(self) -> float:
        """Height at which the lens barrel sits on the camera body."""
        return self.lens_front_mm - self.lens_length_mm

    @property
    def principal_point_px(self) -> tuple[float, float]:
        """Image centre (u, v); pixel centres lie at whole coordinates."""
        return (self.width_px - 1) / 2, (self.height_px - 1) / 2


class Mirror(Record):
    """One annular conic mirror: its face, from inner to outer radius, and the substrate behind it.

    ``radius_mm`` is the signed radius of curvature at the vertex, positive when the centre of curvature lies above
    the vertex, and None for a plane. The substrate is the face shifted back along z by the thickness: upwards for
    a mirror that faces down.
    """

    name: str
    kind: ConicKind
    vertex_mm: Number
    radius_mm: Number | None
    conic: Number
    inner_radius_mm: NonNegative
    outer_radius_mm: Positive
    thickness_mm: NonNegative
    faces: Literal["up", "down"]

    @property
    def back_offset_mm(self) -> float:
        """How far the substrate's back lies above the face; negative behind a mirror that faces up."""
        return self.thickness_mm if self.faces == "down" else -self.thickness_mm

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if self.inner_radius_mm >= self.outer_radius_mm:
            raise ValueError(
                f"inner_radius_mm ({self.inner_radius_mm:g}) must be smaller than "
                f"outer_radius_mm ({self.outer_radius_mm:g})"
            )
        if (self.radius_mm is None) != (self.kind == "plane"):
            raise ValueError("radius_mm is null for a plane, and only for a plane")
        if self.radius_mm == 0:
            raise ValueError("radius_mm must not be zero")
        if self.radius_mm is not None and self.conic > -1:
            # Written without squares, which would overflow for absurd radii.
            narrowing = (1 + self.conic) ** 0.5
            if self.outer_radius_mm * narrowing >= abs(self.radius_mm):
                raise ValueError(
                    f"outer_radius_mm ({self.outer_radius_mm:g}) lies beyond the equator of this ellipsoid "
                    f"(at most {abs(self.radius_mm) / narrowing:g})"
                )
        return self


# A plane of less curvature is flat: its radius is longer than any number of a design.
FLAT_PER_M = 1e-12


def built_mirror(mirror: Mirror, departure: MirrorDeparture) -> Mirror:
    """The mirror with the radius and the conic constant that it was made with; its place is not changed.

    Raises
    ------
    ValueError
        No such surface reaches over the aperture, or the departure does not belong to this kind of mirror.
    """
    if mirror.radius_mm is None:
        if departure.radius_departure_mm or departure.conic_departure:
            raise ValueError("a plane has no radius and no conic constant to depart from: use curvature_per_m")
        if abs(departure.curvature_per_m) < FLAT_PER_M:
            return mirror
        # A plane that is not flat is a sphere of long radius.
        return Mirror.model_validate(
            {**mirror.model_dump(), "kind": "ellipsoid", "radius_mm": 1000.0 / departure.curvature_per_m, "conic": 0.0}
        )
    if departure.curvature_per_m:
        raise ValueError("curvature_per_m belongs to planes: give radius_departure_mm")
    radius = mirror.radius_mm + departure.radius_departure_mm
    if radius * mirror.radius_mm <= 0:
        raise ValueError(f"radius_departure_mm must leave the sign of the radius ({mirror.radius_mm:g})")
    shape = {"radius_mm": radius, "conic": mirror.conic + departure.conic_departure}
    return Mirror.model_validate({**mirror.model_dump(), **shape})


class View(Record):
    """One view: the mirrors it uses, its effective viewpoint, its gain and the elevations asked of it.

    ``gain`` is kappa in tan(psi/2) = kappa tan(pi/4 +- phi/2): + for sense ``direct``, - for ``folded``.
    ``path`` lists the mirrors in the order in which a ray leaving the pinhole meets them.
    """

    path: Annotated[tuple[str, ...], Field(min_length=1)]
    viewpoint_mm: Number
    gain: Number
    sense: Sense
    elevation_deg: Interval
    zone: Zone


class Views(Record):
    """The two views of a stereo system; the upper one has the higher viewpoint."""

    upper: View
    lower: View

    @property
    def by_name(self) -> dict[ViewName, View]:
        """Both views by name, the upper one first."""
        return {"upper": self.upper, "lower": self.lower}

    @property
    def outer(self) -> ViewName:
        """Which view takes the outer zone, as the upper view's record has it."""
        return "upper" if self.upper.zone == "outer" else "lower"

    @property
    def inner(self) -> ViewName:
        """Which view takes the inner zone."""
        return "lower" if self.outer == "upper" else "upper"

    @property
    def middle_mm(self) -> float:
        """Height of the middle of the baseline."""
        return (self.upper.viewpoint_mm + self.lower.viewpoint_mm) / 2.0


class WorkingVolume(Record):
    """Elevations seen from the middle of the baseline, over a range of horizontal distances from the axis."""

    elevation_deg: Interval
    distance_mm: Interval


class Sharpness(Record):
    """What was asked of the light: blur of at most so much, everywhere in the working volume, and little of it lost.

    Blurs are diameters, on the sensor and as an angle in the scene; None where nothing bounds them.
    """

    max_blur_px: Positive | None = None
    max_blur_deg: Positive | None = None
    least_light_percent: NonNegative = 90.0


class Design(Record):
    """A finished mirror system, as the contract's ``designs/<configuration>.json`` holds it."""

    model_config = ConfigDict(frozen=True, extra="allow", populate_by_name=True)

    schema_version: Literal[1] = Field(default=1, alias="schema")
    configuration: str
    variant: str = ""
    camera: Camera
    mirrors: Annotated[tuple[Mirror, ...], Field(min_length=1)]
    views: Views
    baseline_mm: Number
    height_mm: Number
    diameter_mm: Number
    working_volume: WorkingVolume
    noise_px: Positive
    scale_uncertainty: NonNegative = 0.0
    """Relative standard uncertainty of the image's scale, a share; 0 if absent: not counted."""
    zone_gap_px: NonNegative = 0.0
    """Gap asked between the image zones; the closed-form limit depends on it."""
    clearance_mm: NonNegative | None = None
    """Least distance asked between chief rays and edges; unknown if absent."""
    edge_margin_mm: NonNegative | None = None
    """Width asked of a face beyond its used zone; unknown if absent."""
    sharpness: Sharpness | None = None
    """What was asked of the light through the full pupil; absent from records of chief rays alone."""
    as_built: AsBuilt | None = Field(default=None, exclude_if=lambda value: value is None)
    """What this one sensor departs from the design by; absent from the design itself."""
    housing: Housing | None = Field(default=None, exclude_if=lambda value: value is None)
    """What holds the upper mirrors, if the record knows: a transparent tube or struts."""
    score: dict[str, JsonValue] = {}
    """What the file says of the design's quality, as it stands there; nothing is computed from it."""

    @field_validator("schema_version", mode="before")
    @classmethod
    def _schema_is_a_number(cls, value: object) -> object:
        if isinstance(value, bool):
            raise ValueError("must be 1")
        return value

    @model_validator(mode="after")
    def _paths_name_mirrors(self) -> Self:
        names = [mirror.name for mirror in self.mirrors]
        if len(set(names)) != len(names):
            raise ValueError(f"mirror names must differ: {', '.join(names)}")
        for view in self.views.by_name.values():
            for name in view.path:
                if name not in names:
                    raise ValueError(f"path names mirror {name!r}; the mirrors are {', '.join(names)}")
        return self

    @model_validator(mode="after")
    def _departures_fit(self) -> Self:
        for name, departure in (self.as_built.mirrors if self.as_built else {}).items():
            mirror = next((mirror for mirror in self.mirrors if mirror.name == name), None)
            if mirror is None:
                names = ", ".join(mirror.name for mirror in self.mirrors)
                raise ValueError(f"as_built.mirrors names {name!r}; the mirrors are {names}")
            try:
                built_mirror(mirror, departure)
            except ValueError as error:
                reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
                raise ValueError(f"as_built.mirrors.{name}: {reason.removeprefix('Value error, ')}") from None
        if self.as_built and self.camera.focal_length_mm + self.as_built.camera.principal_distance_departure_mm <= 0:
            raise ValueError("as_built.camera.principal_distance_departure_mm leaves no principal distance")
        return self

    @property
    def tube(self) -> Tube | None:
        """The transparent tube through which the views look, if there is one."""
        return self.housing if isinstance(self.housing, Tube) else None

    def mirror(self, name: str) -> Mirror:
        """The mirror of that name. Raises StopIteration if there is none, which validation excludes for paths."""
        return next(mirror for mirror in self.mirrors if mirror.name == name)


def read_design(path: Path) -> Design:
    """Read and validate a design file.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, lacks a key or holds an impossible value: one line says which.
    """
    text = read_text(path)
    try:
        content = json.loads(text)
        json.dumps(content, ensure_ascii=False).encode("utf-8")
        return Design.model_validate(content)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    except UnicodeEncodeError as error:
        half = ascii(error.object[error.start]).strip("'")
        raise InputError(f"{path}: contains {half}, half of a surrogate pair, which is no character") from None
    except RecursionError:
        raise InputError(f"{path}: nested too deeply for a design file") from None
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None
    except ValueError:  # a whole number of more digits than Python reads
        raise InputError(f"{path}: contains a number with thousands of digits") from None


def write_design(design: Design, path: Path) -> None:
    """Write a design file, whole or not at all."""
    write_atomically(path, design_to_json(design))


def design_to_json(design: Design) -> str:
    """The text of a design file."""
    return json.dumps(design.model_dump(mode="json", by_alias=True), indent=2, allow_nan=False) + "\n"
