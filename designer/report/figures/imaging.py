"""From raw image to reconstruction, drawn: kernels, panoramas, disparities, views of the cloud (figures 5, 8 to 12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from designer.design import VIEW_NAMES
from designer.imaging.endtoend.equalisation_experiment import EqualisationComparison
from designer.imaging.images import Image
from designer.imaging.stereo.cloud import FloorPlan, view_of_cloud
from designer.imaging.stereo.equalisation import factors_of_rows
from designer.imaging.stereo.matching import Matches, MatchOutcome
from designer.imaging.stereo.panorama import AZIMUTH_PADDING, PanoramaGrid
from designer.imaging.stereo.reconstruction import PointCloud
from designer.imaging.stereo.rig import StereoRig
from designer.report.figures.equalisation import METHOD_NAMES
from designer.report.figures.style import VIEW_COLOUR, new_figure

KERNELS_ENLARGED = 12.0
"""How many times too large kernels are drawn: true ones are hardly a pixel wide."""


def draw_raw(raw: Image, width_mm: float) -> Figure:
    """Draw a raw image, grey or red, green and blue, by itself (figure 8)."""
    height, width = raw.shape[:2]
    figure = new_figure(width_mm, width_mm * height / width)
    axes = figure.add_subplot()
    axes.imshow(raw, cmap="gray", vmin=0, vmax=255)
    axes.set_axis_off()
    return figure


def draw_kernels(rig: StereoRig, raw: Image, width_mm: float) -> Figure:
    """Draw a raw image and, enlarged, one standard deviation of the equalising kernels in both views (figure 5).

    Raises
    ------
    ValueError
        The rig does not equalise.
    """
    if rig.sigma_px is None:
        raise ValueError("the rig uses bilinear sampling: there are no kernels to draw")
    figure = draw_raw(raw, width_mm)
    (axes,) = figure.axes
    near, far = rig.design.working_volume.distance_mm
    inner = rig.design.views.inner
    factors = factors_of_rows(rig.grid, rig.images, inner, 2.0 / (1.0 / near + 1.0 / far))
    for view in VIEW_NAMES:
        for row in np.linspace(0.12, 0.88, 3) * (rig.grid.rows - 1):
            slope = float(rig.grid.slope(view, row))
            for azimuth in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
                u, v = rig.images[view].pixel_of(slope, azimuth)
                size = 2.0 * KERNELS_ENLARGED * rig.sigma_px
                radial, circular = (getattr(factors[view], way)[round(row)] * size for way in ("radial", "circular"))
                turn = float(np.degrees(azimuth))
                axes.add_patch(
                    Ellipse(
                        (float(u), float(v)), radial, circular, angle=turn, fill=False, color=VIEW_COLOUR[view], lw=1.0
                    )
                )
    return figure


def draw_panoramas(grid: PanoramaGrid, pictures: Mapping[str, Image], width_mm: float) -> Figure:
    """Draw pictures over the whole circle, (rows, columns) grey or with colours, one under another (figures 5, 9)."""
    tall = width_mm * grid.rows / grid.columns
    figure = new_figure(width_mm, len(pictures) * (tall + 7.0))
    for axes, (title, picture) in zip(np.atleast_1d(figure.subplots(len(pictures))), pictures.items(), strict=True):
        axes.imshow(picture, cmap="gray", vmin=0, vmax=255, aspect="auto", interpolation="none")
        axes.set_title(title, loc="left", pad=2.0)
        axes.set_axis_off()
    return figure


def disparity_colours(matches: Matches) -> Image:
    """Disparities as colours, (rows, columns, 3): near is bright, dropped is black."""
    disparity = matches.disparities.T
    known = np.isfinite(disparity)
    low, high = np.percentile(disparity[known], (0.5, 99.5)) if known.any() else (0.0, 1.0)
    share = np.clip((np.where(known, disparity, low) - low) / max(float(high - low), 1e-6), 0.0, 1.0)
    colours = np.asarray(255.0 * colormaps["viridis"](share)[..., :3], dtype=np.uint8)
    colours[~known] = 0
    return colours


def draw_comparison(compared: EqualisationComparison, columns: slice, width_mm: float) -> Figure:
    """Draw a stretch of azimuths, and what reverse verification rejected there in black (figure 10).

    Top: disparities; middle: the upper panorama; bottom: the lower one. Titles count the whole panorama.
    """
    figure = new_figure(width_mm, 0.6 * width_mm)
    grid = figure.subplots(3, len(compared.matches))
    everywhere = next(iter(compared.matches.values())).outcomes.size
    for place, (method, matches) in enumerate(compared.matches.items()):
        rejected = 100.0 * compared.rejected[method] / everywhere
        colours = disparity_colours(matches)
        # Only what reverse verification rejected stays black; what was dropped otherwise is grey.
        colours[(matches.outcomes.T != MatchOutcome.REVERSE_CHECK) & ~np.isfinite(matches.disparities.T)] = 150
        inner = slice(columns.start + AZIMUTH_PADDING, columns.stop + AZIMUTH_PADDING)
        pictures = (colours[:, columns], compared.upper[method][inner].T, compared.lower[method][inner].T)
        for axes, picture in zip(grid[:, place], pictures, strict=True):
            axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="none")
            axes.set_axis_off()
        grid[0, place].set_title(f"{METHOD_NAMES[method]}: {rejected:.2f} % rejected")
    return figure


def draw_views_of_cloud(
    cloud: PointCloud, middle_mm: float, azimuth_deg: float, elevations_deg: Sequence[float], width_mm: float
) -> Figure:
    """Draw the point cloud seen from several directions (figure 11).

    The eye goes round a point three quarters of the median distance ahead, and looks at it from each elevation.
    """
    x, y, _ = cloud.positions_mm.T
    reach = 0.75 * float(np.median(np.hypot(x, y)))
    azimuth = np.radians(azimuth_deg)
    rows = -(-len(elevations_deg) // 3)
    figure = new_figure(width_mm, 0.25 * width_mm * rows)
    panels = np.atleast_1d(figure.subplots(rows, 3)).ravel()
    for axes in panels:
        axes.set_axis_off()
    for axes, elevation in zip(panels, elevations_deg, strict=False):
        angle = np.radians(elevation)
        back = reach * (1.0 - np.cos(angle))
        eye = (back * np.cos(azimuth), back * np.sin(azimuth), middle_mm + reach * np.sin(angle))
        # Seen from above, the eye looks down.
        axes.imshow(view_of_cloud(cloud, eye, azimuth_deg, -elevation, field_deg=75.0, size_px=(800, 520), point_px=4))
        axes.set_title(f"{elevation:+g}°".replace("-", "−") if elevation else "0°")
    return figure


def draw_plan(plan: FloorPlan, width_mm: float) -> Figure:
    """Draw a floor plan in metres (figure 12)."""
    figure = new_figure(width_mm, width_mm)
    axes = figure.add_subplot()
    reach = plan.extent_mm / 1000.0
    axes.imshow(plan.picture(), cmap="gray", extent=(-reach, reach, -reach, reach), interpolation="none")
    axes.set_xlabel("$X$ (m)")
    axes.set_ylabel("$Y$ (m)")
    return figure
