"""What the optimiser chooses: one table of variables, and the bounds in which a variant's variables live.

To add a variable, add an entry to ``VARIABLES``; :mod:`designer.optimise.system` then finds it among its values.
The solver sees every variable scaled to 0..1 within its bounds, linearly or by its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from designer.optics.backend import Scalar, exp
from designer.optimise.limit import limiting_gains
from designer.optimise.specification import Specification
from designer.optimise.variants import Variant

Array = NDArray[np.float64]

# A gain below this share of the largest one a zone can hold wastes the image; above it, the zone overflows.
SMALLEST_GAIN_SHARE = 0.1
LARGEST_GAIN_SHARE = 1.02


@dataclass(frozen=True, slots=True)
class FreeRanges:
    """What the requirement leaves free, mm: (least, greatest), equal where it is given."""

    baseline: tuple[float, float]
    principal_distance: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Least and greatest value of one variable; on a logarithmic scale the signs of both agree."""

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


VariableBounds = dict[str, Bounds]
"""The bounds of every variable by name."""


def _linear(variant: Variant) -> bool:
    return False


def _logarithmic(variant: Variant) -> bool:
    return True


def _positive(variant: Variant) -> float:
    return 1.0


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable of the optimiser.

    Attributes
    ----------
    name, unit
        How values hold it; lengths in mm, gains signed.
    range
        Its least and greatest value for a variant, a requirement's numbers and what they leave free: generous, so
        that constraints decide and not the bounds. Equal ends mean that a variant has no choice.
    sign
        +1 or -1 for a variant: what the logarithm of a logarithmic variable loses.
    is_logarithmic
        Whether a variant's variable is scaled by its logarithm.
    role
        ``shape`` if it places or bends a mirror, ``enclosure`` if it only encloses the mirrors.
    """

    name: str
    unit: str
    range: Callable[[Variant, Specification, FreeRanges], tuple[float, float]]
    is_logarithmic: Callable[[Variant], bool] = _linear
    sign: Callable[[Variant], float] = _positive
    role: Literal["shape", "enclosure"] = "shape"


def _gain_range(view: str) -> Callable[[Variant, Specification, FreeRanges], tuple[float, float]]:
    def range_of(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
        """From a tenth of the least limiting gain over the allowed baselines and principal distances to the largest."""
        limits = [
            limiting_gains(variant, specification, baseline, distance)[view]
            for baseline, distance in product(free.baseline, free.principal_distance)
        ]
        # Where the gap leaves no room at some baseline, the view's gain may still be large at another.
        least = max(min(limits), SMALLEST_GAIN_SHARE * max(limits))
        sign = variant.gain_sign(view)
        return sign * SMALLEST_GAIN_SHARE * least, sign * LARGEST_GAIN_SHARE * max(limits)

    return range_of


def _gain_sign(view: str) -> Callable[[Variant], float]:
    return lambda variant: float(variant.gain_sign(view))


def _secondary_range(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
    return variant.fold.inverse_gains if variant.fold is not None else (1.0, 1.0)


def _reaches_beyond_one(variant: Variant) -> bool:
    return variant.fold is not None and max(abs(end) for end in variant.fold.inverse_gains) > 1.0


def _secondary_sign(variant: Variant) -> float:
    return math.copysign(1.0, variant.fold.inverse_gains[0]) if variant.fold is not None else 1.0


VARIABLES: tuple[Variable, ...] = (
    Variable("baseline", "mm", lambda variant, asked, free: free.baseline),
    Variable("principal_distance", "mm", lambda variant, asked, free: free.principal_distance),
    Variable(
        "lower_viewpoint",
        "mm",
        lambda variant, asked, free: (
            asked.lens_front - 2.0 * asked.envelope_height,
            asked.lens_front + 2.5 * asked.envelope_height,
        ),
    ),
    Variable("lower_gain", "", _gain_range("lower"), _logarithmic, _gain_sign("lower")),
    Variable("upper_gain", "", _gain_range("upper"), _logarithmic, _gain_sign("upper")),
    # Direct configurations have no secondary and ignore both of its variables. Its height keeps its range there, since
    # random starts are drawn for all variables at once and told apart by all that place mirrors.
    Variable(
        "secondary_height",
        "mm",
        lambda variant, asked, free: (
            max(0.5 * asked.nearest_mirror, 1.0),
            asked.lens_front + 1.2 * asked.envelope_height,
        ),
    ),
    Variable("secondary_inverse_gain", "", _secondary_range, _reaches_beyond_one, _secondary_sign),
    Variable(
        "top",
        "mm",
        lambda variant, asked, free: (asked.lens_front, asked.lens_front + 3.0 * asked.envelope_height),
        role="enclosure",
    ),
    Variable(
        "bottom",
        "mm",
        lambda variant, asked, free: (asked.lens_front - 3.0 * asked.envelope_height, asked.lens_front),
        role="enclosure",
    ),
    Variable("radius", "mm", lambda variant, asked, free: (0.0, 2.0 * asked.envelope_diameter), role="enclosure"),
)
"""Every variable, in the order of the solver's vector."""

VARIABLE_NAMES = tuple(variable.name for variable in VARIABLES)


def bounds_of(variant: Variant, specification: Specification, free: FreeRanges) -> VariableBounds:
    """The bounds of every variable of a variant."""
    return {
        variable.name: Bounds(*variable.range(variant, specification, free), variable.is_logarithmic(variant))
        for variable in VARIABLES
    }


def unscaled(variable: Variable, variant: Variant, scaled: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """The physical value of a variable at ``scaled`` in 0..1 between its scaled ends."""
    value = low + scaled * (high - low)
    return variable.sign(variant) * exp(value) if variable.is_logarithmic(variant) else value


def physical_values(variant: Variant, bounds: VariableBounds, scaled: Array) -> dict[str, Array]:
    """Physical variables of designs in the unit box; ``scaled`` has shape (variables, ...)."""
    return {
        variable.name: np.asarray(unscaled(variable, variant, row, *bounds[variable.name].scaled_ends))
        for variable, row in zip(VARIABLES, scaled, strict=True)
    }


def scaled_values(bounds: VariableBounds, values: Mapping[str, Array]) -> Array:
    """Inverse of :func:`physical_values`; a variable whose range is a point is 0."""
    rows = []
    for name in VARIABLE_NAMES:
        low, high = bounds[name].scaled_ends
        value = np.asarray(values[name], dtype=float)
        if high == low:
            rows.append(np.zeros_like(value))
            continue
        # A gain of 0 lies at minus infinity, and so outside all bounds.
        with np.errstate(divide="ignore"):
            on_scale = np.log(np.abs(value)) if bounds[name].logarithmic else value
        rows.append((on_scale - low) / (high - low))
    return np.stack(np.broadcast_arrays(*rows))
