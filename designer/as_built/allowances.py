"""What tolerances allow each part: numbers for a drawing sheet and a prescription."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from designer.as_built.dual import Array
from designer.as_built.parameters import CAMERA
from designer.as_built.tolerances import Tolerances, tolerance_of_part
from designer.design import Design, Mirror
from designer.evaluate.face_dimensions import face_dimensions
from designer.optics.conic import Surface

SAMPLES = 101


@dataclass(frozen=True, slots=True)
class MirrorAllowance:
    """The largest magnitude of each departure of one mirror.

    Decentre and tilt hold about each of x and y, the tilt about the vertex; they and the axial shift are those of the
    mirror in the assembly, against the camera's axis. ``radius_mm`` and ``conic`` are None for a plane, and
    ``curvature_per_m`` for all others. ``sag_mm`` is how far both together move the face at most along the axis, over
    the clear aperture, its vertex held.
    """

    decentre_mm: float
    tilt_deg: float
    axial_shift_mm: float
    radius_mm: float | None
    conic: float | None
    curvature_per_m: float | None
    sag_mm: float


@dataclass(frozen=True, slots=True)
class CameraAllowance:
    """The same of the camera against the head, and of its lens."""

    shift_mm: float
    tilt_deg: float
    axial_shift_mm: float
    principal_distance_mm: float
    radial_distortion: float


def mirror_allowance(design: Design, name: str, tolerances: Tolerances) -> MirrorAllowance:
    """What tolerances allow one mirror of a design."""
    mirror = design.mirror(name)

    def allowed(key: str) -> float:
        return tolerance_of_part(tolerances, name, key)

    radius = conic = curvature = None
    if mirror.radius_mm is None:
        curvature = allowed("plane_curvature_per_m")
    else:
        radius, conic = allowed("radius_percent") / 100.0 * abs(mirror.radius_mm), allowed("conic")
    return MirrorAllowance(
        decentre_mm=allowed("decentre_mm"),
        tilt_deg=allowed("tilt_deg"),
        axial_shift_mm=allowed("axial_shift_mm"),
        radius_mm=radius,
        conic=conic,
        curvature_per_m=curvature,
        sag_mm=_largest_change(design, mirror, radius or 0.0, conic or 0.0, curvature or 0.0),
    )


def camera_allowance(design: Design, tolerances: Tolerances) -> CameraAllowance:
    """What tolerances allow the camera of a design."""

    def allowed(key: str) -> float:
        return tolerance_of_part(tolerances, CAMERA, key)

    return CameraAllowance(
        shift_mm=allowed("shift_mm"),
        tilt_deg=allowed("tilt_deg"),
        axial_shift_mm=allowed("axial_shift_mm"),
        principal_distance_mm=allowed("principal_distance_percent") / 100.0 * design.camera.focal_length_mm,
        radial_distortion=allowed("radial_distortion"),
    )


def _largest_change(design: Design, mirror: Mirror, radius: float, conic: float, curvature_per_m: float) -> float:
    """The largest change of sag over the clear aperture, over both signs of each departure."""
    radii = np.linspace(*face_dimensions(design, mirror.name).clear_radii_mm, SAMPLES)
    if mirror.radius_mm is None:
        return float(np.max(np.abs(_sag(curvature_per_m / 1000.0, 0.0, radii))))
    nominal = _sag(1.0 / mirror.radius_mm, mirror.conic, radii)
    return max(
        float(np.max(np.abs(_sag(1.0 / (mirror.radius_mm + one), mirror.conic + other, radii) - nominal)))
        for one, other in product((-radius, radius), (-conic, conic))
    )


def _sag(curvature: float, conic: float, radii: Array) -> Array:
    return np.asarray(Surface(0.0, curvature, (1.0 + conic) * curvature**2).height(radii), dtype=float)
