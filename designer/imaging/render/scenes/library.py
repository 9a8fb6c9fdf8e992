"""The scenes: office, pipe, hall, sky, a cylinder and the calibration scene, built around a design's working volume.

The origin of a scene is the middle of the baseline. A scene is drawn for a far distance of 5 m and for the near
distance and elevations of the design, so that its surfaces fill the working volume, and then scaled to the far
distance. Lengths in mm, frame of the design (z up).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from designer.design import Design
from designer.files import InputError
from designer.imaging.render.scenes.hall import hall
from designer.imaging.render.scenes.layout import DRAWN_REACH_MM, DrawnVolume, Thing, drawn_volume_of
from designer.imaging.render.scenes.materials import Finishes, make_material
from designer.imaging.render.scenes.office import office
from designer.imaging.render.scenes.pipe import PICTURE_MM, pipe, pipe_radius
from designer.imaging.render.scenes.shapes import Box, Cylinder, Ellipsoid, Point, Rectangle, Shape, Sphere
from designer.imaging.render.scenes.sky import sky
from designer.imaging.render.scenes.world import World
from designer.imaging.render.textures import make_texture

SCENES: dict[str, Callable[[DrawnVolume], list[Thing]]] = {"office": office, "pipe": pipe, "hall": hall, "sky": sky}
"""What stands in each scene that is drawn for a working volume; an entry here is a scene."""
SCENE_NAMES = (*SCENES, "cylinder")
MESH_SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")

# Below this far distance a sensor works in a pipe rather than in a room.
NEAR_FIELD_MM = 1000.0
CALIBRATION_WALLS = 24
# Materials under a lamp that leaves no face at its own tone: white paper just does not saturate.
EXPOSURE = 1.15
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
        ``rich``, ``poor`` or ``repetitive``, the same on all surfaces; or ``natural``: the surfaces' own materials,
        which the cylinder and a mesh have not.
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

        return make_world(Path(scene).stem, [read_mesh(Path(scene), (0.0, 0.0, middle))], far, texture, seed)
    if scene == "cylinder":
        return make_world(scene, [round_wall(float(np.sqrt(near * far)), middle, far)], far, texture, seed)
    if scene not in SCENES:
        raise InputError(f"scene {scene!r}: must be one of auto, {', '.join(SCENE_NAMES)}, or a mesh file")
    volume, scale = drawn_volume_of(design, sensor_height_mm)
    # The nearest first: what they hide need not be looked for.
    things = sorted(SCENES[scene](volume), key=_nearness)
    world = make_world(scene, [_placed(thing.shape, scale, middle) for thing in things], far, texture, seed)
    if texture != "natural":
        return world
    drawn_at = scale * 2.0 * np.pi * pipe_radius(volume) / PICTURE_MM if scene == "pipe" else scale
    return replace(world, finishes=_finishes(things, drawn_at, seed))


def _nearness(thing: Thing) -> float:
    centre, radius = thing.shape.bounding_disc()
    return max(float(np.hypot(*centre)) - radius, 0.0)


def _finishes(things: Sequence[Thing], scale: float, seed: int) -> Finishes:
    random = np.random.default_rng([seed, 0xF141])
    return Finishes(
        tuple(make_material(thing.material, seed) for thing in things),
        EXPOSURE * np.array([thing.tone for thing in things]) * random.uniform(0.93, 1.07, len(things)),
        random.uniform(0.0, DRAWN_REACH_MM, len(things)),
        scale,
    )


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


def choose_scene(design: Design) -> str:
    """The scene that fits a working volume: near field in a pipe, looking down a hall, up the sky, else an office."""
    low, high = design.working_volume.elevation_deg
    if design.working_volume.distance_mm[1] < NEAR_FIELD_MM:
        return "pipe"
    if (low + high) / 2.0 < -15.0:
        return "hall"
    if (low + high) / 2.0 > 15.0:
        return "sky"
    return "office"


def _placed(shape: Shape, scale: float, middle: float) -> Shape:
    """A drawn shape at the scale of a design and about the middle of its baseline."""

    def place(point: Point) -> Point:
        return scale * point[0], scale * point[1], scale * point[2] + middle

    def grow(vector: Point) -> Point:
        return scale * vector[0], scale * vector[1], scale * vector[2]

    match shape:
        case Box(low, high, yaw_deg):
            return Box(place(low), place(high), yaw_deg)
        case Ellipsoid(centre, radii, yaw_deg):
            return Ellipsoid(place(centre), grow(radii), yaw_deg)
        case Sphere(centre, radius):
            return Sphere(place(centre), scale * radius)
        case Cylinder(start, end, radius):
            return Cylinder(place(start), place(end), scale * radius)
        case Rectangle(centre, half_width, half_height):
            return Rectangle(place(centre), grow(half_width), grow(half_height))
    raise TypeError(f"no such drawn shape: {shape!r}")
