"""From corresponding rows to points: closed-form triangulation and its uncertainty.

A point that the lower viewpoint sees at slope m_l and the upper one at m_u lies at the horizontal distance
D = b / (m_l - m_u) and the height z_l + D m_l; seen through the wall of a tube, where :mod:`designer.optics.tube` says.
In a cylindrical panorama rows are equal steps of slope, so D is inversely proportional to the disparity; in a spherical
one the two slopes are tangents of the rows' elevations. The frame is the pinhole's, lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import Design, PerView
from designer.evaluate.depth import depth_shift_per_scale, noise_mm_of, point_covariance, stereo_pair_of
from designer.imaging.images import Image
from designer.imaging.stereo.panorama import PanoramaGrid
from designer.imaging.stereo.placement import Floats
from designer.optics.tube import Wall, distance_of, shift_along_axis, wall_of


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points in the frame of the pinhole, with one standard deviation of each.

    ``positions_mm`` (n, 3); ``colours`` (n, 3) red, green, blue; ``sigma_distance_mm``, ``sigma_height_mm`` and
    ``sigma_across_mm`` (along the circle of azimuth), each (n,); ``rows`` and ``columns`` (n,) of the upper panorama.
    """

    positions_mm: Floats
    colours: Image
    sigma_distance_mm: Floats
    sigma_height_mm: Floats
    sigma_across_mm: Floats
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]


def triangulate(
    slopes: PerView[ArrayLike],
    lower_viewpoint_mm: float,
    baseline_mm: float,
    wall: Wall | None = None,
) -> tuple[Floats, Floats]:
    """Horizontal distance and height (mm) of points from the slopes at which the two viewpoints see them.

    Both are seen through the ``wall`` of a tube, if there is one.

    The distance is infinite, and the height not a number, where the lines of sight do not meet.
    """
    lower, upper = np.asarray(slopes.lower, dtype=float), np.asarray(slopes.upper, dtype=float)
    apart = lower - upper
    meets = apart > 0
    with np.errstate(all="ignore"):
        distance = np.where(meets, np.asarray(distance_of(lower, upper, baseline_mm, wall)), np.inf)
    shift = 0.0 if wall is None else shift_along_axis(lower, wall)
    height = np.where(meets, lower_viewpoint_mm + shift + np.where(meets, distance, 0.0) * lower, np.nan)
    return distance, height


def matched_slopes(
    grid: PanoramaGrid, disparities: NDArray[np.float32], columns: NDArray[np.intp], rows: NDArray[np.intp]
) -> PerView[Floats]:
    """Slopes at which the views see pixels (n,) of the upper panorama and their matches in the lower one."""
    return PerView(
        lower=grid.slope("lower", rows - disparities[columns, rows].astype(float)), upper=grid.slope("upper", rows)
    )


def distance_from_disparity(
    grid: PanoramaGrid, row_upper: ArrayLike, disparity: ArrayLike, baseline_mm: float
) -> Floats:
    """Horizontal distance (mm) of what the upper panorama shows at a row; infinite where lines of sight do not meet.

    ``disparity`` is row_upper - row_lower, in rows; the two broadcast.
    """
    row_upper = np.asarray(row_upper, dtype=float)
    slope_lower = grid.slope("lower", row_upper - np.asarray(disparity, dtype=float))
    slopes = PerView(lower=slope_lower, upper=grid.slope("upper", row_upper))
    return triangulate(slopes, 0.0, baseline_mm)[0]


def disparity_from_distance(
    grid: PanoramaGrid, row_upper: ArrayLike, distance_mm: ArrayLike, baseline_mm: float
) -> Floats:
    """Disparity in rows of what lies at a distance (mm) in a row of the upper panorama; inverse of the above."""
    row_upper = np.asarray(row_upper, dtype=float)
    slope_lower = grid.slope("upper", row_upper) + baseline_mm / np.asarray(distance_mm, dtype=float)
    return row_upper - grid.row("lower", slope_lower)


def distance_map(grid: PanoramaGrid, disparities: NDArray[np.float32], baseline_mm: float) -> NDArray[np.float32]:
    """Horizontal distance (mm) of each pixel of a disparity map of shape (columns, rows).

    The same as :func:`distance_from_disparity` in single precision, which is a few parts in a million here, for
    speed; not a number stays so.
    """
    rows = np.arange(grid.rows)
    coordinates = np.float32(grid.step) * disparities
    coordinates += (grid.top("lower") - (rows + 0.5) * grid.step).astype(np.float32)
    # NumPy's sine and cosine are vectorised where its tangent is not.
    slopes = np.sin(coordinates) / np.cos(coordinates) if grid.sampling == "spherical" else coordinates
    slopes -= grid.slope("upper", rows).astype(np.float32)
    np.maximum(slopes, np.float32(0.0), out=slopes)
    with np.errstate(divide="ignore"):
        return np.asarray(np.divide(np.float32(baseline_mm), slopes, out=slopes))


def reconstruct(
    design: Design,
    grid: PanoramaGrid,
    disparities: NDArray[np.float32],
    colours: Image,
    noise_px: float | None = None,
) -> PointCloud:
    """The point cloud of a disparity map.

    Parameters
    ----------
    disparities
        Rows by which each pixel of the upper panorama lies below its match, shape (columns, rows); not a number
        where there is none.
    colours
        The upper panorama, (rows, columns) or (rows, columns, 3) in OpenCV's order (blue, green, red).
    noise_px
        Standard deviation of a coordinate in the raw image, in each view; the design's own by default.
    """
    columns, rows = np.nonzero(np.isfinite(disparities))
    slopes = matched_slopes(grid, disparities, columns, rows)
    viewpoint = design.views.lower.viewpoint_mm
    distance, height = triangulate(slopes, viewpoint, design.baseline_mm, wall_of(design))
    ahead = np.isfinite(distance)
    columns, rows, distance, height = columns[ahead], rows[ahead], distance[ahead], height[ahead]
    azimuth = grid.azimuth(columns)
    noise_mm = noise_mm_of(design) if noise_px is None else noise_px * design.camera.pixel_pitch_mm
    middle_slope = (slopes.lower[ahead] + slopes.upper[ahead]) / 2.0
    variances = np.diagonal(
        point_covariance(stereo_pair_of(design), middle_slope, distance, noise_mm), axis1=-2, axis2=-1
    )
    sigma_distance, sigma_height, sigma_azimuth = np.sqrt(variances).T
    return PointCloud(
        positions_mm=np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height]),
        colours=_red_green_blue(colours)[rows, columns],
        sigma_distance_mm=sigma_distance,
        sigma_height_mm=sigma_height,
        sigma_across_mm=distance * sigma_azimuth,
        rows=rows,
        columns=columns,
    )


def depth_shifts_per_scale(design: Design, cloud: PointCloud) -> Floats:
    """Relative depth shift of each point per relative error of the image's scale: systematic, not in its deviations."""
    distance = np.hypot(*cloud.positions_mm[:, :2].T)
    slope = (cloud.positions_mm[:, 2] - design.views.middle_mm) / distance
    return np.asarray(depth_shift_per_scale(stereo_pair_of(design), slope, distance))


def _red_green_blue(image: Image) -> Image:
    return np.repeat(image[..., None], 3, axis=-1) if image.ndim == 2 else image[..., ::-1]
