"""A requirement as plain numbers for the optimiser: floats for evaluation, symbols for the program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, cast

from designer.optics.backend import Scalar, radians
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.requirement import PREDICTED, Lens, Requirement
from designer.requirement.design_quantities import design_quantities, number_at

HousingKind = str
"""none, tube or struts, as the requirement has it."""


@dataclass(frozen=True, slots=True)
class Specification:
    """Every number of a requirement that geometry depends on, for one of its lenses.

    The ranges of baseline, focal length, focus and f-number are not here: they bound variables. The law of the lens and
    the kind of housing are no numbers: a program is built for one of each. Lengths are in mm, angles in radians, blurs
    are diameters; ``asked`` alone keeps the units of its keys.

    Parameters
    ----------
    asked
        The keys that shape designs (:class:`~designer.requirement.quantity.DesignQuantity`), by their names in the
        requirement: ``asked.envelope.height_mm``. It has no other keys, its numbers may be symbols, and where the
        requirement sets no limit it has the largest that may be typed, since the solver computes with it.
    """

    asked: Requirement
    image_radius: Scalar
    pixel_pitch: Scalar
    noise: Scalar
    predicted_share: Scalar
    scale_uncertainty: Scalar
    white_electrons: Scalar
    white_f_number: Scalar
    read_noise: Scalar
    wavelength: Scalar
    mirror_reflectivity: Scalar
    texture_contrast: Scalar
    fastest: Scalar
    lens_radius: Scalar
    lens_front: Scalar
    lens_length: Scalar
    housing: HousingKind = "none"
    law: ImageLaw = PERSPECTIVE

    @property
    def elevations(self) -> tuple[Scalar, Scalar]:
        """Lowest and highest elevation, radians."""
        low, high = self.asked.working_volume.elevation_deg
        return radians(low), radians(high)

    @property
    def distances(self) -> tuple[Scalar, Scalar]:
        """Nearest and farthest distance from the axis, mm."""
        near, far = self.asked.working_volume.distance_mm
        return near, far

    @property
    def zone_gap(self) -> Scalar:
        """Gap between the image zones, mm on the sensor."""
        return self.asked.manufacture.zone_gap_px * self.pixel_pitch

    @property
    def largest_blur(self) -> Scalar:
        """Largest blur allowed, mm on the sensor."""
        return self.asked.sharpness.max_blur_px * self.pixel_pitch

    @property
    def largest_blur_angle(self) -> Scalar:
        """Largest blur allowed in the scene, radians."""
        return radians(self.asked.sharpness.max_blur_deg)

    @property
    def housing_gap(self) -> Scalar:
        """Between mirrors and housing, mm; 0 for none."""
        return 0.0 if self.housing == "none" else self.asked.housing.clearance_mm

    @property
    def housing_thickness(self) -> Scalar:
        """How far the tube's wall, or a strut, reaches along the radius, mm; 0 for none."""
        asked = self.asked.housing
        return {"none": 0.0, "tube": asked.wall_mm, "struts": asked.width_mm}[self.housing]

    @property
    def reach_radius(self) -> Scalar:
        """Outside this radius there is nothing that light could hit, mm."""
        return self.asked.envelope.diameter_mm + self.asked.camera.body_radius_mm + self.lens_radius


_NO_NUMBERS = {"asked", "law", "housing"}
_DERIVED = tuple(field.name for field in fields(Specification) if field.name not in _NO_NUMBERS)
SPECIFICATION_NAMES = (*design_quantities(), *_DERIVED)
"""The numbers of a specification, in the order of the program's parameters: keys that shape designs, then others."""


@dataclass(frozen=True, slots=True)
class _NamedNumbers:
    """Numbers by their names in the requirement, read as attributes, and tables of them."""

    entries: Mapping[str, Any]

    def __getattr__(self, name: str) -> Any:
        if name == "entries":  # while it is unpickled
            raise AttributeError(name)
        try:
            return self.entries[name]
        except KeyError:
            raise AttributeError(
                f"{name} is no DesignQuantity of the requirement, so the optimiser does not know it"
            ) from None


def specification_of(requirement: Requirement, lens: Lens) -> Specification:
    """The numbers of a requirement with one of its lenses."""
    camera, predicts = requirement.camera, requirement.noise_px == PREDICTED
    numbers = {
        key: min(number, quantity.high)
        for key, quantity in design_quantities().items()
        if (number := number_at(requirement, key)) is not None
    }
    return Specification(
        asked=_asked(numbers),
        image_radius=camera.image_radius_mm,
        pixel_pitch=camera.pixel_pitch_mm,
        noise=0.0 if predicts else float(requirement.noise_px) * camera.pixel_pitch_mm,
        predicted_share=1.0 if predicts else 0.0,
        scale_uncertainty=requirement.scale_uncertainty_percent / 100.0,
        white_electrons=requirement.light.white_electrons,
        white_f_number=requirement.light.at_f_number,
        read_noise=requirement.light.read_noise_electrons,
        wavelength=requirement.light.wavelength_nm * 1e-6,
        mirror_reflectivity=requirement.light.mirror_reflectivity,
        texture_contrast=requirement.matching.texture_contrast,
        fastest=lens.f_numbers[0],
        lens_radius=lens.radius_mm,
        lens_front=lens.front_mm,
        lens_length=lens.length_mm,
        housing=requirement.housing.kind,
        law=lens.image_law,
    )


def specification_from(numbers: Iterable[Scalar], law: ImageLaw, housing: HousingKind = "none") -> Specification:
    """A specification of floats or symbols in the order of ``SPECIFICATION_NAMES``."""
    named = dict(zip(SPECIFICATION_NAMES, numbers, strict=True))
    asked = _asked({key: named[key] for key in design_quantities()})
    return Specification(asked=asked, law=law, housing=housing, **{name: named[name] for name in _DERIVED})


def specification_values(specification: Specification) -> list[float]:
    """The numbers in the order of ``SPECIFICATION_NAMES``."""
    asked = (number_at(specification.asked, key) for key in design_quantities())
    return [float(value) for value in (*asked, *(getattr(specification, name) for name in _DERIVED))]


def _asked(numbers: Mapping[str, Scalar]) -> Requirement:
    """Numbers by dotted keys as nested tables that read like the requirement itself, for type checkers too."""
    tables: dict[str, Any] = {}
    for key, number in numbers.items():
        *parents, last = key.split(".")
        place = tables
        for parent in parents:
            place = place.setdefault(parent, {})
        place[last] = number
    return cast(Requirement, _nested(tables))


def _nested(entry: Any) -> Any:
    if not isinstance(entry, dict):
        return entry
    parts = {name: _nested(part) for name, part in entry.items()}
    return (parts["0"], parts["1"]) if parts.keys() == {"0", "1"} else _NamedNumbers(parts)
