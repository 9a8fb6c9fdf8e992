"""Solids in the meridional section: which substrates, barrel and body touch or penetrate, and where their rims are.

A section is a set of radii with a lowest and a highest height at each: the substrate between a face and its back,
the lens barrel, the camera body. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np

from designer.design import Camera, Mirror
from designer.trace.arrays import Array
from designer.trace.instrument import BARREL, BODY, sag

# Solids nearer than this count as touching.
CONTACT_MM = 1e-9
SECTION_SAMPLES = 257


class Head(Protocol):
    """A camera and the mirrors about it: a design, or anything else that has both."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @property
    def mirrors(self) -> tuple[Mirror, ...]:
        """The mirrors."""


@dataclass(frozen=True, slots=True)
class Rims:
    """Rim circles of all elements, in the half-plane of positive distance from the axis.

    ``points`` (n, 2) holds distance from the axis and height; ``owner`` (n,) the index of the mirror, -1 for barrel
    and body; ``labels`` says in words which rim it is.
    """

    points: Array
    owner: np.typing.NDArray[np.intp]
    labels: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Section:
    """A solid of revolution: lowest and highest height, by ``bounds``, from an inner to an outer radius."""

    name: str
    inner: float
    outer: float
    bounds: Callable[[Array], tuple[Array, Array]]


def find_rims(design: Head) -> Rims:
    """The rims of every mirror's face and back, of the lens barrel and of the camera body."""
    points: list[tuple[float, float]] = []
    owners: list[int] = []
    labels: list[str] = []
    for index, mirror in enumerate(design.mirrors):
        back = mirror.back_offset_mm
        for radius, edge in ((mirror.outer_radius_mm, "outer edge"), (mirror.inner_radius_mm, "hole edge")):
            if radius == 0.0:
                continue
            height = float(sag(mirror, radius)) + mirror.vertex_mm
            for shift in (0.0, back) if back else (0.0,):
                points.append((radius, height + shift))
                owners.append(index)
                labels.append(f"{edge} of {mirror.name}")
    camera = design.camera
    seat = camera.lens_seat_mm
    points += [(camera.lens_radius_mm, camera.lens_front_mm), (camera.lens_radius_mm, seat)]
    labels += [BARREL, BARREL]
    if camera.body_radius_mm > 0.0:
        points.append((camera.body_radius_mm, seat))
        labels.append(BODY)
    owners += [-1] * (len(points) - len(owners))
    return Rims(np.array(points), np.array(owners, dtype=np.intp), tuple(labels))


def contact_problems(design: Head) -> list[str]:
    """One sentence for each pair of solids that touch or penetrate each other."""
    *sections, barrel, body = solid_sections(design)
    pairs = [*combinations(sections, 2), *((section, solid) for section in sections for solid in (barrel, body))]
    return [problem for pair in pairs if (problem := contact(*pair)) is not None]


def solid_sections(design: Head) -> list[Section]:
    """The substrate of every mirror, then the lens barrel and the camera body."""
    camera = design.camera
    seat = camera.lens_seat_mm
    return [
        *(_substrate(mirror) for mirror in design.mirrors),
        Section(BARREL, 0.0, camera.lens_radius_mm, between(seat, camera.lens_front_mm)),
        Section(BODY, 0.0, camera.body_radius_mm, between(-np.inf, seat)),
    ]


def _substrate(mirror: Mirror) -> Section:
    back = mirror.back_offset_mm

    def bounds(radius: Array) -> tuple[Array, Array]:
        face = mirror.vertex_mm + sag(mirror, radius)
        return np.minimum(face, face + back), np.maximum(face, face + back)

    return Section(mirror.name, mirror.inner_radius_mm, mirror.outer_radius_mm, bounds)


def between(low: float, high: float) -> Callable[[Array], tuple[Array, Array]]:
    """The bounds of a solid with flat ends."""
    return lambda radius: (np.full_like(radius, low), np.full_like(radius, high))


def contact(first: Section, second: Section) -> str | None:
    """A sentence on two solids that touch or penetrate each other; None if they do not."""
    inner, outer = max(first.inner, second.inner), min(first.outer, second.outer)
    if outer - inner < -CONTACT_MM:
        return None
    pair = f"{first.name} and {second.name}"
    if outer - inner <= CONTACT_MM:
        # Side by side: they meet, if at all, in the wall at one common radius.
        (low_1, high_1), (low_2, high_2) = first.bounds(np.array([outer])), second.bounds(np.array([outer]))
        shared = float(min(high_1[0], high_2[0]) - max(low_1[0], low_2[0]))
        return f"{pair} touch at radius {outer:.4g} mm" if shared >= -CONTACT_MM else None
    radius = np.linspace(inner, outer, SECTION_SAMPLES)
    (low_1, high_1), (low_2, high_2) = first.bounds(radius), second.bounds(radius)
    depth = np.minimum(high_1, high_2) - np.maximum(low_1, low_2)
    deepest = int(np.nanargmax(np.where(np.isnan(depth), -np.inf, depth)))
    if depth[deepest] > CONTACT_MM:
        return f"{pair} penetrate each other by {depth[deepest]:.3g} mm at radius {radius[deepest]:.4g} mm"
    # Shells thinner than any overlap, zero thickness above all, may still cross between two samples.
    above = np.sign(low_1 - low_2)
    if (above > 0).any() and (above < 0).any():
        crossing = int(np.argmax(above != above[0]))
        return f"{pair} penetrate each other at radius {radius[crossing]:.4g} mm"
    return f"{pair} touch at radius {radius[deepest]:.4g} mm" if depth[deepest] >= -CONTACT_MM else None
