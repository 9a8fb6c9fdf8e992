"""The limit with margins of :mod:`designer.evaluate.margin_limit` for a variant under a requirement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import PerView
from designer.evaluate.depth import Volume
from designer.evaluate.limit import Arrangement, ImageBounds, arrangement_of
from designer.evaluate.margin_limit import FirstMirrors, MirrorBounds, margin_gains, margin_limit
from designer.optics.backend import radians
from designer.optimise.limit import volume_of
from designer.optimise.problem import Problem


@dataclass(frozen=True, slots=True)
class LensSetting:
    """A lens as it is focused and stopped down: principal distance and pupil in mm, 1 / u of the focus in 1/mm."""

    principal_distance: float
    pupil_diameter: float
    reciprocal_focus: float


def margin_gains_of(problem: Problem, baseline: float, setting: LensSetting) -> PerView[float]:
    """Bound of |gain| of each view with margins, at one baseline, mm; 0 where nothing fits."""
    return margin_gains(*_with_margins(problem, baseline, setting))


def margin_limit_of(problem: Problem, baseline: float, setting: LensSetting, noise_mm: float) -> float | None:
    """The least depth error of mirrors with their edges and within the envelope, for a constant noise.

    At one baseline, mm. None where nothing fits.
    """
    at = _with_margins(problem, baseline, setting)
    return margin_limit(*at, noise_mm, float(problem.specification.scale_uncertainty))


def _with_margins(
    problem: Problem, baseline: float, setting: LensSetting
) -> tuple[Arrangement, FirstMirrors, Volume, float, float, ImageBounds, MirrorBounds]:
    variant, specification, fixed = problem.variant, problem.specification, dict(problem.fixed)
    envelope, manufacture = specification.asked.envelope, specification.asked.manufacture
    configuration, fold = variant.configuration, variant.fold
    signs = dict(variant.direct_gain_signs)
    if fold is None:
        mirrors = FirstMirrors(signs["upper"], signs["lower"])
    else:
        # Beside a plane primary the secondary has the gain of the pair, which is below 1.
        bends = (fold.gain_sign * np.inf,) if fold.primary_is_plane else fold.inverse_gains
        mirrors = FirstMirrors(signs["direct"], None, max(bends) > 1.0, min(bends) < 1.0)
    front, thickness = float(specification.lens_front), float(manufacture.substrate_thickness_mm)
    beside_axis = float(specification.lens_radius) - setting.pupil_diameter / 2.0
    bounds = MirrorBounds(
        edge_margin=float(manufacture.edge_margin_mm),
        clearance=float(manufacture.clearance_mm),
        thickness=thickness,
        highest=front + float(envelope.height_mm) - thickness,
        widest=min(float(envelope.mirror_diameter_mm), float(envelope.diameter_mm)) / 2.0,
        steepest=float(np.tan(radians(manufacture.largest_slope_deg))),
        barrel=beside_axis / front if front > 0.0 else np.inf,
        pupil_radius=setting.pupil_diameter / 2.0,
        reciprocal_focus=setting.reciprocal_focus,
        upper_viewpoint=min(
            fixed.get("upper.viewpoint_mm", np.inf), fixed.get("lower.viewpoint_mm", np.inf) + baseline
        ),
        gains=PerView(lower=abs(fixed.get("lower.gain", np.inf)), upper=abs(fixed.get("upper.gain", np.inf))),
    )
    image = ImageBounds(specification.image_radius, specification.zone_gap, specification.law)
    arrangement = arrangement_of(configuration.family, configuration.topology)
    return arrangement, mirrors, volume_of(specification), baseline, setting.principal_distance, image, bounds
