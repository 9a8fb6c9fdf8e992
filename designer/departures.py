"""What a built sensor departs from its design by: the optional table ``as_built`` of a design file.

Frame of the design: pinhole at the origin, optical axis +z. A tilted part is turned by ``tilt_x_deg`` about the x axis,
then by ``tilt_y_deg`` about the y axis (right-handed, axes that do not turn with it), a mirror about its vertex and the
camera about its pinhole; then it is shifted.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, Strict

# Strict: neither "0.1" nor true is a number.
Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Shift = Annotated[Number, Field(ge=-50.0, le=50.0)]
ImageShift = Annotated[Number, Field(ge=-10_000.0, le=10_000.0)]
Tilt = Annotated[Number, Field(ge=-20.0, le=20.0)]


class Departure(BaseModel):
    """Immutable, and strict about keys: a misspelt one would else be a departure that nobody counts."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class MirrorDeparture(Departure):
    """Where one mirror sits instead of its nominal place, and how its surface departs.

    The surface has the radius ``radius_mm + radius_departure_mm`` and the conic constant
    ``conic + conic_departure``; a plane has the curvature ``curvature_per_m``, positive when the centre of curvature
    lies above it.
    """

    decentre_x_mm: Shift = 0.0
    decentre_y_mm: Shift = 0.0
    tilt_x_deg: Tilt = 0.0
    tilt_y_deg: Tilt = 0.0
    axial_shift_mm: Shift = 0.0
    radius_departure_mm: Annotated[Number, Field(ge=-10_000.0, le=10_000.0)] = 0.0
    conic_departure: Annotated[Number, Field(ge=-10.0, le=10.0)] = 0.0
    curvature_per_m: Annotated[Number, Field(ge=-1000.0, le=1000.0)] = 0.0


class CameraDeparture(Departure):
    """Where the camera's pinhole sits, how the camera is turned about it, and how its lens images.

    What the lens would image at the radius r, with the design's principal distance plus
    ``principal_distance_departure_mm`` for f, is imaged at r (1 + k (r/f)^2), with k the ``radial_distortion``. On the
    chip the whole image then lies ``image_shift_x_px`` to the right and ``image_shift_y_px`` further down.
    """

    shift_x_mm: Shift = 0.0
    shift_y_mm: Shift = 0.0
    axial_shift_mm: Shift = 0.0
    tilt_x_deg: Tilt = 0.0
    tilt_y_deg: Tilt = 0.0
    principal_distance_departure_mm: Annotated[Number, Field(ge=-1000.0, le=1000.0)] = 0.0
    radial_distortion: Annotated[Number, Field(ge=-1.0, le=1.0)] = 0.0
    image_shift_x_px: ImageShift = 0.0
    image_shift_y_px: ImageShift = 0.0


class AsBuilt(Departure):
    """All departures of one sensor; a part that is not named is as designed."""

    mirrors: dict[str, MirrorDeparture] = {}
    camera: CameraDeparture = CameraDeparture()
