"""A yard under the sky: houses, trees, towers, a tank and gantries all round, and clouds far above them."""

from __future__ import annotations

from designer.imaging.render.scenes.layout import (
    DRAWN_REACH_MM,
    DrawnVolume,
    Thing,
    at,
    block,
    chord,
    level,
    panel,
    tree,
)
from designer.imaging.render.scenes.shapes import Cylinder, Ellipsoid, Rectangle, Sphere

SENSOR_HEIGHT_MM = 1200.0
SKY_MM = 100_000.0
SECTORS = 16
BANDS_OF_SECTORS = (0, 3, 1, 2)
WIDE_DEG, HOUSE_WIDE_DEG = 18.0, 21.0


def sky(volume: DrawnVolume) -> list[Thing]:
    """The yard around a working volume."""
    ground = volume.floor(SENSOR_HEIGHT_MM)
    things = [
        Thing(Sphere((0.0, 0.0, ground), SKY_MM), "clouds"),
        Thing(level((0.0, 0.0, ground), 2.0 * SKY_MM, 2.0 * SKY_MM), "soil"),
    ]
    for sector in range(SECTORS):
        azimuth, quarter = 360.0 / SECTORS * (sector + 0.5), sector // len(BANDS_OF_SECTORS)
        band = BANDS_OF_SECTORS[sector % len(BANDS_OF_SECTORS)]
        things += _structure(volume, azimuth, band, (quarter + band) % 4, ground)
    return things + _lines(volume)


def _structure(volume: DrawnVolume, azimuth: float, band: int, kind: int, ground: float) -> list[Thing]:
    """One of four structures, each as tall as the range of elevation where it stands."""
    distance = volume.distance(band, 0.2 + 0.13 * kind)
    deep = volume.distance(band, 1.0) - volume.distance(band, 0.0)
    top = max(volume.top(distance), ground + 900.0)
    if band == 3 or kind == 0:
        return _house(
            azimuth,
            distance,
            chord(distance, HOUSE_WIDE_DEG if band == 3 else WIDE_DEG),
            0.3 * deep,
            (ground, top),
            band + kind,
        )
    width = chord(distance, WIDE_DEG)
    if kind == 1:
        return tree(azimuth, distance + 0.3 * width, (ground, top + 0.06 * (top - ground)), 1.2 * width)
    if kind == 2:
        if band == 2:
            return _water_tower(azimuth, distance, width, (ground, top))
        mast = block(azimuth, distance, (0.8 * width, 0.8 * width), (ground, top))
        return [
            Thing(mast, "lattice"),
            Thing(block(azimuth, distance - 60.0, (width, 0.9 * width), (top - 0.16 * width, top)), "metal", 0.8),
            Thing(
                Cylinder(
                    at(azimuth, distance + 0.3 * width, top), at(azimuth, distance + 0.3 * width, 1.4 * top), 14.0
                ),
                "metal",
                0.5,
            ),
        ]
    # A hoarding on two poles.
    bottom = max(ground, volume.bottom(distance))
    poles = [
        Thing(
            Cylinder(at(azimuth, distance + 60.0, ground, side), at(azimuth, distance + 60.0, top, side), 22.0),
            "metal",
            0.6,
        )
        for side in (-0.4 * width, 0.4 * width)
    ]
    return [Thing(block(azimuth, distance, (width, 40.0), (bottom, top)), f"poster.{band}"), *poles]


def _house(
    azimuth: float, distance: float, width: float, depth: float, heights: tuple[float, float], kind: int
) -> list[Thing]:
    """A house front with a projecting roof and a chimney."""
    ground, top = heights
    eaves = top - 0.2 * (top - max(ground, 0.0))
    walls = "cladding" if kind % 4 == 2 else "brick_wall"
    front = distance - 0.02 * distance
    # The roof leans back from the eaves to the ridge.
    up, back = (top - eaves) / 2.0, (depth + distance - front) / 2.0
    lean = at(azimuth, back, up)
    roof = Rectangle(at(azimuth, front + back, eaves + up), at(azimuth, 0.0, 0.0, 0.54 * width), lean)
    gutter = at(azimuth, front, eaves, -0.54 * width), at(azimuth, front, eaves, 0.54 * width)
    pipe = at(azimuth, distance - 0.015 * width, ground, -0.47 * width), at(azimuth, front, eaves, -0.47 * width)
    chimney = block(
        azimuth, distance + 0.3 * depth, (0.16 * width, 0.16 * width), (eaves, 1.1 * top), aside_mm=0.25 * width
    )
    things = [
        Thing(block(azimuth, distance, (width, depth), (ground, eaves + 0.1 * (top - eaves))), walls),
        Thing(roof, "roof_tiles", 1.2),
        Thing(chimney, "brick_wall"),
        Thing(Cylinder(*gutter, 0.02 * width), "metal", 0.6),
        Thing(Cylinder(*pipe, 0.015 * width), "metal", 0.6),
    ]
    storeys = 2 if eaves - ground < 3.0 * width else 4
    storey = (eaves - ground) / storeys
    for aside in (-0.24 * width, 0.24 * width):
        for low in (ground + storey * (number + 0.25) for number in range(storeys)):
            high = low + min(0.6 * storey, 0.6 * width)
            things.append(Thing(panel(azimuth, distance - 6.0, 0.3 * width, (low, high), aside), f"pane.{kind % 3}"))
            sill = block(azimuth, distance - 25.0, (0.34 * width, 30.0), (low - 0.03 * width, low), aside_mm=aside)
            things.append(Thing(sill, "concrete", 1.5))
    return things


def _water_tower(azimuth: float, distance: float, width: float, heights: tuple[float, float]) -> list[Thing]:
    """A tank with a domed roof on four legs with a ladder."""
    ground, top = heights
    radius = width / 2.0
    centre = distance + radius
    bottom = ground + 0.6 * (top - ground)
    shoulder = top - 0.1 * (top - ground)
    legs = [
        Thing(
            Cylinder(
                at(azimuth, centre + ahead, ground, 1.1 * side), at(azimuth, centre + ahead, bottom, side), 0.06 * width
            ),
            "metal",
            0.7,
        )
        for side in (-0.7 * radius, 0.7 * radius)
        for ahead in (-0.65 * radius, 0.65 * radius)
    ]
    braces = [
        Thing(
            Cylinder(
                at(azimuth, centre - 0.65 * radius, ground + low, -0.7 * radius),
                at(azimuth, centre - 0.65 * radius, ground + high, 0.7 * radius),
                0.025 * width,
            ),
            "metal",
            0.7,
        )
        for low, high in (
            (0.2 * (bottom - ground), 0.95 * (bottom - ground)),
            (0.95 * (bottom - ground), 0.2 * (bottom - ground)),
        )
    ]
    return [
        Thing(Cylinder(at(azimuth, centre, bottom), at(azimuth, centre, shoulder), radius), "cladding", 1.15),
        Thing(Ellipsoid(at(azimuth, centre, shoulder), (1.06 * radius, 1.06 * radius, top - shoulder)), "rust", 1.4),
        *legs,
        *braces,
    ]


def _lines(volume: DrawnVolume) -> list[Thing]:
    """Cables from mast to mast, all round above the yard."""
    distance = volume.distance(3, 0.6)
    posts = [at(90.0 * turn + 12.0, distance, 0.8 * volume.top(distance)) for turn in range(4)]
    ends = zip(posts, [*posts[1:], posts[0]], strict=True)
    return [Thing(Cylinder(start, end, 0.003 * DRAWN_REACH_MM), "plastic") for start, end in ends]
