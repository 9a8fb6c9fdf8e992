"""Finding the image centre of each view, where the mirrors of a built sensor do not share an axis.

Each view's centre shifts azimuths by the law of :mod:`designer.imaging.stereo.centring`, in inverse proportion to the
view's own image radius, and a turn of one view against the other shifts all of them alike. Matched points tell the
shift between the views: five unknowns, which least squares can part if the ratio of the two radii varies enough over
the image. The upper view keeps the turn that it is given, for only the relative one can be seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import VIEW_NAMES, Design, PerView
from designer.imaging.images import Image
from designer.imaging.stereo.centring import (
    LAST_STEP_PX,
    MOST_STEPS,
    best_of_grid,
    coarse_rig,
    differences,
    find_centre,
    lower_as_upper,
    options_for_centring,
    require_matched,
)
from designer.imaging.stereo.matching import DEFAULT_OPTIONS, MatchingOptions, match
from designer.imaging.stereo.panorama import AZIMUTH_PADDING
from designer.imaging.stereo.placement import Floats, Placement, ViewPlacements, placement_of_view
from designer.imaging.stereo.rig import StereoRig, sample

# Columns of the coarse panorama by which the two views of a point may be apart at first, and then.
_REACHES = (8, 3)
# A centre known no better than this is of no use: at a radius of 100 px it leaves a third of a column.
LARGEST_ERROR_PX = 0.25
# Whole columns, which a coarse texture tells more poorly than its grey levels do, only have to lead there.
_LARGEST_ERROR_AT_FIRST_PX = 1.0
# Columns of unit length so nearly dependent multiply whatever the law of the shift leaves out.
LARGEST_CONDITION = 30.0
# Huber's bound, in standard deviations.
_BOUND = 1.5
_REWEIGHTINGS = 10
# Matches share windows: residuals are taken to be independent from one block of this side to the next only.
_BLOCK = 16
# Chi-squared of three differences (centre right and down, turn) that chance exceeds once in a thousand.
_SIGNIFICANT = 16.27


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Amounts (k,) by robust least squares, their covariance (k, k), and the condition of the unit-length columns."""

    amounts: Floats
    covariance: Floats
    condition: float


@dataclass(frozen=True, slots=True)
class FoundCentres:
    """What an image tells of the centres of its two views.

    ``placement`` is one for both views where the image does not show two, else one for each.
    ``standard_errors_px`` are those of the views' centres, each the root mean square of right and down,
    and ``turn_error_rad`` that of the relative turn; None where the image does not determine them. They are those of
    noise: where the texture is much coarser than the matching window, matches err together by several times as much.
    ``note`` says why the centres were moved together, and is empty where they were not.
    """

    placement: Placement
    standard_errors_px: PerView[float] | None
    turn_error_rad: float | None
    note: str


