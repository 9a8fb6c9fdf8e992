"""Solids as triangles: closed, of the volume that Pappus's theorem gives, corners on the conic, chords within 1 um."""

import io

import numpy as np
import pytest
from scipy.integrate import quad

from designer.design import Mirror
from designer.export import stl
from designer.export.stl import CHORD_ERROR_MM, mirror_mesh, stl_solids
from designer.files import InputError
from designer.trace.instrument import sag
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design

ALL = [studied_design(name) for name in NAMES] + [sharp_design(name) for name in SHARP_NAMES]
# One of each shape: ellipsoid, hyperboloid, paraboloid, plane, steep, nearly flat, and one without a hole.
SOME = [
    *sharp_design(SHARP_NAMES[1]).mirrors,
    *studied_design(NAMES[11]).mirrors,
    studied_design(NAMES[12]).mirrors[0],
    studied_design(NAMES[5]).mirrors[0].model_copy(update={"inner_radius_mm": 0.0}),
]


def distance_from_conic(mirror: Mirror, points: np.ndarray, offset: float) -> np.ndarray:
    """First-order distance (n,) of points (n, 3) from the face shifted by ``offset``."""
    curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
    radius, z, k = np.hypot(points[:, 0], points[:, 1]), points[:, 2] - mirror.vertex_mm - offset, 1.0 + mirror.conic
    value = curvature * (radius**2 + k * z**2) - 2.0 * z
    return np.abs(value / np.hypot(2.0 * curvature * radius, 2.0 * curvature * k * z - 2.0))


def volume_by_quadrature(mirror: Mirror) -> float:
    """Shells of radius r about the axis: 2 pi r times the height between face and back."""

    def shell(r: float) -> float:
        top, bottom = float(sag(mirror, r)) + mirror.back_offset_mm, float(sag(mirror, r))
        return 2.0 * np.pi * r * abs(top - bottom)

    return quad(shell, mirror.inner_radius_mm, mirror.outer_radius_mm)[0]


@pytest.mark.parametrize("mirror", SOME, ids=lambda mirror: f"{mirror.kind} {mirror.outer_radius_mm:.1f}")
def test_trimesh_finds_a_closed_solid_of_the_right_volume_on_the_conic(mirror: Mirror) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh, which reads solids, is not installed")
    design = ALL[0].model_copy(update={"mirrors": (mirror,)})
    (content,) = stl_solids(design).values()
    assert b"mm" in content[:80]
    solid = trimesh.load(io.BytesIO(content), file_type="stl")
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume == pytest.approx(volume_by_quadrature(mirror), rel=1e-3)
    # The file holds single precision; what it is made from holds the conic.
    points = np.asarray(solid.vertices)
    near = np.minimum(*(distance_from_conic(mirror, points, offset) for offset in (0.0, mirror.back_offset_mm)))
    assert near.max() <= 2.0 * np.spacing(np.float32(np.abs(points).max()))
    corners = mirror_mesh(mirror).corners_mm
    near = np.minimum(*(distance_from_conic(mirror, corners, offset) for offset in (0.0, mirror.back_offset_mm)))
    assert near.max() < 1e-9
    assert np.hypot(*corners.T[:2]).max() == pytest.approx(mirror.outer_radius_mm, abs=1e-12)


@pytest.mark.parametrize("mirror", SOME, ids=lambda mirror: f"{mirror.kind} {mirror.outer_radius_mm:.1f}")
def test_no_point_of_a_triangle_is_farther_from_the_solid_than_stated(mirror: Mirror) -> None:
    """Points all over the triangles of the face and its back, and of both walls."""
    mesh = mirror_mesh(mirror)
    rng = np.random.default_rng(5)
    chosen = mesh.corners_mm[mesh.triangles[rng.integers(len(mesh.triangles), size=20_000)]]
    middles = [chosen.mean(axis=1), *((chosen[:, i] + chosen[:, i - 1]) / 2.0 for i in range(3))]
    points = np.concatenate([*middles, np.einsum("ij,ijk->ik", rng.dirichlet(np.ones(3), len(chosen)), chosen)])
    radius = np.hypot(points[:, 0], points[:, 1])
    distances = [distance_from_conic(mirror, points, offset) for offset in (0.0, mirror.back_offset_mm)]
    walls = [np.abs(radius - wall) for wall in (mirror.inner_radius_mm, mirror.outer_radius_mm)]
    assert np.min([*distances, *walls], axis=0).max() < CHORD_ERROR_MM


def test_what_is_no_solid_is_refused() -> None:
    mirror = ALL[0].mirrors[0]
    with pytest.raises(InputError, match="no thickness"):
        mirror_mesh(mirror.model_copy(update={"thickness_mm": 0.0}))
    with pytest.raises(InputError, match="too large or too steep"):
        mirror_mesh(mirror.model_copy(update={"outer_radius_mm": 1e5, "conic": -2.0, "radius_mm": 1e5}))


@pytest.mark.filterwarnings("error")
def test_a_hole_of_a_denormal_radius_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library may have set the processor to take denormal numbers for zero: then the hole passes for none."""
    whole, holed = (SOME[-1].model_copy(update={"inner_radius_mm": radius}) for radius in (0.0, 5e-324))
    monkeypatch.setattr(stl, "check_solid", lambda mirror: None)
    contents = [stl_solids(ALL[0].model_copy(update={"mirrors": (mirror,)})) for mirror in (whole, holed)]
    assert contents[0] == contents[1]
