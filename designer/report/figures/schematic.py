"""Catadioptric cameras with one viewpoint, drawn as principles: conics, foci, a few rays (figures 1 and 3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from designer.optics.conic import Surface
from designer.report.figures.style import BLUE, GREY, HALO, INK

Point = NDArray[np.float64]

_RADII = np.linspace(1e-6, 400.0, 40001)


@dataclass(frozen=True, slots=True)
class Principle:
    """What a schematic shows: surfaces in the order in which a ray from the pinhole meets them, foci, and rays.

    ``psi_deg`` are the angles of the rays at the pinhole, which lies at the origin; ``foci`` are heights by name.
    """

    title: str
    surfaces: Sequence[Surface]
    foci: Mapping[str, float]
    psi_deg: Sequence[float]


def hyperboloid_or_ellipsoid(
    title: str, half_distance: float, inverse_eccentricity: float, psi_deg: Sequence[float]
) -> Principle:
    """One mirror above the camera with foci at the pinhole F' and at F (figure 1 (a, b); design notes, section 2)."""
    surface = conic_between(0.0, 2.0 * half_distance, inverse_eccentricity, 1)
    return Principle(title, (surface,), {"F'": 0.0, "F": 2.0 * half_distance}, psi_deg)


def paraboloid_pair(
    title: str, viewpoint: float, primary: float, secondary: float, psi_deg: Sequence[float]
) -> Principle:
    """A secondary paraboloid of focal length ``secondary`` over a primary one (figure 1 (c))."""
    above = Surface(secondary, -1.0 / (2.0 * secondary), 0.0)
    below = Surface(viewpoint + primary, -1.0 / (2.0 * primary), 0.0)
    return Principle(title, (above, below), {"F_2": 0.0, "F_1": viewpoint}, psi_deg)


def conic_between(focus: float, other_focus: float, inverse_eccentricity: float, facing: int) -> Surface:
    """The mirror with two given foci: ``facing`` is +1 for one that faces down, -1 for one that faces up."""
    q, c = inverse_eccentricity, facing * (other_focus - focus) / 2.0
    curvature = q / (facing * c * (1.0 - q * q))
    return Surface(focus + facing * c * (1.0 + q), curvature, (1.0 - 1.0 / (q * q)) * curvature**2)


def draw_principle(axes: Axes, principle: Principle, reach: float) -> None:
    """Draw a schematic; rays leave up to ``reach`` from the axis, dotted back to the viewpoint, the last focus."""
    paths = [trace(principle.surfaces, np.radians(angle)) for angle in principle.psi_deg]
    viewpoint = list(principle.foci.values())[-1]
    for path in paths:
        last, ahead = path[-2], path[-1]
        end = last + ahead * (reach - abs(last[0])) / max(abs(ahead[0]), 1e-9)
        # On the other side of the axis if the mirror sends it there.
        end = end if np.sign(ahead[0]) == np.sign(last[0]) else last + ahead * (reach + abs(last[0])) / abs(ahead[0])
        points = np.array([*path[:-1], end])
        axes.plot(points[:, 0], points[:, 1], color=BLUE, linewidth=0.8)
        axes.plot([last[0], 0.0], [last[1], viewpoint], ":", color=BLUE, linewidth=0.7)
    for index, surface in enumerate(principle.surfaces, start=1):
        widest = 1.15 * max(abs(path[index][0]) for path in paths)
        radii = np.linspace(-widest, widest, 201)
        heights = np.array([float(surface.height(abs(radius))) for radius in radii])
        axes.plot(radii, heights, color=INK, linewidth=2.0)
    axes.axvline(0.0, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1.5, 2)), zorder=0)
    for name, height in principle.foci.items():
        axes.plot([0.0], [height], "o", color=INK, markersize=3.5, zorder=5)
        label = axes.annotate(f"${name}$", (0.0, height), (-4, 3), textcoords="offset points", ha="right", fontsize=9.0)
        label.set_path_effects(HALO)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(principle.title)


def trace(surfaces: Sequence[Surface], psi: float) -> list[Point]:
    """Points (R, z) of a ray that leaves the pinhole at an angle from the axis, by reflection; its direction last.

    Raises
    ------
    ValueError
        The ray misses a surface.
    """
    place, ahead = np.zeros(2), np.array([np.sin(psi), np.cos(psi)])
    points = [place]
    for surface in surfaces:
        place = _first_point(surface, place, ahead)
        step = 1e-4
        radius = abs(place[0])
        slope = float(surface.height(radius + step) - surface.height(radius - step)) / (2.0 * step) * np.sign(place[0])
        normal = np.array([-slope, 1.0]) / np.hypot(slope, 1.0)
        ahead = ahead - 2.0 * (ahead @ normal) * normal
        points.append(place)
    return [*points, ahead]


def _first_point(surface: Surface, place: Point, ahead: Point) -> Point:
    heights = np.asarray(surface.height(_RADII))
    # Distances along the ray and beside it: rays may be parallel to the axis.
    along = (_RADII - place[0]) * ahead[0] + (heights - place[1]) * ahead[1]
    beyond = (_RADII - place[0]) * ahead[1] - (heights - place[1]) * ahead[0]
    crossings = np.flatnonzero((np.sign(beyond[1:]) != np.sign(beyond[:-1])) & (along[1:] > 1e-6))
    if not len(crossings):
        raise ValueError("the ray misses a surface")
    first = crossings[np.argmin(along[crossings])]
    share = beyond[first] / (beyond[first] - beyond[first + 1])
    radius = _RADII[first] + share * (_RADII[first + 1] - _RADII[first])
    return np.array([radius, float(surface.height(radius))])
