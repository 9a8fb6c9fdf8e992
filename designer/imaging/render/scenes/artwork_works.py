"""Drawings for halls, yards and pipes: bricks, racks, cartons, signs, cladding, roofs, lattices, leaves, pipe walls.

As :mod:`designer.imaging.render.scenes.artwork` has them.
"""

from __future__ import annotations

import cv2
import numpy as np

from designer.imaging.render.scenes.brushes import (
    LETTERS,
    Array,
    Random,
    blotches,
    fibres,
    frame,
    print_lines,
    speckle,
    texels_about,
    write,
)


def brick_wall(random: Random) -> Array:
    """Running bond of 256 mm bricks in courses of 64 mm, 2 m wide and 1 m high at 4 mm to a texel."""
    image = np.full((256, 512), 0.56) + 0.02 * speckle(random, (256, 512), 1)
    for course in range(16):
        for brick in range(8):
            left = 64 * brick + 32 * (course % 2)
            columns = np.arange(left + 1, left + 63) % 512
            tone = 0.28 + 0.2 * random.random()
            image[16 * course + 1 : 16 * course + 15, columns] = tone + 0.03 * speckle(random, (14, 62), 1)
    return np.asarray(image)


def floor_slabs(random: Random) -> Array:
    """A concrete floor with joints and a painted lane with an arrow, 4 m by 4 m at 8 mm to a texel."""
    image = 0.45 + 0.1 * blotches(random, (512, 512), 60) + 0.05 * speckle(random, (512, 512), 1)
    image[::128] = image[:, ::128] = 0.25
    for _ in range(25):
        row, column = random.integers(0, 512, 2)
        image[row : row + 2, column : column + int(random.integers(20, 90))] *= 0.75
    for lane in (40, 300):
        image[:, lane : lane + 13] = 0.86 - 0.1 * random.random((512, 13)) ** 4
    for dash in range(0, 512, 64):
        image[dash : dash + 34, 168:176] = 0.9
    return np.asarray(np.clip(image, 0.05, 0.95))


def rack(random: Random) -> Array:
    """A pallet rack 2 m wide with four levels of cartons on pallets, 2 m high, at 4 mm to a texel."""
    image = np.full((512, 512), 0.07)
    for bottom in range(0, 512, 128):
        image[bottom : bottom + 14] = 0.72
        image[bottom + 2 : bottom + 12 : 5] = 0.55
        for pallet in (14, 180, 346):
            image[bottom + 16 : bottom + 28, pallet : pallet + 150] = 0.5 + 0.1 * fibres(random, (16, 256))[:12, :150]
            image[bottom + 20 : bottom + 26, pallet + 16 : pallet + 62] = 0.08
            image[bottom + 20 : bottom + 26, pallet + 88 : pallet + 134] = 0.08
            tall = int(random.integers(2, 4))
            for layer in range(tall):
                for column in range(int(random.integers(2, 4))):
                    wide = 150 // 3 if random.random() < 0.4 else 49
                    left, low = pallet + column * 50, bottom + 28 + layer * 30
                    image[low : low + 29, left : left + wide] = _carton(random, (29, wide))
    for upright in (0, 166, 332, 500):
        image[:, upright : upright + 12] = 0.62
        image[::16, upright + 4 : upright + 8] = 0.15
        image[1::16, upright + 4 : upright + 8] = 0.15
    return np.asarray(np.clip(image, 0.04, 0.95))


def cartons(random: Random) -> Array:
    """Stacked cartons with tape and labels, 1 m by 1 m at 4 mm to a texel."""
    image = np.empty((256, 256))
    for row in range(0, 256, 64):
        edges = np.sort(random.choice(np.arange(2, 7), 2, replace=False)) * 32
        for left, right in zip((0, *edges), (*edges, 256), strict=True):
            image[row : row + 64, left:right] = _carton(random, (64, int(right - left)))
    return np.asarray(np.clip(image, 0.05, 0.95))


def sign(random: Random) -> Array:
    """A hanging sign 512 mm wide and 1 m high at 2 mm to a texel: a large character, an arrow, print."""
    image = np.full((512, 256), random.choice([0.16, 0.85]))
    ink = 0.92 if image[0, 0] < 0.5 else 0.1
    write(image, str(random.choice(LETTERS)) + str(random.integers(1, 9)), (26, 300), 150, ink, 16)
    tip = np.array([[60, 190], [128, 250], [196, 190], [150, 190], [150, 130], [106, 130], [106, 190]], dtype=np.int32)
    cv2.fillPoly(image, [tip], float(ink))
    print_lines(random, image, (24, 24), (232, 110), 16, ink)
    frame(image, 8, 0.5)
    image += 0.03 * blotches(random, (512, 256), 40)
    return np.asarray(np.clip(image, 0.04, 0.95))


def cladding(random: Random) -> Array:
    """Profiled sheets with rivets and run-off stains, 2 m by 2 m at 4 mm to a texel."""
    columns = np.arange(512)
    image = np.tile(0.55 + 0.1 * np.sign(np.sin(2 * np.pi * columns / 64.0)), (512, 1))
    streaks = blotches(random, (8, 512), 3)[0]
    image += 0.08 * streaks + 0.06 * blotches(random, (512, 512), 70) + 0.02 * speckle(random, (512, 512), 1)
    image[::256] = 0.25
    image[16::256, 16::32] = 0.2
    image[17::256, 16::32] = 0.85
    return np.asarray(np.clip(image, 0.05, 0.95))


