"""The box that a variant's variables live in, scaled to 0..1 for the solver."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

from designer.evaluate.depth import Volume
from designer.evaluate.limit import Arrangement, ImageBounds, arrangement_of, depth_error_limit, limit_gains
from designer.optics.backend import Scalar, exp
from designer.optimise.specification import Specification
from designer.optimise.system import VARIABLES
from designer.optimise.variants import Variant

# A gain below this share of the largest one a zone can hold wastes the image; above it, the zone overflows.
SMALLEST_GAIN_SHARE = 0.1
LARGEST_GAIN_SHARE = 1.02


@dataclass(frozen=True, slots=True)
class Ranges:
    """What the requirement leaves free, mm."""

    baseline: tuple[float, float]
    principal_distance: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Interval:
    """Range of one variable; on a logarithmic scale the signs of both ends agree."""

    low: float
    high: float
    logarithmic: bool = False

    @property
    def scaled_ends(self) -> tuple[float, float]:
        """The ends on the scale on which the variable is linear in 0..1."""
        if self.logarithmic:
            return math.log(abs(self.low)), math.log(abs(self.high))
        return self.low, self.high

    @property
    def is_fixed(self) -> bool:
        """Whether there is nothing to choose."""
        return self.low == self.high


Bounds = dict[str, Interval]


def bounds_of(variant: Variant, specification: Specification, ranges: Ranges) -> Bounds:
    """The range of every variable of a variant: generous, so that constraints decide and not the box."""
    height, front = specification.envelope_height, specification.lens_front
    if variant.fold is None:
        inverse_gain = Interval(1.0, 1.0)
    else:
        inverse_low, inverse_high = variant.fold.inverse_gains
        inverse_gain = Interval(inverse_low, inverse_high, is_logarithmic(variant, "secondary_inverse_gain"))
    bounds = {
        "baseline": Interval(*ranges.baseline),
        "principal_distance": Interval(*ranges.principal_distance),
        "lower_viewpoint": Interval(front - 2.0 * height, front + 2.5 * height),
        "secondary_height": Interval(max(0.5 * specification.nearest_mirror, 1.0), front + 1.2 * height),
        "secondary_inverse_gain": inverse_gain,
        "top": Interval(front, front + 3.0 * height),
        "bottom": Interval(front - 3.0 * height, front),
        "radius": Interval(0.0, 2.0 * specification.envelope_diameter),
    }
    largest = _largest_gains(variant, specification, ranges)
    for view in ("lower", "upper"):
        low, high = largest[view]
        sign = variant.gain_sign(view)
        ends = (sign * SMALLEST_GAIN_SHARE * low, sign * LARGEST_GAIN_SHARE * high)
        bounds[f"{view}_gain"] = Interval(*ends, is_logarithmic(variant, f"{view}_gain"))
    return {name: bounds[name] for name in VARIABLES}


def is_logarithmic(variant: Variant, name: str) -> bool:
    """Whether a variable is scaled by its logarithm: gains are, inverse ones where they reach beyond 1."""
    if name == "secondary_inverse_gain" and variant.fold is not None:
        return max(abs(end) for end in variant.fold.inverse_gains) > 1.0
    return name in {"lower_gain", "upper_gain"}


def physical(variant: Variant, name: str, scaled: Scalar, low: Scalar, high: Scalar, logarithmic: bool) -> Scalar:
    """The value of a variable at ``scaled`` in 0..1 between its scaled ends."""
    value = low + scaled * (high - low)
    return _sign(variant, name) * exp(value) if logarithmic else value


def _sign(variant: Variant, name: str) -> float:
    if name.endswith("_gain") and name != "secondary_inverse_gain":
        return float(variant.gain_sign(name.removesuffix("_gain")))
    if name == "secondary_inverse_gain" and variant.fold is not None:
        return math.copysign(1.0, variant.fold.inverse_gains[0])
    return 1.0


def _largest_gains(variant: Variant, specification: Specification, ranges: Ranges) -> dict[str, tuple[float, float]]:
    """Least and greatest limiting |gain| of each view over the allowed baselines and principal distances."""
    limits = [
        limits_at(variant, specification, baseline, distance)
        for baseline, distance in product(ranges.baseline, ranges.principal_distance)
    ]
    # Where the gap leaves no room at some baseline, the view's gain may still be large at another.
    return {
        view: (
            max(min(limit[view] for limit in limits), SMALLEST_GAIN_SHARE * max(limit[view] for limit in limits)),
            max(limit[view] for limit in limits),
        )
        for view in limits[0]
    }


def limits_at(
    variant: Variant, specification: Specification, baseline: Scalar, principal_distance: Scalar
) -> dict[str, Scalar]:
    """The closed-form largest |gain| of each view at one baseline and principal distance."""
    bounds = ImageBounds(specification.image_radius, specification.zone_gap)
    gains = limit_gains(
        arrangement_of_variant(variant), volume_of_specification(specification), baseline, principal_distance, bounds
    )
    return {"lower": gains[0], "upper": gains[1]}


def limit_of(variant: Variant, specification: Specification, baseline: Scalar, principal_distance: Scalar) -> Scalar:
    """The closed-form least depth error at one baseline and principal distance."""
    bounds = ImageBounds(specification.image_radius, specification.zone_gap)
    arrangement, volume = arrangement_of_variant(variant), volume_of_specification(specification)
    return depth_error_limit(arrangement, volume, baseline, principal_distance, bounds, specification.noise)


def arrangement_of_variant(variant: Variant) -> Arrangement:
    """Senses and zones as the limit wants them."""
    return arrangement_of(variant.configuration.family, variant.configuration.topology)


def volume_of_specification(specification: Specification) -> Volume:
    """The working volume of a requirement's numbers."""
    return Volume(
        (specification.elevation_low, specification.elevation_high),
        (specification.distance_near, specification.distance_far),
    )
