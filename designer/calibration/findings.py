"""What a calibration found, in numbers and words: residuals by region, and what the images do not tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.merits import first_order_errors, grid_of
from designer.as_built.projection import linearise
from designer.calibration.bundle import Adjusted, Sighting
from designer.calibration.unknowns import Unknowns
from designer.design import VIEW_NAMES, Design, ViewName

RINGS, SECTORS = 2, 4
# The images tell a departure if what is left of its prior standard deviation is less than this share.
STILL_OPEN = 0.5
# A combination of departures of which the images say less than was known before.
LEAST_INFORMATION = 1.0
MOST_NAMED, LARGEST_SHARE = 4, 0.3


@dataclass(frozen=True, slots=True)
class RegionResidual:
    """Residuals of one region of a view's image: ring (``inner`` or ``outer`` half of its points) and sector.

    ``sector_deg`` are the ends of the sector in image angle, from right towards down; ``rms_px`` is that of a
    coordinate, ``bias_px`` the length of the mean residual.
    """

    view: ViewName
    ring: str
    sector_deg: tuple[float, float]
    points: int
    rms_px: float
    bias_px: float


@dataclass(frozen=True, slots=True)
class Undetermined:
    """A combination of departures that the images tell less about than the tolerances do.

    ``shares`` are its largest components, in units of the prior standard deviations, by the departures' names.
    """

    information: float
    shares: tuple[tuple[str, float], ...]


def residuals_by_view(sightings: Sequence[Sighting], adjusted: Adjusted) -> dict[ViewName, float]:
    """Root mean square residual of a coordinate in px, for each view that shows any point."""
    found = {}
    for view in VIEW_NAMES:
        parts = [left for sighting, left in zip(sightings, adjusted.residuals_px, strict=True) if sighting.view == view]
        if parts:
            found[view] = float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))
    return found


def residuals_by_region(
    design: Design, sightings: Sequence[Sighting], adjusted: Adjusted
) -> tuple[RegionResidual, ...]:
    """Residuals of each view in two rings, inside and outside the median radius of its points, and four sectors."""
    found = []
    for view in VIEW_NAMES:
        parts = [(s.pixels, r) for s, r in zip(sightings, adjusted.residuals_px, strict=True) if s.view == view]
        if not parts:
            continue
        pixels, left = (np.concatenate(part) for part in zip(*parts, strict=True))
        across, down = (pixels - design.camera.principal_point_px).T
        radius, angle = np.hypot(across, down), np.degrees(np.arctan2(down, across)) % 360.0
        is_outer = radius > np.median(radius)
        for ring, in_ring in (("inner", ~is_outer), ("outer", is_outer)):
            for sector in range(SECTORS):
                ends = (360.0 * sector / SECTORS, 360.0 * (sector + 1) / SECTORS)
                here = left[in_ring & (angle >= ends[0]) & (angle < ends[1]) & np.isfinite(left).all(axis=1)]
                if len(here):
                    rms, bias = np.sqrt(np.mean(here**2)), np.hypot(*here.mean(axis=0))
                    found.append(RegionResidual(view, ring, ends, len(here), float(rms), float(bias)))
    return tuple(found)


def undetermined(unknowns: Unknowns, adjusted: Adjusted) -> tuple[Undetermined, ...]:
    """Combinations of departures that rest on the tolerances and not on the images, the least told first."""
    free = np.flatnonzero(unknowns.free)
    here = np.ix_(free, free)
    unit = np.linalg.cholesky(unknowns.prior[here])
    told, combinations = np.linalg.eigh(unit.T @ adjusted.information[here] @ unit)
    sigma, names = unknowns.prior_sigma[free], [unknowns.parameters[place].name for place in free]
    found = []
    for amount, combination in zip(told, combinations.T, strict=True):
        if amount >= LEAST_INFORMATION:
            break
        shares = unit @ combination / sigma
        shares = shares / np.linalg.norm(shares)
        largest = [place for place in np.argsort(-np.abs(shares)) if abs(shares[place]) >= LARGEST_SHARE]
        sign = np.sign(shares[largest[0]]) if largest else 1.0
        found.append(
            Undetermined(
                float(max(amount, 0.0)),
                tuple((names[place], float(sign * shares[place])) for place in largest[:MOST_NAMED]),
            )
        )
    return tuple(found)


def still_open(unknowns: Unknowns, sigma: Array) -> tuple[str, ...]:
    """Names of the free departures whose standard deviation (parameters,) is hardly below the prior's."""
    return tuple(
        parameter.name
        for parameter, left, before, is_free in zip(
            unknowns.parameters, sigma, unknowns.prior_sigma, unknowns.free, strict=True
        )
        if is_free and left > STILL_OPEN * before
    )


def depth_uncertainty(design: Design, adjusted: Adjusted) -> float:
    """Relative standard deviation of distances that the covariance leaves, rms over the working volume; first order.

    ``design`` is that without departures, about which errors are linear. It is systematic: the same in every image.
    """
    slopes, weights = depth_slopes(design)
    return float(np.sqrt(np.einsum("pn,pq,qn->n", slopes, adjusted.covariance, slopes) @ weights))


def depth_slopes(design: Design) -> tuple[Array, Array]:
    """Relative change of distances (parameters, n) per departure, image shift last, and the weights (n,) of the points.

    The points fill the working volume; the design is that without departures.
    """
    grid = grid_of(design)
    shift = np.broadcast_to(np.eye(2)[:, :, None], (2, 2, len(grid.weights)))
    changes = {view: np.concatenate([linearise(design, view, grid.targets[view]).pixels, shift]) for view in VIEW_NAMES}
    _, bias = first_order_errors(design, grid, changes)
    return bias, grid.weights


def undetermined_in_words(found: Sequence[Undetermined], free: int) -> list[str]:
    """Lines that say what the images leave open; what no image of loose targets can tell is always said."""
    lines = [
        "the images do not say how the sensor stands in the room, nor how it is turned about its axis: azimuths and "
        "heights are those of the camera"
    ]
    if found:
        lines.append(
            f"{len(found)} of {free} combinations of departures rest on the tolerances, not on the images; the weakest:"
        )
        lines += [f"  {_combination(each)}" for each in found[:3]]
        lines.append("more poses, nearer and tilted, tell more")
    return lines


def _combination(found: Undetermined) -> str:
    return " with ".join(f"{name} ({share:+.2f})" for name, share in found.shares) or "many departures together"