def find_centres(
    design: Design,
    raw: Image,
    placement: Placement,
    reach_px: float = 8.0,
    distances_mm: tuple[float, float] | None = None,
    options: MatchingOptions = DEFAULT_OPTIONS,
) -> FoundCentres:
    """Move the centres of both views, and turn the lower one, until matched points share their columns.

    Parameters
    ----------
    raw
        Grey raw image (height, width).
    placement
        Where to start; scales and the turn of the upper view are kept.
    reach_px
        How far from there to look, in u and in v, for the centre common to both that matches most.
    distances_mm
        Nearest and farthest distance to match, as for the rig.

    Raises
    ------
    InputError
        Too little is matched wherever the centres are put.
    """
    options = options_for_centring(options)
    start, matched = best_of_grid(design, raw, placement, reach_px, distances_mm, options)
    found = ViewPlacements(upper=placement_of_view(start, "upper"), lower=placement_of_view(start, "lower"))
    for reach in _REACHES:
        rig = coarse_rig(design, found, distances_mm)
        shifts, columns, rows, rows_lower = column_shifts(rig, raw, reach, options)
        share = len(shifts) / (rig.grid.columns * rig.grid.rows)
        require_matched(max(matched, share) if reach == _REACHES[0] else share, reach_px)
        factors = shift_factors(rig, columns, rows, rows_lower)
        solution = robust_least_squares(factors, shifts, _blocks(columns, rows))
        if not _is_determined(solution, _LARGEST_ERROR_AT_FIRST_PX):
            return _one_centre(design, raw, placement, reach_px, distances_mm, options)
        found = _corrected(found, solution.amounts)
    for _ in range(MOST_STEPS):
        rig = coarse_rig(design, found, distances_mm)
        seen = differences(rig, raw, options)
        factors = seen.by_azimuth[:, None] * shift_factors(rig, seen.columns, seen.rows, seen.rows_lower)
        # Where the views differ in brightness, the difference has a mean that is no shift.
        factors = np.column_stack([factors, np.ones(len(factors))])
        solution = robust_least_squares(factors, seen.differences, _blocks(seen.columns, seen.rows))
        if not _is_determined(solution, LARGEST_ERROR_PX):
            return _one_centre(design, raw, placement, reach_px, distances_mm, options)
        found = _corrected(found, solution.amounts)
        errors = np.sqrt(np.diag(solution.covariance))
        # Which pixels match changes a little with every step, so that steps do not fade out entirely.
        if np.all(np.abs(solution.amounts[:4]) < np.maximum(LAST_STEP_PX, 0.1 * errors[:4])):
            break
    of_centres = PerView(
        upper=float(np.hypot(*errors[:2]) / np.sqrt(2.0)), lower=float(np.hypot(*errors[2:4]) / np.sqrt(2.0))
    )
    if isinstance(placement, ViewPlacements) or _differ(found, placement.rotation_rad, solution.covariance):
        return FoundCentres(found, of_centres, float(errors[4]), "")
    one = find_centre(design, raw, placement, reach_px, distances_mm, options)
    return FoundCentres(one, of_centres, float(errors[4]), "both views have the same centre within its standard error")


def shift_factors(
    rig: StereoRig, columns: NDArray[np.intp], rows: NDArray[np.intp], rows_lower: ArrayLike
) -> NDArray[np.float64]:
    """How much farther on the upper view shows an azimuth than the lower, (n, 5), in radians.

    Per pixel by which the upper centre is off to the right and downwards, the same of the lower centre, and per radian
    by which the lower view is turned too far.
    """
    parts = []
    for view, sign, at in zip(VIEW_NAMES, (1.0, -1.0), (rows, rows_lower), strict=True):
        image = rig.images[view]
        radius = image.radius_px(rig.grid.slope(view, at))
        angle = rig.grid.azimuth(columns) + image.placement.rotation_rad
        parts += [-sign * np.sin(angle) / radius, sign * np.cos(angle) / radius]
    return np.column_stack([*parts, np.full(len(columns), -1.0)])


def column_shifts(
    rig: StereoRig, raw: Image, reach: int, options: MatchingOptions
) -> tuple[Floats, NDArray[np.intp], NDArray[np.intp], Floats]:
    """Shift in azimuth (rad) at which each matched pixel fits best, its column and row, and its row in the lower view.

    ``reach`` is how many columns to either side to look.
    """
    grid, lines = rig.grid, sample(rig, raw)
    inner = lines["lower"][AZIMUTH_PADDING:-AZIMUTH_PADDING]
    shifts = np.arange(-reach, reach + 1)
    costs = np.full((len(shifts), grid.columns, grid.rows), np.inf, np.float32)
    disparities = np.zeros_like(costs)
    for place, shift in enumerate(shifts):
        lower = np.pad(np.roll(inner, shift, axis=0), ((AZIMUTH_PADDING, AZIMUTH_PADDING), (0, 0)), mode="wrap")
        imaged = None if rig.imaged is None else replace(rig.imaged, lower=np.roll(rig.imaged.lower, shift, axis=0))
        matches = match(grid, rig.search, lines["upper"], lower, imaged, options)
        remaining = cv2.absdiff(lines["upper"], lower_as_upper(lower, matches))
        window = (options.window, options.window)
        cost = cv2.boxFilter(remaining, cv2.CV_32F, window)[AZIMUTH_PADDING:-AZIMUTH_PADDING]
        kept = np.isfinite(matches.disparities)
        costs[place][kept] = cost[kept]
        disparities[place][kept] = matches.disparities[kept]
    best = np.argmin(costs, axis=0)
    # At an end of the reach, or beside a shift without match, the least may lie elsewhere.
    between = (best > 0) & (best < len(shifts) - 1)
    columns, rows = np.nonzero(between)
    before, least, after = (costs[best[columns, rows] + step, columns, rows] for step in (-1, 0, 1))
    known = np.isfinite(before) & np.isfinite(after)
    columns, rows, before, least, after = (part[known] for part in (columns, rows, before, least, after))
    at = best[columns, rows]
    # The lines of absolute differences rise alike on either side of the least.
    fraction = (before - after) / (2.0 * np.maximum(np.maximum(before, after) - least, 1e-6))
    found = (shifts[at] + fraction) * (2.0 * np.pi / grid.columns)
    return np.asarray(found, dtype=float), columns, rows, rows - disparities[at, columns, rows].astype(float)


