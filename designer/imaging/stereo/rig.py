"""A design as a stereo rig: tables built once, then raw images to panoramas, matches and points."""

from __future__ import annotations

from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import VIEW_NAMES, Design, PerView, ViewName
from designer.files import InputError
from designer.imaging.images import Image
from designer.imaging.stereo.equalisation import (
    Equaliser,
    build_equaliser,
    equalised_scan_lines,
    factors_of_rows,
    reference_sigma_px,
)
from designer.imaging.stereo.illumination import Floats, brightened, brightening
from designer.imaging.stereo.matching import DEFAULT_OPTIONS, Matches, MatchingOptions, SearchRange, match, search_range
from designer.imaging.stereo.panorama import (
    DEFAULT_COLUMNS,
    LookUp,
    PanoramaGrid,
    Sampling,
    look_up,
    panorama_grid,
    panorama_of,
    scan_lines,
    view_images,
)
from designer.imaging.stereo.placement import Placement, ViewImage
from designer.imaging.stereo.reconstruction import PointCloud, matched_slopes, reconstruct, triangulate
from designer.imaging.stereo.traced_view import TracedViewImage, midpoints, traced_views
from designer.optics.tube import wall_of

# How far beyond the working volume, as a factor of distance, a match is still believed.
RANGE_MARGIN = 1.1


@dataclass(frozen=True, slots=True, eq=False)
class StereoRig:
    """Everything about a design that processing an image needs, built once by :func:`build_rig`.

    ``imaged`` is None where every sample of both panoramas is imaged, else which ones are in each.
    ``equalisers`` is None for plain bilinear sampling; ``sigma_px`` is then None too. ``brightening`` holds a factor
    for each row of both panoramas, (rows,); None leaves them as bright as they were recorded.
    """

    design: Design
    grid: PanoramaGrid
    images: dict[ViewName, ViewImage]
    tables: dict[ViewName, LookUp]
    search: SearchRange
    imaged: PerView[NDArray[np.bool_]] | None
    equalisers: dict[ViewName, Equaliser] | None
    sigma_px: float | None
    brightening: dict[ViewName, Floats] | None = None

    @property
    def is_traced(self) -> bool:
        """Whether the tables are those of a built sensor."""
        return isinstance(self.images["upper"], TracedViewImage)


def build_rig(
    design: Design,
    sampling: Sampling = "spherical",
    columns: int = DEFAULT_COLUMNS,
    elevation_deg: tuple[float, float] | None = None,
    placement: Placement | None = None,
    distances_mm: tuple[float, float] | None = None,
    equalise: bool = False,
    sigma_px: float | None = None,
    reference_distance_mm: float | None = None,
    mirror_reflectivity: float | None = None,
    as_built: bool = False,
) -> StereoRig:
    """Build the tables of a design.

    Parameters
    ----------
    sampling, columns, elevation_deg
        The panoramas' grid: see :func:`designer.imaging.stereo.panorama.panorama_grid`.
    placement
        How the real camera's image lies, or that of each view; as designed by default.
    distances_mm
        Nearest and farthest distance to look for; the working volume's, with a tenth more at either end, by default.
    equalise
        Whether to equalise the resolution of the two views (equation (10)).
    sigma_px, reference_distance_mm
        The reference sigma (raw pixels) and the distance at which the two views are compared for equalisation. By
        default the least sigma without aliasing, and the middle of the working volume in disparity; infinity
        compares equal elevations, as the paper does.
    mirror_reflectivity
        Brighten the panoramas by what mirrors of this reflectivity and the rim of the lens take away; by default they
        stay as bright as they were recorded.
    as_built
        Trace the sensor that the design's ``as_built`` table describes, which also says where the image lies; without
        it the tables are the design's own.

    Raises
    ------
    InputError
        Neither view images any of the panorama, the tables would take more memory than they may, or a view of the built
        sensor is blind.
    """
    near, far = design.working_volume.distance_mm
    grid = panorama_grid(design, sampling, columns, elevation_deg)
    images = traced_views(design) if as_built else view_images(design, placement)
    nearest, farthest = distances_mm or (near / RANGE_MARGIN, far * RANGE_MARGIN)
    if design.tube is not None:
        # Before correction, points come out nearer by less than the wall is thick.
        nearest = max(nearest - design.tube.wall_mm, nearest / 2.0)
    search = search_range(grid, design.baseline_mm, (nearest, farthest))
    tables = {view: look_up(grid, images[view], view) for view in VIEW_NAMES}
    imaged = PerView(upper=tables["upper"].imaged, lower=tables["lower"].imaged)
    if not (imaged.upper.any() or imaged.lower.any()):
        raise InputError(
            "neither view's image falls on the sensor: check --center (or --placement), --scale and --elevation-deg"
        )
    equalisers = None
    if equalise:
        inner = design.views.inner
        widths = factors_of_rows(grid, images, inner, reference_distance_mm or 2.0 / (1.0 / near + 1.0 / far))
        sigma_px = sigma_px or reference_sigma_px(grid, images, widths)
        equalisers = {view: build_equaliser(grid, images[view], view, widths[view], sigma_px) for view in VIEW_NAMES}
    partly = None if imaged.upper.all() and imaged.lower.all() else imaged
    factors = None if mirror_reflectivity is None else brightening(design, grid, images, mirror_reflectivity)
    return StereoRig(design, grid, images, tables, search, partly, equalisers, sigma_px if equalise else None, factors)


