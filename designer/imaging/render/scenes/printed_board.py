"""A printed board in front of a scene: a picture on a flat plate that stands anywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.pictures import make_picture
from designer.imaging.render.scenes.materials import Material
from designer.imaging.render.scenes.shapes import Array, Rectangle
from designer.imaging.render.scenes.world import World
from designer.imaging.render.textures import Texture

# Radiance of paper and of ink.
WHITE, BLACK = 0.85, 0.05
TEXELS_PER_MODULE = 8
MARGIN_MODULES = 8


def with_board(world: World, modules: NDArray[np.uint8], module_mm: float, turn: Array, corner_mm: Array) -> World:
    """A world of finished surfaces with a board in front.

    Parameters
    ----------
    modules
        The picture (rows, columns), 1 white and 0 black, the first row uppermost; a white margin surrounds it.
    turn, corner_mm
        The matrix (3, 3) whose columns are the board's right, down and into the board, and its upper left corner.

    Raises
    ------
    ValueError
        The world's surfaces have no finishes (texture ``natural``).
    """
    if world.finishes is None:
        raise ValueError("a board needs a world of natural finishes")
    rows, columns = (side + 2 * MARGIN_MODULES for side in modules.shape)
    texels = np.full([1 << (TEXELS_PER_MODULE * side - 1).bit_length() for side in (rows, columns)], WHITE)
    ink = np.kron(np.where(modules[::-1] > 0, WHITE, BLACK), np.ones((TEXELS_PER_MODULE, TEXELS_PER_MODULE)))
    start = TEXELS_PER_MODULE * MARGIN_MODULES
    texels[start : start + ink.shape[0], start : start + ink.shape[1]] = ink
    finishes = world.finishes
    picture = make_picture(texels, module_mm / TEXELS_PER_MODULE / finishes.scale)
    right, down = turn[:, 0], turn[:, 1]
    middle = corner_mm + module_mm / 2.0 * (modules.shape[1] * right + modules.shape[0] * down)
    half = module_mm / 2.0
    plate = Rectangle(
        tuple(middle.tolist()), tuple((half * columns * right).tolist()), tuple((-half * rows * down).tolist())
    )
    return replace(
        world,
        shapes=(plate, *world.shapes),
        tones=np.append(WHITE, world.tones),
        offsets=np.vstack([np.zeros(3), world.offsets]),
        turns=None if world.turns is None else np.concatenate([np.eye(3)[None], world.turns]),
        finishes=replace(
            finishes,
            materials=(Material(1.0, Texture(()), picture), *finishes.materials),
            tones=np.append(1.0, finishes.tones),
            shifts=np.append(0.0, finishes.shifts),
        ),
    )
