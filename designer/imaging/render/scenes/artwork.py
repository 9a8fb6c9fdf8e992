"""What stands on surfaces, drawn as grey images: bricks, boards, books, posters, windows, pipe walls.

Images are (rows, columns) from 0 to 1 with the lowest row first, sides powers of two, and repeat without a seam
where a surface repeats them. Sizes are those of the things themselves, in mm.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from designer.imaging.render.scenes.artwork_works import (
    brick_wall,
    cartons,
    cladding,
    floor_slabs,
    lattice,
    leaves,
    pane,
    pipe_wall,
    rack,
    roof_tiles,
    sign,
)
from designer.imaging.render.scenes.brushes import (
    Array,
    Random,
    blotches,
    fibres,
    frame,
    print_lines,
    speckle,
    word,
    write,
)


def boards(random: Random) -> Array:
    """Floor boards of 128 mm, 2 m by 1 m at 4 mm to a texel."""
    image = np.empty((256, 512))
    for row in range(8):
        shift = int(random.integers(512))
        plank = np.concatenate(
            [0.36 + 0.2 * random.random() + 0.1 * fibres(random, (32, length)) for length in (232, 280)], axis=1
        )
        plank[:, [0, 231, 232, 511]] = 0.18
        plank[0] = 0.2
        image[32 * row : 32 * row + 32] = np.roll(plank, shift, axis=1)
    return image


def wood(random: Random) -> Array:
    """Veneer with fibres upright, 1 m by 1 m at 4 mm to a texel."""
    image = 0.42 + 0.16 * fibres(random, (256, 256)).T
    image[:, ::128] = 0.2
    return np.asarray(image)


def books(random: Random) -> Array:
    """Three shelves full of books, 1 m wide and 1 m high at 2 mm to a texel."""
    image = np.full((512, 512), 0.1)
    for shelf, bottom in enumerate((0, 171, 341)):
        top = (171, 341, 512)[shelf]
        image[bottom : bottom + 10] = 0.62
        column = 0
        while column < 504:
            width = min(int(random.integers(8, 24)), 512 - column)
            height = int((top - bottom - 14) * random.uniform(0.72, 0.98))
            spine = np.full((height, width), random.choice([0.14, 0.25, 0.38, 0.52, 0.7, 0.85]))
            spine += random.uniform(-0.06, 0.06)
            print_tone = 0.85 if spine[0, 0] < 0.5 else 0.15
            if width >= 8:
                _spine_print(random, spine, print_tone)
            spine[:, 0] *= 0.4
            spine[:, -1] *= 0.6
            image[bottom + 10 : bottom + 10 + height, column : column + width] = spine
            column += width
            if random.random() < 0.06:
                column += int(random.integers(8, 30))
    image[:, 506:] = 0.62
    return np.asarray(np.clip(image, 0.03, 0.95))


def ceiling_tiles(random: Random) -> Array:
    """Mineral tiles of 512 mm, 1 m by 1 m at 4 mm to a texel."""
    image = 0.78 + 0.03 * speckle(random, (256, 256), 1)
    image[random.random((256, 256)) < 0.03] = 0.5
    image[::128] = image[:, ::128] = 0.52
    image[1::128] = image[:, 1::128] = 0.6
    return np.asarray(image)


def poster(random: Random) -> Array:
    """A poster 512 mm wide and 1 m high at 2 mm to a texel: a picture, a title, lines of print."""
    image = np.full((512, 256), 0.9)
    ground = random.uniform(0.2, 0.8)
    scene = ground + 0.25 * blotches(random, (256, 256), 90)[:, :220]
    hill = 90 + 45 * np.sin(np.linspace(0, random.uniform(4, 9), 220) + random.uniform(0, 6))
    rows = np.arange(256)[:, None]
    scene = np.where(rows < hill, 0.22 + 0.1 * speckle(random, (256, 220), 1), scene)
    centre = random.uniform((40, 170), (180, 220))
    disc = np.hypot(rows - centre[1], np.arange(220) - centre[0]) < random.uniform(18, 34)
    scene[disc] = 0.95 if ground < 0.6 else 0.12
    image[200:456, 18:238] = scene
    write(image, word(random, 7), (18, 462), 34, 0.1)
    print_lines(random, image, (18, 20), (238, 186), 9)
    frame(image, 5, 0.15)
    return np.asarray(np.clip(image, 0.04, 0.95))


def notices(random: Random) -> Array:
    """A cork board with sheets of paper, 1 m by 1 m at 4 mm to a texel."""
    image = 0.4 + 0.1 * speckle(random, (256, 256), 1)
    for left in (12, 72, 132, 192):
        for bottom in (14, 92, 170):
            column, row = left + int(random.integers(-5, 6)), bottom + int(random.integers(-6, 7))
            sheet = np.full((70, 50), random.uniform(0.7, 0.93))
            if random.random() < 0.35:
                sheet[22:62, 6:44] = 0.35 + 0.25 * blotches(random, (64, 64), 14)[:40, :38]
            else:
                print_lines(random, sheet, (5, 5), (45, 54), 5)
                sheet[58:63, 5:32] = 0.15
            image[row : row + 70, column : column + 50] = sheet
            image[row + 66 : row + 69, column + 24 : column + 27] = 0.1
    frame(image, 7, 0.25)
    return np.asarray(np.clip(image, 0.04, 0.95))


def whiteboard(random: Random) -> Array:
    """A board with sketches and writing, 1 m by 1 m at 4 mm to a texel."""
    image = np.full((256, 256), 0.86) + 0.03 * blotches(random, (256, 256), 80)
    canvas = np.ascontiguousarray(image)
    for _ in range(5):
        x, y = (int(value) for value in random.integers(25, 190, 2))
        cv2.rectangle(canvas, (x, y), (x + 45, y + 25), 0.2, 2)
        cv2.line(canvas, (x + 45, y + 12), (x + 62, y + int(random.integers(-20, 40))), 0.3, 2)
    for line in range(7):
        write(canvas, word(random, 12), (20 + 30 * (line % 2), 16 + 32 * line), 14, 0.3)
    angles = np.linspace(0, 4 * np.pi, 60)
    curve = np.stack([np.linspace(130, 235, 60), 60 + 30 * np.sin(angles)], axis=-1).astype(np.int32)
    cv2.polylines(canvas, [curve], False, 0.2, 2)
    frame(canvas, 7, 0.4)
    return np.asarray(np.clip(canvas, 0.04, 0.95))


def screen(random: Random) -> Array:
    """A monitor 512 mm wide and 256 mm high at 2 mm to a texel: windows with print and a graph."""
    image = np.full((128, 256), 0.3)
    for left, right in ((8, 124), (132, 248)):
        image[10:118, left:right] = 0.88
        image[108:118, left:right] = 0.5
        print_lines(random, image, (left + 6, 14), (right - 6, 104), 7)
    image[20:70, 140:240] = 0.15
    curve = np.stack([np.arange(140, 240), 45 + 18 * np.sin(np.arange(100) / 8.0)], axis=-1).astype(np.int32)
    cv2.polylines(image, [curve], False, 0.9, 2)
    frame(image, 6, 0.08)
    return np.asarray(np.clip(image, 0.05, 0.95))


def window(random: Random) -> Array:
    """A window 1 m wide and 1 m high at 4 mm to a texel: frame, cross bars, and houses and trees under the sky."""
    rows, columns = np.indices((256, 256))
    image = 0.93 - 0.12 * rows[::-1] / 256 + 0.05 * blotches(random, (256, 256), 60)
    column = 0
    while column < 256:
        width, height = int(random.integers(28, 60)), int(random.integers(50, 130))
        house = np.full((height, min(width, 256 - column)), random.uniform(0.35, 0.6))
        for row in range(10, height - 14, 22):
            for across in range(6, house.shape[1] - 8, 14):
                house[row : row + 12, across : across + 7] = 0.18
        image[:height, column : column + width] = house
        column += width
    leaves = blotches(random, (256, 256), 9)
    for _ in range(4):
        x, y, size = random.uniform(0, 256), random.uniform(15, 60), random.uniform(22, 45)
        crown = np.hypot(columns - x, rows - y) < size * (1 + 0.3 * leaves)
        image = np.where(crown, 0.2 + 0.12 * leaves, image)
    for bar in (0, 122, 244):
        image[:, bar : bar + 12] = 0.82
        image[:, bar] = image[:, bar + 11] = 0.45
    for bar in (0, 150, 244):
        image[bar : bar + 12] = 0.82
        image[bar] = image[bar + 11] = 0.45
    return np.asarray(np.clip(image, 0.05, 0.97))


def door(random: Random) -> Array:
    """A panelled door 1 m wide and 2 m high at 4 mm to a texel."""
    image = 0.55 + 0.07 * fibres(random, (256, 512)).T
    for bottom, top in ((30, 200), (225, 350), (375, 480)):
        for left, right in ((34, 116), (140, 222)):
            image[bottom:top, left:right] *= 0.86
            image[bottom : bottom + 4, left:right] *= 1.3
            image[top - 4 : top, left:right] *= 0.6
            image[bottom:top, left : left + 4] *= 0.65
            image[bottom:top, right - 4 : right] *= 1.25
    image[236:246, 226:244] = 0.9
    image[228:254, 234:240] = 0.12
    frame(image, 10, 0.3)
    return np.asarray(np.clip(image, 0.05, 0.95))


def cupboard(random: Random) -> Array:
    """Steel drawers with handles and labels, 512 mm wide and 1 m high at 2 mm to a texel."""
    image = 0.5 + 0.03 * blotches(random, (512, 256), 90) + 0.015 * speckle(random, (512, 256), 1)
    for bottom in range(0, 512, 128):
        image[bottom : bottom + 4] = 0.15
        image[bottom + 4 : bottom + 7] *= 1.25
        image[bottom + 60 : bottom + 70, 88:168] = 0.85
        image[bottom + 56 : bottom + 60, 88:168] = 0.2
        image[bottom + 86 : bottom + 112, 96:160] = 0.92
        write(image, word(random, 4), (100, bottom + 92), 14, 0.15)
    image[:, :4] = image[:, -4:] = 0.18
    return np.asarray(np.clip(image, 0.05, 0.95))


def shirt(random: Random) -> Array:
    """Checked cloth, 128 mm by 128 mm at 2 mm to a texel."""
    rows, columns = np.indices((64, 64))
    image = 0.42 + 0.1 * np.sign(np.sin(2 * np.pi * rows / 16)) + 0.1 * np.sign(np.sin(2 * np.pi * columns / 32))
    return np.asarray(image + 0.03 * speckle(random, image.shape, 1))


def face(random: Random) -> Array:
    """A head once round, the face in the middle, hair elsewhere: 128 by 128 texels to be fitted."""
    rows, columns = np.indices((128, 128))
    away = np.abs(columns - 64)
    image = 0.62 + 0.02 * speckle(random, (128, 128), 1) - 0.16 * (away / 40.0) ** 2 * (away < 40)
    hair = (away > 27 + 4 * np.sin(rows / 9.0)) | (rows > 96 - away**2 / 60.0)
    strands = 0.15 + 0.05 * fibres(random, (128, 128)).T
    image = np.where(hair & (rows > 28), strands, image)
    for eye in (51, 77):
        image[66:72, eye - 6 : eye + 6] = 0.85
        image[65:73, eye - 3 : eye + 3] = 0.08
        image[77:80, eye - 8 : eye + 8] = 0.2
    image[48:52, 58:70] = 0.45
    image[50:70, 66:69] = 0.54
    image[35:39, 54:74] = 0.32
    return np.asarray(np.clip(image, 0.05, 0.95))


def _spine_print(random: Random, spine: Array, ink: float) -> None:
    height, width = spine.shape
    for band in random.uniform(0.05, 0.95, int(random.integers(0, 3))):
        row = int(band * (height - 4))
        spine[row : row + 4] = ink
    row, end = int(height * 0.25), int(height * random.uniform(0.5, 0.8))
    while row < end:
        letter = int(random.integers(2, 5))
        spine[row : row + letter, width // 3 : width - width // 3 : 1] = ink
        row += letter + int(random.integers(1, 4))


ARTWORK: dict[str, Callable[[Random], Array]] = {
    artwork.__name__: artwork
    for artwork in (
        brick_wall, boards, wood, books, ceiling_tiles, floor_slabs, poster, notices, whiteboard, screen, window, door,
        cupboard, rack, cartons, sign, cladding, roof_tiles, lattice, pipe_wall, shirt,
        face, leaves, pane,
    )
}  # fmt: skip
