"""The image of a view of a built sensor, traced: where the directions of the design really lie, and the rays behind.

A built sensor has no single viewpoint, so a direction alone has no image. Here the direction (slope, azimuth) stands
for the point at a reference distance that the design's viewpoint sees in it: the pixel is where the built sensor images
that point, so that the two views of what stands there share a column and have the design's disparity. Of what stands
nearer or farther the columns differ by the displacement of the viewpoints times the difference of the inverse
distances, a few hundredths of a pixel. Distances are not read off the disparity: they are where the two traced rays
pass nearest to each other.

Departures are smooth, so a coarse grid of traced points and cubic splines give them between.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RectBivariateSpline

from designer.as_built.built import refuse_unbuildable
from designer.as_built.parameters import values_of
from designer.as_built.projection import linearise, project, targets_of
from designer.departures import AsBuilt
from designer.design import VIEW_NAMES, Design, PerView, ViewName
from designer.files import InputError
from designer.imaging.stereo.placement import Floats, ViewImage, view_image

AZIMUTHS, ELEVATIONS = 72, 17
# Nodes repeated beyond either end of the circle, for the splines.
OVERLAP = 4
INVERSE_STEPS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Departed:
    """How a built view departs from its design, as splines of azimuth (rad) and elevation (rad).

    ``right_px`` and ``down_px`` are the displacements of the image; ``aside`` and ``steeper`` how far the rays through
    the points at ``reference_mm`` turn from the design's, to the left and upwards, per radial mm.
    """

    reference_mm: float
    elevations: tuple[float, float]
    right_px: RectBivariateSpline
    down_px: RectBivariateSpline
    aside: RectBivariateSpline
    steeper: RectBivariateSpline

    def at(self, spline: RectBivariateSpline, slope: Floats, azimuth: Floats) -> Floats:
        """A spline at directions, which broadcast; elevations beyond the view's range count as its ends."""
        turn = np.remainder(azimuth + np.pi, 2.0 * np.pi) - np.pi
        elevation = np.clip(np.arctan(slope), *self.elevations)
        # Tables have an azimuth for each column and a slope for each row, which splines evaluate far faster.
        if _is_table(slope, azimuth):
            columns, where_columns = np.unique(turn, return_inverse=True)
            rows, where_rows = np.unique(elevation, return_inverse=True)
            values = spline(columns, rows)[np.ix_(where_columns.ravel(), where_rows.ravel())]
            return np.asarray(values if azimuth.shape[0] == azimuth.size else values.T)
        across, up = np.broadcast_arrays(turn, elevation)
        return np.asarray(spline.ev(across, up))


@dataclass(frozen=True, slots=True, eq=False)
class TracedViewImage(ViewImage):
    """A view of a built sensor; ``placement`` is that of the design."""

    departed: Departed | None = None

    def pixel_of(self, slope: ArrayLike, azimuth: ArrayLike) -> tuple[Floats, Floats]:
        """Pixel (u, v) at which the built sensor images the point at the reference distance in a direction."""
        slope, azimuth = np.asarray(slope, dtype=float), np.asarray(azimuth, dtype=float)
        u, v = ViewImage.pixel_of(self, slope, azimuth)
        if self.departed is None:
            return u, v
        right, down = (
            self.departed.at(each, slope, azimuth) for each in (self.departed.right_px, self.departed.down_px)
        )
        return u + right, v + down

    def direction_of(self, u_px: ArrayLike, v_px: ArrayLike) -> tuple[Floats, Floats]:
        """Slope and azimuth of the point at the reference distance that is seen at a pixel."""
        u, v = np.asarray(u_px, dtype=float), np.asarray(v_px, dtype=float)
        slope, azimuth = ViewImage.direction_of(self, u, v)
        for _ in range(INVERSE_STEPS if self.departed is not None else 0):
            shown_u, shown_v = self.pixel_of(slope, azimuth)
            designed_u, designed_v = ViewImage.pixel_of(self, slope, azimuth)
            slope, azimuth = ViewImage.direction_of(self, designed_u + u - shown_u, designed_v + v - shown_v)
        return slope, azimuth

    def ray_of(self, slope: ArrayLike, azimuth: ArrayLike) -> tuple[Floats, Floats]:
        """A point (..., 3) in mm on the ray that is seen in a direction, and the ray's direction per radial mm."""
        slope, azimuth = np.broadcast_arrays(np.asarray(slope, dtype=float), np.asarray(azimuth, dtype=float))
        cosine, sine = np.cos(azimuth), np.sin(azimuth)
        aside = steeper = np.zeros_like(slope)
        reference = 1.0
        if self.departed is not None:
            reference = self.departed.reference_mm
            aside = self.departed.at(self.departed.aside, slope, azimuth)
            steeper = self.departed.at(self.departed.steeper, slope, azimuth)
        point = np.stack([reference * cosine, reference * sine, self.viewpoint_mm + reference * slope], axis=-1)
        return point, np.stack([cosine - aside * sine, sine + aside * cosine, slope + steeper], axis=-1)


