"""Textured triangle meshes as shapes, through the optional library trimesh (extra ``mesh``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.extras import require_extra
from designer.files import InputError
from designer.imaging.render.scenes.shapes import Array, Point

# To find again which triangle a point lies on, the ray starts this part of the mesh's size before it.
STEP_BACK = 1e-5
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True)
class TriangleMesh:
    """Triangles that wear the world's texture; ``mesh`` is a ``trimesh.Trimesh`` in the design's frame, in mm."""

    mesh: Any

    def distances(self, points: Array, directions: Array) -> Array:
        """Distance (n,) in mm to the first triangle, infinite where the ray misses."""
        triangle = self._first_triangles(points, directions)
        met = np.flatnonzero(triangle >= 0)
        distance = np.full(points.shape[1], np.inf)
        corner, normal = self.mesh.triangles[triangle[met], 0].T, self.mesh.face_normals[triangle[met]].T
        with np.errstate(all="ignore"):
            # The search works in single precision; the place is computed again on the triangle's plane.
            reached = np.einsum("in,in->n", normal, corner - points[:, met]) / np.einsum(
                "in,in->n", normal, directions[:, met]
            )
        distance[met] = np.where(reached > 0.0, reached, np.inf)
        return distance

    def normals(self, points: Array, directions: Array) -> Array:
        """Unit normals (3, n) where rays along ``directions`` meet the mesh in ``points`` (3, n)."""
        return np.asarray(self.mesh.face_normals[self._triangles_at(points, directions)].T)

    def bounding_disc(self) -> tuple[Array, float]:
        """Centre (2,) and radius in mm of a disc that holds the mesh seen along the z axis."""
        low, high = self.mesh.bounds[:, :2]
        return np.asarray((low + high) / 2.0), float(np.hypot(*(high - low)) / 2.0)

    def heights(self) -> tuple[float, float]:
        """Lowest and highest z in mm."""
        low, high = self.mesh.bounds[:, 2]
        return float(low), float(high)

    def _first_triangles(self, points: Array, directions: Array) -> NDArray[np.intp]:
        return np.asarray(self.mesh.ray.intersects_first(points.T, directions.T), dtype=np.intp)

    def _triangles_at(self, points: Array, directions: Array) -> NDArray[np.intp]:
        back = STEP_BACK * float(self.mesh.scale) / 2.0
        return np.maximum(self._first_triangles(points - back * directions, directions), 0)


@dataclass(frozen=True, slots=True)
class ColouredMesh(TriangleMesh):
    """Triangles with a brightness of their own: ``greys`` of triangles (n,) and barycentric coordinates (n, 3)."""

    greys: Callable[[NDArray[np.intp], Array], Array]

    def albedo(self, points: Array, directions: Array) -> Array:
        """Radiance (n,) from 0 to 1 where rays along ``directions`` meet the mesh in ``points`` (3, n)."""
        triangle = self._triangles_at(points, directions)
        weights = _trimesh().triangles.points_to_barycentric(self.mesh.triangles[triangle], points.T)
        return self.greys(triangle, np.clip(weights, 0.0, 1.0))


def read_mesh(path: Path, origin: Point) -> TriangleMesh:
    """A mesh file in mm, z up, whose own origin comes to ``origin`` in the design's frame.

    Raises
    ------
    InputError
        trimesh is not installed, the file cannot be read, or it holds no triangles.
    """
    require_extra("mesh", f"{path}: a mesh")
    trimesh = _trimesh()
    if not path.is_file():
        raise InputError(f"{path}: cannot be read: there is no such file")
    try:
        mesh = trimesh.load(path, force="mesh")
    except Exception as error:
        # Each format's parser has failures of its own kind; for a person they are one: this file is no use.
        # It looks for further libraries once the file has turned out to be no ordinary one.
        is_library = isinstance(error, ImportError)
        reason = "neither binary data of this format nor UTF-8 text" if is_library else " ".join(str(error).split())
        kind = path.suffix.removeprefix(".").upper()
        raise InputError(f"{path}: damaged, or not a mesh of the format {kind}: {reason}") from None
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise InputError(f"{path}: is empty; a scene needs at least one triangle with finite corners")
    greys = _greys(mesh)
    mesh.apply_translation(origin)
    return TriangleMesh(mesh) if greys is None else ColouredMesh(mesh, greys)


def _greys(mesh: Any) -> Callable[[NDArray[np.intp], Array], Array] | None:
    """The brightness of a mesh's own colours as a function of triangle and barycentric place; None if it has none."""
    visual = mesh.visual
    if visual.kind == "texture" and visual.uv is not None and getattr(visual.material, "image", None) is not None:
        picture, uv = visual.material.image, np.asarray(visual.uv)

        def from_picture(triangle: NDArray[np.intp], weights: Array) -> Array:
            places = np.einsum("nc,nci->ni", weights, uv[mesh.faces[triangle]])
            colours = _trimesh().visual.color.uv_to_interpolated_color(places, picture)
            return np.asarray(colours[:, :3] @ LUMINANCE / 255.0)

        return from_picture
    if visual.kind in ("vertex", "face"):
        greys = np.asarray(visual.vertex_colors)[:, :3] @ LUMINANCE / 255.0

        def from_corners(triangle: NDArray[np.intp], weights: Array) -> Array:
            return np.asarray(np.einsum("nc,nc->n", weights, greys[mesh.faces[triangle]]))

        return from_corners
    return None


def _trimesh() -> Any:
    return import_module("trimesh")