def robust_least_squares(factors: Floats, values: Floats, blocks: NDArray[np.intp]) -> Solution:
    """Amounts x for which factors (n, k) x come near values (n,), with Huber's loss.

    The covariance allows for any dependence among the values of one block: ``blocks`` (n,) numbers them from 0.
    """
    length = np.maximum(np.linalg.norm(factors, axis=0), 1e-300)
    unit = factors / length
    weights = np.ones(len(values))
    count = factors.shape[1]
    amounts = np.zeros(count)
    for _ in range(_REWEIGHTINGS):
        normal = unit.T @ (unit * weights[:, None])
        amounts = np.linalg.lstsq(normal, unit.T @ (weights * values), rcond=None)[0]
        rest = values - unit @ amounts
        sigma = max(1.4826 * float(np.median(np.abs(rest))), 1e-300)
        weights = _BOUND / np.maximum(np.abs(rest) / sigma, _BOUND)
    strength = np.linalg.eigvalsh(normal)
    condition = float(np.sqrt(strength[-1] / max(strength[0], 1e-300)))
    scores = np.zeros((int(blocks.max()) + 1, count))
    np.add.at(scores, blocks, unit * (weights * rest)[:, None])
    # The loss bends only where it is not yet straight.
    bent = unit[np.abs(rest) <= _BOUND * sigma]
    inverse = np.linalg.pinv(bent.T @ bent) / length[:, None]
    return Solution(amounts / length, np.asarray(inverse @ (scores.T @ scores) @ inverse.T), condition)


def _blocks(columns: NDArray[np.intp], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    return np.asarray(np.unique(columns // _BLOCK * 100_000 + rows // _BLOCK, return_inverse=True)[1])


def _is_determined(solution: Solution, largest_error_px: float) -> bool:
    errors = np.sqrt(np.diag(solution.covariance)[:4])
    return solution.condition <= LARGEST_CONDITION and bool(errors.max() <= largest_error_px)


def _corrected(placements: ViewPlacements, off: Floats) -> ViewPlacements:
    upper, lower = placements.upper, placements.lower
    (u, v), (u_lower, v_lower) = upper.center_px, lower.center_px
    return ViewPlacements(
        upper=replace(upper, center_px=(float(u - off[0]), float(v - off[1]))),
        lower=replace(
            lower,
            center_px=(float(u_lower - off[2]), float(v_lower - off[3])),
            rotation_rad=float(lower.rotation_rad - off[4]),
        ),
    )


def _differ(found: ViewPlacements, rotation_rad: float, covariance: Floats) -> bool:
    """Whether centres and turns differ by more than their errors."""
    apart = np.subtract(found.upper.center_px, found.lower.center_px)
    amounts = np.array([*apart, rotation_rad - found.lower.rotation_rad])
    difference = np.array([[1.0, 0.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 0.0, -1.0]])
    of_amounts = difference @ covariance[:5, :5] @ difference.T
    return bool(amounts @ np.linalg.solve(of_amounts, amounts) > _SIGNIFICANT)


def _one_centre(
    design: Design,
    raw: Image,
    placement: Placement,
    reach_px: float,
    distances_mm: tuple[float, float] | None,
    options: MatchingOptions,
) -> FoundCentres:
    one = find_centre(design, raw, placement, reach_px, distances_mm, options)
    done = "both were moved alike" if isinstance(one, ViewPlacements) else "the centre is common to both"
    return FoundCentres(one, None, None, f"this image does not determine a centre for each view; {done}")
