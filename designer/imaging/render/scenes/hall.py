"""A warehouse as a sensor under its ceiling sees it: racks, columns, signs, a deck with lanes, people and pallets."""

from __future__ import annotations

import numpy as np

from designer.imaging.render.scenes.layout import (
    DRAWN_REACH_MM,
    PERSON_MM,
    DrawnVolume,
    Thing,
    at,
    block,
    chord,
    level,
    panel,
    person,
)
from designer.imaging.render.scenes.shapes import Box, Cylinder

SENSOR_HEIGHT_MM, ROOF_MM = 2600.0, 900.0
SECTORS = 16
BANDS_OF_SECTORS = (0, 3, 1, 2)
WIDE_DEG = 20.0
# The deck lies this far down to the floor, along two walls of the hall.
DECK_DEPTH = 0.38
# Of the farthest to the nearest distance: in a narrower volume goods would hide all of the farthest band but the
# corners of the hall, and a rack stands in their place.
LEAST_RATIO_FOR_GOODS = 3.0
STACK_WIDE_DEG, PERSON_WIDE_DEG = 7.0, 9.0


def hall(volume: DrawnVolume) -> list[Thing]:
    """The warehouse around a working volume."""
    floor = volume.floor(SENSOR_HEIGHT_MM)
    roof = max(ROOF_MM, volume.top(DRAWN_REACH_MM))
    deck = DECK_DEPTH * floor
    walls = [volume.distance(3, share) for share in (0.35, 0.25, 0.45, 0.3)]
    things = _shell(walls, floor, roof)
    edge = min(
        0.98 * walls[1], max(volume.near_mm, 0.45 * walls[1], min(0.75 * walls[1], -deck / max(abs(volume.low), 0.05)))
    )
    things += _deck(walls, edge, deck, floor)
    for sector in range(SECTORS):
        azimuth, quarter = 360.0 / SECTORS * (sector + 0.5), sector // len(BANDS_OF_SECTORS)
        band = BANDS_OF_SECTORS[sector % len(BANDS_OF_SECTORS)]
        ahead_x, ahead_y, _ = at(azimuth, 1.0, 0.0)
        on_deck = max(ahead_x, ahead_y) > 0.55
        if band == 3:
            if DRAWN_REACH_MM / volume.near_mm < LEAST_RATIO_FOR_GOODS:
                things += _equipment(volume, azimuth, band, 0, floor, roof)
            else:
                things += _goods(volume, azimuth, quarter, deck if on_deck else floor, edge)
        else:
            things += _equipment(volume, azimuth, band, (quarter + band) % 4, floor, roof)
    return things


def _shell(walls: list[float], floor: float, roof: float) -> list[Thing]:
    """Walls with a row of windows under the roof and doors, the floor with its lanes, the roof."""
    things: list[Thing] = []
    middle, half_height = (floor + roof) / 2.0, (roof - floor) / 2.0 * (1.0 + 1e-6)
    for number, distance in enumerate(walls):
        azimuth = 90.0 * number
        left, right = walls[(number + 1) % 4], walls[number - 1]
        aside = (right - left) / 2.0
        heights = (middle - half_height, middle + half_height)
        wall = panel(azimuth, distance, (left + right) * (1.0 + 1e-6), heights, aside)
        things.append(Thing(wall, "brick_wall" if number % 2 else "cladding", 1.1))
        for place, window_aside in enumerate(np.arange(-left + 900.0, right - 500.0, 1500.0)):
            tall = min(1150.0, 0.3 * (roof - floor))
            bottom = min(roof - 1.2 * tall, -0.9 * tall - 150.0)
            things.append(
                Thing(
                    panel(azimuth, distance - 8.0, 1300.0, (bottom, bottom + tall), float(window_aside)),
                    f"window.{place % 2}",
                )
            )
            if place % 2 and number > 1:
                heights = (floor + 0.25 * (bottom - floor), floor + 0.85 * (bottom - floor))
                things.append(
                    Thing(
                        panel(azimuth, distance - 8.0, 0.45 * (heights[1] - heights[0]), heights, float(window_aside)),
                        "sign.1",
                    )
                )
        for height in (0.3, 0.42, 0.9):
            z = floor * height
            pipe = at(azimuth, distance - 90.0, z, -left), at(azimuth, distance - 90.0, z, right)
            things.append(Thing(Cylinder(*pipe, 60.0), "metal", 0.9))
    size = 2.2 * max(walls)
    return [
        *things,
        Thing(level((0.0, 0.0, floor), size, size), "floor_slabs"),
        Thing(level((0.0, 0.0, roof), size, size), "cladding", 0.6),
    ]


