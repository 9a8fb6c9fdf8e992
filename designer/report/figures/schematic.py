"""Catadioptric cameras with one viewpoint, drawn as principles: conics, foci, a few rays (figures 1 and 3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from designer.design import Camera, Mirror
from designer.optics.conversions import FocalForm, vertex_from_focal
from designer.optics.kinds import kind_of_conic
from designer.report.figures.style import BLUE, GREY, HALO, INK
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import assemble_instrument, sag
from designer.trace.sequential import trace_sequential

# A pinhole and no camera body: a principle has mirrors only.
_PINHOLE = Camera(
    focal_length_mm=1.0,
    pixel_pitch_mm=1e-3,
    width_px=1,
    height_px=1,
    f_number=1.0,
    lens_radius_mm=1e-6,
    lens_front_mm=0.0,
    lens_length_mm=0.0,
    body_radius_mm=0.0,
)


@dataclass(frozen=True, slots=True)
class Principle:
    """What a schematic shows: mirrors in the order in which a ray from the pinhole meets them, foci, and rays.

    ``psi_deg`` are the angles of the rays at the pinhole, which lies at the origin; ``foci`` are heights by name.
    """

    title: str
    mirrors: Sequence[Mirror]
    foci: Mapping[str, float]
    psi_deg: Sequence[float]


def hyperboloid_or_ellipsoid(
    title: str, half_distance: float, inverse_eccentricity: float, psi_deg: Sequence[float]
) -> Principle:
    """One mirror above the camera with foci at the pinhole F' and at F (figure 1 (a, b); docs/theory.md, section 2)."""
    mirror = conic_between(0.0, 2.0 * half_distance, inverse_eccentricity, 1)
    return Principle(title, (mirror,), {"F'": 0.0, "F": 2.0 * half_distance}, psi_deg)


def paraboloid_pair(
    title: str, viewpoint: float, primary: float, secondary: float, psi_deg: Sequence[float]
) -> Principle:
    """A secondary paraboloid of focal length ``secondary`` over a primary one (figure 1 (c))."""
    above = _mirror(secondary, -2.0 * secondary, -1.0, 1)
    below = _mirror(viewpoint + primary, -2.0 * primary, -1.0, -1)
    return Principle(title, (above, below), {"F_2": 0.0, "F_1": viewpoint}, psi_deg)


def conic_between(focus: float, other_focus: float, inverse_eccentricity: float, facing: int) -> Mirror:
    """The mirror with two given foci: ``facing`` is +1 for one that faces down, -1 for one that faces up."""
    form = FocalForm(facing * (other_focus - focus) / 2.0, inverse_eccentricity)
    vertex = vertex_from_focal(form)
    return _mirror(focus + facing * form.vertex_distance, facing * vertex.radius, vertex.conic_constant, facing)


def _mirror(vertex_mm: float, radius_mm: float, conic: float, facing: int) -> Mirror:
    """A face without aperture or substrate; rays meet it wherever its conic goes."""
    kind = kind_of_conic(conic).word
    return Mirror(
        name=f"{kind} at {vertex_mm:g}",
        kind=kind,
        vertex_mm=vertex_mm,
        radius_mm=radius_mm,
        conic=conic,
        inner_radius_mm=0.0,
        outer_radius_mm=1e-6,
        thickness_mm=0.0,
        faces="down" if facing > 0 else "up",
    )


def draw_principle(axes: Axes, principle: Principle, reach: float) -> None:
    """Draw a schematic; rays leave up to ``reach`` from the axis, dotted back to the viewpoint, the last focus."""
    paths = rays(principle)
    viewpoint = list(principle.foci.values())[-1]
    for path in paths:
        last, ahead = path[-2], path[-1]
        end = last + ahead * (reach - abs(last[0])) / max(abs(ahead[0]), 1e-9)
        # On the other side of the axis if the mirror sends it there.
        end = end if np.sign(ahead[0]) == np.sign(last[0]) else last + ahead * (reach + abs(last[0])) / abs(ahead[0])
        points = np.array([*path[:-1], end])
        axes.plot(points[:, 0], points[:, 1], color=BLUE, linewidth=0.8)
        axes.plot([last[0], 0.0], [last[1], viewpoint], ":", color=BLUE, linewidth=0.7)
    for index, mirror in enumerate(principle.mirrors, start=1):
        widest = 1.15 * np.abs(paths[:, index, 0]).max()
        radii = np.linspace(-widest, widest, 201)
        axes.plot(radii, mirror.vertex_mm + sag(mirror, radii), color=INK, linewidth=2.0)
    axes.axvline(0.0, color=GREY, linewidth=0.5, linestyle=(0, (8, 2, 1.5, 2)), zorder=0)
    for name, height in principle.foci.items():
        axes.plot([0.0], [height], "o", color=INK, markersize=3.5, zorder=5)
        label = axes.annotate(f"${name}$", (0.0, height), (-4, 3), textcoords="offset points", ha="right", fontsize=9.0)
        label.set_path_effects(HALO)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(principle.title)


def rays(principle: Principle) -> NDArray[np.float64]:
    """Traced rays (rays, mirrors + 2, 2): the pinhole, a point (R, z) on each mirror, and the direction of leaving.

    Raises
    ------
    ValueError
        A ray misses a mirror.
    """
    instrument = assemble_instrument(principle.mirrors, _PINHOLE)
    directions = pinhole_directions(np.radians(principle.psi_deg))
    trace = trace_sequential(instrument, range(len(principle.mirrors)), directions, apertures=False)
    if (trace.missed >= 0).any():
        raise ValueError("a ray misses a mirror")
    return np.stack([np.zeros_like(trace.point), *trace.hits, trace.direction], axis=1)[:, :, [0, 2]]
