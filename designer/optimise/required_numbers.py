"""A requirement as plain numbers for the optimiser: floats for evaluation, symbols for the program."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from designer.optics.backend import Scalar
from designer.optics.image_law import PERSPECTIVE, ImageLaw
from designer.requirement import PREDICTED, Lens, Requirement

# Blurs that bound nothing.
MOST_BLUR_PX, MOST_BLUR_DEG = 1e6, 90.0


HousingKind = str
"""none, tube or struts, as the requirement has it."""


@dataclass(frozen=True, slots=True)
class Specification:
    """Every number of a requirement that geometry depends on, for one of its lenses; mm and radians.

    The ranges of baseline, focal length, focus and f-number are not here: they bound variables. Blurs are diameters,
    on the sensor and as an angle in the scene. The law of the lens and the kind of housing are no numbers: a program
    is built for one of each.
    """

    elevation_low: Scalar
    elevation_high: Scalar
    distance_near: Scalar
    distance_far: Scalar
    envelope_height: Scalar
    envelope_diameter: Scalar
    mirror_diameter: Scalar
    image_radius: Scalar
    pixel_pitch: Scalar
    zone_gap: Scalar
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
    largest_blur: Scalar
    largest_blur_angle: Scalar
    nearest_mirror: Scalar
    body_radius: Scalar
    lens_radius: Scalar
    lens_front: Scalar
    lens_length: Scalar
    substrate_thickness: Scalar
    edge_margin: Scalar
    clearance: Scalar
    smallest_mirror_radius: Scalar
    largest_slope: Scalar
    housing_gap: Scalar = 0.0
    housing_thickness: Scalar = 0.0
    housing: HousingKind = "none"
    law: ImageLaw = PERSPECTIVE

    @property
    def reach_radius(self) -> Scalar:
        """Outside this radius there is nothing that light could hit."""
        return self.envelope_diameter + self.body_radius + self.lens_radius


SPECIFICATION_NAMES = tuple(field.name for field in fields(Specification) if field.name not in {"law", "housing"})


def specification_of(requirement: Requirement, lens: Lens) -> Specification:
    """The numbers of a requirement with one of its lenses."""
    low, high = requirement.working_volume.elevation_deg
    near, far = requirement.working_volume.distance_mm
    predicts = requirement.noise_px == PREDICTED
    camera, manufacture, envelope = requirement.camera, requirement.manufacture, requirement.envelope
    return Specification(
        elevation_low=math.radians(low),
        elevation_high=math.radians(high),
        distance_near=near,
        distance_far=far,
        envelope_height=envelope.height_mm,
        envelope_diameter=envelope.diameter_mm,
        mirror_diameter=envelope.mirror_diameter_mm,
        image_radius=camera.image_radius_mm,
        pixel_pitch=camera.pixel_pitch_mm,
        zone_gap=manufacture.zone_gap_px * camera.pixel_pitch_mm,
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
        # Finite, since the solver computes with them.
        largest_blur=min(requirement.sharpness.max_blur_px, MOST_BLUR_PX) * camera.pixel_pitch_mm,
        largest_blur_angle=math.radians(min(requirement.sharpness.max_blur_deg, MOST_BLUR_DEG)),
        nearest_mirror=camera.nearest_mirror_mm,
        body_radius=camera.body_radius_mm,
        lens_radius=lens.radius_mm,
        lens_front=lens.front_mm,
        lens_length=lens.length_mm,
        substrate_thickness=manufacture.substrate_thickness_mm,
        edge_margin=manufacture.edge_margin_mm,
        clearance=manufacture.clearance_mm,
        smallest_mirror_radius=manufacture.smallest_mirror_radius_mm,
        largest_slope=math.radians(manufacture.largest_slope_deg),
        housing_gap=requirement.housing.gap_mm,
        housing_thickness=requirement.housing.thickness_mm,
        housing=requirement.housing.kind,
        law=lens.image_law,
    )


def specification_values(specification: Specification) -> list[float]:
    """The numbers in the order of ``SPECIFICATION_NAMES``."""
    return [float(getattr(specification, name)) for name in SPECIFICATION_NAMES]
