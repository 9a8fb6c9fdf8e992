"""Where rays meet shapes, in compiled loops; needs Numba (the extra ``compiled``).

As the ``distances`` of :mod:`designer.imaging.render.scenes.shapes`, to which a test holds these, in the same steps.
Frame: the design's, millimetres.
"""

from __future__ import annotations

from math import cos, inf, nan, radians, sin, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from designer.imaging.render.scenes.shapes import (
    NEAREST_HIT_MM,
    Box,
    Cylinder,
    Ellipsoid,
    Rectangle,
    Shape,
    Sphere,
)

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

RECTANGLE, BOX, BALL, CYLINDER = range(4)
NUMBERS = 14

# Division by zero gives infinity or NaN, as in NumPy.
_compile = numba.njit(error_model="numpy", cache=True, nogil=True)


def as_numbers(shape: Shape) -> tuple[int, Array] | None:
    """What kind a shape is for the loops, and its numbers (NUMBERS,); None if they do not know it."""
    match shape:
        case Rectangle():
            width, height = np.asarray(shape.half_width), np.asarray(shape.half_height)
            normal = np.cross(width, height)
            return RECTANGLE, _row(shape.centre, width, height, normal / np.linalg.norm(normal))
        case Box():
            low, high, yaw = np.asarray(shape.low), np.asarray(shape.high), radians(shape.yaw_deg)
            return BOX, _row((low + high) / 2.0, (high - low) / 2.0, (cos(yaw), sin(yaw)))
        case Sphere():
            return BALL, _row(shape.centre, 3 * (shape.radius,), (1.0, 0.0))
        case Ellipsoid():
            yaw = radians(shape.yaw_deg)
            return BALL, _row(shape.centre, shape.radii, (cos(yaw), sin(yaw)))
        case Cylinder():
            axis = np.asarray(shape.end) - np.asarray(shape.start)
            length = float(np.linalg.norm(axis))
            return CYLINDER, _row(shape.start, axis / length, (length, shape.radius))
        case _:
            return None


def _row(*numbers: Array | tuple[float, ...]) -> Array:
    given = np.concatenate([np.asarray(part, dtype=float) for part in numbers])
    return np.concatenate([given, np.zeros(NUMBERS - given.size)])


@_compile
def meet_run(
    kind: int,
    numbers: Array,
    surface: int,
    first: int,
    last: int,
    nearest: float,
    lowest: float,
    highest: float,
    points: Array,
    directions: Array,
    slopes: Array,
    levels: Array,
    found: Array,
    found_surface: Indices,
) -> None:
    """Enter a shape that is nearer than what was found into ``found`` and ``found_surface`` (n,), for a run of rays.

    Rays (3, n) from ``first`` to before ``last`` that rise by ``slopes`` (n,) between ``lowest`` and ``highest``, and
    have found nothing nearer than ``nearest`` mm, horizontally; ``levels`` (n,) are the horizontal parts of their
    directions.
    """
    for ray in range(first, last):
        if not lowest <= slopes[ray] <= highest or found[ray] * levels[ray] < nearest:
            continue
        x, y, z = points[0, ray], points[1, ray], points[2, ray]
        dx, dy, dz = directions[0, ray], directions[1, ray], directions[2, ray]
        if kind == RECTANGLE:
            distance = _to_rectangle(numbers, x, y, z, dx, dy, dz)
        elif kind == BOX:
            distance = _to_box(numbers, x, y, z, dx, dy, dz)
        elif kind == BALL:
            distance = _to_ball(numbers, x, y, z, dx, dy, dz)
        else:
            distance = _to_cylinder(numbers, x, y, z, dx, dy, dz)
        if distance < found[ray]:
            found[ray] = distance
            found_surface[ray] = surface


@_compile
def _first_forward(enter: float, leave: float) -> float:
    distance = enter if enter > NEAREST_HIT_MM else leave
    return distance if enter <= leave and distance > NEAREST_HIT_MM else inf


