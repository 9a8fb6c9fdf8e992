"""The closed-form limit of :mod:`designer.evaluate.limit` for a variant and a requirement's numbers."""

from __future__ import annotations

from designer.design import PerView
from designer.evaluate.depth import Volume
from designer.evaluate.limit import ImageBounds, arrangement_of, depth_error_limit, limit_gains
from designer.evaluate.noise import MATCHER_PERFORMANCE, CollectedLight, TextureSpectrum
from designer.evaluate.predicted_noise import COARSEST_TEXTURE, FINEST_TEXTURE, Conditions, sharp_noise_model
from designer.optics.backend import Scalar
from designer.optimise.required_numbers import Specification
from designer.optimise.variants import Variant


def limiting_gains(
    variant: Variant, specification: Specification, baseline: Scalar, principal_distance: Scalar
) -> PerView[Scalar]:
    """The closed-form largest |gain| of each view at one baseline and principal distance, mm."""
    configuration = variant.configuration
    return limit_gains(
        arrangement_of(configuration.family, configuration.topology),
        volume_of(specification),
        baseline,
        principal_distance,
        ImageBounds(specification.image_radius, specification.zone_gap, specification.law),
    )


def limit_of(variant: Variant, specification: Specification, baseline: Scalar, principal_distance: Scalar) -> Scalar:
    """The closed-form least depth error at one baseline and principal distance, mm."""
    configuration = variant.configuration
    conditions = conditions_of(specification)
    return depth_error_limit(
        arrangement_of(configuration.family, configuration.topology),
        volume_of(specification),
        baseline,
        principal_distance,
        ImageBounds(specification.image_radius, specification.zone_gap, specification.law),
        lambda pair: sharp_noise_model(conditions, pair, specification.fastest),
        specification.scale_uncertainty,
    )


def conditions_of(specification: Specification) -> Conditions:
    """What the noise is predicted for."""
    _, far = specification.distances
    return Conditions(
        specification.noise,
        specification.predicted_share,
        specification.pixel_pitch,
        specification.wavelength,
        specification.mirror_reflectivity,
        TextureSpectrum(specification.texture_contrast, FINEST_TEXTURE * far, COARSEST_TEXTURE * far),
        CollectedLight(specification.white_electrons, specification.white_f_number, specification.read_noise),
        MATCHER_PERFORMANCE["sad"],
    )


def volume_of(specification: Specification) -> Volume:
    """The working volume of a requirement's numbers."""
    return Volume(specification.elevations, specification.distances)
