"""How many of the sensors that are built within tolerances turn out good: by Monte Carlo, and to first order.

Every departure is drawn from a Gaussian whose standard deviation is half its tolerance, cut off at the tolerance, and
independently of the others. Row n of a draw does not depend on how many follow, so any trial can be built again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import beta

from designer.as_built.dual import Array
from designer.as_built.model import Measured, Perturbable, depth_error, first_order_bias, measure

# Tolerance over standard deviation.
CUT_OFF = 2.0
CONFIDENCE = 0.95
FIRST_ORDER_HOLDS = 0.03
PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True, slots=True)
class Yield:
    """The yield of many trials: sharp sensors whose depth error, once calibrated, grows by at most ``growth``.

    ``value`` is the share of ``trials`` that pass, ``interval`` its exact 95 % interval (Clopper and Pearson, 1934),
    ``first_order`` the share that first order lets pass, ``first_order_holds`` whether the two agree within 3
    percentage points; both take the blur as traced. ``blind`` counts sensors that do not show all of the working
    volume, ``blurred`` others that exceed the design's limits of blur somewhere; they fail. ``blurred`` is None if the
    design has no such limits.
    """

    trials: int
    passed: int
    value: float
    interval: tuple[float, float]
    first_order: float
    first_order_holds: bool
    growth: float
    blind: int
    blurred: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Departures and merits of many sensors, and the depth error (T,) of each, before and after calibration."""

    measured: Measured
    depth_error_before: Array
    depth_error_after: Array
    depth_error_first_order: Array
    result: Yield


def draw_departures(tolerances: Array, trials: int, seed: int) -> Array:
    """Departures (trials, parameters) within tolerances (parameters,)."""
    share = np.random.default_rng(seed).random((trials, len(tolerances)))
    low = ndtr(-CUT_OFF)
    return np.asarray(ndtri(low + share * (1.0 - 2.0 * low)) / CUT_OFF * tolerances)


def simulate(
    model: Perturbable, tolerances: Array, growth: float, trials: int, seed: int, align: int | None = None
) -> Trials:
    """Build and trace sensors within tolerances.

    Parameters
    ----------
    growth
        The largest share by which a good sensor's depth error grows over the design's own.
    align
        The place of a departure that is adjusted at assembly: see :func:`designer.as_built.model.measure`.
    """
    values = draw_departures(tolerances, trials, seed)
    found = measure(model, values, align)
    after = depth_error(model, found.after.depth_bias)
    simple = depth_error(model, first_order_bias(model, values, align))
    limit = (1.0 + growth) * model.noise
    is_sharp = found.blur_of_limit <= 1.0
    passed = int(np.sum((after <= limit) & is_sharp))
    first_order = float(np.mean((simple <= limit) & is_sharp))
    is_blind = np.isnan(after)
    result = Yield(
        trials=trials,
        passed=passed,
        value=passed / trials,
        interval=clopper_pearson(passed, trials),
        first_order=first_order,
        first_order_holds=abs(first_order - passed / trials) <= FIRST_ORDER_HOLDS,
        growth=growth,
        blind=int(np.sum(is_blind)),
        blurred=None if model.sharp is None else int(np.sum(~is_sharp & ~is_blind)),
    )
    return Trials(found, depth_error(model, found.before.depth_bias), after, simple, result)


def expected_depth_error(model: Perturbable, tolerances: Array, trials: int, seed: int, share: float = 95.0) -> float:
    """Percentile of the calibrated depth error of sensors within tolerances, to first order.

    ``tolerances`` (parameters,) are in the units of ``model.parameters``.
    """
    draws = draw_departures(tolerances, trials, seed)
    return float(np.percentile(depth_error(model, first_order_bias(model, draws)), share))


def clopper_pearson(passed: int, trials: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """The exact interval of a probability of which some of so many trials came true."""
    outside = (1.0 - confidence) / 2.0
    low = 0.0 if passed == 0 else float(beta.ppf(outside, passed, trials - passed + 1))
    high = 1.0 if passed == trials else float(beta.ppf(1.0 - outside, passed + 1, trials - passed))
    return low, high
