"""What places are laid out by: a working volume, its bands of distance, and the things that stand about.

Scenes are drawn about the middle of the baseline for a far distance of ``DRAWN_REACH_MM`` and scaled to the design's
afterwards. Things stand all round at distances that go through the bands again and again, each tall enough for the
whole range of elevation where it stands; lengths in mm, azimuths in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.design import Design
from designer.imaging.render.scenes.shapes import Box, Cylinder, Ellipsoid, Point, Rectangle, Shape

DRAWN_REACH_MM = 5000.0
# Bands of equal ratio between the nearest and the farthest distance: as many as the end-to-end check judges.
BANDS = 4
# Things are this much taller than what a view from the middle needs: the two viewpoints lie above and below it.
SPARE = 1.05
PERSON_MM = 1720.0
PERSON_WIDTH_MM = 460.0


@dataclass(frozen=True, slots=True)
class Thing:
    """A shape, the material it is made of and a factor on that material's tone."""

    shape: Shape
    material: str
    tone: float = 1.0


@dataclass(frozen=True, slots=True)
class DrawnVolume:
    """A working volume as drawn: its nearest distance in mm (the farthest is ``DRAWN_REACH_MM``) and its slopes.

    ``low`` and ``high`` are tan(elevation) of its ends, ``sensor_height_mm`` the height over the floor if given.
    """

    near_mm: float
    low: float
    high: float
    sensor_height_mm: float | None = None

    def distance(self, band: int, share: float) -> float:
        """A distance in a band, 0 the nearest, from its near end (share 0) to its far one (1)."""
        return float(self.near_mm * (DRAWN_REACH_MM / self.near_mm) ** ((band + share) / BANDS))

    def top(self, distance_mm: float) -> float:
        """Height over the middle of the baseline that reaches above all elevations at a distance."""
        return float(distance_mm * self.high + (SPARE - 1.0) * distance_mm * max(abs(self.high), abs(self.low)))

    def bottom(self, distance_mm: float) -> float:
        """Height over the middle of the baseline that reaches below all elevations at a distance."""
        return float(distance_mm * self.low - (SPARE - 1.0) * distance_mm * max(abs(self.high), abs(self.low)))

    def floor(self, usual_mm: float) -> float:
        """Height of a floor: the given one, the usual one, or as low as the farthest things need."""
        if self.sensor_height_mm is not None:
            return -self.sensor_height_mm
        return min(-usual_mm, self.bottom(DRAWN_REACH_MM))


def drawn_volume_of(design: Design, sensor_height_mm: float | None) -> tuple[DrawnVolume, float]:
    """The working volume of a design as drawn, and the scale from there to the design's mm."""
    near, far = design.working_volume.distance_mm
    low, high = np.tan(np.radians(design.working_volume.elevation_deg))
    scale = far / DRAWN_REACH_MM
    height = None if sensor_height_mm is None else sensor_height_mm / scale
    return DrawnVolume(near / scale, float(low), float(high), height), scale


def at(azimuth_deg: float, distance_mm: float, height_mm: float, aside_mm: float = 0.0) -> Point:
    """A place at an azimuth and distance, ``aside_mm`` to the right of who looks there from the middle."""
    angle = np.radians(azimuth_deg)
    return (
        float(distance_mm * np.cos(angle) + aside_mm * np.sin(angle)),
        float(distance_mm * np.sin(angle) - aside_mm * np.cos(angle)),
        float(height_mm),
    )


def block(
    azimuth_deg: float,
    distance_mm: float,
    size_mm: tuple[float, float],
    heights_mm: tuple[float, float],
    *,
    aside_mm: float = 0.0,
    turn_deg: float = 0.0,
) -> Box:
    """A box whose front, ``size_mm[0]`` wide, faces the middle at a distance; ``size_mm[1]`` deep behind it."""
    width, depth = size_mm
    x, y, _ = at(azimuth_deg, distance_mm + depth / 2.0, 0.0, aside_mm)
    return Box(
        (x - depth / 2.0, y - width / 2.0, heights_mm[0]),
        (x + depth / 2.0, y + width / 2.0, heights_mm[1]),
        azimuth_deg + turn_deg,
    )


def panel(
    azimuth_deg: float, distance_mm: float, width_mm: float, heights_mm: tuple[float, float], aside_mm: float = 0.0
) -> Rectangle:
    """An upright rectangle that faces the middle."""
    bottom, top = heights_mm
    right = at(azimuth_deg, 0.0, 0.0, width_mm / 2.0)
    return Rectangle(
        at(azimuth_deg, distance_mm, (bottom + top) / 2.0, aside_mm), right, (0.0, 0.0, (top - bottom) / 2.0)
    )


def level(centre: Point, width_mm: float, depth_mm: float, azimuth_deg: float = 0.0) -> Rectangle:
    """A level rectangle, ``depth_mm`` long along an azimuth."""
    return Rectangle(centre, at(azimuth_deg, depth_mm / 2.0, 0.0), at(azimuth_deg, 0.0, 0.0, -width_mm / 2.0))


