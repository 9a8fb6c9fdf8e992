"""What each departure of a sensor does by itself, and how large it may be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.merits import Merits
from designer.as_built.model import Perturbable, depth_error, measure
from designer.as_built.parameters import Parameter
from designer.as_built.sharpness import blur_of_limit

ALLOWED_STEPS = 8
# A departure is said to be harmless if this multiple of its tolerance is.
FARTHEST = 1e3
# What stands for a tolerance of zero: FARTHEST of it, in mm or degrees, is more than a design file holds.
UNTOLERATED = 0.05
# Halvings of up to a thousand tolerances.
BLUR_STEPS = 30


@dataclass(frozen=True, slots=True)
class Impact:
    """One departure at its tolerance, the worse of both signs; before calibration and after.

    ``tolerance`` and ``allowed`` are in the parameter's unit. ``depth_bias`` is a share, root mean square over the
    working volume; ``growth_after`` the share by which it makes the depth error grow once the sensor is calibrated, and
    ``allowed`` the departure at which that is the growth asked for, or at which the blur reaches what the design
    allows if that comes before: ``allowed_by`` says which. It is None if the departure ``is_harmless``, up to a
    thousand tolerances, or if the mirrors cease to show the working volume before. ``bias_per_unit`` and
    ``bias_per_unit_after`` are exact derivatives without departures.
    """

    parameter: Parameter
    tolerance: float
    epipolar_px: float
    epipolar_px_after: float
    depth_bias: float
    depth_bias_after: float
    growth_after: float
    viewpoint_spread_mm: float
    blur_change_px: float
    allowed: float | None
    allowed_by: Literal["growth", "blur"] | None
    is_harmless: bool
    bias_per_unit: float
    bias_per_unit_after: float

    def allowed_in_words(self, unit: str = "") -> str:
        """The departure allowed, with the unit, and ``(blur)`` where that ends it."""
        if self.allowed is None:
            return "any" if self.is_harmless else "unknown"
        return f"{self.allowed:.3g}{unit}" + (" (blur)" if self.allowed_by == "blur" else "")


def sensitivities(model: Perturbable, tolerances: Array, growth: float) -> list[Impact]:
    """The impact of each departure at its tolerance (parameters,), the worst first.

    ``growth`` is the share of the depth error for which ``allowed`` is given.
    """
    count = len(tolerances)
    zero = measure(model, np.zeros((1, count)))
    both = measure(model, _one_at_a_time(tolerances))
    before, after = _worse(both.before), _worse(both.after)
    weights = model.grid.weights
    slope, slope_after = (np.sqrt(errors**2 @ weights) for errors in (model.depth_bias, model.depth_bias_left))
    by_growth = allowed_departures(model, growth, tolerances, slope_after)
    by_blur = sharp_departures(model, by_growth, tolerances)
    is_by_blur = np.isfinite(by_blur)
    allowed = np.where(is_by_blur, by_blur, by_growth)
    grown = depth_error(model, after["depth_bias"]) / model.noise - 1.0
    impacts = [
        Impact(
            parameter=parameter,
            tolerance=float(tolerances[place]),
            epipolar_px=float(before["epipolar_px"][place]),
            epipolar_px_after=float(after["epipolar_px"][place]),
            depth_bias=float(before["depth_bias"][place]),
            depth_bias_after=float(after["depth_bias"][place]),
            growth_after=float(grown[place]),
            viewpoint_spread_mm=float(before["viewpoint_spread_mm"][place]),
            blur_change_px=float(before["blur_px"][place] - zero.before.blur_px[0]),
            allowed=float(allowed[place]) if np.isfinite(allowed[place]) else None,
            allowed_by="blur" if is_by_blur[place] else "growth" if np.isfinite(allowed[place]) else None,
            is_harmless=bool(np.isposinf(allowed[place])),
            bias_per_unit=float(slope[place]),
            bias_per_unit_after=float(slope_after[place]),
        )
        for place, parameter in enumerate(model.parameters)
    ]
    return sorted(impacts, key=lambda impact: (-impact.growth_after, -impact.depth_bias))


def allowed_departures(model: Perturbable, growth: float, tolerances: Array, slopes: Array) -> Array:
    """The departure (parameters,) of each parameter alone that lets the calibrated depth error grow by a share.

    First order gives ``sqrt((1 + growth)^2 - 1)`` times the noise over the bias per unit; the tracer then corrects it,
    by the worse of both signs. Infinite for a departure that is harmless within ``FARTHEST`` tolerances, NaN where the
    mirrors cease to show the working volume before.
    """
    wanted = model.noise * np.sqrt((1.0 + growth) ** 2 - 1.0)
    with np.errstate(all="ignore"):
        allowed = wanted / slopes
        harmless = ~(allowed < _farthest(tolerances))
        allowed = np.where(harmless, 0.0, allowed)
        for _ in range(ALLOWED_STEPS):
            bias = _worse(measure(model, _one_at_a_time(allowed)).after)["depth_bias"]
            ratio = wanted / bias
            # Not all of the working volume may be seen so far out.
            allowed = np.where(harmless, 0.0, allowed * np.where(np.isfinite(bias), np.clip(ratio, 0.3, 3.0), 0.5))
            if np.all(harmless | (np.abs(ratio - 1.0) < 1e-6)):
                break
        settled = np.abs(ratio - 1.0) < 1e-2
    return np.where(harmless, np.inf, np.where(settled, allowed, np.nan))


def sharp_departures(model: Perturbable, allowed: Array, tolerances: Array) -> Array:
    """The departure (parameters,) of each parameter alone at which the blur reaches what the design allows.

    By halving, with the tracer and by the worse of both signs, up to those ``allowed`` for another reason or else to
    ``FARTHEST`` tolerances. Infinite where the blur stays within its limits so far, or as far as the mirrors show all.
    """
    if model.sharp is None:
        return np.full(len(tolerances), np.inf)

    def ratio(sizes: Array) -> Array:
        found = blur_of_limit(model.design, model.sharp, _one_at_a_time(sizes))
        return np.asarray(np.max(found.reshape(2, -1), axis=0))

    low, high = np.zeros(len(tolerances)), np.where(np.isfinite(allowed), allowed, _farthest(tolerances))
    with np.errstate(all="ignore"):
        within = ratio(high) <= 1.0
        for _ in range(BLUR_STEPS):
            middle = (low + high) / 2.0
            is_sharp = ratio(middle) <= 1.0
            low, high = np.where(is_sharp, middle, low), np.where(is_sharp, high, middle)
        return np.where(within | ~(ratio(high) > 1.0), np.inf, low)


def _farthest(tolerances: Array) -> Array:
    return FARTHEST * np.where(tolerances > 0.0, tolerances, UNTOLERATED)


def _one_at_a_time(sizes: Array) -> Array:
    """Systems (2 parameters, parameters) that depart by one size each, first upwards, then downwards."""
    return np.concatenate([np.diag(sizes), -np.diag(sizes)])


def _worse(merits: Merits) -> dict[str, Array]:
    """The larger value of each pair of systems that depart by the same size either way; NaN if either is."""
    return {key: np.max(getattr(merits, key).reshape(2, -1), axis=0) for key in Merits.__dataclass_fields__}
