"""The camera of a requirement: sensor, body, and one lens or a catalogue of lenses."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Discriminator, Field, StrictStr, Tag, model_validator

from designer.design import MOST_COEFFICIENTS, Projection
from designer.optics.image_law import WIDEST_ANGLE, ImageLaw, widest_half_tangent
from designer.optics.thin_lens import principal_distance, pupil_radius
from designer.requirement.part import METRES, NumberOrRange, Part, ends
from designer.requirement.quantity import Choice, Coefficients, DesignQuantity, Quantity, refuse

CLOSEST_FOCUS = 1.001
"""Focus distance in focal lengths that no lens goes below: there its image plane would lie a thousand of them away."""


NEAREST_FOCUS = 8.0
"""Nearest focus in focal lengths where a lens does not say: the thread of a small lens lets it out by a seventh."""


class Lens(Part):
    """One lens, or a zoom or family of lenses between two focal lengths."""

    name: Annotated[StrictStr, Field(default="", description="Maker and model, for the report.")]
    focal_length_mm: Annotated[
        NumberOrRange,
        Quantity(0.2, 2000, "mm", if_smaller=METRES, shape="number or range"),
        Field(
            title="focal length",
            description="Focal length engraved on the lens, or the range in which the optimiser may choose.",
        ),
    ]
    nearest_focus_mm: Annotated[
        float,
        Quantity(0.3, 1e9, "mm", if_smaller=METRES),
        Field(
            title="nearest focus",
            default_factory=lambda data: NEAREST_FOCUS * ends(data.get("focal_length_mm", math.nan))[1],
            description="Nearest distance from the entrance pupil at which the lens can be focused. Default: eight "
            "times the longest focal length, the limit of a small lens's focusing thread.",
        ),
    ]
    focus_distance_mm: Annotated[
        NumberOrRange,
        Quantity(0.3, 1e9, "mm", if_smaller=METRES, shape="number or range", may_be_infinite=True),
        Field(
            title="focused at",
            default_factory=lambda data: (data.get("nearest_focus_mm", math.nan), math.inf),
            description="Distance from the entrance pupil at which the lens is focused, or the range in which the "
            "optimiser may choose. The image plane then lies at f u / (u - f). Default: free from nearest_focus_mm "
            "to inf, since mirrors form virtual images nearby.",
        ),
    ]
    f_number: Annotated[
        NumberOrRange,
        Quantity(0.5, 128, shape="number or range"),
        Field(
            title="f-number",
            description="F-number at which the lens is used, or the range in which it is optimised; sets the depth of "
            "field, the exposure and the diffraction.",
        ),
    ]
    radius_mm: Annotated[
        float,
        Quantity(0.2, 1000, "mm", if_smaller=METRES),
        Field(title="barrel radius", description="Outer radius (not diameter) of the barrel."),
    ]
    front_mm: Annotated[
        float,
        Quantity(0, 1000, "mm", if_smaller="the barrel's front lies above the entrance pupil"),
        Field(
            title="front above entrance pupil",
            description="Height of the barrel's front rim above the entrance pupil: the depth of the pupil inside the "
            "lens, typically a few millimetres.",
        ),
    ]
    length_mm: Annotated[
        float,
        Quantity(0, 1000, "mm"),
        Field(title="barrel length", description="Length of the barrel from its front rim down to the camera body."),
    ]
    projection: Annotated[
        Projection,
        Choice(tuple(MOST_COEFFICIENTS)),
        Field(
            default="perspective",
            description="How the lens images the angle psi from the optical axis, f being its focal length at the "
            "image's centre (as focused): perspective r = f tan(psi), equidistant r = f psi, equisolid "
            "r = 2 f sin(psi/2), stereographic r = 2 f tan(psi/2). Default: perspective; lenses that cover more than "
            "45 degrees from the axis are mostly equidistant or equisolid.",
        ),
    ]
    distortion: Annotated[
        tuple[float, ...],
        Coefficients(max(MOST_COEFFICIENTS.values()), 1000.0),
        Field(
            default=(),
            description="Radial distortion [k1, k2, ...] as OpenCV calibrates it. For a perspective lens up to three, "
            "r = f x (1 + k1 x^2 + k2 x^4 + k3 x^6) with x = tan(psi); for an equidistant one up to four (OpenCV's "
            "fisheye model), r = f psi (1 + k1 psi^2 + k2 psi^4 + k3 psi^6 + k4 psi^8). The other projections take "
            "none. The image radius must rise with psi as far as the image circle. Default: none.",
        ),
    ]

    @property
    def focal_lengths_mm(self) -> tuple[float, float]:
        """Least and greatest focal length; equal for a fixed lens."""
        return ends(self.focal_length_mm)

    @property
    def f_numbers(self) -> tuple[float, float]:
        """Least and greatest f-number; equal if it is given."""
        return ends(self.f_number)

    @property
    def reciprocal_focus_per_mm(self) -> tuple[float, float]:
        """Least and greatest reciprocal focus distance 1/u in 1/mm, 0 for infinity; equal if it is given."""
        near, far = ends(self.focus_distance_mm)
        return 1.0 / far, 1.0 / near

    @property
    def image_law(self) -> ImageLaw:
        """The law from angle to image radius."""
        return ImageLaw(self.projection, self.distortion)

    @property
    def principal_distances_mm(self) -> tuple[float, float]:
        """Least and greatest principal distance f0 u / (u - f0); equal for a fixed lens at a given focus."""
        (shortest, longest), (near, far) = self.focal_lengths_mm, ends(self.focus_distance_mm)
        return principal_distance(shortest, far), principal_distance(longest, near)

    @model_validator(mode="after")
    def _projection_has_its_coefficients(self) -> Self:
        most = MOST_COEFFICIENTS[self.projection]
        if len(self.distortion) > most:
            refuse(
                f"must be at most {most} coefficients because projection = {self.projection}"
                if most
                else f"must be omitted because projection = {self.projection}",
                "distortion",
                list(self.distortion),
            )
        return self

    @model_validator(mode="after")
    def _can_be_built(self) -> Self:
        longest = self.focal_lengths_mm[1]
        which = "longest focal length" if isinstance(self.focal_length_mm, tuple) else "focal length"
        nearest = ends(self.focus_distance_mm)[0]
        if nearest <= CLOSEST_FOCUS * longest:
            refuse(
                f"must be greater than {CLOSEST_FOCUS:g} times the {which}, {CLOSEST_FOCUS * longest:.8g} mm",
                "focus_distance_mm" if "focus_distance_mm" in self.model_fields_set else "nearest_focus_mm",
                nearest,
            )
        # The f-number holds at every focal length, so the pupil is widest at the longest.
        pupil = pupil_radius(longest, self.f_numbers[0])
        if pupil > self.radius_mm:
            refuse(
                f"must be at least the radius of the entrance pupil, {which} / (2 f_number) = {pupil:.4g} mm",
                "radius_mm",
                self.radius_mm,
            )
        return self


def _is_lens_or_catalogue(value: Any) -> Any:
    if not isinstance(value, dict | Lens) and not (isinstance(value, list | tuple) and value):
        refuse("must be a table [camera.lens], or a catalogue of at least one [[camera.lens]]")
    return value


def _lens_form(value: Any) -> str:
    """One table is one lens; an array of tables is a catalogue. The tags are dropped from messages."""
    return "(catalogue)" if isinstance(value, list | tuple) else "(one)"


class Camera(Part):
    """Sensor, body and lens."""

    name: Annotated[StrictStr, Field(default="", description="Maker and model, for the report.")]
    width_px: Annotated[int, Quantity(16, 100_000, "pixels", whole=True), Field(description="Image width in pixels.")]
    height_px: Annotated[int, Quantity(16, 100_000, "pixels", whole=True), Field(description="Image height in pixels.")]
    pixel_pitch_mm: Annotated[
        float,
        Quantity(0.0003, 0.1, "mm", if_smaller=METRES, if_larger="is that micrometres? 4.4 um is 0.0044"),
        Field(description="Distance between neighbouring pixel centres; pixels are square."),
    ]
    image_circle_radius_px: Annotated[
        float,
        Quantity(4, 100_000, "pixels"),
        Field(
            title="image circle's radius",
            default_factory=lambda data: min(data.get("width_px", 0), data.get("height_px", 0)) / 2,
            description="Radius of the usable image, from its centre. Default: half the smaller image side, so that "
            "all azimuths are fully imaged. At most half the diagonal.",
        ),
    ]
    body_radius_mm: Annotated[
        float,
        DesignQuantity(0.5, 1e4, "mm", if_smaller=METRES),
        Field(
            title="camera body's radius",
            description="Radius of the cylinder about the optical axis that encloses the camera body below the lens.",
        ),
    ]
    nearest_mirror_mm: Annotated[
        float,
        DesignQuantity(0, 1e4, "mm"),
        Field(
            title="nearest mirror point, at least",
            default=25.0,
            description="Least axial distance from the entrance pupil to the first mirror of each path. Without it, "
            "optimal designs place mirrors too close to the lens to be in focus. Default: 25, about the closest "
            "focus of a small lens with a thin spacer.",
        ),
    ]
    lens: Annotated[
        Annotated[Lens, Tag("(one)")] | Annotated[tuple[Lens, ...], Tag("(catalogue)")],
        Discriminator(_lens_form),
        BeforeValidator(_is_lens_or_catalogue),
        Field(
            description="The lens, as a table [camera.lens]; or a catalogue to choose from, one [[camera.lens]] "
            "for each lens."
        ),
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

    @model_validator(mode="after")
    def _laws_rise_to_the_image_circle(self) -> Self:
        for number, lens in enumerate(self.lenses):
            law, shortest = lens.image_law, lens.principal_distances_mm[0]
            if law.is_perspective:
                continue
            reached = float(law.ratio(widest_half_tangent(law))) * shortest
            if reached <= self.image_radius_mm:
                key = "distortion" if lens.distortion else "projection"
                end = math.degrees(law.widest)
                limit = "a little before it stops rising" if law.widest < WIDEST_ANGLE else "the widest angle allowed"
                refuse(
                    f"the image radius is {reached:.4g} mm at {end:.4g} degrees, {limit}; it must exceed the image "
                    f"circle's, camera.image_circle_radius_px = {self.image_circle_radius_px:g} "
                    f"({self.image_radius_mm:.4g} mm)",
                    f"lens.{number}.{key}" if isinstance(self.lens, tuple) else f"lens.{key}",
                    list(lens.distortion) if lens.distortion else lens.projection,
                )
        return self
