"""Procedural textures: sums of plane waves in space, so that every surface they fill is textured without seams.

A wave that is finer than what a pixel sees would alias. Each octave therefore fades with the pixel's footprint as
if seen through a Gaussian, which for plane waves is exact and needs no look-up of coarser copies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from designer.files import InputError
from designer.imaging.render.compiled import compiled_loops

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
TextureKind = Literal["rich", "poor", "repetitive", "natural"]
TEXTURE_KINDS: tuple[TextureKind, ...] = get_args(TextureKind)

# Of the largest extent of a scene: 4 mm to 1 m in a scene of 5 m.
FINEST_WAVELENGTH, COARSEST_WAVELENGTH = 0.8e-3, 0.2
WAVES_PER_OCTAVE = 12
RICH_CONTRAST, POOR_CONTRAST, REPETITIVE_CONTRAST = 0.3, 0.02, 0.35
# A poor texture keeps only shades wider than this; the period of a repetitive one.
POOR_WAVELENGTH, REPETITIVE_PERIOD = 0.1, 0.014
# Waves of which less is left are not added: a fraction of a grey level.
LEAST_CONTRAST_LEFT = 1e-3


@dataclass(frozen=True, slots=True)
class Octave:
    """Plane waves of one octave: ``waves`` (3, m) in radians per mm, ``phases`` (m,), all of one ``amplitude``.

    ``wave_number`` is the largest length of a wave vector, in radians per mm.
    """

    waves: Floats
    phases: Floats
    amplitude: float
    wave_number: float

    def in_turns(self) -> tuple[Floats, Floats]:
        """Waves and phases as parts of a full turn: (3, m) per mm, and (m,)."""
        turn = np.float32(2.0 * np.pi)
        return self.waves / turn, self.phases / turn


@dataclass(frozen=True, slots=True)
class Texture:
    """A scalar pattern in space between -1 and 1 (mean 0), to modulate a surface's tone."""

    octaves: tuple[Octave, ...]


def make_texture(kind: str, extent_mm: float, seed: int = 0) -> Texture:
    """The texture of a scene that extends over ``extent_mm``.

    ``rich`` holds equal contrast in every octave and does not repeat; ``poor`` holds faint, wide shades alone;
    ``repetitive`` is a cubic lattice, all of whose cells look alike. ``natural`` leaves the surfaces of a scene to
    their materials (:mod:`designer.imaging.render.scenes.materials`); this is the texture of those that have none,
    which is rich.

    Raises
    ------
    InputError
        There is no such kind.
    """
    if kind not in TEXTURE_KINDS:
        raise InputError(f"texture {kind!r}: must be one of {', '.join(TEXTURE_KINDS)}")
    if kind == "repetitive":
        return Texture(_lattice(REPETITIVE_PERIOD * extent_mm))
    random = np.random.default_rng([seed, 0x7E97])
    finest, contrast = (FINEST_WAVELENGTH, RICH_CONTRAST) if kind != "poor" else (POOR_WAVELENGTH, POOR_CONTRAST)
    count = max(1, round(np.log2(COARSEST_WAVELENGTH / finest)))
    return Texture(_octaves(random, COARSEST_WAVELENGTH * extent_mm, count, contrast))


def make_grain(finest_mm: float, coarsest_mm: float, contrast: float, seed: int = 0) -> Texture:
    """A texture with equal contrast in every octave between two wavelengths, that of a material.

    ``contrast`` is its standard deviation, before the ends are rounded off.
    """
    random = np.random.default_rng([seed, 0x64A1])
    count = max(1, round(np.log2(coarsest_mm / finest_mm)))
    return Texture(_octaves(random, coarsest_mm, count, contrast))


def _octaves(random: np.random.Generator, coarsest_mm: float, count: int, contrast: float) -> tuple[Octave, ...]:
    # Independent waves of amplitude a have variance a^2 / 2 each.
    amplitude = contrast * np.sqrt(2.0 / (count * WAVES_PER_OCTAVE))
    octaves = []
    for octave in range(count):
        longest = coarsest_mm / 2.0**octave
        finer = 2.0 ** ((random.permutation(WAVES_PER_OCTAVE) + random.random(WAVES_PER_OCTAVE)) / WAVES_PER_OCTAVE)
        waves = _even_headings(random) * (2.0 * np.pi / longest * finer)
        phases = random.uniform(0.0, 2.0 * np.pi, WAVES_PER_OCTAVE)
        octaves.append(_octave(waves, phases, amplitude))
    return tuple(octaves)


def texture_values(texture: Texture, coordinates: Array, footprint: Array) -> Floats:
    """Values (n,) between -1 and 1 at texture coordinates (3, n) in mm.

    ``footprint`` (n,) is the distance in mm between neighbouring samples on the surface: waves are seen through a
    Gaussian whose standard deviation is half of that, so what would alias is under one percent of its contrast.
    """
    squared = np.square(footprint, dtype=np.float32)
    total = np.zeros(squared.size, dtype=np.float32)
    loops = compiled_loops("compiled_waves")
    places = None if loops else np.ascontiguousarray(coordinates.T, dtype=np.float32)
    for octave in texture.octaves:
        faded = np.exp(squared * np.float32(-(octave.wave_number**2) / 8.0))
        if loops:
            loops.add_octave(coordinates, faded, LEAST_CONTRAST_LEFT, *octave.in_turns(), octave.amplitude, total)
        elif places is not None:
            _add_octave(places, faded, octave, total)
    return np.tanh(total, out=total)


def _add_octave(places: Floats, faded: Floats, octave: Octave, total: Floats) -> None:
    """Add the waves of an octave, of which ``faded`` (n,) is left, to ``total`` (n,) in places (n, 3)."""
    seen = np.flatnonzero(faded > LEAST_CONTRAST_LEFT)
    values = places[seen] @ octave.waves
    values += octave.phases
    np.cos(values, out=values)
    # A product with ones: NumPy's own sum along short rows is several times slower.
    total[seen] += np.float32(octave.amplitude) * faded[seen] * (values @ np.ones(values.shape[1], np.float32))


def _even_headings(random: np.random.Generator) -> Array:
    """Unit vectors (3, WAVES_PER_OCTAVE), evenly over half the sphere (a Fibonacci spiral), turned at random.

    Even headings make every draw alike rich in every direction, so that one scene's noise predicts another's.
    """
    index = np.arange(WAVES_PER_OCTAVE)
    height = (index + 0.5) / WAVES_PER_OCTAVE
    azimuth = index * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - height**2)
    turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
    return np.asarray(turn @ np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height]))


def _lattice(period_mm: float) -> tuple[Octave, ...]:
    wave_number = 2.0 * np.pi / period_mm
    axes = np.eye(3) * wave_number
    edges = np.array([[1, 1, 0], [1, -1, 0], [0, 1, 1], [0, 1, -1], [1, 0, 1], [1, 0, -1]]).T * wave_number
    return (
        _octave(axes, np.zeros(3), REPETITIVE_CONTRAST / np.sqrt(3.0)),
        _octave(edges, np.zeros(6), REPETITIVE_CONTRAST / np.sqrt(12.0)),
    )


def _octave(waves: Array, phases: Array, amplitude: float) -> Octave:
    largest = float(np.linalg.norm(waves, axis=0).max())
    return Octave(waves.astype(np.float32), phases.astype(np.float32), float(amplitude), largest)
