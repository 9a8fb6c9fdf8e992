"""A view's path as wide as its light: what the full pupil takes in of every scene point, not chief rays alone.

At each end of a zone the light of the nearest and of the farthest scene point goes with the chief ray; the wider of
the two counts. Widths are first order about the chief ray (:mod:`designer.optics.focus`).

Everything takes floats, NumPy arrays or CasADi symbols; lengths in mm.
"""

from __future__ import annotations

from dataclasses import replace

from designer.optics.backend import Scalar, absolute, maximum, sqrt
from designer.optics.focus import ChiefRay, LightWidth, light_width, reciprocal_along_ray
from designer.optics.layout import OpticalPath, Reflection


def widened(
    path: OpticalPath,
    rays: tuple[ChiefRay, ChiefRay],
    pupil_radius: Scalar,
    distances: tuple[Scalar, Scalar],
) -> OpticalPath:
    """A path of chief rays with the half-widths of the light at both ends of its zone.

    Parameters
    ----------
    rays
        The chief rays at the zone's inner and outer end.
    pupil_radius
        Radius of the entrance pupil.
    distances
        Nearest and farthest distance of the scene from the axis.
    """
    widths = [
        [light_width(ray, reciprocal_along_ray(ray.slope, distance), pupil_radius) for distance in distances]
        for ray in rays
    ]
    reflections = tuple(
        replace(
            reflection,
            face_widths=(_on_face(widths[0], place), _on_face(widths[1], place)),
            crossing_width=_at_crossing(path, rays, widths, place, reflection),
        )
        for place, reflection in enumerate(path.reflections)
    )
    last = len(path.reflections) - 1
    world = (_across(widths[0], last), _across(widths[1], last))
    return replace(path, reflections=reflections, pupil_radius=pupil_radius, world_widths=world)


def _on_face(widths: list[LightWidth], place: int) -> Scalar:
    near, far = widths
    return maximum(absolute(near.radial[place]), absolute(far.radial[place]))


def _across(widths: list[LightWidth], place: int) -> Scalar:
    near, far = widths
    return maximum(absolute(near.across[place]), absolute(far.across[place]))


def _at_crossing(
    path: OpticalPath,
    rays: tuple[ChiefRay, ChiefRay],
    widths: list[list[LightWidth]],
    place: int,
    reflection: Reflection,
) -> Scalar:
    """The larger half-width across the chief rays where they cross the axis; zero where they do not."""
    if reflection.crossing_height is None:
        return 0.0
    largest: Scalar = 0.0
    for ray, of_end in zip(rays, widths, strict=True):
        radius, height = ray.points[place]
        rise = reflection.crossing_height - height
        to_crossing = sqrt(radius * radius + rise * rise)
        # The last leg has no end: there widths go by the distance itself.
        share = to_crossing / ray.legs[place + 1] if place + 1 < len(path.reflections) else to_crossing
        for width in of_end:
            largest = maximum(largest, width.along_leg(place + 1, share))
    return largest
