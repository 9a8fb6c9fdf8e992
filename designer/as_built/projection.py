"""Where a built sensor images scene points: the ray from its pinhole that the mirrors send through each point.

The ray is found by Newton's method on its two slopes, with exact derivatives of the traced ray. How the image depends
on each departure, and on the place in the pupil, then follows by implicit differentiation: the miss g(slopes, p) stays
zero, so d slopes / dp = -(dg/d slopes)^-1 dg/dp. Image places are in pixels from the principal point of the design.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from designer.as_built.dual import Array, Number, slopes_of, value_of, variables
from designer.as_built.image import built_places, slopes_towards, stretched
from designer.as_built.parameters import CAMERA, parameters_of, systems_of
from designer.as_built.tracing import PosedCamera, PosedMirror, Triple, follow_rays, leave_camera
from designer.design import Design, ViewName

# A pixel is some 3e-4 of slope. Newton's method squares the error with its last step, so less than 1e-12 is left.
LAST_STEP = 1e-7
MOST_STEPS = 20
# Steps with the derivatives of the unperturbed system, which cost a fifth and are nearly as good.
BORROWED_STEPS = 2
# The working arrays of so many rays stay in the processor's cache.
RAYS_PER_BLOCK = 4096


@dataclass(frozen=True, slots=True)
class Targets:
    """Scene points (3, n) in mm as one view of a design sees them.

    ``basis`` (3, 3, n) are the directions to the right, upwards and towards each point from the view's viewpoint,
    ``slopes`` (2, n) the slopes dx/dz and dy/dz at the pinhole at which the design itself images the points.
    """

    points_mm: Array
    basis: Array
    slopes: Array


@dataclass(frozen=True, slots=True)
class Projection:
    """Images of n points in T built systems.

    ``pixels`` (2, T, n) from the principal point, ``slopes`` (2, T, n) those of the rays at the pinhole in the camera's
    frame; ``blur_px`` (T, n) the largest diameter of the blur; ``start`` and ``ahead`` (3, T, n) the rays from the last
    mirror to the points. NaN where the mirrors show no such point.
    """

    pixels: Array
    slopes: Array
    blur_px: Array
    start: Array
    ahead: Array


def targets_of(design: Design, view: ViewName, points_mm: Array) -> Targets:
    """Points (n, 3) in mm as a view's own viewpoint sees them."""
    record = design.views.by_name[view]
    x, y, z = points = np.ascontiguousarray(np.asarray(points_mm, dtype=float).T)
    distance = np.hypot(x, y)
    cosine, sine = x / distance, y / distance
    slope = (z - record.viewpoint_mm) / distance
    level = 1.0 / np.sqrt(1.0 + slope * slope)
    zero = np.zeros_like(x)
    basis = np.stack(
        [
            np.stack([-sine, cosine, zero]),
            np.stack([-slope * level * cosine, -slope * level * sine, level]),
            np.stack([level * cosine, level * sine, slope * level]),
        ]
    )
    return Targets(points, basis, slopes_towards(record, slope, np.arctan2(y, x)))


@dataclass(frozen=True, slots=True)
class Linear:
    """How the images of n points change with the departures, about one system; exact derivatives.

    ``pixels`` and ``slopes`` (parameters, 2, n) are the derivatives of image places in px and of the slopes of the rays
    at the pinhole; ``origin`` (2, n) the slopes themselves; ``by_slope`` (2, 2, 1, n) how they change the miss.
    """

    pixels: Array
    slopes: Array
    origin: Array
    by_slope: Array