@_compile
def _to_rectangle(numbers: Array, x: float, y: float, z: float, dx: float, dy: float, dz: float) -> float:
    x, y, z = numbers[0] - x, numbers[1] - y, numbers[2] - z
    nx, ny, nz = numbers[9], numbers[10], numbers[11]
    distance = (nx * x + ny * y + nz * z) / (nx * dx + ny * dy + nz * dz)
    if not distance > NEAREST_HIT_MM:
        return inf
    for side in (3, 6):
        hx, hy, hz = numbers[side], numbers[side + 1], numbers[side + 2]
        along = (hx * dx + hy * dy + hz * dz) * distance - (hx * x + hy * y + hz * z)
        if not abs(along) <= hx * hx + hy * hy + hz * hz:
            return inf
    return float(distance)


@_compile
def _to_box(numbers: Array, x: float, y: float, z: float, dx: float, dy: float, dz: float) -> float:
    x, y, z = x - numbers[0], y - numbers[1], z - numbers[2]
    cosine, sine = numbers[6], numbers[7]
    x, y = cosine * x + sine * y, cosine * y - sine * x
    dx, dy = cosine * dx + sine * dy, cosine * dy - sine * dx
    enter, leave = -inf, inf
    for axis in range(3):
        place = x if axis == 0 else (y if axis == 1 else z)
        heading = dx if axis == 0 else (dy if axis == 1 else dz)
        one, other = (-numbers[3 + axis] - place) / heading, (numbers[3 + axis] - place) / heading
        # A ray that runs in a slab's face gives 0/0, which no comparison lets in.
        near, far = min(one, other), max(one, other)
        if one != one or other != other:
            near, far = (one, one) if other != other else (other, other)
        enter = near if near > enter else enter
        leave = far if far < leave else leave
    return _first_forward(enter, leave)


@_compile
def _to_ball(numbers: Array, x: float, y: float, z: float, dx: float, dy: float, dz: float) -> float:
    x, y, z = x - numbers[0], y - numbers[1], (z - numbers[2]) / numbers[5]
    cosine, sine = numbers[6], numbers[7]
    x, y = (cosine * x + sine * y) / numbers[3], (cosine * y - sine * x) / numbers[4]
    dx, dy, dz = (cosine * dx + sine * dy) / numbers[3], (cosine * dy - sine * dx) / numbers[4], dz / numbers[5]
    speed = dx * dx + dy * dy + dz * dz
    middle = -(x * dx + y * dy + z * dz) / speed
    # The squared distance of the centre from the ray, not the difference of large squares.
    x, y, z = x + middle * dx, y + middle * dy, z + middle * dz
    squared = (1.0 - (x * x + y * y + z * z)) / speed
    if not squared >= 0.0:
        return inf
    root = sqrt(squared)
    return _first_forward(middle - root, middle + root)


@_compile
def _to_cylinder(numbers: Array, x: float, y: float, z: float, dx: float, dy: float, dz: float) -> float:
    x, y, z = x - numbers[0], y - numbers[1], z - numbers[2]
    ax, ay, az = numbers[3], numbers[4], numbers[5]
    length, radius = numbers[6], numbers[7]
    start, heading = ax * x + ay * y + az * z, ax * dx + ay * dy + az * dz
    x, y, z = x - ax * start, y - ay * start, z - az * start
    dx, dy, dz = dx - ax * heading, dy - ay * heading, dz - az * heading
    speed = dx * dx + dy * dy + dz * dz
    if speed == 0.0:
        inside = x * x + y * y + z * z <= radius * radius
        enter, leave = (-inf, inf) if inside else (nan, nan)
    else:
        middle = -(x * dx + y * dy + z * dz) / speed
        x, y, z = x + middle * dx, y + middle * dy, z + middle * dz
        squared = (radius * radius - (x * x + y * y + z * z)) / speed
        if not squared >= 0.0:
            return inf
        root = sqrt(squared)
        enter, leave = middle - root, middle + root
    if heading == 0.0:
        if not 0.0 <= start <= length:
            return inf
    else:
        one, other = -start / heading, (length - start) / heading
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    return _first_forward(enter, leave)
