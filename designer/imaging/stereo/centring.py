"""Finding the pixel that the mirrors' axis hits, from any image with texture all around.

With the centre off by Delta, a sample at the image angle alpha and the signed radius r shows the azimuth that is
(Delta_v cos(alpha) - Delta_u sin(alpha)) / r further on. The two views see it at different radii, so matched points
no longer share a column: the shift between them, once around, tells Delta. What the centre does to the rows cannot
be told from depth, and is left alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.matching import DEFAULT_OPTIONS, Matches, MatchingOptions, match
from designer.imaging.stereo.panorama import AZIMUTH_PADDING
from designer.imaging.stereo.placement import Floats, Placement, ViewPlacements
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image, sample

# A scene of which less is matched cannot tell its centre.
LEAST_MATCHED = 0.02
MOST_STEPS = 12
LAST_STEP_PX = 0.005
_COLUMNS = 900

AnyPlacement = TypeVar("AnyPlacement", bound=Placement)


def find_centre(
    design: Design,
    raw: Image,
    placement: AnyPlacement,
    reach_px: float = 8.0,
    distances_mm: tuple[float, float] | None = None,
    options: MatchingOptions = DEFAULT_OPTIONS,
) -> AnyPlacement:
    """Move the centre of a placement, or those of both views alike, until matched points share their columns.

    Parameters
    ----------
    raw
        Grey raw image (height, width).
    reach_px
        How far from the given centre to look, in u and in v.
    distances_mm
        Nearest and farthest distance to match, as for the rig.

    Raises
    ------
    InputError
        Too little is matched wherever the centre is put.
    """
    options = options_for_centring(options)
    found, matched = best_of_grid(design, raw, placement, reach_px, distances_mm, options)
    require_matched(matched, reach_px)
    for _ in range(MOST_STEPS):
        off = _offset(coarse_rig(design, found, distances_mm), raw, options)
        found = with_centre_moved(found, float(-off[0]), float(-off[1]))
        if np.hypot(*off) < LAST_STEP_PX:
            break
    return found


def options_for_centring(options: MatchingOptions) -> MatchingOptions:
    """Matching without what smooths over wrong columns."""
    return replace(options, matcher="sad", speckle_size=0)


def coarse_rig(design: Design, placement: Placement, distances_mm: tuple[float, float] | None) -> StereoRig:
    """A rig of few columns, in which a centre that is off leaves more matches."""
    return build_rig(design, columns=_COLUMNS, placement=placement, distances_mm=distances_mm)


def best_of_grid(
    design: Design,
    raw: Image,
    placement: AnyPlacement,
    reach_px: float,
    distances_mm: tuple[float, float] | None,
    options: MatchingOptions,
) -> tuple[AnyPlacement, float]:
    """The placement that matches most among those moved in steps of 2 pixels, and the share that it matches."""
    steps = np.arange(-reach_px, reach_px + 1e-9, 2.0)
    tried = [with_centre_moved(placement, float(across), float(down)) for across in steps for down in steps]
    rigs = (coarse_rig(design, place, distances_mm) for place in tried)
    matched = [match_image(rig, raw, options).fractions["kept"] for rig in rigs]
    return tried[int(np.argmax(matched))], max(matched)


def require_matched(matched: float, reach_px: float) -> None:
    """Raise InputError where too small a share of the panorama is matched to tell its centre."""
    if matched < LEAST_MATCHED:
        raise InputError(
            f"no centre found: at best {100 * matched:.1f} % of the panorama is matched within {reach_px:g} "
            "pixels; give a better --center and --scale, or an image with texture all round"
        )


def with_centre_moved(placement: AnyPlacement, across_px: float, down_px: float) -> AnyPlacement:
    """The placement with its centre, or the centres of both views, moved."""
    if isinstance(placement, ViewPlacements):
        upper, lower = (with_centre_moved(one, across_px, down_px) for one in (placement.upper, placement.lower))
        return replace(placement, upper=upper, lower=lower)
    u, v = placement.center_px
    return replace(placement, center_px=(u + across_px, v + down_px))


@dataclass(frozen=True, slots=True, eq=False)
class Differences:
    """The two views of all n matched pixels compared; arrays (n,).

    ``columns`` and ``rows`` in the upper panorama, ``rows_lower`` in the lower; ``differences`` in grey levels, upper
    less lower, and ``by_azimuth`` how fast the grey level of both rises with the azimuth, per radian.
    """

    columns: NDArray[np.intp]
    rows: NDArray[np.intp]
    rows_lower: Floats
    differences: Floats
    by_azimuth: Floats


def differences(rig: StereoRig, raw: Image, options: MatchingOptions) -> Differences:
    """Match a raw image and compare the two views of each matched pixel."""
    grid = rig.grid
    lines = sample(rig, raw)
    matches = match(grid, rig.search, lines["upper"], lines["lower"], rig.imaged, options)
    columns, rows = np.nonzero(np.isfinite(matches.disparities))
    rows_lower = np.asarray(rows - matches.disparities[columns, rows], dtype=float)
    upper, lower = lines["upper"].astype(float), lower_as_upper(lines["lower"], matches).astype(float)
    # Azimuth decreases from column to column.
    by_azimuth = -np.gradient((upper + lower) / 2.0, axis=0) * grid.columns / (2.0 * np.pi)
    places = (columns + AZIMUTH_PADDING, rows)
    return Differences(columns, rows, rows_lower, upper[places] - lower[places], by_azimuth[places])


def lower_as_upper(lower: Image, matches: Matches) -> Image:
    """Scan lines of the lower view as the upper one would show them."""
    all_columns, all_rows = np.mgrid[0 : len(lower), 0 : lower.shape[1]].astype(np.float32)
    shift = np.nan_to_num(np.pad(matches.disparities, ((AZIMUTH_PADDING, AZIMUTH_PADDING), (0, 0)), mode="wrap"))
    shown = cv2.remap(lower, all_rows - shift, all_columns, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(shown, dtype=np.uint8)


def _offset(rig: StereoRig, raw: Image, options: MatchingOptions) -> Floats:
    """How far (u, v) the centre is off, to first order, by least squares over all matched pixels."""
    grid, seen = rig.grid, differences(rig, raw, options)
    inverse_radii = 1.0 / rig.images["upper"].radius_px(grid.slope("upper", seen.rows))
    inverse_radii -= 1.0 / rig.images["lower"].radius_px(grid.slope("lower", seen.rows_lower))
    angle = grid.azimuth(seen.columns) + rig.images["upper"].placement.rotation_rad
    by_centre = seen.by_azimuth * inverse_radii
    factors = np.column_stack([-by_centre * np.sin(angle), by_centre * np.cos(angle)])
    # Where the views differ in brightness, the difference has a mean that is no shift.
    factors = np.column_stack([factors, np.ones(len(seen.differences))])
    return np.asarray(np.linalg.lstsq(factors, seen.differences, rcond=None)[0][:2])
