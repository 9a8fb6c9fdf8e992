"""Image places and their derivatives: finite differences, and closed forms that know nothing of Newton's method."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import root

from designer.as_built.merits import grid_of
from designer.as_built.parameters import parameters_of, rotation
from designer.as_built.projection import Targets, aim, linearise, project
from designer.as_built.tracing import PosedCamera, PosedMirror
from designer.design import VIEW_NAMES
from designer.trace.built import tilted
from designer.trace.instrument import build_instrument, sag
from designer.trace.sequential import trace_sequential
from support.studied_designs import SHARP_NAMES, sharp_design

# Slopes of the pinhole's rays are compared; with the designs' lenses 1e-6 px are some 3e-10.
PIXEL = 3e-4
DIFFERENCE_STEPS = {"mm": 2e-3, "deg": 2e-3, "1/m": 2e-3, "": 1e-3}
CAMERA = PosedCamera((0.0, 0.0, 0.0), rotation(0.0, 0.0), 1.0, 0.0)


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_derivatives_are_those_of_central_differences(name: str):
    """About a system that is already departed; fourth order, so that rounding and truncation stay below 1e-5."""
    design = sharp_design(name)
    parameters = parameters_of(design)
    scale = np.array([{"mm": 0.03, "deg": 0.05, "1/m": 0.02, "": 0.003}[p.unit] for p in parameters])
    about = scale * np.random.default_rng(1).standard_normal(len(parameters))
    steps = np.array([DIFFERENCE_STEPS[parameter.unit] for parameter in parameters])
    for view in VIEW_NAMES:
        targets = grid_of(design).targets[view]
        exact = linearise(design, view, targets, about).pixels
        moved = about + (np.array([-2.0, -1.0, 1.0, 2.0])[:, None, None] * np.diag(steps)).reshape(-1, len(steps))
        far_below, below, above, far_above = np.split(project(design, view, targets, moved).pixels, 4, axis=1)
        different = ((far_below - 8.0 * below + 8.0 * above - far_above) / (12.0 * steps[:, None])).transpose(1, 0, 2)
        on_way = [p.part == "camera" or p.part in getattr(design.views, view).path for p in parameters]
        for index, parameter in enumerate(parameters):
            size = np.abs(exact[index]).max()
            # A plane that is shifted in its own plane, or a mirror of the other view, changes nothing.
            rounding = 1e-10 / steps[index]
            assert np.abs(different[index] - exact[index]).max() < 1e-5 * size + rounding, parameter.name
            assert on_way[index] or size == 0.0


def test_a_shifted_and_tilted_sphere_images_where_alhazens_equation_says():
    """The sphere of radius 1 about 0, source a and point b in the plane of the three: a quartic in the place z."""
    random = np.random.default_rng(5)
    for _ in range(20):
        radius, vertex = random.uniform(20.0, 40.0), np.array([*random.uniform(-3.0, 3.0, 2), random.uniform(80, 120)])
        tilt = random.uniform(-3.0, 3.0, 2)
        turn = tilted(*tilt)
        centre = vertex + turn @ [0.0, 0.0, radius]
        mirror = PosedMirror(tuple(vertex), rotation(*tilt), 1.0 / radius, 1.0, -1.0)
        azimuth, elevation, distance = random.uniform(-3, 3), random.uniform(-0.6, 0.3), random.uniform(200, 3000)
        point = centre + distance * np.array(
            [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
        )
        touched = alhazen(np.zeros(3), point, centre, radius)
        found = aimed(mirror, point, centre, 0.1 * np.array([np.cos(azimuth), np.sin(azimuth)]))
        np.testing.assert_allclose(found, touched[:2] / touched[2], atol=1e-6 * PIXEL)


def alhazen(source: np.ndarray, point: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Where a convex sphere reflects light between two points: conj(ab) z^4 - conj(a + b) z^3 + (a + b) z = ab."""
    first = (source - centre) / radius
    along = first / np.linalg.norm(first)
    second = (point - centre) / radius
    aside = second - (second @ along) * along
    aside /= np.linalg.norm(aside)
    a, b = complex(np.linalg.norm(first)), complex(second @ along, second @ aside)
    places = np.roots([np.conj(a * b), -np.conj(a + b), 0.0, a + b, -a * b])
    places = places[np.abs(np.abs(places) - 1.0) < 1e-6]
    shortest = places[np.argmin(np.abs(places - a) + np.abs(places - b))]
    return centre + radius * (shortest.real * along + shortest.imag * aside)


