"""Panoramas: the two views resampled so that corresponding points share a column (paper, section 5).

Columns are azimuths, cell centres, from +180 degrees on the left to -180 on the right: so the panorama reads as seen
from the sensor, not mirrored. Rows run downwards from the highest elevation, in equal steps of elevation (spherical)
or of height on a cylinder of radius 1 (cylindrical, tan(elevation)). Each view has its own highest row, since near
the sensor the two look at the same points in different directions; disparity takes the difference into account.

For matching, images are kept as scan lines: transposed, one azimuth a row, with the azimuths at either end repeated
beyond the other (``AZIMUTH_PADDING`` of them), so that row-wise code sees neither a seam nor a border.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import VIEW_NAMES, Design, ViewName
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.placement import Floats, Placement, ViewImage, view_image

Sampling = Literal["spherical", "cylindrical"]

DEFAULT_COLUMNS = 1800
# Half of the widest matching window, in columns.
AZIMUTH_PADDING = 16
# OpenCV samples no wider and no higher arrays.
LARGEST_SIDE = 32766
# Tables, matches and points take some 400 bytes for each pixel of a panorama.
MOST_PIXELS = 10_000_000


@dataclass(frozen=True, slots=True)
class PanoramaGrid:
    """The directions of a pair of panoramas of ``rows`` x ``columns`` pixels.

    ``step`` is the height of a row: radians of elevation (spherical) or of slope (cylindrical). ``top_upper`` and
    ``top_lower`` are the upper edge of row 0 of each view in the same unit.
    """

    sampling: Sampling
    columns: int
    rows: int
    step: float
    top_upper: float
    top_lower: float

    def top(self, view: ViewName) -> float:
        """Upper edge of row 0 of a view."""
        return self.top_upper if view == "upper" else self.top_lower

    def azimuth(self, column: ArrayLike) -> Floats:
        """Azimuth (rad) at a column; whole columns are cell centres, and columns outside 0..columns-1 wrap."""
        return np.pi - (np.asarray(column, dtype=float) + 0.5) * (2.0 * np.pi / self.columns)

    def column(self, azimuth: ArrayLike) -> Floats:
        """Column of an azimuth, from -0.5 up to columns - 0.5."""
        turns = (np.pi - np.asarray(azimuth, dtype=float)) / (2.0 * np.pi)
        return np.asarray(np.remainder(turns, 1.0) * self.columns - 0.5)

    def slope(self, view: ViewName, row: ArrayLike) -> Floats:
        """tan(elevation) seen by a view at a row; whole rows are cell centres."""
        coordinate = self.top(view) - (np.asarray(row, dtype=float) + 0.5) * self.step
        return np.tan(coordinate) if self.sampling == "spherical" else coordinate

    def row(self, view: ViewName, slope: ArrayLike) -> Floats:
        """Row at which a view sees a slope; inverse of :meth:`slope`."""
        slope = np.asarray(slope, dtype=float)
        coordinate = np.arctan(slope) if self.sampling == "spherical" else slope
        return np.asarray((self.top(view) - coordinate) / self.step - 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class LookUp:
    """Where the scan lines of one view lie in the raw image, and which of their samples are imaged.

    ``u_px`` and ``v_px`` have shape (columns + 2 AZIMUTH_PADDING, rows), ``imaged`` has shape (columns, rows).
    """

    u_px: NDArray[np.float32]
    v_px: NDArray[np.float32]
    imaged: NDArray[np.bool_]


def panorama_grid(
    design: Design,
    sampling: Sampling = "spherical",
    columns: int = DEFAULT_COLUMNS,
    elevation_deg: tuple[float, float] | None = None,
) -> PanoramaGrid:
    """The grid that covers what a design's views were asked to see, with rows as fine as its columns.

    Parameters
    ----------
    elevation_deg
        Lowest and highest elevation of both panoramas, instead of each view's own range. The paper's panoramas of
        1800 x 160 pixels are (-16, 16).

    Raises
    ------
    InputError
        Neither view sees those elevations, or the panoramas would have more than ``MOST_PIXELS`` pixels or
        ``LARGEST_SIDE`` on a side.
    """
    asked_of_views = {"upper": design.views.upper.elevation_deg, "lower": design.views.lower.elevation_deg}
    ranges = asked_of_views
    if elevation_deg is not None:
        ranges = dict.fromkeys(VIEW_NAMES, elevation_deg)
        low, high = elevation_deg
        if not any(low < seen_high and high > seen_low for seen_low, seen_high in asked_of_views.values()):
            seen = ", ".join(f"the {view} one {ends[0]:.1f} to {ends[1]:.1f}" for view, ends in asked_of_views.items())
            raise InputError(f"--elevation-deg {low:g} {high:g}: no view sees any of it; {seen} degrees")
    step = 2.0 * np.pi / columns
    edges = {name: np.radians(limits) for name, limits in ranges.items()}
    if sampling == "cylindrical":
        edges = {name: np.tan(limits) for name, limits in edges.items()}
    rows = max(int(np.ceil((high - low) / step - 1e-6)) for low, high in edges.values())
    if rows * columns > MOST_PIXELS or max(rows, columns + 2 * AZIMUTH_PADDING) > LARGEST_SIDE:
        raise InputError(
            f"--columns {columns}: panoramas of {columns} x {rows} pixels; at most {MOST_PIXELS / 1e6:g} million and "
            f"{LARGEST_SIDE} on a side: use fewer columns, or a narrower --elevation-deg"
        )
    return PanoramaGrid(sampling, columns, rows, step, float(edges["upper"][1]), float(edges["lower"][1]))


def view_images(design: Design, placement: Placement | None = None) -> dict[ViewName, ViewImage]:
    """Both views' images on the sensor, by name."""
    return {name: view_image(design, name, placement) for name in VIEW_NAMES}


def imaged_rows(grid: PanoramaGrid, image: ViewImage, view: ViewName) -> NDArray[np.bool_]:
    """Which rows of a view's panorama are imaged at some azimuth, (rows,)."""
    slopes = grid.slope(view, np.arange(grid.rows))[:, None]
    return np.asarray(image.is_imaged(slopes, grid.azimuth(np.arange(grid.columns))).any(axis=1))


def look_up(grid: PanoramaGrid, image: ViewImage, view: ViewName) -> LookUp:
    """Build the table of one view; a view of negative gain is turned by 180 degrees by its signed image radius."""
    padded = np.arange(-AZIMUTH_PADDING, grid.columns + AZIMUTH_PADDING)
    azimuths = grid.azimuth(padded)[:, None]
    slopes = grid.slope(view, np.arange(grid.rows))[None, :]
    u, v = image.pixel_of(slopes, azimuths)
    imaged = image.is_imaged(slopes, azimuths)[AZIMUTH_PADDING:-AZIMUTH_PADDING]
    return LookUp(u.astype(np.float32), v.astype(np.float32), imaged)


def scan_lines(raw: Image, table: LookUp) -> Image:
    """Sample the scan lines of one view bilinearly; shape (columns + 2 AZIMUTH_PADDING, rows[, channels])."""
    lines = cv2.remap(raw, table.u_px, table.v_px, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(lines, dtype=np.uint8)


def panorama_of(lines: Image) -> Image:
    """The panorama, (rows, columns[, channels]), of padded scan lines."""
    inner = lines[AZIMUTH_PADDING:-AZIMUTH_PADDING]
    return np.ascontiguousarray(np.swapaxes(inner, 0, 1))
