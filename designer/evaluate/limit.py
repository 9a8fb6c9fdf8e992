"""The least depth error that any conic mirrors can reach (docs/theory.md, section 6).

Larger gains lower the error of both views, and only the image bounds them: the outer zone ends at the edge of the
image circle, the inner zone where the outer one begins, less the gap between them. So the best gains for a given
baseline, principal distance, camera and volume follow without any optimisation. The part of an uncertain image scale
falls with the gains too where one view is folded: each slope shifts in proportion to cos(psi), and the shifts add up.
Where both views are direct the shifts nearly cancel, and smaller gains may cancel them better: there the limit is that
of the noise alone, which holds but is not reached. All that is so where r = f tan(psi). Another law may resolve
elevation best at an angle below the largest (equisolid: 70.5 degrees), and its share of the scale's uncertainty may
rise with the angle (equidistant: psi / sin(psi)). There the limit takes, at every elevation, the best of all angles up
to that of the largest gain, found numerically: it holds, and is reached only where the largest gain is the best.
Margins, clearances and the camera's own image in the inner view are
left out: what they cost shows in the ratio of a design's score to its limit.
Lengths in mm, angles in radians; everything but :func:`least_limit_over` broadcasts over arrays and, for a perspective
lens, takes symbols.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.configurations import Family, Topology, outer_view
from designer.design import PerView, Sense, ViewName
from designer.evaluate.depth import NoiseModel, StereoPair, Volume, depth_error_rms
from designer.optics.backend import Scalar, tan
from designer.optics.image_law import PERSPECTIVE, ImageLaw, most_favourable
from designer.optics.view import elevation_tangents_of_views, half_angle_tangent, image_half_tangent

NoiseOfPair = Callable[[StereoPair], Scalar | NoiseModel]
"""The noise of a pair of views, where it depends on their gains."""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """What a family and a topology fix: the sense of each view, and which of them takes the outer zone."""

    sense_lower: Sense
    sense_upper: Sense
    outer_view: ViewName

    @property
    def inner_view(self) -> ViewName:
        """The view that takes the inner zone."""
        return "lower" if self.outer_view == "upper" else "upper"


@dataclass(frozen=True, slots=True)
class ImageBounds:
    """What bounds the gains: radius of the usable image and gap asked between the zones (mm), and the lens's law."""

    image_radius_mm: Scalar
    zone_gap_mm: Scalar = 0.0
    law: ImageLaw = PERSPECTIVE


@dataclass(frozen=True, slots=True)
class LeastLimit:
    """The least limit over a range of baselines and principal distances, and where it lies."""

    depth_error_rms: float
    baseline_mm: float
    principal_distance_mm: float


def arrangement_of(family: Family, topology: Topology) -> Arrangement:
    """The arrangement of a configuration: only the lower view of the folded family has folded sense."""
    return Arrangement(
        sense_lower="direct" if family == "direct" else "folded",
        sense_upper="direct",
        outer_view=outer_view(topology),
    )


def limit_gains(
    arrangement: Arrangement, volume: Volume, baseline: Scalar, principal_distance: Scalar, bounds: ImageBounds
) -> PerView[Scalar]:
    """The largest gain of each view, as an absolute value.

    The inner one is zero or negative where the outer zone and the gap leave no room.
    """
    low, high = volume.elevations
    ranges = elevation_tangents_of_views((tan(low), tan(high)), volume.distances, baseline)
    upper = _half_tangent_range(ranges.upper, arrangement.sense_upper)
    lower = _half_tangent_range(ranges.lower, arrangement.sense_lower)
    outer, inner = (upper, lower) if arrangement.outer_view == "upper" else (lower, upper)
    gain_outer = image_half_tangent(bounds.image_radius_mm, principal_distance, bounds.law) / outer[1]
    outer_begins = gain_outer * outer[0]
    if bounds.law.is_perspective:
        outer_begins_mm = 2.0 * principal_distance * outer_begins / (1.0 - outer_begins * outer_begins)
    else:
        outer_begins_mm = principal_distance * bounds.law.ratio(outer_begins)
    gain_inner = image_half_tangent(outer_begins_mm - bounds.zone_gap_mm, principal_distance, bounds.law) / inner[1]
    if arrangement.outer_view == "upper":
        return PerView(lower=gain_inner, upper=gain_outer)
    return PerView(lower=gain_outer, upper=gain_inner)


