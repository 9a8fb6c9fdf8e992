"""Resolution equalisation: the finer view smoothed to the coarser one's resolution (paper, equation (10)).

At each elevation, and separately along the radius and along the circle, the raw image of each view is smoothed by a
Gaussian of standard deviation s sigma:

    s_i^r = max(1, |dr_i/dphi| / |dr_o/dphi|)     s_i^c = 1
    s_o^r = max(1, |dr_o/dphi| / |dr_i/dphi|)     s_o^c = r_o / r_i

with i the inner and o the outer zone. In elevation and azimuth both views then have the same blur. Slopes and radii
are taken in absolute value, since a folded view's image runs the other way and a gain may be negative.

The smoothing happens on samples finer than the raw pixels. Along the radius, where the scale changes from row to
row, by Lindeberg's discrete analogue of the Gaussian, whose variance is exact on any grid; along the circle, which
closes on itself, by multiplying the spectrum. Bilinear sampling has itself smoothed by a triangle of variance 1/6
pixel; the filters supply the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft
from scipy.sparse import csr_array
from scipy.special import ive

from designer.design import ViewName
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.panorama import AZIMUTH_PADDING, LARGEST_SIDE, PanoramaGrid, imaged_rows
from designer.imaging.stereo.placement import Floats, ViewImage

# A Gaussian of half a sample passes 0.7 percent of a pattern at the sampling rate itself.
ANTI_ALIASING_SAMPLES = 0.5
BILINEAR_VARIANCE_PX2 = 1.0 / 6.0
# Each takes some 30 bytes while the tables are built.
MOST_FINE_SAMPLES = 100_000_000


@dataclass(frozen=True, slots=True)
class ScaleFactors:
    """Scale factors s of one view, each of shape (rows,): along the radius and along the circle."""

    radial: Floats
    circular: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Equaliser:
    """Tables that sample and smooth one view.

    ``u_px``, ``v_px`` (fine rows, fine columns) are where the fine samples lie in the raw image, ``radial`` (rows,
    fine rows) mixes them along the radius, and ``transfer`` (rows, columns // 2 + 1) is the circular filter.
    """

    u_px: NDArray[np.float32]
    v_px: NDArray[np.float32]
    radial: csr_array
    transfer: NDArray[np.float32]
    columns: int


def scale_factors(
    inner: ViewImage, outer: ViewImage, slopes_inner: Floats, slopes_outer: Floats | None = None
) -> tuple[ScaleFactors, ScaleFactors]:
    """Equation (10): the inner view's factors, then the outer one's.

    Parameters
    ----------
    slopes_inner, slopes_outer
        tan(phi) of the corresponding projections in the two views. The paper takes the same elevation in both, which
        is exact at infinity and the default; near the sensor the two differ by parallax.
    """
    slopes_outer = slopes_inner if slopes_outer is None else slopes_outer
    steepness_inner = np.abs(inner.radius_per_elevation_px(slopes_inner))
    steepness_outer = np.abs(outer.radius_per_elevation_px(slopes_outer))
    ratio = steepness_inner / steepness_outer
    circular = np.abs(outer.radius_px(slopes_outer) / inner.radius_px(slopes_inner))
    return (
        ScaleFactors(np.maximum(1.0, ratio), np.ones_like(ratio)),
        ScaleFactors(np.maximum(1.0, 1.0 / ratio), np.maximum(1.0, circular)),
    )


def factors_of_rows(
    grid: PanoramaGrid, images: dict[ViewName, ViewImage], inner: ViewName, reference_distance_mm: float
) -> dict[ViewName, ScaleFactors]:
    """Equation (10) for the rows of both panoramas, by view.

    Each row is compared with where the other view sees the same point at the reference distance; infinity compares
    equal elevations, as the paper does.
    """
    outer: ViewName = "lower" if inner == "upper" else "upper"
    parallax = (images["upper"].viewpoint_mm - images["lower"].viewpoint_mm) / reference_distance_mm
    to_outer = -parallax if inner == "lower" else parallax
    rows = np.arange(grid.rows)
    slopes_inner, slopes_outer = grid.slope(inner, rows), grid.slope(outer, rows)
    of_inner, _ = scale_factors(images[inner], images[outer], slopes_inner, slopes_inner + to_outer)
    _, of_outer = scale_factors(images[inner], images[outer], slopes_outer - to_outer, slopes_outer)
    return {inner: of_inner, outer: of_outer}


def reference_sigma_px(
    grid: PanoramaGrid, images: dict[ViewName, ViewImage], factors: dict[ViewName, ScaleFactors]
) -> float:
    """The least sigma (raw pixels) that prevents aliasing of the pixels and of the panorama's samples, where imaged."""
    widest = 1.0
    for view, image in images.items():
        imaged = imaged_rows(grid, image, view)
        radial, circular = _spacings_px(grid, image, view)
        for spacing, factor in ((radial, factors[view].radial), (circular, factors[view].circular)):
            widest = float(np.max(spacing[imaged] / factor[imaged], initial=widest))
    return ANTI_ALIASING_SAMPLES * widest


def fine_samples(grid: PanoramaGrid, image: ViewImage, view: ViewName) -> tuple[int, int]:
    """How many samples a row and a column of one view's panorama need, to be no coarser than the raw pixels.

    Rows that are not imaged need none, though there the raw pixels that would be may lie ever closer.
    """
    imaged = imaged_rows(grid, image, view)
    radial, circular = (np.ceil(np.max(px[imaged], initial=1.0)) for px in _spacings_px(grid, image, view))
    return int(radial), int(circular)


def build_equaliser(
    grid: PanoramaGrid, image: ViewImage, view: ViewName, factors: ScaleFactors, sigma_px: float
) -> Equaliser:
    """Build the tables of one view for scale factors and a reference sigma in raw pixels.

    Raises
    ------
    InputError
        They would sample the raw image at more than ``MOST_FINE_SAMPLES`` places, or ``LARGEST_SIDE`` along a side.
    """
    finer_rows, finer_columns = fine_samples(grid, image, view)
    # Fine samples lie on the coarse ones and between them, with one coarse row more at either end.
    height, width = (grid.rows + 1) * finer_rows + 1, grid.columns * finer_columns
    if height * width > MOST_FINE_SAMPLES or max(height, width) > LARGEST_SIDE:
        raise InputError(
            f"equalising the {view} view needs {width} x {height} samples; at most {MOST_FINE_SAMPLES / 1e6:g} million "
            f"and {LARGEST_SIDE} along a side: use --no-equalise, other --columns, or a narrower --elevation-deg"
        )
    rows, columns = np.arange(height) / finer_rows - 1.0, np.arange(width) / finer_columns
    u, v = image.pixel_of(grid.slope(view, rows)[:, None], grid.azimuth(columns)[None, :])
    radial_px, circular_px = _spacings_px(grid, image, view)
    imaged = imaged_rows(grid, image, view)
    variance_radial = _variances(imaged, factors.radial * sigma_px, radial_px / finer_rows)
    variance_circular = _variances(imaged, factors.circular * sigma_px, circular_px)
    frequencies = np.arange(grid.columns // 2 + 1) / grid.columns
    transfer = np.exp(-2.0 * np.pi**2 * variance_circular[:, None] * frequencies**2) / finer_columns
    centres = (np.arange(grid.rows) + 1) * finer_rows
    radial = _mixing(variance_radial, centres, len(rows))
    return Equaliser(u.astype(np.float32), v.astype(np.float32), radial, transfer.astype(np.float32), grid.columns)


def equalised_scan_lines(raw: Image, equaliser: Equaliser) -> Image:
    """Sample and smooth one view of a grey raw image; scan lines, (columns + 2 AZIMUTH_PADDING, rows)."""
    fine = cv2.remap(raw, equaliser.u_px, equaliser.v_px, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    mixed = equaliser.radial @ fine.astype(np.float32)
    spectrum = rfft(mixed, axis=1, workers=2)[:, : equaliser.transfer.shape[1]]
    smooth = irfft(spectrum * equaliser.transfer, n=equaliser.columns, axis=1, workers=2)
    lines = np.clip(np.rint(smooth), 0, 255).astype(np.uint8).T
    return np.concatenate([lines[-AZIMUTH_PADDING:], lines, lines[:AZIMUTH_PADDING]])


def _spacings_px(grid: PanoramaGrid, image: ViewImage, view: ViewName) -> tuple[Floats, Floats]:
    """Raw pixels from one row to the next and from one column to the next, at each row."""
    edges = np.abs(image.radius_px(grid.slope(view, np.arange(grid.rows + 1) - 0.5)))
    radii = np.abs(image.radius_px(grid.slope(view, np.arange(grid.rows))))
    return np.abs(np.diff(edges)), radii * (2.0 * np.pi / grid.columns)


def _variances(imaged: NDArray[np.bool_], sigma_px: Floats, spacing_px: Floats) -> Floats:
    """Variance in samples that smoothing adds at each row; rows not imaged take after the nearest one that is."""
    if not imaged.any():
        return np.zeros(len(imaged))
    added = np.maximum(sigma_px[imaged] ** 2 - BILINEAR_VARIANCE_PX2, 0.0) / spacing_px[imaged] ** 2
    return np.asarray(np.interp(np.arange(len(imaged)), np.flatnonzero(imaged), added))


def _mixing(variances: Floats, centres: NDArray[np.intp], count: int) -> csr_array:
    """Rows of discrete Gaussians (Lindeberg), of the given variances in samples, about the given samples.

    Cut off at four standard deviations, and at the first and last sample, and brought back to a sum of one.
    """
    reach = np.ceil(4.0 * np.sqrt(variances)).astype(int)
    weights, columns, starts = [], [], [0]
    for variance, centre, radius in zip(variances, centres, reach, strict=True):
        samples = np.arange(max(centre - radius, 0), min(centre + radius, count - 1) + 1)
        kernel = ive(np.abs(samples - centre), variance)
        weights.append(kernel / kernel.sum())
        columns.append(samples)
        starts.append(starts[-1] + len(samples))
    data = np.concatenate(weights).astype(np.float32)
    return csr_array((data, np.concatenate(columns), np.array(starts)), shape=(len(variances), count))