def roof_tiles(random: Random) -> Array:
    """Rows of clay tiles, 1 m by 1 m at 4 mm to a texel."""
    rows, columns = np.indices((256, 256))
    image = 0.22 + 0.2 * (rows % 32) / 32.0 + 0.06 * np.cos(2 * np.pi * columns / 32.0)
    tones = random.uniform(-0.07, 0.07, (8, 8))
    return np.asarray(
        np.clip(image + np.kron(tones, np.ones((32, 32))) + 0.03 * speckle(random, (256, 256), 1), 0.05, 0.95)
    )


def lattice(random: Random) -> Array:
    """Struts of a lattice tower before the sky, 512 mm by 1 m at 4 mm to a texel."""
    image = np.full((256, 128), 0.84) + 0.04 * blotches(random, (256, 128), 40)
    for bottom in (0, 128):
        for start, end in (((4, 0), (123, 127)), ((123, 0), (4, 127))):
            cv2.line(image, (start[0], start[1] + bottom), (end[0], end[1] + bottom), 0.24, 7)
        image[bottom : bottom + 9] = 0.3
        image[bottom + 60 : bottom + 70, 54:74] = 0.18
    image[:, :10] = image[:, -10:] = 0.2
    image[::16, 3:6] = image[::16, -6:-3] = 0.6
    return np.asarray(np.clip(image + 0.02 * speckle(random, image.shape, 1), 0.05, 0.95))


def pipe_wall(random: Random) -> Array:
    """The wall of a steel pipe unrolled, once round (2048 texels) and an eighth of that along.

    Weld beads round it and in a spiral, stains, run-off, markings and a scale; the sensor's height is the middle row.
    """
    size = (256, 2048)
    rows, columns = np.indices(size)
    image = 0.46 + 0.06 * blotches(random, size, 70) + 0.05 * blotches(random, size, 14)
    image += 0.04 * speckle(random, size, 1)
    for _ in range(60):
        wide = random.uniform(3, 22)
        stain = np.ix_(*(texels_about(random, side, int(3 * wide)) for side in size))
        across = np.arange(-int(3 * wide), int(3 * wide) + 1)
        away = (across[:, None] ** 2 + across**2) / wide**2
        image[stain] *= 1.0 - random.uniform(0.2, 0.65) * np.exp(-away * (1.5 + image[stain]))
    for _ in range(22):
        length = int(random.integers(30, 110))
        run = np.ix_(texels_about(random, size[0], length), texels_about(random, size[1], 20))
        beside = np.arange(-20, 21) - 5.0 * np.sin(np.arange(2 * length + 1) / 40.0)[:, None]
        image[run] *= 1.0 - 0.4 * np.exp(-((beside / 5.0) ** 2))
    turns = 2.0 * np.pi * columns / size[1]
    for bead in (rows - 172.0, (rows - columns * (3.0 * size[0] / size[1])) % size[0] - size[0] / 2.0):
        image += 0.3 * np.exp(-((bead / 3.5) ** 2)) * (0.6 + 0.4 * np.cos(240.0 * turns + 0.6 * bead))
        image -= 0.18 * np.exp(-(((np.abs(bead) - 9.0) / 4.0) ** 2))
    for number, column in enumerate(range(70, 2048, 410)):
        write(image, f"DN {number + 1}0{random.integers(10, 99)}", (column, 126), 24, 0.92, 3)
        image[108:111, column : column + 170] = 0.92
        for mark in range(0, 171, 10):
            image[108 : 116 + 5 * (mark % 50 == 0), column + mark : column + mark + 3] = 0.92
    return np.asarray(np.clip(image, 0.05, 0.95))


def leaves(random: Random) -> Array:
    """Leaves before the dark inside of a crown, 512 mm by 512 mm at 2 mm to a texel."""
    canvas = np.full((512, 512), 0.08)
    for depth in range(1100):
        tone = (0.12 + 0.4 * depth / 1100.0) * random.uniform(0.7, 1.3)
        centre, axes = random.integers(0, 256, 2), (int(random.integers(7, 13)), int(random.integers(3, 6)))
        angle = float(random.uniform(0.0, 180.0))
        for shift_x in (-256, 0, 256):
            for shift_y in (-256, 0, 256):
                place = (int(centre[0]) + shift_x + 128, int(centre[1]) + shift_y + 128)
                if -16 < place[0] < 528 and -16 < place[1] < 528:
                    cv2.ellipse(canvas, place, axes, angle, 0.0, 360.0, float(tone), -1)
    return np.asarray(np.clip(canvas[128:384, 128:384], 0.05, 0.95))


def pane(random: Random) -> Array:
    """A window from outside, 512 mm by 1 m at 4 mm to a texel: bars, curtains and dark behind them."""
    image = 0.17 + 0.06 * blotches(random, (256, 128), 60)
    image[:, :24] = image[:, -26:] = random.uniform(0.5, 0.75)
    image[:, 6:24:6] *= 0.8
    image[:, -26:-4:6] *= 0.8
    for bar in (0, 122, 246):
        image[bar : bar + 10] = 0.88
    for bar in (0, 60, 119):
        image[:, bar : bar + 9] = 0.88
    frame(image, 3, 0.4)
    return np.asarray(np.clip(image, 0.05, 0.95))


def _carton(random: Random, shape: tuple[int, int]) -> Array:
    rows, columns = shape
    face = random.uniform(0.34, 0.6) + 0.02 * random.standard_normal(shape)
    middle = rows // 2
    face[middle - max(1, rows // 16) : middle + max(1, rows // 16)] *= 1.25
    left, bottom = int(columns * random.uniform(0.1, 0.5)), int(rows * random.uniform(0.12, 0.6))
    face[bottom : bottom + rows // 4, left : left + columns // 3] = 0.9
    face[bottom + 2 : bottom + rows // 4 - 1 : 3, left + 2 : left + columns // 3 - 2] = 0.25
    face[0] = face[-1] = face[:, 0] = face[:, -1] = 0.14
    return np.asarray(face)