def sample(rig: StereoRig, raw: Image) -> dict[ViewName, Image]:
    """Scan lines of both views of a grey or colour raw image, equalised and brightened if the rig is built so."""
    lines = _sample(rig, raw)
    if rig.brightening is None:
        return lines
    return {view: brightened(lines[view], factors) for view, factors in rig.brightening.items()}


def _sample(rig: StereoRig, raw: Image) -> dict[ViewName, Image]:
    if rig.equalisers is None:
        return {view: scan_lines(raw, table) for view, table in rig.tables.items()}
    equalisers = rig.equalisers
    if raw.ndim == 2:
        return {view: equalised_scan_lines(raw, equaliser) for view, equaliser in equalisers.items()}
    channels = [np.ascontiguousarray(raw[..., channel]) for channel in range(raw.shape[-1])]
    return {
        view: np.stack([equalised_scan_lines(channel, equaliser) for channel in channels], axis=-1)
        for view, equaliser in equalisers.items()
    }


def in_grey(raw: Image) -> Image:
    """A raw image as grey, (height, width)."""
    return raw if raw.ndim == 2 else np.asarray(cv2.cvtColor(raw, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def panoramas(rig: StereoRig, raw: Image) -> dict[ViewName, Image]:
    """Both panoramas, (rows, columns[, 3]), of a raw image."""
    return {view: panorama_of(lines) for view, lines in sample(rig, raw).items()}


def match_image(rig: StereoRig, raw: Image, options: MatchingOptions = DEFAULT_OPTIONS) -> Matches:
    """Disparities, distances and outcomes of a raw image; colour is matched in grey."""
    lines = sample(rig, in_grey(raw))
    matches = match(rig.grid, rig.search, lines["upper"], lines["lower"], rig.imaged, options)
    if rig.is_traced or rig.design.tube is not None:
        columns, rows = np.nonzero(np.isfinite(matches.distances_mm))
        matches.distances_mm[columns, rows] = _distances_of(rig, matches.disparities, columns, rows)
    return matches


def _distances_of(
    rig: StereoRig, disparities: NDArray[np.float32], columns: NDArray[np.intp], rows: NDArray[np.intp]
) -> Floats:
    """Distances (n,) in mm of pixels of the upper panorama, where disparity and baseline alone do not give them."""
    if rig.is_traced:
        return np.asarray(np.hypot(*points_of(rig, disparities, columns, rows)[:, :2].T))
    slopes = matched_slopes(rig.grid, disparities, columns, rows)
    return triangulate(slopes, 0.0, rig.design.baseline_mm, wall_of(rig.design))[0]


def points_of(
    rig: StereoRig, disparities: NDArray[np.float32], columns: NDArray[np.intp], rows: NDArray[np.intp]
) -> Floats:
    """Where the traced rays behind pixels (n,) of the upper panorama and behind their matches meet: (n, 3) in mm."""
    slopes = matched_slopes(rig.grid, disparities, columns, rows)
    return midpoints(rig.images, slopes, rig.grid.azimuth(columns))


def point_cloud(
    rig: StereoRig, raw: Image, matches: Matches, noise_px: float | None = None, colours: Image | None = None
) -> PointCloud:
    """The point cloud of matches, coloured by the upper panorama of the raw image, equalised if the rig is.

    Parameters
    ----------
    noise_px
        Standard deviation of a coordinate in the raw image; the design's own by default.
    colours
        The upper one of the rig's :func:`panoramas` of the raw image, if it is there already.
    """
    if colours is None:
        colours = panoramas(rig, raw)["upper"]
    cloud = reconstruct(rig.design, rig.grid, matches.disparities, colours, noise_px)
    if not rig.is_traced:
        return cloud
    points = points_of(rig, matches.disparities, cloud.columns, cloud.rows)
    met = np.isfinite(points).all(axis=1)
    every = {each.name: getattr(cloud, each.name)[met] for each in fields(cloud)}
    return PointCloud(**{**every, "positions_mm": points[met]})
