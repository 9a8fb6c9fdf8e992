"""A furnished office: bookcases, cabinets, boards, desks with screens, plants and people between papered walls."""

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
    plant,
)
from designer.imaging.render.scenes.shapes import Box, Cylinder, Sphere

SENSOR_HEIGHT_MM, ROOM_HEIGHT_MM = 1500.0, 2700.0
SECTORS = 16
# Of each quarter of the circle in turn; the farthest band, 3, is the walls and what stands low before them.
BANDS_OF_SECTORS = (0, 3, 1, 2)
WIDE_DEG = 20.0


def office(volume: DrawnVolume) -> list[Thing]:
    """The office around a working volume."""
    floor = volume.floor(SENSOR_HEIGHT_MM)
    ceiling = max(floor + ROOM_HEIGHT_MM, volume.top(DRAWN_REACH_MM))
    things = _room(volume, floor, ceiling)
    for sector in range(SECTORS):
        azimuth, quarter = 360.0 / SECTORS * (sector + 0.5), sector // len(BANDS_OF_SECTORS)
        band = BANDS_OF_SECTORS[sector % len(BANDS_OF_SECTORS)]
        if band == 3:
            things += _desk(azimuth, volume.distance(2, 0.45), floor, quarter)
        else:
            things += _furniture(volume, azimuth, band, (quarter + band) % 4, (floor, ceiling))
    return things


def _room(volume: DrawnVolume, floor: float, ceiling: float) -> list[Thing]:
    """Walls in the farthest band, with windows, doors and posters."""
    things: list[Thing] = []
    middle, half_height = (floor + ceiling) / 2.0, (ceiling - floor) / 2.0 * (1.0 + 1e-6)
    walls = [volume.distance(3, share) for share in (0.12, 0.3, 0.2, 0.4)]
    for number, distance in enumerate(walls):
        azimuth = 90.0 * number
        left, right = walls[(number + 1) % 4], walls[number - 1]
        # Each wall reaches from its neighbour to the other, a millionth over.
        wall = panel(
            azimuth,
            distance,
            (left + right) * (1.0 + 1e-6),
            (middle - half_height, middle + half_height),
            (right - left) / 2.0,
        )
        things.append(Thing(wall, "brick_wall" if number == 2 else "plaster", 1.0 if number != 3 else 0.85))
        things.append(
            Thing(
                block(
                    azimuth,
                    distance - 12.0,
                    (left + right, 10.0),
                    (floor, floor + 110.0),
                    aside_mm=(right - left) / 2.0,
                ),
                "wood",
                0.8,
            )
        )
        things += _on_wall(azimuth, distance - 8.0, (left, right), floor, ceiling, number)
    across = level((0.0, 0.0, floor), 2.2 * max(walls), 2.2 * max(walls))
    above = level((0.0, 0.0, ceiling), 2.2 * max(walls), 2.2 * max(walls))
    lamps = [
        Thing(level(at(90.0 * turn + 45.0, 2600.0, ceiling - 4.0), 300.0, 1200.0, 45.0), "paint", 1.6)
        for turn in range(4)
    ]
    return [*things, Thing(across, "boards"), Thing(above, "ceiling_tiles"), *lamps]


def _on_wall(
    azimuth: float, distance: float, reach: tuple[float, float], floor: float, ceiling: float, number: int
) -> list[Thing]:
    """Windows from a sill up on two walls, a door and posters on the others, all along them."""
    tall = ceiling - floor
    things: list[Thing] = []
    places = np.arange(-reach[0] + 520.0, reach[1] - 480.0, 1060.0)
    for place, aside in enumerate(places):
        if number % 2 == 0:
            heights = (floor + 0.27 * tall, floor + 0.9 * tall)
            things.append(Thing(panel(azimuth, distance, 940.0, heights, float(aside)), f"window.{place % 3}"))
        elif place == 4:
            things.append(Thing(panel(azimuth, distance, 950.0, (floor, floor + 2050.0), float(aside)), "door"))
        else:
            heights = (floor + 0.38 * tall, floor + 0.38 * tall + 1240.0)
            things.append(
                Thing(panel(azimuth, distance, 620.0, heights, float(aside)), f"poster.{(place + number) % 4}")
            )
            shelf = block(
                azimuth,
                distance - 220.0,
                (860.0, 220.0),
                (floor + 0.85 * tall, floor + 0.85 * tall + 350.0),
                aside_mm=float(aside),
            )
            things.append(Thing(shelf, "books"))
    return things


