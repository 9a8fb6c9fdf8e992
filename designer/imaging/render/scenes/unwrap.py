"""Places on surfaces as a picture that covers them counts them: mm right and mm up, as seen by who looks at them.

Faces of boxes count from their lowest corner, so that what stands on the floor is drawn from the floor up. Round a
cylinder or a ball a whole number of pictures is fitted, so that they meet without a seam; a cylinder's ends are flat.
"""

from __future__ import annotations

import numpy as np

from designer.imaging.render.scenes.shapes import Array, Box, Cylinder, Ellipsoid, Point, Rectangle, Shape, Sphere

# Of the equator: circles nearer to a pole than this are as coarse as it.
SMALLEST_CIRCLE = 1e-3


def places_on(
    shape: Shape, points: Array, normals: Array, directions: Array, picture_mm: tuple[float, float], fitted: bool
) -> tuple[Array, Array, Array]:
    """Places (n,) right and up, in mm on a picture of ``picture_mm`` that repeats, of ``points`` (3, n) on a shape.

    ``normals`` (3, n) are its outward normals there and ``directions`` (3, n) those of the rays. ``fitted`` draws one
    picture over each whole face. The third (n,) is the largest number of mm on the picture for one on the surface.

    Raises
    ------
    TypeError
        There is no way known to cover such a shape.
    """
    match shape:
        case Rectangle():
            return _on_rectangle(shape, points, picture_mm, fitted)
        case Box():
            return _on_box(shape, points, normals, picture_mm, fitted)
        case Cylinder():
            return _on_cylinder(shape, points, normals, directions, picture_mm)
        case Sphere(centre, radius):
            return _on_ball(centre, (radius, radius, radius), 0.0, points, picture_mm, fitted)
        case Ellipsoid(centre, radii, yaw_deg):
            return _on_ball(centre, radii, yaw_deg, points, picture_mm, fitted)
    raise TypeError(f"no picture is known to cover a {type(shape).__name__}")


def _on_rectangle(
    shape: Rectangle, points: Array, picture_mm: tuple[float, float], fitted: bool
) -> tuple[Array, Array, Array]:
    offset = points - np.asarray(shape.centre)[:, None]
    found, shrunk = [], 1.0 if not fitted else 0.0
    for half, side in ((shape.half_width, picture_mm[0]), (shape.half_height, picture_mm[1])):
        vector = np.asarray(half)
        length = float(np.linalg.norm(vector))
        along = vector @ offset / length + length
        if fitted:
            along *= side / (2.0 * length)
            shrunk = max(shrunk, side / (2.0 * length))
        found.append(along)
    return found[0], found[1], np.full(points.shape[1], shrunk)


def _on_box(
    shape: Box, points: Array, normals: Array, picture_mm: tuple[float, float], fitted: bool
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
    if not fitted:
        return across, up, np.ones(points.shape[1])
    sideways_shrunk, upwards_shrunk = picture_mm[0] / width, picture_mm[1] / height
    return across * sideways_shrunk, up * upwards_shrunk, np.maximum(sideways_shrunk, upwards_shrunk)


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
    centre: Point, radii: Point, yaw_deg: float, points: Array, picture_mm: tuple[float, float], fitted: bool
) -> tuple[Array, Array, Array]:
    """Right by azimuth, up by height: who looks along the yaw sees the middle of a fitted picture."""
    offset = points - np.asarray(centre)[:, None]
    cosine, sine = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    x, y = (cosine * offset[0] + sine * offset[1]) / radii[0], (cosine * offset[1] - sine * offset[0]) / radii[1]
    equator = 2.0 * np.pi * np.sqrt(radii[0] * radii[1])
    pictures = 1 if fitted else max(1, round(equator / picture_mm[0]))
    stretch_up = picture_mm[1] / (2.0 * radii[2]) if fitted else 1.0
    across = np.arctan2(y, x) / (2.0 * np.pi) * pictures * picture_mm[0]
    # Towards the poles the picture is drawn together, and a pixel sees more of it.
    from_axis = np.maximum(np.hypot(x, y), SMALLEST_CIRCLE)
    shrunk = np.maximum(pictures * picture_mm[0] / (equator * from_axis), stretch_up)
    return across, (offset[2] + radii[2]) * stretch_up, shrunk
