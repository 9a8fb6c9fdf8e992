"""The numbers that describe a built sensor, one after the other: a row of them for each of many sensors.

The order is that of the design's mirrors, then the camera. Units are those of the ``as_built`` table of a design file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from designer.as_built.dual import Array, Number, cosine, sine
from designer.as_built.tracing import PosedCamera, PosedMirror, Turn
from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import Design, Mirror
from designer.optics.image_law import image_law_of

CAMERA = "camera"
MIRROR_KEYS = ("decentre_x_mm", "decentre_y_mm", "tilt_x_deg", "tilt_y_deg", "axial_shift_mm")
CURVED_KEYS = ("radius_departure_mm", "conic_departure")
PLANE_KEYS = ("curvature_per_m",)
CAMERA_KEYS = (
    "shift_x_mm",
    "shift_y_mm",
    "axial_shift_mm",
    "tilt_x_deg",
    "tilt_y_deg",
    "principal_distance_departure_mm",
    "radial_distortion",
)
IMAGE_KEYS = ("image_shift_x_px", "image_shift_y_px")
"""Where the image lies on the chip: no part of the tolerances, since every calibration finds it exactly."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One departure of one part: ``part`` is a mirror's name or ``camera``, ``key`` that of the ``as_built`` table."""

    part: str
    key: str

    @property
    def unit(self) -> str:
        """Unit of the key's values; empty for a number without one."""
        for ending, unit in (("_mm", "mm"), ("_deg", "deg"), ("_per_m", "1/m"), ("_px", "px")):
            if self.key.endswith(ending):
                return unit
        return ""

    @property
    def name(self) -> str:
        """Part and key in words, without the unit."""
        words = self.key
        for ending in ("_mm", "_deg", "_per_m", "_px"):
            words = words.removesuffix(ending)
        return f"{self.part} {words.replace('_', ' ')}"


def parameters_of(design: Design) -> tuple[Parameter, ...]:
    """All departures that a sensor of a design can have."""
    found = []
    for mirror in design.mirrors:
        surface = PLANE_KEYS if mirror.radius_mm is None else CURVED_KEYS
        found += [Parameter(mirror.name, key) for key in (*MIRROR_KEYS, *surface)]
    return (*found, *(Parameter(CAMERA, key) for key in CAMERA_KEYS))


def values_of(design: Design, as_built: AsBuilt | None = None) -> Array:
    """The departures (parameters,) of one sensor: of a record, or of the design's own; zero where there is none."""
    record = as_built or design.as_built or AsBuilt()
    parts: dict[str, Any] = {**record.mirrors, CAMERA: record.camera}
    return np.array(
        [
            getattr(parts[parameter.part], parameter.key) if parameter.part in parts else 0.0
            for parameter in parameters_of(design)
        ]
    )


def as_built_record(design: Design, values: ArrayLike) -> AsBuilt:
    """The record of one sensor's departures (parameters,)."""
    parts: dict[str, dict[str, float]] = {}
    for parameter, value in zip(parameters_of(design), np.asarray(values, dtype=float), strict=True):
        if value:
            parts.setdefault(parameter.part, {})[parameter.key] = float(value)
    camera = CameraDeparture.model_validate(parts.pop(CAMERA, {}))
    return AsBuilt(mirrors={name: MirrorDeparture.model_validate(part) for name, part in parts.items()}, camera=camera)


@dataclass(frozen=True, slots=True)
class Systems:
    """Many built sensors of one design, as rays meet them."""

    mirrors: dict[str, PosedMirror]
    camera: PosedCamera

    def along(self, path: Sequence[str]) -> list[PosedMirror]:
        """The mirrors of a path of names, in its order."""
        return [self.mirrors[name] for name in path]


def systems_of(design: Design, values: Sequence[Number]) -> Systems:
    """The sensors whose departures are given, one number for each parameter.

    A number has the shape (systems, 1), so that it broadcasts over rays, or is a dual of that shape.
    """
    at = {(p.part, p.key): value for p, value in zip(parameters_of(design), values, strict=True)}
    camera = PosedCamera(
        pinhole=(at[CAMERA, "shift_x_mm"], at[CAMERA, "shift_y_mm"], at[CAMERA, "axial_shift_mm"]),
        turn=rotation(at[CAMERA, "tilt_x_deg"], at[CAMERA, "tilt_y_deg"]),
        principal_distance=design.camera.focal_length_mm + at[CAMERA, "principal_distance_departure_mm"],
        radial_distortion=at[CAMERA, "radial_distortion"],
        law=image_law_of(design.camera),
    )
    return Systems({mirror.name: _posed(mirror, at) for mirror in design.mirrors}, camera)


def rotation(tilt_x_deg: Number, tilt_y_deg: Number) -> Turn:
    """The rotation by one angle about x, then by the other about y."""
    (cos_x, sin_x), (cos_y, sin_y) = _cosine_and_sine(tilt_x_deg), _cosine_and_sine(tilt_y_deg)
    return (
        (cos_y, sin_y * sin_x, sin_y * cos_x),
        (0.0, cos_x, -sin_x),
        (-sin_y, cos_y * sin_x, cos_y * cos_x),
    )


def _posed(mirror: Mirror, at: dict[tuple[str, str], Number]) -> PosedMirror:
    name = mirror.name
    if mirror.radius_mm is None:
        curvature = at[name, "curvature_per_m"] * 1e-3
        one_plus_conic: Number = 1.0
    else:
        curvature = 1.0 / (mirror.radius_mm + at[name, "radius_departure_mm"])
        one_plus_conic = 1.0 + mirror.conic + at[name, "conic_departure"]
    return PosedMirror(
        vertex=(
            at[name, "decentre_x_mm"],
            at[name, "decentre_y_mm"],
            mirror.vertex_mm + at[name, "axial_shift_mm"],
        ),
        turn=rotation(at[name, "tilt_x_deg"], at[name, "tilt_y_deg"]),
        curvature=curvature,
        one_plus_conic=one_plus_conic,
        side=1.0 if mirror.faces == "up" else -1.0,
    )


def _cosine_and_sine(angle_deg: Number) -> tuple[Number, Number]:
    angle = angle_deg * (np.pi / 180.0)
    return cosine(angle), sine(angle)
