"""Materials: what surfaces of a place are made of. A picture, a grain in space, or both, each with natural tones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from zlib import crc32

import numpy as np

from designer.imaging.render.pictures import Picture, make_picture, picture_values
from designer.imaging.render.scenes.artwork import ARTWORK
from designer.imaging.render.scenes.shapes import Array, Shape
from designer.imaging.render.scenes.unwrap import Fit, places_on
from designer.imaging.render.textures import Floats, Texture, make_grain, texture_values

# Sides of a texel in mm.
TEXEL_MM = {"books": 2.0, "poster": 2.0, "screen": 2.0, "cupboard": 2.0, "sign": 2.0, "shirt": 2.0,
            "floor_slabs": 8.0, "pipe_wall": 1.5, "face": 4.0, "leaves": 2.0}  # fmt: skip
USUAL_TEXEL_MM = 4.0
FITS: dict[str, Fit] = {
    **dict.fromkeys(
        ("poster", "notices", "whiteboard", "screen", "window", "door", "cupboard", "sign", "face", "pane"), "whole"
    ),
    "lattice": "across",
}
# Finest and coarsest wavelength in mm, and contrast.
_Grain = tuple[float, float, float]
GRAINS: dict[str, tuple[float, _Grain]] = {
    "plaster": (0.80, (8.0, 128.0, 0.06)),
    "paint": (0.62, (8.0, 128.0, 0.05)),
    "concrete": (0.48, (8.0, 1000.0, 0.20)),
    "soil": (0.34, (8.0, 1000.0, 0.25)),
    "carpet": (0.38, (6.0, 48.0, 0.16)),
    "cloth": (0.34, (6.0, 200.0, 0.16)),
    "skin": (0.62, (8.0, 60.0, 0.06)),
    "metal": (0.52, (6.0, 200.0, 0.10)),
    "rust": (0.36, (6.0, 400.0, 0.28)),
    "bark": (0.26, (10.0, 80.0, 0.35)),
    "plastic": (0.22, (8.0, 60.0, 0.07)),
    "clouds": (0.76, (6000.0, 96000.0, 0.10)),
}
# A little of this lies on what has a picture, so that there is detail between its texels.
OVER_PICTURES: _Grain = (6.0, 96.0, 0.04)


@dataclass(frozen=True, slots=True)
class Material:
    """A mean radiance, and over it a picture, which has a radiance of its own, and a grain in space."""

    tone: float
    grain: Texture
    picture: Picture | None = None
    fit: Fit = "repeated"


@dataclass(frozen=True, slots=True, eq=False)
class Finishes:
    """The materials (s,) of a world's shapes; their sizes are drawn at ``scale`` mm for each of their own.

    ``tones`` (s,) multiply their radiance; ``shifts`` (s,) in mm set the repeating pictures of shapes apart.
    """

    materials: tuple[Material, ...]
    tones: Array
    shifts: Array
    scale: float


@lru_cache(maxsize=64)
def make_material(name: str, seed: int = 0) -> Material:
    """A material of ``GRAINS`` or ``ARTWORK``, or a further drawing of the latter: ``poster.1``."""
    random_seed = crc32(name.encode())
    if name in GRAINS:
        tone, (finest, coarsest, contrast) = GRAINS[name]
        return Material(tone, make_grain(finest, coarsest, contrast, seed + random_seed))
    kind = name.partition(".")[0]
    texels = np.clip(ARTWORK[kind](np.random.default_rng([seed, random_seed])), 0.02, 0.97)
    finest, coarsest, contrast = OVER_PICTURES
    picture = make_picture(texels, TEXEL_MM.get(kind, USUAL_TEXEL_MM))
    grain = make_grain(finest, coarsest, contrast, seed + random_seed)
    return Material(1.0, grain, picture, FITS.get(kind, "repeated"))


def brightness(
    finishes: Finishes, index: int, shape: Shape, points: Array, normals: Array, directions: Array, footprint: Array
) -> Floats:
    """Radiance (n,) of the shape of that index under even light, where rays meet it in ``points`` (3, n).

    ``normals`` and ``directions`` are (3, n), ``footprint`` (n,) the distance in mm between neighbouring samples.
    """
    material, scale = finishes.materials[index], finishes.scale
    tone = np.float32(finishes.tones[index] * material.tone)
    shift = float(finishes.shifts[index])
    fine = footprint / scale
    result = tone * (1.0 + texture_values(material.grain, points / scale + shift, fine))
    if material.picture is None:
        return np.asarray(result, dtype=np.float32)
    width, height = material.picture.size_mm
    size = (width * scale, height * scale)
    across, up, shrunk = places_on(shape, points, normals, directions, size, material.fit)
    sideways = shift if material.fit == "repeated" else 0.0
    return np.asarray(result * picture_values(material.picture, across / scale + sideways, up / scale, fine * shrunk))