def traced_views(design: Design) -> dict[ViewName, ViewImage]:
    """Both views of the sensor that a design's ``as_built`` table describes.

    Raises
    ------
    InputError
        A view is blind, in part of its elevations or in most of the working volume, or parts touch each other.
    """
    if design.tube is not None:
        raise InputError(
            "as_built: a built sensor behind the wall of a tube is not traced back from images: take the table housing "
            "or the table as_built out of the design file"
        )
    refuse_unbuildable(design)
    return {view: _traced_view(design, view) for view in VIEW_NAMES}


def midpoints(images: Mapping[ViewName, ViewImage], slopes: PerView[Floats], azimuth: Floats) -> NDArray[np.float64]:
    """The points (n, 3) in mm halfway between two traced rays where they are nearest; NaN where they part.

    Slopes and azimuth (n,) are those of the panoramas' rows and column.
    """
    start_u, ahead_u = _ray(images["upper"], slopes.upper, azimuth)
    start_l, ahead_l = _ray(images["lower"], slopes.lower, azimuth)
    offset = start_l - start_u
    uu, ll, ul = (
        np.einsum("...i,...i", *pair) for pair in ((ahead_u, ahead_u), (ahead_l, ahead_l), (ahead_u, ahead_l))
    )
    to_u, to_l = np.einsum("...i,...i", ahead_u, offset), np.einsum("...i,...i", ahead_l, offset)
    with np.errstate(all="ignore"):
        determinant = uu * ll - ul * ul
        along_u, along_l = (ll * to_u - ul * to_l) / determinant, (ul * to_u - uu * to_l) / determinant
        middle = (start_u + along_u[..., None] * ahead_u + start_l + along_l[..., None] * ahead_l) / 2.0
    # Behind the sensor, where a point cannot be, the radial part of a place points the other way.
    radial = middle[..., 0] * np.cos(azimuth) + middle[..., 1] * np.sin(azimuth)
    return np.where((radial > 0.0)[..., None], middle, np.nan)


def _is_table(slope: Floats, azimuth: Floats) -> bool:
    """Whether one varies along rows only and the other along columns only."""
    if not slope.ndim == azimuth.ndim == 2:
        return False
    return bool((slope.shape[0] == azimuth.shape[1] == 1) or (slope.shape[1] == azimuth.shape[0] == 1))


def _ray(image: ViewImage, slope: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
    if not isinstance(image, TracedViewImage):
        raise TypeError("only a traced view has rays of its own")
    return image.ray_of(slope, azimuth)


def _traced_view(design: Design, view: ViewName) -> TracedViewImage:
    plain = view_image(design, view)
    near, far = design.working_volume.distance_mm
    reference = 2.0 / (1.0 / near + 1.0 / far)
    low, high = np.arctan(plain.slopes)
    elevations = np.linspace(low, high, ELEVATIONS)
    step = 2.0 * np.pi / AZIMUTHS
    azimuths = -np.pi + step * np.arange(-OVERLAP, AZIMUTHS + OVERLAP + 1)
    slope, azimuth = np.tan(elevations)[None, :], azimuths[:, None]
    cosine, sine, rise = np.broadcast_arrays(np.cos(azimuth), np.sin(azimuth), plain.viewpoint_mm + reference * slope)
    points = np.column_stack([(reference * cosine).ravel(), (reference * sine).ravel(), rise.ravel()])
    targets = targets_of(design, view, points)
    as_designed = design.model_copy(update={"as_built": None})
    found = project(design, view, targets, values_of(design)[None], linearise(as_designed, view, targets))
    if not np.isfinite(found.pixels).all():
        raise InputError(
            f"as_built: the {view} view of this sensor does not show all elevations from {np.degrees(low):.1f} to "
            f"{np.degrees(high):.1f} degrees: the departures leave it blind there"
        )
    camera = (design.as_built or AsBuilt()).camera
    u0, v0 = design.camera.principal_point_px
    u, v = (part.reshape(cosine.shape) for part in found.pixels[:, 0])
    designed_u, designed_v = plain.pixel_of(slope, azimuth)
    ahead = found.ahead[:, 0].reshape(3, *cosine.shape)
    radial = ahead[0] * cosine + ahead[1] * sine
    aside, steeper = (ahead[1] * cosine - ahead[0] * sine) / radial, ahead[2] / radial - slope
    right_px, down_px = u + u0 + camera.image_shift_x_px - designed_u, v + v0 + camera.image_shift_y_px - designed_v
    splines = (RectBivariateSpline(azimuths, elevations, part) for part in (right_px, down_px, aside, steeper))
    departed = Departed(reference, (float(low), float(high)), *splines)
    return TracedViewImage(**{each.name: getattr(plain, each.name) for each in fields(plain)}, departed=departed)
