"""The closed-form limit of :mod:`designer.evaluate.limit` for a variant and a requirement's numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.evaluate.depth import Volume
from designer.evaluate.limit import Arrangement, ImageBounds, arrangement_of, depth_error_limit, limit_gains
from designer.evaluate.margin_limit import FirstMirrors, MirrorBounds, margin_gains, margin_limit
from designer.evaluate.noise import MATCHING, Light, Texture
from designer.evaluate.predicted_noise import COARSEST_TEXTURE, FINEST_TEXTURE, Conditions, sharp_noise_model
from designer.optics.backend import Scalar
from designer.optimise.specification import Specification
from designer.optimise.variants import Variant


def limiting_gains(
    variant: Variant, specification: Specification, baseline: Scalar, principal_distance: Scalar
) -> dict[str, Scalar]:
    """The closed-form largest |gain| of each view at one baseline and principal distance, mm."""
    configuration = variant.configuration
    lower, upper = limit_gains(
        arrangement_of(configuration.family, configuration.topology),
        volume_of(specification),
        baseline,
        principal_distance,
        ImageBounds(specification.image_radius, specification.zone_gap, specification.law),
    )
    return {"lower": lower, "upper": upper}


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
    far = specification.distance_far
    return Conditions(
        specification.noise,
        specification.predicted_share,
        specification.pixel_pitch,
        specification.wavelength,
        specification.mirror_reflectivity,
        Texture(specification.texture_contrast, FINEST_TEXTURE * far, COARSEST_TEXTURE * far),
        Light(specification.white_electrons, specification.white_f_number, specification.read_noise),
        MATCHING["sad"],
    )


def volume_of(specification: Specification) -> Volume:
    """The working volume of a requirement's numbers."""
    return Volume(
        (specification.elevation_low, specification.elevation_high),
        (specification.distance_near, specification.distance_far),
    )


@dataclass(frozen=True, slots=True)
class LensSetting:
    """A lens as it is focused and stopped down: principal distance and pupil in mm, 1 / u of the focus in 1/mm."""

    principal_distance: float
    pupil_diameter: float
    reciprocal_focus: float


def margin_gains_of(
    variant: Variant, specification: Specification, baseline: float, setting: LensSetting
) -> tuple[float, float]:
    """Bounds of |gain| of the lower and of the upper view with margins, at one baseline, mm; 0 where nothing fits."""
    return margin_gains(*_with_margins(variant, specification, baseline, setting))


def margin_limit_of(
    variant: Variant, specification: Specification, baseline: float, setting: LensSetting, noise_mm: float
) -> float | None:
    """The least depth error of mirrors with their edges and within the envelope, for a constant noise.

    At one baseline, mm. None where nothing fits.
    """
    at = _with_margins(variant, specification, baseline, setting)
    return margin_limit(*at, noise_mm, float(specification.scale_uncertainty))


def _with_margins(
    variant: Variant, specification: Specification, baseline: float, setting: LensSetting
) -> tuple[Arrangement, FirstMirrors, Volume, float, float, ImageBounds, MirrorBounds]:
    configuration, fold = variant.configuration, variant.fold
    signs = dict(variant.direct_gain_signs)
    if fold is None:
        mirrors = FirstMirrors(signs["upper"], signs["lower"])
    else:
        # Beside a plane primary the secondary has the gain of the pair, which is below 1.
        bends = (fold.gain_sign * np.inf,) if fold.primary_is_plane else fold.inverse_gains
        mirrors = FirstMirrors(signs["direct"], None, max(bends) > 1.0, min(bends) < 1.0)
    front, thickness = float(specification.lens_front), float(specification.substrate_thickness)
    beside_axis = float(specification.lens_radius) - setting.pupil_diameter / 2.0
    bounds = MirrorBounds(
        edge_margin=float(specification.edge_margin),
        clearance=float(specification.clearance),
        thickness=thickness,
        highest=front + float(specification.envelope_height) - thickness,
        widest=min(float(specification.mirror_diameter), float(specification.envelope_diameter)) / 2.0,
        steepest=float(np.tan(specification.largest_slope)),
        barrel=beside_axis / front if front > 0.0 else np.inf,
        pupil_radius=setting.pupil_diameter / 2.0,
        reciprocal_focus=setting.reciprocal_focus,
    )
    image = ImageBounds(specification.image_radius, specification.zone_gap, specification.law)
    arrangement = arrangement_of(configuration.family, configuration.topology)
    return arrangement, mirrors, volume_of(specification), baseline, setting.principal_distance, image, bounds