@pytest.mark.parametrize("conic", [-2.3, -1.0, -0.6, 0.0, 0.8], ids=lambda k: f"conic {k}")
def test_a_conic_off_its_focus_images_where_the_axial_polynomial_says(conic: float):
    """The projection through an axial conic is the root of one polynomial (Agrawal, Taguchi and Ramalingam, 2011)."""
    random = np.random.default_rng(int(10 * conic) + 50)
    for _ in range(10):
        radius, vertex = random.uniform(25.0, 40.0), random.uniform(80.0, 120.0)
        mirror = PosedMirror((0.0, 0.0, vertex), rotation(0.0, 0.0), 1.0 / radius, 1.0 + conic, -1.0)
        azimuth, elevation, distance = random.uniform(-3, 3), random.uniform(-0.5, 0.2), random.uniform(300, 3000)
        middle = np.array([0.0, 0.0, vertex + radius / 2.0])
        point = middle + distance * np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)])
        # In units of the radius, which keeps the polynomial's digits.
        tangents = axial_tangents(1.0 + conic, *(np.array([vertex, np.hypot(*point[:2]), point[2]]) / radius))
        ahead = np.array([np.cos(azimuth), np.sin(azimuth)])
        found = aimed(mirror, point, middle, 0.1 * ahead)
        # The polynomial has further roots, where the conic's back or its other sheet would reflect.
        assert np.min(np.abs(tangents - found @ ahead)) < 1e-6 * PIXEL
        assert abs(found[0] * ahead[1] - found[1] * ahead[0]) < 1e-6 * PIXEL


def axial_tangents(k: float, vertex: float, distance: float, height: float) -> np.ndarray:
    """Slopes at the pinhole of all rays in the meridian that a conic's surface takes from the pinhole to a point.

    With i and r the rays in and out and n the normal at (x, z), (i x n)(r.n) + (r x n)(i.n) = 0 is a(z) + x b(z) = 0
    on x^2 + k z^2 = 2 z, whence a^2 = x^2 b^2, a polynomial in z.
    """
    from numpy.polynomial import Polynomial as P

    z = P([0.0, 1.0])
    x_squared = 2.0 * z - k * z * z

    def times(left, right):
        """Products of (even, odd) in x."""
        return left[0] * right[0] + x_squared * left[1] * right[1], left[0] * right[1] + left[1] * right[0]

    zero, one = P([0.0]), P([1.0])
    x = (zero, one)
    normal = ((zero, one), (P([-1.0, k]), zero))
    into = (x, (z + vertex, zero))
    out = ((P([distance]), -one), (P([height - vertex]) - z, zero))

    def plus(left, right, sign=1.0):
        return left[0] + sign * right[0], left[1] + sign * right[1]

    def cross(ray):
        return plus(times(ray[0], normal[1]), times(ray[1], normal[0]), -1.0)

    def dot(ray):
        return plus(times(ray[0], normal[0]), times(ray[1], normal[1]))

    even, odd = plus(times(cross(into), dot(out)), times(cross(out), dot(into)))
    heights = (even * even - x_squared * odd * odd).roots()
    heights = heights[np.abs(heights.imag) < 1e-5].real
    heights = heights[(np.abs(odd(heights)) > 1e-9) & (x_squared(heights) > 0.0)]
    side = -np.sign(even(heights) / odd(heights))
    # Squared, roots on the two sides lie close together and lose digits: Newton's method before squaring.
    for _ in range(3):
        across = side * np.sqrt(x_squared(heights))
        slope = even.deriv()(heights) + across * odd.deriv()(heights) + (1.0 - k * heights) / across * odd(heights)
        heights = heights - (even(heights) + across * odd(heights)) / slope
    return side * np.sqrt(x_squared(heights)) / (heights + vertex)