def _furniture(volume: DrawnVolume, azimuth: float, band: int, kind: int, room: tuple[float, float]) -> list[Thing]:
    """One of four pieces as wide as a sector: bookcase, cupboard, board, or a person with a plant."""
    floor, ceiling = room
    distance = volume.distance(band, 0.2 + 0.13 * kind)
    width = chord(distance, WIDE_DEG)
    depth = 0.25 * (volume.distance(band, 1.0) - volume.distance(band, 0.0)) + 150.0
    top = min(max(volume.top(distance), floor + 1900.0), ceiling)
    heights = (floor, top)
    if kind == 0:
        return [
            Thing(block(azimuth, distance, (width, depth), heights), "books"),
            Thing(block(azimuth, distance - 6.0, (width, depth + 8.0), (top, min(top + 45.0, ceiling))), "wood"),
            *(
                Thing(
                    block(azimuth, distance - 6.0, (30.0, depth), heights, aside_mm=side * (width / 2.0 - 15.0)),
                    "wood",
                    0.8,
                )
                for side in (-1.0, 1.0)
            ),
        ]
    if kind == 1:
        split = floor + 0.42 * (top - floor)
        return [
            Thing(block(azimuth, distance, (width, depth), (floor, split)), "cupboard"),
            Thing(block(azimuth, distance, (width, depth), (split, top)), "books" if band else "cupboard.1"),
            Thing(block(azimuth, distance - 5.0, (width, depth), (split - 12.0, split + 18.0)), "wood"),
            *_ornaments(azimuth, distance + 100.0, top, width),
        ]
    if kind == 2:
        board = "notices" if band != 1 else "whiteboard"
        sill = max(floor, min(volume.bottom(distance), floor + 0.4 * (top - floor)))
        return [
            Thing(block(azimuth, distance, (width, 40.0), (sill, top)), board),
            *(
                Thing(
                    Cylinder(at(azimuth, distance + 20.0, floor, side), at(azimuth, distance + 20.0, top, side), 18.0),
                    "metal",
                )
                for side in (-0.47 * width, 0.47 * width)
            ),
            Thing(block(azimuth, distance + 5.0, (width, 30.0), (floor, sill)), "carpet"),
        ]
    things = person(azimuth - 4.0, distance, floor, (0.7, 1.5, 1.1)[band], PERSON_MM, 21.0)
    return things + plant(
        azimuth + 6.5, distance + 60.0, (floor, max(volume.top(distance), floor + 1500.0)), chord(distance, 11.0)
    )


def _ornaments(azimuth: float, distance: float, height: float, width: float) -> list[Thing]:
    size = min(110.0, width / 6.0)
    return [
        Thing(Sphere(at(azimuth, distance, height + size, -width / 4.0), size), "paint"),
        Thing(
            block(azimuth, distance, (2.0 * size, 1.6 * size), (height, height + 2.2 * size), aside_mm=width / 5.0),
            "cartons",
        ),
    ]


def _desk(azimuth: float, distance: float, floor: float, kind: int) -> list[Thing]:
    """A desk with a screen or two on it and a chair before it, below the middle of the view."""
    size = min(1.0, distance / 1500.0)
    width, depth, height = 1300.0 * size, 650.0 * size, floor + 740.0
    things = [
        Thing(block(azimuth, distance, (width, depth), (height - 35.0, height)), "wood", 1.2),
        *(
            Thing(
                block(azimuth, distance + 30.0, (60.0, depth - 60.0), (floor, height - 35.0), aside_mm=side),
                "metal",
                0.8,
            )
            for side in (-0.46 * width, 0.46 * width)
        ),
    ]
    for number, side in enumerate((-0.24 * width, 0.24 * width)[: 1 + kind % 2]):
        screen: Box = block(
            azimuth, distance + 0.45 * depth, (560.0 * size, 40.0), (height + 110.0, height + 440.0), aside_mm=side
        )
        foot = at(azimuth, distance + 0.5 * depth, height, side)
        things += [
            Thing(screen, f"screen.{number}"),
            Thing(Cylinder(foot, (foot[0], foot[1], height + 120.0), 35.0), "plastic"),
        ]
    things.append(
        Thing(
            block(azimuth, distance + 90.0, (260.0 * size, 190.0), (height, height + 60.0), aside_mm=0.36 * width),
            "books",
        )
    )
    seat = at(azimuth, distance - 240.0, floor + 460.0, -0.1 * width)
    return [
        *things,
        Thing(Cylinder((seat[0], seat[1], floor + 60.0), (seat[0], seat[1], floor + 430.0), 32.0), "metal", 0.7),
        Thing(
            block(azimuth, distance - 420.0, (440.0, 420.0), (floor + 430.0, floor + 500.0), aside_mm=-0.1 * width),
            "cloth",
            0.8,
        ),
        Thing(
            block(azimuth, distance - 440.0, (420.0, 60.0), (floor + 560.0, floor + 980.0), aside_mm=-0.1 * width),
            "cloth",
            0.9,
        ),
    ]
