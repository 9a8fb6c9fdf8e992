"""Penumbrae on the sensor: how softly the rims of the mirrors end the image zones, and where the two views mix.

A lens of pupil diameter p that is focused at the distance u sees an edge at the height z out of focus: on the sensor
its shadow runs from full light to none over the width p f |1/u - 1/z|, stretched along the radius by a lens that is not
perspective. Lengths in mm, image radii in pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from designer.design import VIEW_NAMES, Design, Mirror, ViewName
from designer.evaluate.fabrication import surface_of
from designer.optics.focus import lens_of_camera
from designer.optics.image_law import PERSPECTIVE, image_law_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Rim:
    """Image of a mirror's rim: its radius and the width of its penumbra, and the rim's height above the pinhole."""

    radius_px: float
    width_px: float
    height_mm: float

    @property
    def inner_px(self) -> float:
        """Radius at which the penumbra begins."""
        return self.radius_px - self.width_px / 2.0

    @property
    def outer_px(self) -> float:
        """Radius at which the penumbra ends."""
        return self.radius_px + self.width_px / 2.0


@dataclass(frozen=True, slots=True)
class ZoneRims:
    """The inner and the outer rim of the first mirror on a view's path, as imaged; no inner rim without a hole."""

    inner: Rim | None
    outer: Rim


def penumbra_px(design: Design, edge_height_mm: float) -> float:
    """Width in pixels of the penumbra of an edge at a height above the pinhole: p f |1/u - 1/z|, in perspective."""
    return abs(float(lens_of_camera(design.camera).blur(1.0 / edge_height_mm))) / design.camera.pixel_pitch_mm


def zone_rims(design: Design) -> dict[ViewName, ZoneRims]:
    """Imaged rims of the first mirror of each view: the face alone, whatever stands in front of it."""
    return {name: _rims_of(design, design.mirror(design.views.by_name[name].path[0])) for name in VIEW_NAMES}


def mixing_band_px(design: Design) -> tuple[float, float] | None:
    """Image radii between which light of both views arrives; None if no point of the sensor receives both.

    The inner zone ends, and the outer one begins, in the penumbra of the rim that is nearer to the lens: that of the
    inner zone's mirror, or of the hole in the outer zone's. The other rim may narrow the band.
    """
    rims = zone_rims(design)
    ends, begins = rims[design.views.inner].outer, rims[design.views.outer].inner
    if begins is None:
        return None
    # The nearer mirror hides the farther one's rim, and reveals it over its own penumbra.
    if ends.height_mm < begins.height_mm:
        low, high = max(begins.inner_px, ends.inner_px), ends.outer_px
    else:
        low, high = begins.inner_px, min(ends.outer_px, begins.outer_px)
    return (low, high) if low < high else None


def share_of_pupil(radius_px: ArrayLike, rim: Rim) -> Array:
    """Share of the pupil's light that passes outside a rim, at image radii in pixels: 0 inside, 1 outside.

    The rim is taken as straight: the share is the area of a segment of a disc.
    """
    radius = np.asarray(radius_px, dtype=float)
    if rim.width_px == 0.0:
        return np.asarray((radius > rim.radius_px).astype(float))
    offset = np.clip(2.0 * (radius - rim.radius_px) / rim.width_px, -1.0, 1.0)
    return np.asarray(0.5 + (np.arcsin(offset) + offset * np.sqrt(1.0 - offset**2)) / np.pi)


def _rims_of(design: Design, mirror: Mirror) -> ZoneRims:
    inner = _rim(design, mirror, mirror.inner_radius_mm) if mirror.inner_radius_mm > 0.0 else None
    return ZoneRims(inner, _rim(design, mirror, mirror.outer_radius_mm))


def _rim(design: Design, mirror: Mirror, radius_mm: float) -> Rim:
    camera = design.camera
    height = float(surface_of(mirror).height(radius_mm))
    law = image_law_of(camera)
    if law.is_perspective:
        imaged = camera.focal_length_mm * radius_mm / height / camera.pixel_pitch_mm
        return Rim(imaged, penumbra_px(design, height), height)
    half_tangent = PERSPECTIVE.half_tangent(radius_mm / height)
    imaged = camera.focal_length_mm * float(law.ratio(half_tangent)) / camera.pixel_pitch_mm
    return Rim(imaged, penumbra_px(design, height) * abs(float(law.stretch(half_tangent)[0])), height)
