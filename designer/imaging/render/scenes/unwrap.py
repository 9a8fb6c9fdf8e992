"""Places on surfaces as a picture that covers them counts them: mm right and mm up, as seen by who looks at them.

Faces of boxes count from their lowest corner, so that what stands on the floor is drawn from the floor up. Round a
cylinder or a ball a whole number of pictures is fitted, so that they meet without a seam; a cylinder's ends are flat.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from designer.imaging.render.scenes.shapes import Array, Box, Cylinder, Ellipsoid, Point, Rectangle, Shape, Sphere

# A picture repeats at its own size, is drawn over the whole face, or is as wide as the face and repeats upwards.
Fit = Literal["repeated", "whole", "across"]
# Of the equator: circles nearer to a pole than this are as coarse as it.
SMALLEST_CIRCLE = 1e-3


def places_on(
    shape: Shape, points: Array, normals: Array, directions: Array, picture_mm: tuple[float, float], fit: Fit
) -> tuple[Array, Array, Array]:
    """Places (n,) right and up, in mm on a picture of ``picture_mm`` that repeats, of ``points`` (3, n) on a shape.

    ``normals`` (3, n) are its outward normals there and ``directions`` (3, n) those of the rays. ``fit`` says how
    pictures are fitted to each face. The third (n,) is the largest number of mm on the picture for one on the surface.

    Raises
    ------
    TypeError
        There is no way known to cover such a shape.
    """
    match shape:
        case Rectangle():
            return _on_rectangle(shape, points, picture_mm, fit)
        case Box():
            return _on_box(shape, points, normals, picture_mm, fit)
        case Cylinder():
            return _on_cylinder(shape, points, normals, directions, picture_mm)
        case Sphere(centre, radius):
            return _on_ball(centre, (radius, radius, radius), 0.0, points, picture_mm, fit)
        case Ellipsoid(centre, radii, yaw_deg):
            return _on_ball(centre, radii, yaw_deg, points, picture_mm, fit)
    raise TypeError(f"no picture is known to cover a {type(shape).__name__}")


def _on_rectangle(
    shape: Rectangle, points: Array, picture_mm: tuple[float, float], fit: Fit
) -> tuple[Array, Array, Array]:
    offset = points - np.asarray(shape.centre)[:, None]
    vectors = np.array([shape.half_width, shape.half_height])
    lengths = np.linalg.norm(vectors, axis=1)
    across, up = (vectors / lengths[:, None]) @ offset + lengths[:, None]
    stretch_across, stretch_up = _stretches(2.0 * lengths[0], 2.0 * lengths[1], picture_mm, fit)
    shrunk = np.full(points.shape[1], max(float(stretch_across), float(stretch_up)))
    return across * stretch_across, up * stretch_up, shrunk


def _on_box(
    shape: Box, points: Array, normals: Array, picture_mm: tuple[float, float], fit: Fit
) -> tuple[Array, Array, Array]:
    size = np.asarray(shape.high) - np.asarray(shape.low)
    centre = (np.asarray(shape.high) + np.asarray(shape.low)) / 2.0
    cosine, sine = np.cos(np.radians(shape.yaw_deg)), np.sin(np.radians(shape.yaw_deg))
    x, y, z = points - centre[:, None]
    x, y = cosine * x + sine * y, cosine * y - sine * x
    normal_x, normal_y = cosine * normals[0] + sine * normals[1], cosine * normals[1] - sine * normals[0]
    level = np.abs(normals[2]) > 0.5
    sideways = np.abs(normal_x) > 0.5
    # Who looks at an upright face sees up x outward normal to the right.
    across = np.where(level, x, np.where(sideways, y * np.sign(normal_x), -x * np.sign(normal_y)))
    width = np.where(level | ~sideways, size[0], size[1])
    up, height = np.where(level, y, z), np.where(level, size[1], size[2])
    across, up = across + width / 2.0, up + height / 2.0
    stretch_across, stretch_up = _stretches(width, height, picture_mm, fit)
    return across * stretch_across, up * stretch_up, np.maximum(stretch_across, stretch_up)


def _stretches(width: ArrayLike, height: ArrayLike, picture_mm: tuple[float, float], fit: Fit) -> tuple[Array, Array]:
    """Millimetres on the picture for one on faces of a width and height (n,), across and up."""
    if fit == "repeated":
        return np.ones(np.shape(width)), np.ones(np.shape(width))
    across = picture_mm[0] / np.asarray(width)
    return across, across if fit == "across" else picture_mm[1] / np.asarray(height)


def _on_cylinder(
    shape: Cylinder, points: Array, normals: Array, directions: Array, picture_mm: tuple[float, float]
) -> tuple[Array, Array, Array]:
    axis = np.asarray(shape.end) - np.asarray(shape.start)
    axis = axis / np.linalg.norm(axis)
    first = np.cross([0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0], axis)
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    offset = points - np.asarray(shape.start)[:, None]
    along, right, ahead = axis @ offset, first @ offset, second @ offset
    round_it = 2.0 * np.pi * shape.radius
    pictures = max(1, round(round_it / picture_mm[0]))
    turn = np.arctan2(ahead, right) / (2.0 * np.pi) * pictures * picture_mm[0]
    # From inside, right and left change places.
    turn = turn * np.where(np.einsum("in,in->n", normals, directions) > 0.0, -1.0, 1.0)
    end = np.abs(axis @ normals) > 0.5
    shrunk = np.full(points.shape[1], max(1.0, pictures * picture_mm[0] / round_it))
    return np.where(end, right, turn), np.where(end, ahead, along), shrunk


def _on_ball(
    centre: Point, radii: Point, yaw_deg: float, points: Array, picture_mm: tuple[float, float], fit: Fit
) -> tuple[Array, Array, Array]:
    """Right by azimuth, up by height: who looks along the yaw sees the middle of a fitted picture."""
    offset = points - np.asarray(centre)[:, None]
    cosine, sine = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    x, y = (cosine * offset[0] + sine * offset[1]) / radii[0], (cosine * offset[1] - sine * offset[0]) / radii[1]
    equator = 2.0 * np.pi * np.sqrt(radii[0] * radii[1])
    pictures = 1 if fit != "repeated" else max(1, round(equator / picture_mm[0]))
    stretch_up = picture_mm[1] / (2.0 * radii[2]) if fit == "whole" else 1.0
    across = np.arctan2(y, x) / (2.0 * np.pi) * pictures * picture_mm[0]
    # Towards the poles the picture is drawn together, and a pixel sees more of it.
    from_axis = np.maximum(np.hypot(x, y), SMALLEST_CIRCLE)
    shrunk = np.maximum(pictures * picture_mm[0] / (equator * from_axis), stretch_up)
    return across, (offset[2] + radii[2]) * stretch_up, shrunk