def project(
    design: Design, view: ViewName, targets: Targets, values: Array, about_design: Linear | None = None
) -> Projection:
    """Image points by built systems of departures (T, parameters).

    ``about_design``, the derivatives of the design without departures, shortens the search for the rays.
    """
    count, number = len(values), targets.points_mm.shape[1]
    path = design.views.by_name[view].path
    found = Projection(
        np.empty((2, count, number)),
        np.empty((2, count, number)),
        np.empty((count, number)),
        np.empty((3, count, number)),
        np.empty((3, count, number)),
    )
    for block in _blocks(count, number):
        systems = systems_of(design, list(values[block].T[:, :, None]))
        mirrors = systems.along(path)
        if about_design is None:
            slopes = np.tile(targets.slopes[:, None], (1, len(values[block]), 1))
        else:
            slopes = about_design.origin[:, None] + np.einsum("tp,pxn->xtn", values[block], about_design.slopes)
            slopes = _approach(systems.camera, mirrors, targets, slopes, about_design.by_slope)
        light = aim(systems.camera, mirrors, targets, slopes)
        places = np.stack(built_places(systems.camera, (light.slopes[0], light.slopes[1])))
        found.pixels[:, block] = places / design.camera.pixel_pitch_mm
        found.slopes[:, block] = light.slopes
        found.blur_px[block] = _blur_px(design, systems.camera, light)
        found.start[:, block], found.ahead[:, block] = light.start, light.ahead
    return found


def linearise(design: Design, view: ViewName, targets: Targets, values: Array | None = None) -> Linear:
    """Derivatives about one system of departures (parameters,), the design itself if not given.

    Raises
    ------
    ValueError
        The system does not show all points.
    """
    at = np.zeros(len(parameters_of(design))) if values is None else values
    plain = systems_of(design, list(at[:, None, None]))
    light = aim(plain.camera, plain.along(design.views.by_name[view].path), targets, targets.slopes[:, None])
    if not np.isfinite(light.slopes).all():
        raise ValueError(f"the {view} view does not show all points")
    return derivatives_at(design, view, targets, at, light.slopes)


def derivatives_at(design: Design, view: ViewName, targets: Targets, values: Array, slopes: Array) -> Linear:
    """Derivatives about one system of departures (parameters,), at the slopes (2, 1, n) of the rays through the points.

    What the light of the view does not meet has derivatives of zero, and costs nothing.
    """
    path = design.views.by_name[view].path
    parameters = parameters_of(design)
    met = [place for place, parameter in enumerate(parameters) if parameter.part in (*path, CAMERA)]
    # One variable for each departure, then the two slopes: their derivatives are independent of one another.
    ones = variables([*values[met, None, None], *np.zeros((2, 1, 1))])
    given: list[Number] = list(values[:, None, None])
    for place, one in zip(met, ones[:-2], strict=True):
        given[place] = one
    systems = systems_of(design, given)
    aimed = (slopes[0] + ones[-2], slopes[1] + ones[-1])
    with np.errstate(all="ignore"):
        miss, _ = _miss(systems.camera, systems.along(path), targets, aimed)
        gradient = np.stack([slopes_of(part, len(ones)) for part in miss], axis=1)
        turn = _solve(gradient[-2:], -gradient[:-2].transpose(1, 0, 2, 3))
        # The image follows the slopes, and the lens's own departures besides.
        own = np.stack([slopes_of(part, len(ones)) for part in built_places(systems.camera, aimed)], axis=1)
        change = own[:-2] + np.einsum("jixn,jpxn->pixn", own[-2:], turn)
    pixels, by_departure = (np.zeros((len(parameters), 2, slopes.shape[2])) for _ in range(2))
    pixels[met] = change[:, :, 0] / design.camera.pixel_pitch_mm
    by_departure[met] = turn[:, :, 0].transpose(1, 0, 2)
    return Linear(pixels=pixels, slopes=by_departure, origin=slopes[:, 0], by_slope=gradient[-2:])


@dataclass(frozen=True, slots=True)
class AimedRays:
    """Chief rays through points, and what the rays beside them do.

    ``slopes`` (2, T, n) at the pinhole; ``by_place`` (2, 2, T, n) how they change with the place in the pupil, 1/mm;
    ``start`` and ``ahead`` (3, T, n) the exit rays. NaN where there is no such ray.
    """

    slopes: Array
    by_place: Array
    start: Array
    ahead: Array


