"""Rays from the sensor through the whole pupil of a design, traced by the designer and by optiland."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PupilRays:
    """Rays (n, 3) of the fields of a view: sensor points, pupil points, points on each mirror and on the wall.

    Frame of the designer, mm. NaN on and after a mirror that a ray misses.
    """

    sensor: Array
    pupil: Array
    mirrors: tuple[Array, ...]
    wall: Array


def pupil_rays(design: Design, view_name: str, sensor_heights_mm: Any, wall_mm: float) -> PupilRays:
    """Rays through points spread over the pupil, refracted by a thin lens focused where the design says.

    A thin lens sends the light of a sensor point through the image of that point, at the focus distance.
    """
    camera = design.camera
    principal, focus = camera.focal_length_mm, camera.focus_distance_mm
    angles, radii = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False) + 0.1, [0.0, 0.5, 0.999])
    across = camera.pupil_radius_mm * (radii * np.exp(1j * angles)).ravel()
    heights, pupil = np.meshgrid(np.asarray(sensor_heights_mm), across, indexing="ij")
    heights, pupil = heights.ravel(), pupil.ravel()
    nothing = np.zeros(len(heights))
    start = np.stack([pupil.real, pupil.imag, nothing], axis=-1)
    sensor = np.stack([nothing, heights, nothing - principal], axis=-1)
    ahead = -sensor if focus is None else -sensor * (focus / principal) - start
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    instrument = build_instrument(design)
    view = design.views.by_name[view_name]
    trace = trace_sequential(instrument, instrument.path(view.path), ahead, start)
    length = (wall_mm - trace.point[:, 1]) / trace.direction[:, 1]
    return PupilRays(sensor, start, trace.hits, trace.point + length[:, None] * trace.direction)


def traced_by_optiland(optic: Any, rays: PupilRays) -> tuple[list[Array], NDArray[np.bool_]]:
    """The same rays through an optiland system: points (n, 3) on every surface after the sensor, in the designer's
    frame, and whether they pass all apertures (n,)."""
    from optiland.rays import RealRays

    lift = float(optic.surfaces.surfaces[0].geometry.cs.z) - rays.sensor[0, 2]
    ahead = rays.pupil - rays.sensor
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    start = rays.sensor + np.array([0.0, 0.0, lift])
    ones = np.ones(len(start))
    traced = RealRays(*(np.ascontiguousarray(column) for column in (*start.T, *ahead.T)), ones, 0.55 * ones)
    optic.surfaces.trace(traced, skip=1)
    points = [
        np.stack([surface.x, surface.y, np.asarray(surface.z) - lift], axis=-1)
        for surface in optic.surfaces.surfaces[1:]
    ]
    return points, np.asarray(traced.i) > 0.0


def check_against_optiland(optic: Any, rays: PupilRays, tolerance_mm: float) -> None:
    """Both tracers agree on which rays pass, and on their points on lens, mirrors and wall."""
    points, passes = traced_by_optiland(optic, rays)
    met = np.isfinite(rays.wall).all(axis=1)
    assert met.mean() > 0.85
    assert (met == passes).all()
    for ours, theirs in zip([rays.pupil, *rays.mirrors, rays.wall], points, strict=True):
        assert np.linalg.norm(ours[met] - theirs[met], axis=1).max() < tolerance_mm


def reflected(start: Array, ahead: Array, vertex_mm: float, curvature: float, conic: float) -> tuple[Array, Array]:
    """Where rays (n, 3) meet c (x^2 + y^2 + (1 + K) z^2) = 2 z, z from the vertex, and where they then go.

    The nearest hit ahead on the vertex sheet counts; apertures do not.
    """
    origin, k = start - [0.0, 0.0, vertex_mm], 1.0 + conic
    metric = np.array([1.0, 1.0, k])
    a = curvature * (metric * ahead * ahead).sum(axis=1)
    b = curvature * (metric * origin * ahead).sum(axis=1) - ahead[:, 2]
    c = curvature * (metric * origin * origin).sum(axis=1) - 2.0 * origin[:, 2]
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - a * c)
        lengths = np.stack([c / (-b - root), c / (-b + root)])
        heights = origin[:, 2] + lengths * ahead[:, 2]
        usable = (lengths > 1e-9) & (1.0 - k * curvature * heights >= 0.0)
    length = np.where(usable, lengths, np.inf).min(axis=0)
    local = origin + length[:, None] * ahead
    normal = np.stack([curvature * local[:, 0], curvature * local[:, 1], curvature * k * local[:, 2] - 1.0], axis=-1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lift = np.array([0.0, 0.0, vertex_mm])
    return local + lift, ahead - 2.0 * (normal * ahead).sum(axis=1, keepdims=True) * normal
