"""Solids of mirrors and housing as triangles (binary ``.stl``), in mm, each in its place above the pinhole.

The face, its back shifted along the axis, the outer edge and the hole close the solid. The corners of the triangles lie
on the conic; between them the triangles depart from it by less than a micrometre. Two neighbouring rings of corners and
two neighbouring meridians make a plane trapezoid. It departs from the surface by no more than the height of the
profile over its chord and that of the outer circle over its own, together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.design import Design, Mirror
from designer.export.assembly_name import check_names_of_parts, housing_parts
from designer.export.conic_arc import ConicArc, check_solid, height_over_chord_mm, profile_arc, split
from designer.files import InputError
from designer.housing import Tube
from designer.trace.instrument import sag

CHORD_ERROR_MM = 1e-3
"""Largest distance of the triangles from the solid that they stand for; they keep a tenth of it in reserve."""
_ALONG_MM, _AROUND_MM = 0.4 * CHORD_ERROR_MM, 0.5 * CHORD_ERROR_MM
_MOST_TRIANGLES = 4_000_000
_ON_AXIS_MM = float(np.finfo(np.float32).tiny)
"""The file's numbers have single precision, so what is nearer to the axis lies on it."""
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles that close a solid, seen from outside counterclockwise.

    ``corners_mm`` are points (n, 3), ``triangles`` their indices (m, 3).
    """

    corners_mm: NDArray[np.float64]
    triangles: NDArray[np.intp]


def stl_solids(design: Design) -> dict[str, bytes]:
    """The solids of a design's mirrors and housing, by their names.

    Raises
    ------
    InputError
        A mirror has no thickness, or is too large or too steep for triangles of this accuracy.
    """
    check_names_of_parts(design)
    meshes = {mirror.name: mirror_mesh(mirror) for mirror in design.mirrors}
    return {name: _binary(mesh) for name, mesh in (meshes | housing_meshes(design)).items()}


def housing_meshes(design: Design) -> dict[str, Mesh]:
    """The tube, or each strut, as triangles, by their names; nothing for a design without a housing."""
    housing, names = design.housing, housing_parts(design)
    if housing is None:
        return {}
    low, high = housing.low_mm, housing.high_mm
    if isinstance(housing, Tube):
        inner, outer = housing.inner_radius_mm, housing.outer_radius_mm
        section = np.array([[inner, low], [outer, low], [outer, high], [inner, high]])
        return {names[0]: _revolved(section, _meridians(outer))}
    radius = housing.width_mm / 2.0
    rod = _revolved(np.array([[0.0, low], [radius, low], [radius, high], [0.0, high]]), _meridians(radius))
    angles = np.radians(housing.azimuths_deg)
    places = housing.radius_mm * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
    return {name: Mesh(rod.corners_mm + place, rod.triangles) for name, place in zip(names, places, strict=True)}


def mirror_mesh(mirror: Mirror) -> Mesh:
    """A mirror's solid as triangles.

    Raises
    ------
    InputError
        The mirror has no thickness, or is too large or too steep for triangles of this accuracy.
    """
    check_solid(mirror)
    meridians = _meridians(mirror.outer_radius_mm)
    most = _MOST_TRIANGLES / (4 * meridians)
    radii = _radii(mirror, most)
    if radii.size > most:
        raise InputError(
            f"mirror {mirror.name}: too large or too steep for triangles within {1000 * CHORD_ERROR_MM:g} µm of it "
            f"(more than {_MOST_TRIANGLES} of them)"
        )
    heights = mirror.vertex_mm + sag(mirror, radii)
    # Around the section, the solid on its left: with radius along the lower surface, back along the upper one.
    lower, upper = sorted((0.0, mirror.back_offset_mm))
    section = np.concatenate(
        [np.column_stack([radii, heights + lower]), np.column_stack([radii, heights + upper])[::-1]]
    )
    return _revolved(section, meridians)


def _meridians(outer_radius: float) -> int:
    """How many meridians keep the outer circle close enough to its chords."""
    share = min(_AROUND_MM / outer_radius, 0.5)
    return max(16, math.ceil(math.pi / math.acos(1.0 - share)))


def _radii(mirror: Mirror, most: float) -> NDArray[np.float64]:
    """Radii of the rings, inner to outer rim, so close that the profile stays close to its chords.

    Halving ends early, with more than ``most`` of them, where that takes too many.
    """
    waiting: list[ConicArc] = [profile_arc(mirror)]
    found = [mirror.inner_radius_mm]
    while waiting and len(found) <= most:
        arc = waiting.pop()
        if height_over_chord_mm(arc) <= _ALONG_MM:
            found.append(arc.points[2][0])
        else:
            first, second = split(arc)
            waiting += [second, first]
    return np.array([*found[:-1], mirror.outer_radius_mm])


def _revolved(section: NDArray[np.float64], meridians: int) -> Mesh:
    """A closed section (k, 2) of radius and height, turned about the axis; points on the axis stay single."""
    angles = 2.0 * np.pi * np.arange(meridians) / meridians
    on_axis = section[:, 0] < _ON_AXIS_MM
    # Corner number of each point of the section on each meridian.
    counts = np.where(on_axis, 1, meridians)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    rings = [
        np.array([[0.0, 0.0, z]])
        if axis
        else np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(meridians, z)])
        for (r, z), axis in zip(section, on_axis, strict=True)
    ]
    here, ahead = np.arange(meridians), (np.arange(meridians) + 1) % meridians
    found = []
    for first in range(len(section)):
        second = (first + 1) % len(section)
        a, b = (starts[i] + (0 * here if on_axis[i] else here) for i in (first, second))
        c, d = (starts[i] + (0 * here if on_axis[i] else ahead) for i in (second, first))
        if not on_axis[second]:
            found.append(np.column_stack([a, c, b]))
        if not on_axis[first]:
            found.append(np.column_stack([a, d, c]))
    return Mesh(np.concatenate(rings), np.concatenate(found))


def _binary(mesh: Mesh) -> bytes:
    """The file: 80 bytes of words, the number of triangles, and each with its normal."""
    corners = mesh.corners_mm[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rows = np.zeros(len(corners), _TRIANGLE)
    rows["normal"], rows["corners"] = normals, corners
    words = f"lengths in mm, within {1000 * CHORD_ERROR_MM:g} um of the conic; z above the pinhole"
    return words.encode("ascii").ljust(80) + np.uint32(len(rows)).tobytes() + rows.tobytes()