def aim(camera: PosedCamera, mirrors: list[PosedMirror], targets: Targets, slopes: Array) -> AimedRays:
    """The rays from the pinhole that pass through the points, by Newton's method from slopes (2, T, n)."""
    zero = np.zeros(slopes.shape[1:])
    with np.errstate(all="ignore"):
        for _ in range(MOST_STEPS):
            first, second, right, down = variables([slopes[0], slopes[1], zero, zero])
            miss, ray = _miss(camera, mirrors, targets, (first, second), (right, down))
            error = np.stack([value_of(part) for part in miss])
            gradient = np.stack([slopes_of(part, 4) for part in miss], axis=1)
            step = -_solve(gradient[:2], error[:, None])[:, 0]
            slopes = slopes + step
            if not np.any(np.abs(step) > LAST_STEP):
                break
        found = np.where(np.all(np.abs(step) <= LAST_STEP, axis=0), 0.0, np.nan)
        by_place = _solve(gradient[:2], -gradient[2:].transpose(1, 0, 2, 3))
        start, ahead = (
            np.stack([value_of(part) + np.einsum("jtn,jtn->tn", slopes_of(part, 4)[:2], step) for part in triple])
            for triple in ray
        )
    return AimedRays(slopes + found, by_place + found, start + found, ahead + found)


def _approach(
    camera: PosedCamera, mirrors: list[PosedMirror], targets: Targets, slopes: Array, by_slope: Array
) -> Array:
    """Slopes nearer to those of the rays through the points, by steps with borrowed derivatives."""
    with np.errstate(all="ignore"):
        for _ in range(BORROWED_STEPS):
            miss, _ = _miss(camera, mirrors, targets, tuple(slopes))
            slopes = slopes - _solve(by_slope, np.stack(miss)[:, None])[:, 0]
    return slopes


def _miss(
    camera: PosedCamera,
    mirrors: list[PosedMirror],
    targets: Targets,
    slopes: tuple[Number, ...],
    start: tuple[Number, Number] = (0.0, 0.0),
) -> tuple[list[Number], tuple[Triple, Triple]]:
    """How far exit rays pass right of and above their points, as tangents of angles; then the rays.

    NaN for a ray that points away from its point.
    """
    point, ahead = follow_rays(mirrors, *leave_camera(camera, (slopes[0], slopes[1]), start))
    x, y, z = targets.points_mm
    offset = (x - point[0], y - point[1], z - point[2])
    to_right, up, towards = (
        [axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2] for vector in (offset, ahead)]
        for axis in targets.basis
    )
    aims = np.where((value_of(towards[0]) > 0.0) & (value_of(towards[1]) > 0.0), 0.0, np.nan)
    return [side[1] / towards[1] - side[0] / towards[0] + aims for side in (to_right, up)], (point, ahead)


def _blur_px(design: Design, built: PosedCamera, light: AimedRays) -> Array:
    """Largest blur (T, n) in px of the light of the points.

    Light from the place a of the pupil reaches the point at other slopes than the chief ray, by a d slopes/da; the lens
    takes it to f (slopes + a/u) on the sensor.
    """
    camera = design.camera
    focus = 0.0 if camera.focus_distance_mm is None else 1.0 / camera.focus_distance_mm
    # The glass stays the same: a longer principal distance focuses nearer.
    focus = focus + 1.0 / camera.focal_length_mm - 1.0 / built.principal_distance
    focused = light.by_place + np.eye(2)[:, :, None, None] * focus
    (a, b), (c, d) = stretched(built.law, light.slopes, focused)
    widest = (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2.0
    blur = 2.0 * camera.pupil_radius_mm * built.principal_distance * widest / camera.pixel_pitch_mm
    return np.asarray(blur)


def _solve(by_slope: Array, right: Array) -> Array:
    """Solutions (2, k, ...) of 2 x 2 systems, given by columns: ``by_slope[j, i]`` is d miss_i / d slope_j."""
    (a, c), (b, d) = by_slope
    determinant = a * d - b * c
    first, second = right
    return np.stack([(d * first - b * second) / determinant, (a * second - c * first) / determinant])


def _blocks(count: int, number: int) -> Iterator[slice]:
    step = max(1, RAYS_PER_BLOCK // number)
    for low in range(0, count, step):
        yield slice(low, low + step)
