"""Finding the pixel that the mirrors' axis hits, from any image with texture all around.

With the centre off by Delta, a sample at the image angle alpha and the signed radius r shows the azimuth that is
(Delta_v cos(alpha) - Delta_u sin(alpha)) / r further on. The two views see it at different radii, so matched points
no longer share a column: the shift between them, once around, tells Delta. What the centre does to the rows cannot
be told from depth, and is left alone.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from designer.design import Design
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.matching import DEFAULT_OPTIONS, MatchingOptions, match
from designer.imaging.stereo.panorama import AZIMUTH_PADDING
from designer.imaging.stereo.placement import Floats, ImagePlacement
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image, sample

# A scene of which less is matched cannot tell its centre.
LEAST_MATCHED = 0.02
_COLUMNS = 900
_MOST_STEPS = 12


def find_centre(
    design: Design,
    raw: Image,
    placement: ImagePlacement,
    reach_px: float = 8.0,
    distances_mm: tuple[float, float] | None = None,
    options: MatchingOptions = DEFAULT_OPTIONS,
) -> ImagePlacement:
    """Move the centre of a placement until matched points share their columns.

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
    options = replace(options, matcher="sad", speckle_size=0)

    def rig_at(centre: tuple[float, float]) -> StereoRig:
        moved = replace(placement, center_px=centre)
        return build_rig(design, columns=_COLUMNS, placement=moved, distances_mm=distances_mm)

    u, v = placement.center_px
    steps = np.arange(-reach_px, reach_px + 1e-9, 2.0)
    grid = [(float(u + across), float(v + down)) for across in steps for down in steps]
    matched = [match_image(rig_at(centre), raw, options).fractions["kept"] for centre in grid]
    if max(matched) < LEAST_MATCHED:
        raise InputError(
            f"no centre found: at best {100 * max(matched):.1f} % of the panorama is matched within {reach_px:g} "
            "pixels; give a better --center and --scale, or an image with texture all round"
        )
    centre = grid[int(np.argmax(matched))]
    for _ in range(_MOST_STEPS):
        off = _offset(rig_at(centre), raw, options)
        centre = (float(centre[0] - off[0]), float(centre[1] - off[1]))
        if np.hypot(*off) < 0.005:
            break
    return replace(placement, center_px=centre)


def _offset(rig: StereoRig, raw: Image, options: MatchingOptions) -> Floats:
    """How far (u, v) the centre is off, to first order, by least squares over all matched pixels."""
    grid = rig.grid
    lines = sample(rig, raw)
    matches = match(grid, rig.search, lines["upper"], lines["lower"], rig.imaged, options)
    columns, rows = np.nonzero(np.isfinite(matches.disparities))
    rows_lower = rows - matches.disparities[columns, rows]
    # The lower view as the upper one would show it.
    all_columns, all_rows = np.mgrid[0 : len(lines["lower"]), 0 : grid.rows].astype(np.float32)
    shift = np.nan_to_num(np.pad(matches.disparities, ((AZIMUTH_PADDING, AZIMUTH_PADDING), (0, 0)), mode="wrap"))
    moved = cv2.remap(lines["lower"], all_rows - shift, all_columns, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    upper, lower = lines["upper"].astype(float), np.asarray(moved, dtype=float)
    # Azimuth decreases from column to column.
    by_azimuth = -np.gradient((upper + lower) / 2.0, axis=0) * grid.columns / (2.0 * np.pi)
    places = (columns + AZIMUTH_PADDING, rows)
    inverse_radii = 1.0 / rig.images["upper"].radius_px(grid.slope("upper", rows))
    inverse_radii -= 1.0 / rig.images["lower"].radius_px(grid.slope("lower", rows_lower))
    angle = grid.azimuth(columns) + rig.images["upper"].placement.rotation_rad
    by_centre = by_azimuth[places] * inverse_radii
    factors = np.column_stack([-by_centre * np.sin(angle), by_centre * np.cos(angle)])
    difference = upper[places] - lower[places]
    # Where the views differ in brightness, the difference has a mean that is no shift.
    factors = np.column_stack([factors, np.ones(len(difference))])
    return np.asarray(np.linalg.lstsq(factors, difference, rcond=None)[0][:2])
