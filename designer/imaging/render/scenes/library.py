"""The scenes: office, pipe, hall, sky, a cylinder and the calibration scene, built around a design's working volume.

The origin of a scene is the middle of the baseline. A scene is drawn for a far distance of 5 m and scaled to the far
distance of the design, so that its surfaces lie in the working volume; the pipe takes its radius from the near and
far distance. Lengths in mm, frame of the design (z up).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from designer.design import Design
from designer.files import InputError
from designer.imaging.render.scenes.shapes import Box, Cylinder, Point, Rectangle, Shape, Sphere
from designer.imaging.render.scenes.world import World
from designer.imaging.render.textures import make_texture

SceneName = Literal["office", "pipe", "hall", "sky", "cylinder"]
SCENE_NAMES: tuple[SceneName, ...] = get_args(SceneName)
MESH_SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")

DRAWN_REACH_MM = 5000.0
# Below this far distance a sensor works in a pipe rather than in a room.
NEAR_FIELD_MM = 1000.0
CALIBRATION_WALLS = 24
DARKEST_TONE, BRIGHTEST_TONE = 0.18, 0.68


def build_world(
    name: str, design: Design, texture: str = "rich", seed: int = 0, sensor_height_mm: float | None = None
) -> World:
    """The scene of that name around a design; ``auto`` chooses by its working volume, a mesh file is loaded.

    Parameters
    ----------
    name
        One of ``SCENE_NAMES``, ``auto``, or the path of a mesh (mm, origin at the middle of the baseline, z up).
    texture
        ``rich``, ``poor`` or ``repetitive``.
    seed
        Of tones and textures; the shapes stay.
    sensor_height_mm
        Height of the middle of the baseline above the floor (office, hall), the scene's own if not given.

    Raises
    ------
    InputError
        There is no such scene or texture, the mesh cannot be used, or the scene is empty.
    """
    if sensor_height_mm is not None and not 0.0 < sensor_height_mm < np.inf:
        raise InputError(f"sensor height {sensor_height_mm:g} mm: must be greater than 0")
    near, far = design.working_volume.distance_mm
    middle = design.views.middle_mm
    scene = choose_scene(design) if name == "auto" else name
    if Path(scene).suffix.lower() in MESH_SUFFIXES:
        from designer.imaging.render.scenes.mesh import read_mesh

        shapes: Sequence[Shape] = [read_mesh(Path(scene), (0.0, 0.0, middle))]
    elif scene == "pipe":
        shapes = _pipe(near, far, middle)
    elif scene == "cylinder":
        shapes = [round_wall(float(np.sqrt(near * far)), middle, far)]
    elif scene in _DRAWN:
        scale = far / DRAWN_REACH_MM
        drawn, own_height = _DRAWN[scene]
        height = own_height if sensor_height_mm is None else sensor_height_mm / scale
        shapes = [_placed(shape, scale, middle) for shape in drawn(height)]
    else:
        raise InputError(f"scene {scene!r}: must be one of auto, {', '.join(SCENE_NAMES)}, or a mesh file")
    return make_world(Path(scene).stem, shapes, far, texture, seed)


def make_world(name: str, shapes: Sequence[Shape], extent_mm: float, texture: str = "rich", seed: int = 0) -> World:
    """A world of shapes, each with a tone and a piece of the texture of its own.

    Raises
    ------
    InputError
        There are no shapes, or no such texture.
    """
    if not shapes:
        raise InputError(f"scene {name!r}: is empty; it needs at least one surface")
    random = np.random.default_rng([seed, 0x70E5])
    # The golden ratio spreads tones evenly however many shapes there are, and sets neighbours in the list apart.
    steps = (random.random() + np.arange(len(shapes)) * 0.618033988749895) % 1.0
    tones = np.asarray(DARKEST_TONE + (BRIGHTEST_TONE - DARKEST_TONE) * steps, dtype=float)
    offsets = random.uniform(-extent_mm, extent_mm, (len(shapes), 3))
    return World(name, tuple(shapes), tones, offsets, make_texture(texture, extent_mm, seed))


def calibration_world(design: Design, texture: str = "rich", seed: int = 0) -> World:
    """A ring of flat walls around the sensor, which goes from the nearest to the farthest working distance and back.

    All distances of the working volume occur at all elevations and, since each wall has a tone of its own, in shades
    from dark to bright; no wall hides another. The texture is turned from wall to wall, so that what is measured on
    them is an average over its directions.
    """
    near, far = design.working_volume.distance_mm
    middle = design.views.middle_mm
    azimuths = 2.0 * np.pi * (np.arange(CALIBRATION_WALLS + 1) + 0.5) / CALIBRATION_WALLS
    distances = np.sqrt(near * far) * (far / near) ** (0.5 * np.cos(azimuths))
    corners = np.stack([distances * np.cos(azimuths), distances * np.sin(azimuths)], axis=-1)
    # Halves that overlap by a millionth: no ray slips through a corner by rounding.
    halves = (corners[1:] - corners[:-1]) * (0.5 + 1e-6)
    walls = [
        Rectangle((float(x), float(y), middle), (float(across), float(along), 0.0), (0.0, 0.0, 100.0 * far))
        for (x, y), (across, along) in zip((corners[1:] + corners[:-1]) / 2.0, halves, strict=True)
    ]
    random = np.random.default_rng([seed, 0x7042])
    turns, _ = np.linalg.qr(random.standard_normal((len(walls), 3, 3)))
    return replace(make_world("calibration", walls, far, texture, seed), turns=turns)


def round_wall(radius_mm: float, middle_mm: float, extent_mm: float) -> Cylinder:
    """A wide cylinder about the axis, its ends out of sight of any working volume."""
    reach = 100.0 * max(radius_mm, extent_mm)
    return Cylinder((0.0, 0.0, middle_mm - reach), (0.0, 0.0, middle_mm + reach), radius_mm)


def choose_scene(design: Design) -> SceneName:
    """The scene that fits a working volume: near field in a pipe, looking down a hall, up the sky, else an office."""
    low, high = design.working_volume.elevation_deg
    if design.working_volume.distance_mm[1] < NEAR_FIELD_MM:
        return "pipe"
    if (low + high) / 2.0 < -15.0:
        return "hall"
    if (low + high) / 2.0 > 15.0:
        return "sky"
    return "office"


def _office(height: float) -> list[Shape]:
    """A furnished room 2.7 m high, the sensor at ``height`` over its floor; surfaces 0.7 to 5 m away."""
    floor, ceiling = -height, 2700.0 - height
    return [
        Box((-4100.0, -3300.0, floor), (3500.0, 3900.0, ceiling)),
        *_table(floor, (1500.0, -900.0), (1400.0, 700.0), 20.0),
        *_table(floor, (-1900.0, 1100.0), (1600.0, 800.0), -35.0),
        # On the tables: screens, boxes, balls.
        Box((1250.0, -1250.0, floor + 760.0), (1750.0, -1200.0, floor + 1160.0), 20.0),
        Sphere((1150.0, -620.0, floor + 880.0), 120.0),
        Box((-2300.0, 900.0, floor + 760.0), (-1900.0, 1200.0, floor + 1090.0), 15.0),
        Cylinder((-1500.0, 1150.0, floor + 760.0), (-1500.0, 1150.0, floor + 1060.0), 90.0),
        # About the room: cabinets, a shelf, a column, a barrel, a ball on a stool, a roll of carpet.
        Box((2300.0, 1100.0, floor), (3000.0, 2200.0, floor + 1900.0), -15.0),
        Box((-700.0, 3100.0, floor), (900.0, 3500.0, floor + 1500.0)),
        Box((-3700.0, -2300.0, floor), (-3100.0, -900.0, floor + 1250.0), 10.0),
        Cylinder((-1250.0, -1750.0, floor), (-1250.0, -1750.0, ceiling), 190.0),
        Cylinder((700.0, 1750.0, floor), (700.0, 1750.0, floor + 1060.0), 320.0),
        Sphere((-250.0, -1150.0, floor + 980.0), 230.0),
        Cylinder((-250.0, -1150.0, floor), (-250.0, -1150.0, floor + 750.0), 180.0),
        Cylinder((100.0, -2700.0, floor + 1000.0), (1700.0, -2500.0, floor + 1150.0), 200.0),
        Box((300.0, -2900.0, floor), (1600.0, -2400.0, floor + 800.0), 7.0),
        # The nearest things, two of them wide: a screen between desks, a filing cabinet.
        Box((-1075.0, 1060.0, floor), (-175.0, 1100.0, floor + 1450.0), 30.0),
        Box((-1562.0, -896.0, floor), (-1162.0, -96.0, floor + 1400.0), 20.0),
        Box((700.0, 250.0, floor + 700.0), (950.0, 500.0, floor + 1180.0), 30.0),
        Cylinder((700.0, 375.0, floor), (950.0, 375.0, floor + 700.0), 70.0),
        Sphere((-780.0, 60.0, floor + 1020.0), 130.0),
        Cylinder((-780.0, 60.0, floor), (-780.0, 60.0, floor + 900.0), 40.0),
    ]


def _table(floor: float, centre: tuple[float, float], size: tuple[float, float], yaw_deg: float) -> list[Shape]:
    (x, y), (width, depth) = centre, size
    angle = np.radians(yaw_deg)
    top: list[Shape] = [
        Box((x - width / 2, y - depth / 2, floor + 720.0), (x + width / 2, y + depth / 2, floor + 760.0), yaw_deg)
    ]
    for right in (-0.45, 0.45):
        for back in (-0.42, 0.42):
            leg_x = x + width * right * np.cos(angle) - depth * back * np.sin(angle)
            leg_y = y + width * right * np.sin(angle) + depth * back * np.cos(angle)
            top.append(Cylinder((leg_x, leg_y, floor), (leg_x, leg_y, floor + 720.0), 30.0))
    return top


def _hall(height: float) -> list[Shape]:
    """A hall seen from its ceiling, ``height`` over the floor: walls, vehicles, crates and people."""
    floor = -height
    shapes: list[Shape] = [
        Box((-4600.0, -4300.0, floor), (4400.0, 4700.0, 900.0)),
        # Vehicles: body and cabin.
        Box((1300.0, -1900.0, floor + 150.0), (3300.0, -800.0, floor + 700.0), 12.0),
        Box((1700.0, -1800.0, floor + 700.0), (2800.0, -900.0, floor + 1250.0), 12.0),
        Box((-3500.0, 900.0, floor + 150.0), (-1700.0, 2000.0, floor + 800.0), -30.0),
        Box((-3100.0, 1000.0, floor + 800.0), (-2200.0, 1900.0, floor + 1350.0), -30.0),
        # A tall rack beside the sensor, crates and a tank.
        Box((-1900.0, -900.0, floor), (-1250.0, 500.0, floor + 2250.0), 10.0),
        Box((-900.0, 2400.0, floor), (300.0, 3500.0, floor + 900.0), 25.0),
        Box((900.0, 1100.0, floor), (1700.0, 1900.0, floor + 700.0), 40.0),
        Cylinder((-2600.0, -2900.0, floor + 500.0), (-800.0, -2700.0, floor + 500.0), 500.0),
    ]
    people = ((-900.0, -1500.0), (700.0, -2600.0), (2700.0, 900.0), (-200.0, 1600.0), (-3300.0, -700.0))
    for index, (x, y) in enumerate((*people, (2400.0, 3000.0))):
        tall = floor + 1480.0 + 70.0 * (index % 4)
        shapes += [Cylinder((x, y, floor), (x, y, tall), 230.0), Sphere((x, y, tall + 120.0), 125.0)]
    return shapes


def _sky(height: float) -> list[Shape]:
    """A dome of clouds with masts, beams and cables before it; ``height`` is that of the sensor over the ground."""
    shapes: list[Shape] = [
        Sphere((0.0, 0.0, 0.0), 5200.0),
        Rectangle((0.0, 0.0, -height), (6000.0, 0.0, 0.0), (0.0, 6000.0, 0.0)),
        # A gantry: two beams and a girder between them.
        Box((-3500.0, 1900.0, 1500.0), (3300.0, 2200.0, 1850.0), 8.0),
        Box((-3300.0, -2500.0, 1100.0), (3500.0, -2250.0, 1400.0), -6.0),
        Box((-1900.0, -2400.0, 1500.0), (-1600.0, 2200.0, 1800.0)),
        # A tank on legs, a ball on a mast, a chimney.
        Cylinder((2400.0, -900.0, 1200.0), (2400.0, 900.0, 1400.0), 550.0),
        Sphere((1000.0, 900.0, 1150.0), 260.0),
        Cylinder((-2900.0, 800.0, -height), (-2900.0, 800.0, 2600.0), 320.0),
        # The nearest thing, and wide: a hoarding.
        Box((980.0, -1250.0, 250.0), (1020.0, -350.0, 1350.0), -38.7),
    ]
    masts = ((1000.0, 900.0, 900.0), (2200.0, 2900.0, 2300.0), (-900.0, -1500.0, 1700.0), (900.0, -3200.0, 2700.0))
    shapes += [Cylinder((x, y, -height), (x, y, top), 55.0) for x, y, top in masts]
    cables: tuple[tuple[Point, Point], ...] = (
        ((2200.0, 2900.0, 2300.0), (-2900.0, 800.0, 2500.0)),
        ((-900.0, -1500.0, 1650.0), (900.0, -3200.0, 2600.0)),
        ((-900.0, -1500.0, 1600.0), (-2900.0, 800.0, 1700.0)),
    )
    shapes += [Cylinder(start, end, 22.0) for start, end in cables]
    return shapes


def _pipe(near: float, far: float, middle: float) -> list[Shape]:
    """A pipe along the axis, the sensor off its centre, with deposits, rods and a branch inside it."""
    mean, swing = (near + far) / 2.0, (far - near) / 2.0
    radius, aside = mean, 0.7 * swing
    reach = 100.0 * far
    lump = 0.28 * swing

    def on_wall(azimuth_deg: float, height: float, depth: float = 0.0) -> Point:
        angle = np.radians(azimuth_deg)
        inside = radius - depth
        return float(aside + inside * np.cos(angle)), float(inside * np.sin(angle)), float(middle + height * radius)

    rod = [on_wall(215.0, -1.0, 0.2 * lump), on_wall(215.0, 1.0, 0.2 * lump)]
    branch = [on_wall(80.0, 0.05, 0.6 * lump), on_wall(125.0, 0.02, 0.6 * lump)]
    return [
        Cylinder((aside, 0.0, middle - reach), (aside, 0.0, middle + reach), radius),
        *(Sphere(on_wall(azimuth, height), lump) for azimuth, height in ((20, 0.05), (50, -0.08), (310, 0.0))),
        Cylinder(rod[0], rod[1], 0.35 * lump),
        Cylinder(branch[0], branch[1], 0.5 * lump),
        Box(
            (aside - 0.72 * radius - lump, -0.72 * radius - lump, middle - 0.1 * radius),
            (aside - 0.72 * radius + lump, -0.72 * radius + lump, middle + 0.08 * radius),
            45.0,
        ),
    ]


_DRAWN: dict[str, tuple[Callable[[float], list[Shape]], float]] = {
    "office": (_office, 1000.0),
    "hall": (_hall, 2600.0),
    "sky": (_sky, 1200.0),
}


def _placed(shape: Shape, scale: float, middle: float) -> Shape:
    """A drawn shape at the scale of a design and about the middle of its baseline."""

    def place(point: Point) -> Point:
        return scale * point[0], scale * point[1], scale * point[2] + middle

    def grow(vector: Point) -> Point:
        return scale * vector[0], scale * vector[1], scale * vector[2]

    match shape:
        case Box(low, high, yaw_deg):
            return Box(place(low), place(high), yaw_deg)
        case Sphere(centre, radius):
            return Sphere(place(centre), scale * radius)
        case Cylinder(start, end, radius):
            return Cylinder(place(start), place(end), scale * radius)
        case Rectangle(centre, half_width, half_height):
            return Rectangle(place(centre), grow(half_width), grow(half_height))
    raise TypeError(f"no such drawn shape: {shape!r}")