def chord(distance_mm: float, wide_deg: float) -> float:
    """Width in mm of what is ``wide_deg`` wide at a distance."""
    return float(2.0 * distance_mm * np.tan(np.radians(wide_deg) / 2.0))


def person(
    azimuth_deg: float, distance_mm: float, floor_mm: float, tone: float, tallest_mm: float, wide_deg: float
) -> list[Thing]:
    """A person who stands at a place, no taller than ``tallest_mm`` nor wider than ``wide_deg``."""
    scale = min(1.0, tallest_mm / PERSON_MM, chord(distance_mm, wide_deg) / PERSON_WIDTH_MM)

    def place(aside: float, height: float, nearer: float = 0.0) -> Point:
        return at(azimuth_deg, distance_mm - scale * nearer, floor_mm + scale * height, scale * aside)

    def limb(start: Point, end: Point, radius: float, material: str, shade: float = 1.0) -> Thing:
        return Thing(Cylinder(start, end, scale * radius), material, shade)

    coat = "shirt" if tone > 1.0 else "cloth"
    things = [
        Thing(Ellipsoid(place(0, 1600), (scale * 105.0, scale * 88.0, scale * 128.0), azimuth_deg), "face"),
        limb(place(0, 1400), place(0, 1520), 55.0, "skin"),
        # Chest and hips.
        Thing(Ellipsoid(place(0, 1180), (scale * 140.0, scale * 215.0, scale * 330.0), azimuth_deg), coat, tone),
        Thing(Ellipsoid(place(0, 930), (scale * 135.0, scale * 175.0, scale * 180.0), azimuth_deg), "cloth", 0.6),
    ]
    for side in (-1.0, 1.0):
        things += [
            limb(place(205 * side, 1380), place(235 * side, 1080, 20), 55.0, coat, tone),
            limb(place(235 * side, 1080, 20), place(190 * side, 860, 120), 45.0, "skin"),
            limb(place(85 * side, 60), place(80 * side, 900), 82.0, "cloth", 0.6),
            Thing(
                Ellipsoid(place(90 * side, 45, 50), (scale * 130.0, scale * 55.0, scale * 45.0), azimuth_deg),
                "plastic",
                0.6,
            ),
        ]
    return things


def plant(azimuth_deg: float, distance_mm: float, heights_mm: tuple[float, float], wide_mm: float) -> list[Thing]:
    """A potted plant with leaves up to a height."""
    bottom, top = heights_mm
    tall = top - bottom
    rim = bottom + min(0.2 * tall, 0.8 * wide_mm)

    def upright(low: float, high: float, radius: float, material: str) -> Thing:
        return Thing(
            Cylinder(at(azimuth_deg, distance_mm, low), at(azimuth_deg, distance_mm, high), radius), material, 1.4
        )

    return [
        upright(bottom, rim, 0.27 * wide_mm, "rust"),
        upright(rim, top - 0.1 * tall, 0.04 * wide_mm, "bark"),
        *_foliage(azimuth_deg, distance_mm, (rim + 0.1 * tall, top), wide_mm, 9),
    ]


def tree(azimuth_deg: float, distance_mm: float, heights_mm: tuple[float, float], wide_mm: float) -> list[Thing]:
    """A tree that stands on the lower height, with a crown from a quarter of the way up to the upper one."""
    ground, top = heights_mm
    start, end = at(azimuth_deg, distance_mm, ground), at(azimuth_deg, distance_mm, top - 0.25 * (top - ground))
    crown = (ground + 0.25 * (top - ground), top)
    return [
        Thing(Cylinder(start, end, 0.07 * wide_mm), "bark"),
        *_foliage(azimuth_deg, distance_mm, crown, wide_mm, 22),
    ]


def _foliage(
    azimuth_deg: float, distance_mm: float, heights_mm: tuple[float, float], wide_mm: float, balls: int
) -> list[Thing]:
    """Balls of leaves about an upright axis, wound up it, wider in the middle than at the ends."""
    bottom, top = heights_mm
    things = []
    for number in range(balls):
        up = (number + 0.5) / balls
        size = wide_mm * (0.25 + 0.05 * np.sin(5.0 * number))
        out = max(0.0, 0.5 * wide_mm * np.sin(np.pi * (0.12 + 0.8 * up)) ** 0.7 - size)
        turn = 2.4 * number
        centre = at(azimuth_deg, distance_mm + out * np.cos(turn), bottom + (top - bottom) * up, out * np.sin(turn))
        half_tall = min(1.2 * size, (top - bottom) * min(up, 1.0 - up) + 0.4 * size)
        tall = max(half_tall, 0.75 * (top - bottom) / balls * 2.4)
        things.append(
            Thing(Ellipsoid(centre, (size, size, tall)), "leaves", 0.85 + 0.4 * up + 0.15 * np.cos(7.0 * number))
        )
    return things
