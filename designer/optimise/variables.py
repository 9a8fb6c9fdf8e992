"""What the optimiser chooses: one table of variables, and the bounds in which a variant's variables live.

To add a variable, add an entry to ``VARIABLES``; :mod:`designer.optimise.system` then finds it among its values.
The solver sees every variable scaled to 0..1 within its bounds, linearly or by its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from designer.design import ViewName
from designer.optics.backend import Scalar, exp
from designer.optimise.limit import limiting_gains
from designer.optimise.reach import lower_viewpoints, sampled, secondary_vertices
from designer.optimise.required_numbers import Specification
from designer.optimise.variants import Variant
from designer.requirement import Lens, Requirement

Array = NDArray[np.float64]

# A gain below this share of the largest one a zone can hold wastes the image; above it, the zone overflows.
SMALLEST_GAIN_SHARE = 0.1
LARGEST_GAIN_SHARE = 1.02
# What is small for other reasons than depth may need a gain this much smaller still.
LEAST_GAIN_SHARE = 0.01
# Nor does a secondary's vertex lie at the pinhole itself, where its shape has no size.
LOWEST_VERTEX_MM = 0.05


@dataclass(frozen=True, slots=True)
class FreeRanges:
    """What the requirement leaves free, with one of its lenses: (least, greatest), equal where it is given.

    Baseline, focal length and principal distance in mm, the reciprocal of the focus distance in 1/mm. ``fixed`` are
    parameters that must have a given value, by names such as ``upper.viewpoint_mm``.
    """

    baseline: tuple[float, float]
    focal_length: tuple[float, float]
    reciprocal_focus: tuple[float, float]
    f_number: tuple[float, float]
    fixed: Mapping[str, float] = field(default_factory=dict)

    @property
    def principal_distance(self) -> tuple[float, float]:
        """Least and greatest principal distance."""
        (shortest, longest), (far, near) = self.focal_length, self.reciprocal_focus
        return shortest / (1.0 - shortest * far), longest / (1.0 - longest * near)


def free_ranges(requirement: Requirement, lens: Lens) -> FreeRanges:
    """What a requirement leaves free with one of its lenses."""
    return FreeRanges(
        requirement.baseline_range_mm,
        lens.focal_lengths_mm,
        lens.reciprocal_focus_per_mm,
        lens.f_numbers,
        fixed_parameters(requirement),
    )


def fixed_parameters(requirement: Requirement) -> dict[str, float]:
    """The parameters the requirement fixes, by names such as ``primary.radius_mm`` and ``upper.gain``."""
    given: dict[str, float] = {}
    for owners in (requirement.fixed.mirror, requirement.fixed.view):
        for owner, part in owners.items():
            given |= {f"{owner}.{name}": value for name, value in part.model_dump(exclude_none=True).items()}
    return given


@dataclass(frozen=True, slots=True)
class Bounds:
    """Where one variable lives; on a logarithmic scale all signs agree.

    Starts are drawn between ``low`` and ``high``, which the solver sees as 0 and 1. It may go from ``least`` to
    ``greatest``, which lie at or beyond them (None: no farther).
    """

    low: float
    high: float
    logarithmic: bool = False
    least: float | None = None
    greatest: float | None = None

    @property
    def scaled_reach(self) -> tuple[float, float]:
        """How far the solver may go, on the scale of 0..1."""
        low, high = self.scaled_ends
        if high == low:
            return 0.0, 1.0
        ends = [low if self.least is None else self._on_scale(self.least)]
        ends.append(high if self.greatest is None else self._on_scale(self.greatest))
        return min((ends[0] - low) / (high - low), 0.0), max((ends[1] - low) / (high - low), 1.0)

    def _on_scale(self, value: float) -> float:
        return math.log(abs(value)) if self.logarithmic else value

    @property
    def scaled_ends(self) -> tuple[float, float]:
        """The ends on the scale on which the variable is linear in 0..1."""
        return self._on_scale(self.low), self._on_scale(self.high)

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
        Where starts are drawn for a variant, a requirement's numbers and what they leave free. Equal ends mean that a
        variant has no choice.
    reach
        How far beyond its range the solver may go: so far that constraints decide and not the bounds. None if the
        range itself is what the requirement, or the variant, allows.
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
    reach: Callable[[Variant, Specification, FreeRanges], tuple[float, float]] | None = None


def _gain_range(view: ViewName) -> Callable[[Variant, Specification, FreeRanges], tuple[float, float]]:
    def range_of(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
        """From a tenth of the least limiting gain over the allowed baselines and principal distances to the largest."""
        limits = [
            limiting_gains(variant, specification, baseline, distance)[view]
            for baseline, distance in product(sampled(free.baseline), free.principal_distance)
        ]
        # Where the gap leaves no room at some baseline, the view's gain may still be large at another.
        least = max(min(limits), SMALLEST_GAIN_SHARE * max(limits))
        sign = variant.gain_sign(view)
        return sign * SMALLEST_GAIN_SHARE * least, sign * LARGEST_GAIN_SHARE * max(limits)

    return range_of


def _gain_reach(view: ViewName) -> Callable[[Variant, Specification, FreeRanges], tuple[float, float]]:
    range_of = _gain_range(view)

    def reach_of(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
        """A hundredth of its range, which a small mirror may need, and a gain that is fixed."""
        least, most = range_of(variant, specification, free)
        given = free.fixed.get(f"{view}.gain", most)
        if given * most < 0.0:  # no design of this variant can have it
            given = most
        return min(LEAST_GAIN_SHARE * least, given, key=abs), max(most, given, key=abs)

    return reach_of


def _gain_sign(view: ViewName) -> Callable[[Variant], float]:
    return lambda variant: float(variant.gain_sign(view))


def _lower_viewpoint_range(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
    """Everywhere in and around the envelope, and as far beyond as steep views and long baselines need."""
    low, high = lower_viewpoints(variant, specification, free.baseline, free.fixed)
    front, height = specification.lens_front, specification.asked.envelope.height_mm
    around = (front - 2.0 * height, front + 2.5 * height)
    return min(around[0], low, high), max(around[1], low, high)


def _secondary_height_reach(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
    low, high = secondary_vertices(variant, specification, free.baseline, free.principal_distance[0])
    given = free.fixed.get("secondary.vertex_mm", high)
    return max(min(low, given), LOWEST_VERTEX_MM), max(high, given)


def _secondary_range(variant: Variant, specification: Specification, free: FreeRanges) -> tuple[float, float]:
    return variant.fold.inverse_gains if variant.fold is not None else (1.0, 1.0)


def _reaches_beyond_one(variant: Variant) -> bool:
    return variant.fold is not None and max(abs(end) for end in variant.fold.inverse_gains) > 1.0


def _secondary_sign(variant: Variant) -> float:
    return math.copysign(1.0, variant.fold.inverse_gains[0]) if variant.fold is not None else 1.0


VARIABLES: tuple[Variable, ...] = (
    Variable("baseline", "mm", lambda variant, specification, free: free.baseline),
    Variable("focal_length", "mm", lambda variant, specification, free: free.focal_length),
    Variable("reciprocal_focus", "1/mm", lambda variant, specification, free: free.reciprocal_focus),
    Variable("f_number", "", lambda variant, specification, free: free.f_number, _logarithmic),
    Variable("lower_viewpoint", "mm", _lower_viewpoint_range),
    Variable("lower_gain", "", _gain_range("lower"), _logarithmic, _gain_sign("lower"), reach=_gain_reach("lower")),
    Variable("upper_gain", "", _gain_range("upper"), _logarithmic, _gain_sign("upper"), reach=_gain_reach("upper")),
    # Direct configurations have no secondary and ignore both of its variables. Its height keeps its range there, since
    # random starts are drawn for all variables at once and told apart by all that place mirrors.
    Variable(
        "secondary_height",
        "mm",
        lambda variant, specification, free: (
            max(0.5 * specification.asked.camera.nearest_mirror_mm, 1.0),
            specification.lens_front + 1.2 * specification.asked.envelope.height_mm,
        ),
        reach=_secondary_height_reach,
    ),
    Variable("secondary_inverse_gain", "", _secondary_range, _reaches_beyond_one, _secondary_sign),
    Variable(
        "top",
        "mm",
        lambda variant, specification, free: (
            specification.lens_front,
            specification.lens_front + 3.0 * specification.asked.envelope.height_mm,
        ),
        role="enclosure",
    ),
    Variable(
        "bottom",
        "mm",
        lambda variant, specification, free: (
            specification.lens_front - 3.0 * specification.asked.envelope.height_mm,
            specification.lens_front,
        ),
        role="enclosure",
    ),
    Variable(
        "radius",
        "mm",
        lambda variant, specification, free: (0.0, 2.0 * specification.asked.envelope.diameter_mm),
        role="enclosure",
    ),
)
"""Every variable, in the order of the solver's vector."""