def _deck(walls: list[float], edge: float, deck: float, floor: float) -> list[Thing]:
    """A mezzanine from its edge to the walls at 0 and 90 degrees, with lanes on it and a railing along it."""
    left, right, back, front = walls[2], walls[0], walls[1], walls[3]
    things = [
        Thing(Box((-left, edge, deck - 180.0), (right, back, deck)), "floor_slabs", 1.15),
        Thing(Box((edge, -front, deck - 180.0), (right, edge, deck)), "floor_slabs", 1.15),
        Thing(panel(90.0, back - 8.0, 950.0, (deck, deck + 2050.0), 300.0), "door"),
        Thing(panel(0.0, right - 8.0, 950.0, (deck, deck + 2050.0), -500.0), "door"),
    ]
    for near, far in (((-left, edge), (edge, edge)), ((edge, -front), (edge, edge))):
        for part in np.linspace(0.02, 0.98, 4):
            x, y = (start + float(part) * (end - start) for start, end in zip(near, far, strict=True))
            things.append(Thing(Cylinder((x, y, floor), (x, y, deck), 60.0), "metal", 0.8))
            things.append(Thing(Cylinder((x, y, deck), (x, y, deck + 900.0), 20.0), "paint", 1.4))
        things.append(Thing(Cylinder((*near, deck + 900.0), (*far, deck + 900.0), 25.0), "paint", 1.4))
    return things


def _equipment(volume: DrawnVolume, azimuth: float, band: int, kind: int, floor: float, roof: float) -> list[Thing]:
    """One of four things as wide as a sector and as tall as the range of elevation: rack, column, goods, sign."""
    distance = volume.distance(band, 0.2 + 0.13 * kind)
    width = chord(distance, WIDE_DEG)
    depth = 0.25 * (volume.distance(band, 1.0) - volume.distance(band, 0.0)) + 150.0
    top = max(volume.top(distance), floor + 300.0)
    if kind == 0 or (kind == 3 and band == 2):
        return [Thing(block(azimuth, distance, (width, depth), (floor, top)), "rack", 1.1)]
    if kind == 1 and band == 0:
        things = [Thing(block(azimuth, distance, (width, width), (floor, roof)), "brick_wall", 1.2)]
        heights = (0.5 * (volume.bottom(distance) + top), top)
        return [*things, Thing(panel(azimuth, distance - 4.0, 0.5 * width, heights), "sign.2")]
    if kind == 1:
        radius = width / 2.0
        tank = Cylinder(at(azimuth, distance + radius, floor), at(azimuth, distance + radius, top), radius)
        ladder = [
            Thing(
                Cylinder(at(azimuth, distance - 20.0, floor, side), at(azimuth, distance - 20.0, top, side), 16.0),
                "paint",
                1.4,
            )
            for side in (-70.0, 70.0)
        ]
        return [Thing(tank, "cladding", 1.1), *ladder]
    if kind == 2:
        split = max(floor, volume.bottom(distance)) + 0.25 * (top - max(floor, volume.bottom(distance)))
        return [
            Thing(block(azimuth, distance, (width, depth), (split, top)), "cartons"),
            Thing(block(azimuth, distance - 10.0, (width, depth), (floor, split)), "rack"),
        ]
    bottom = max(floor, volume.bottom(distance))
    hung = [
        Thing(
            Cylinder(at(azimuth, distance + 15.0, top, side), at(azimuth, distance + 15.0, roof, side), 8.0),
            "metal",
            0.6,
        )
        for side in (-0.4 * width, 0.4 * width)
    ]
    # A sign hangs there, or a crate from a crane.
    if band == 0:
        return [Thing(block(azimuth, distance, (width, 40.0), (bottom, top)), "sign.0"), *hung]
    return [Thing(block(azimuth, distance, (width, depth), (bottom, top)), "boards", 1.2), *hung]


def _goods(volume: DrawnVolume, azimuth: float, quarter: int, ground: float, edge: float) -> list[Thing]:
    """People and pallets with cartons that stand before the far wall."""
    distance = max(volume.distance(2, 0.7), edge / max(0.3, float(np.sin(np.radians(azimuth)))) + 150.0)
    deep = volume.distance(3, 1.0) - volume.distance(3, 0.0)
    things: list[Thing] = []
    for turn, further, tall in ((-5.5, 0.0, 500.0), (4.5, 0.27 * deep, 800.0)):
        place, width = azimuth + turn, min(750.0, chord(distance, STACK_WIDE_DEG))
        size, heights = (width, width), (ground + 130.0, ground + 130.0 + tall)
        things.append(Thing(block(place, distance + further, size, heights, turn_deg=17.0), f"cartons.{quarter % 2}"))
        size, heights = (width + 60.0, width + 60.0), (ground, ground + 130.0)
        things.append(Thing(block(place, distance + further - 30.0, size, heights, turn_deg=17.0), "wood", 1.2))
    tallest = min(PERSON_MM, max(300.0, -0.8 * ground))
    for turn, further in ((0.5, 0.0), (9.0, 0.15)):
        tone = (0.6, 1.6, 1.0, 2.2)[(quarter + int(turn)) % 4]
        things += person(azimuth + turn, distance + further * deep, ground, tone, tallest, PERSON_WIDE_DEG)
    return things