def depth_error_limit(
    arrangement: Arrangement,
    volume: Volume,
    baseline: Scalar,
    principal_distance: Scalar,
    bounds: ImageBounds,
    noise_mm: Scalar | NoiseOfPair,
    scale_uncertainty: Scalar = 0.0,
) -> Scalar:
    """The score (RMS of sigma_D / D) at the largest gains.

    With a constant noise no mirrors of this arrangement can beat it; with a predicted one smaller gains can be a few
    percent better, and it is a reference.
    Of two direct views it counts the noise alone, whatever the relative uncertainty of the image's scale. Meaningless
    where :func:`limit_gains` gives no positive inner gain.
    """
    gains = limit_gains(arrangement, volume, baseline, principal_distance, bounds)
    pair = _pair_of(arrangement, gains, baseline, principal_distance, bounds.law)
    return _limit_of_pair(pair, volume, noise_mm, scale_uncertainty)


def least_limit_over(
    arrangement: Arrangement,
    volume: Volume,
    baselines: tuple[float, float],
    principal_distances: tuple[float, float],
    bounds: ImageBounds,
    noise_mm: float | NoiseOfPair,
    scale_uncertainty: float = 0.0,
) -> LeastLimit:
    """The least limit over ranges of baseline and principal distance; either range may be a single value.

    A grid is laid over the ranges and drawn in around its best node until the step is lost in rounding.

    Raises
    ------
    ValueError
        Nowhere in the ranges is there room for the inner zone.
    """
    ranges = (baselines, principal_distances)
    spans = [high - low for low, high in ranges]
    best = LeastLimit(np.inf, baselines[0], principal_distances[0])
    for _ in range(_DRAWINGS_IN):
        grid = np.meshgrid(*(np.linspace(low, high, _GRID_NODES if high > low else 1) for low, high in ranges))
        baseline, principal_distance = (axis.ravel() for axis in grid)
        scores = _limit_or_infinity(
            arrangement, volume, baseline, principal_distance, bounds, noise_mm, scale_uncertainty
        )
        index = int(np.argmin(scores))
        if scores[index] < best.depth_error_rms:
            best = LeastLimit(float(scores[index]), float(baseline[index]), float(principal_distance[index]))
        spans = [span * 2.0 / (_GRID_NODES - 1) for span in spans]
        ranges = (
            _clipped(best.baseline_mm, spans[0], baselines),
            _clipped(best.principal_distance_mm, spans[1], principal_distances),
        )
    if not np.isfinite(best.depth_error_rms):
        raise ValueError("the outer zone and the gap leave no space for the inner zone")
    return best


_GRID_NODES = 33
_DRAWINGS_IN = 7


def _half_tangent_range(slopes: tuple[Scalar, Scalar], sense: Sense) -> tuple[Scalar, Scalar]:
    """Smallest and largest half-angle tangent over a range of slopes; it falls with the slope in a folded view."""
    ends = [half_angle_tangent(slope, sense) for slope in slopes]
    return (ends[0], ends[1]) if sense == "direct" else (ends[1], ends[0])


def _limit_or_infinity(
    arrangement: Arrangement,
    volume: Volume,
    baseline: NDArray[np.float64],
    principal_distance: NDArray[np.float64],
    bounds: ImageBounds,
    noise_mm: float | NoiseOfPair,
    scale_uncertainty: float,
) -> NDArray[np.float64]:
    """The limit at each node, infinite where the inner zone has no room."""
    gains = limit_gains(arrangement, volume, baseline, principal_distance, bounds)
    has_room = np.minimum(gains.lower, gains.upper) > 0
    # Where there is no room any positive gain will do: its score is thrown away.
    positive = PerView(lower=np.where(has_room, gains.lower, 1.0), upper=np.where(has_room, gains.upper, 1.0))
    pair = _pair_of(arrangement, positive, baseline, principal_distance, bounds.law)
    return np.where(has_room, _limit_of_pair(pair, volume, noise_mm, scale_uncertainty), np.inf)


def _pair_of(
    arrangement: Arrangement,
    gains: PerView[Scalar],
    baseline: Scalar,
    principal_distance: Scalar,
    law: ImageLaw,
) -> StereoPair:
    """The pair of the largest gains, which sees as finely as any smaller gains do at the same elevation."""
    return StereoPair(
        gains.lower,
        arrangement.sense_lower,
        gains.upper,
        arrangement.sense_upper,
        baseline,
        principal_distance,
        most_favourable(law),
    )


def _limit_of_pair(
    pair: StereoPair, volume: Volume, noise_mm: Scalar | NoiseOfPair, scale_uncertainty: Scalar
) -> Scalar:
    """The limit where the pair has the largest gains."""
    noise = noise_mm(pair) if callable(noise_mm) else noise_mm
    return depth_error_rms(pair, volume, noise, scale_uncertainty if pair.sense_lower != pair.sense_upper else 0.0)


def _clipped(centre: float, span: float, allowed: tuple[float, float]) -> tuple[float, float]:
    return max(centre - span / 2.0, allowed[0]), min(centre + span / 2.0, allowed[1])