VARIABLE_NAMES = tuple(variable.name for variable in VARIABLES)


def bounds_of(variant: Variant, specification: Specification, free: FreeRanges) -> VariableBounds:
    """The bounds of every variable of a variant."""
    return {
        variable.name: Bounds(
            *variable.range(variant, specification, free),
            variable.is_logarithmic(variant),
            *(variable.reach(variant, specification, free) if variable.reach is not None else ()),
        )
        for variable in VARIABLES
    }


def unscaled(variable: Variable, variant: Variant, scaled: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """The physical value of a variable at ``scaled`` in 0..1 between its scaled ends."""
    value = low + scaled * (high - low)
    return variable.sign(variant) * exp(value) if variable.is_logarithmic(variant) else value


def physical_values(variant: Variant, bounds: VariableBounds, scaled: Array) -> dict[str, Array]:
    """Physical variables of designs in the unit box, and what follows from them; ``scaled``: (variables, ...)."""
    return with_principal_distance(
        {
            variable.name: np.asarray(unscaled(variable, variant, row, *bounds[variable.name].scaled_ends))
            for variable, row in zip(VARIABLES, scaled, strict=True)
        }
    )


def with_principal_distance(values: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """The variables and the principal distance f0 / (1 - f0 / u) of the focused lens, mm."""
    focal_length = values["focal_length"]
    distance = focal_length / (1.0 - focal_length * values["reciprocal_focus"])
    return {**values, "principal_distance": distance}


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
