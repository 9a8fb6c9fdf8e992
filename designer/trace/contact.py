"""Which solids of a built sensor penetrate each other: points all over each one, tested against the others."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from designer.design import Camera, Design, Mirror, built_mirror
from designer.trace.arrays import Array
from designer.trace.built import build_as_built
from designer.trace.instrument import BARREL, BODY, Instrument, sag

RADII, AZIMUTHS, DEPTHS = 33, 72, 5
# Solids that lie this deep in one another count as penetrating.
DEPTH_MM = 1e-6


def built_contacts(design: Design) -> list[str]:
    """A sentence for each pair of solids of the sensor, as the design's ``as_built`` table has it, that penetrate."""
    built = build_as_built(design)
    departures = design.as_built.mirrors if design.as_built else {}
    mirrors = [built_mirror(m, departures[m.name]) if m.name in departures else m for m in design.mirrors]
    clouds = [_in_camera(built.instrument, frame, _points(mirror)) for frame, mirror in enumerate(mirrors)]
    pairs = [
        (mirrors[one].name, mirrors[other].name)
        for one, other in combinations(range(len(mirrors)), 2)
        if _inside(mirrors[other], _in_frame(built.instrument, other, clouds[one])).any()
        or _inside(mirrors[one], _in_frame(built.instrument, one, clouds[other])).any()
    ]
    for mirror, cloud in zip(mirrors, clouds, strict=True):
        pairs += [(mirror.name, part) for part in _camera_parts(design.camera, cloud)]
    return [f"{one} and {other} penetrate each other" for one, other in pairs]


def _points(mirror: Mirror) -> Array:
    """Points (n, 3) throughout a mirror's substrate, in its own frame."""
    radius = np.linspace(mirror.inner_radius_mm, mirror.outer_radius_mm, RADII)
    azimuth = np.linspace(0.0, 2.0 * np.pi, AZIMUTHS, endpoint=False)
    depth = np.linspace(0.0, mirror.back_offset_mm, DEPTHS)
    r, theta, back = (part.ravel() for part in np.meshgrid(radius, azimuth, depth))
    return np.stack([r * np.cos(theta), r * np.sin(theta), sag(mirror, r) + back], axis=-1)


def _inside(mirror: Mirror, points: Array) -> Array:
    """Which points (n, 3) of a mirror's frame lie in its substrate."""
    across = np.hypot(points[:, 0], points[:, 1])
    over = points[:, 2] - sag(mirror, across)
    low, high = sorted((0.0, mirror.back_offset_mm))
    within = (across > mirror.inner_radius_mm + DEPTH_MM) & (across < mirror.outer_radius_mm - DEPTH_MM)
    return np.asarray(within & (over > low + DEPTH_MM) & (over < high - DEPTH_MM))


def _camera_parts(camera: Camera, points: Array) -> list[str]:
    """Which of lens barrel and camera body hold some of the points (n, 3)."""
    across, height, seat = np.hypot(points[:, 0], points[:, 1]), points[:, 2], camera.lens_seat_mm
    barrel = (across < camera.lens_radius_mm - DEPTH_MM) & (height < camera.lens_front_mm - DEPTH_MM) & (height > seat)
    body = (across < camera.body_radius_mm - DEPTH_MM) & (height < seat - DEPTH_MM)
    return [name for name, held in ((f"the {BARREL}", barrel), (f"the {BODY}", body)) if held.any()]


def _in_camera(instrument: Instrument, frame: int, points: Array) -> Array:
    return np.asarray(points @ instrument.rotations[frame].T + instrument.origins[frame])


def _in_frame(instrument: Instrument, frame: int, points: Array) -> Array:
    return np.asarray((points - instrument.origins[frame]) @ instrument.rotations[frame])