def aimed(mirror: PosedMirror, point: np.ndarray, middle: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Slopes of the pinhole's ray to a point, from slopes to start with; ``middle`` is where the rays seem to meet."""
    towards = (point - middle) / np.linalg.norm(point - middle)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    basis = np.stack([right, np.cross(towards, right), towards])[:, :, None]
    targets = Targets(point[:, None], basis, slopes[:, None])
    return aim(CAMERA, [mirror], targets, slopes[:, None, None]).slopes[:, 0, 0]


@pytest.mark.parametrize("name", [SHARP_NAMES[place] for place in (0, 3, 7, 8)])
def test_light_between_pinhole_and_point_takes_a_stationary_path(name: str):
    """Fermat: on two tilted, shifted mirrors the path's length has no slope in any direction on either face."""
    design = sharp_design(name)
    parameters = parameters_of(design)
    scale = np.array([{"mm": 0.1, "deg": 0.1, "1/m": 0.0, "": 0.0}[p.unit] for p in parameters])
    scale[[p.key.startswith(("principal", "radial", "radius")) or p.part == "camera" for p in parameters]] = 0.0
    values = scale * np.random.default_rng(1).standard_normal(len(parameters))
    at = {(p.part, p.key): value for p, value in zip(parameters, values, strict=True)}
    path = design.views.lower.path
    mirrors = [design.mirror(name) for name in path]
    turns = [tilted(at[name, "tilt_x_deg"], at[name, "tilt_y_deg"]) for name in path]
    places = [
        np.array([at[m.name, "decentre_x_mm"], at[m.name, "decentre_y_mm"], m.vertex_mm + at[m.name, "axial_shift_mm"]])
        for m in mirrors
    ]
    grid = grid_of(design)
    chosen = [3, 20, 41]
    pixels = project(design, "lower", grid.targets["lower"], values[None]).pixels[:, 0, chosen].T
    instrument = build_instrument(design)
    for index, point, pixel in zip(chosen, grid.points_mm[chosen], pixels, strict=True):

        def on_faces(where, turns=turns, places=places):
            return [
                origin + turn @ np.array([*xy, sag(mirror, np.hypot(*xy))])
                for mirror, turn, origin, xy in zip(mirrors, turns, places, where.reshape(2, 2), strict=True)
            ]

        def slope(where, point=point):
            """The gradient of the length of the path, each face's tangents against the unit vectors that meet there."""
            corners = [np.zeros(3), *on_faces(where), point]
            legs = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(corners)]
            gradient = []
            for mirror, turn, xy, before, after in zip(
                mirrors, turns, where.reshape(2, 2), legs[:-1], legs[1:], strict=True
            ):
                radius = np.hypot(*xy)
                c = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
                rise = c / np.sqrt(1.0 - (1.0 + mirror.conic) * (c * radius) ** 2)
                gradient += [
                    (before - after) @ turn @ [1.0, 0.0, rise * xy[0]],
                    (before - after) @ turn @ [0.0, 1.0, rise * xy[1]],
                ]
            return np.array(gradient)

        slopes = pixel * design.camera.pixel_pitch_mm / design.camera.focal_length_mm
        # From where the design itself, without departures, reflects the light.
        ahead = np.array([*grid.targets["lower"].slopes[:, index], 1.0])
        hits = trace_sequential(instrument, instrument.path(path), [ahead / np.linalg.norm(ahead)]).hits
        solved = root(slope, np.concatenate([hit[0, :2] for hit in hits]), tol=1e-14, options={"factor": 0.1})
        touched = on_faces(solved.x)[0]
        assert np.abs(slope(solved.x)).max() < 1e-12
        np.testing.assert_allclose(touched[:2] / touched[2], slopes, atol=1e-6 * PIXEL)
