"""Inside a welded steel pipe, off its centre: seams and markings on the wall, a fitting, bolts, a cable, deposits."""

from __future__ import annotations

import numpy as np

from designer.imaging.render.scenes.layout import DRAWN_REACH_MM, DrawnVolume, Thing
from designer.imaging.render.scenes.shapes import Cylinder, Ellipsoid, Point, Sphere

# The pipe's wall is drawn for this circumference, and repeats along it after an eighth.
PICTURE_MM, PICTURE_ALONG = 3072.0, 1.0 / 8.0
# Of half the difference between nearest and farthest: the wall goes through all distances round the sensor.
ASIDE = 0.96
REACH = 100.0


def pipe_radius(volume: DrawnVolume) -> float:
    """Radius in mm of the pipe as drawn."""
    return (volume.near_mm + DRAWN_REACH_MM) / 2.0


def pipe(volume: DrawnVolume) -> list[Thing]:
    """The pipe around a working volume."""
    radius, swing = pipe_radius(volume), (DRAWN_REACH_MM - volume.near_mm) / 2.0
    aside, lump = ASIDE * swing, 0.1 * swing
    steep = max(abs(volume.low), abs(volume.high))

    def on_wall(azimuth_deg: float, height: float, depth: float = 0.0) -> Point:
        """A place on the wall, its height from -1 to 1 over the range of elevation there, ``depth`` inside it."""
        angle = np.radians(azimuth_deg)
        x, y = aside + (radius - depth) * np.cos(angle), (radius - depth) * np.sin(angle)
        return float(x), float(y), float(height * steep * np.hypot(x, y))

    period = 2.0 * np.pi * radius * PICTURE_ALONG
    repeats = np.ceil(REACH * DRAWN_REACH_MM / period) + 0.5
    wall = Cylinder((aside, 0.0, -period * repeats), (aside, 0.0, period * repeats), radius)
    things = [Thing(wall, "pipe_wall")]
    # A branch: a collar with a dark mouth, and the bolts that hold it.
    mouth, collar = on_wall(24.0, 0.1, 0.9 * lump), on_wall(24.0, 0.1, 0.8 * lump)
    away = on_wall(24.0, 0.1, -lump)
    size = min(2.2 * lump, 0.5 * steep * DRAWN_REACH_MM)
    things += [
        Thing(Cylinder(mouth, away, 0.62 * size), "plastic", 0.35),
        Thing(Cylinder(collar, away, size), "metal", 1.2),
    ]
    for bolt in range(8):
        around = 2.0 * np.pi * bolt / 8.0
        place = on_wall(24.0 + np.degrees(0.81 * size * np.cos(around) / radius), 0.0, 0.85 * lump)
        things.append(
            Thing(Sphere((place[0], place[1], collar[2] + 0.81 * size * np.sin(around)), 0.12 * size), "metal", 0.7)
        )
    # A cable along the pipe, held by clips, and a rod across.
    things.append(
        Thing(Cylinder(on_wall(215.0, -3.0, 0.2 * lump), on_wall(215.0, 3.0, 0.2 * lump), 0.25 * lump), "plastic", 1.5)
    )
    for height in (-0.8, 0.0, 0.8):
        start, end = on_wall(211.0, height, 0.25 * lump), on_wall(219.0, height, 0.25 * lump)
        things.append(Thing(Cylinder(start, end, 0.28 * lump), "metal", 1.3))
    # Deposits, flat against the wall.
    for azimuth, height, wide in (
        (-60.0, -0.4, 1.3),
        (-48.0, 0.3, 0.8),
        (75.0, -0.5, 1.1),
        (130.0, 0.3, 0.7),
        (-95.0, 0.5, 0.9),
    ):
        things.append(
            Thing(Ellipsoid(on_wall(azimuth, height), (0.4 * lump, wide * lump, 0.5 * wide * lump), azimuth), "rust")
        )
    return things
