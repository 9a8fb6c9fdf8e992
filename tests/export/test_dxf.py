"""Drawings, read again by ezdxf: every point of a profile's spline lies on the conic."""

import math
from pathlib import Path

import numpy as np
import pytest

from designer.design import Mirror
from designer.export.conic_arc import profile_arc
from designer.export.dxf import dxf_drawing
from designer.files import InputError
from support.studied_designs import NAMES, studied_design


def distance_from_conic(mirror: Mirror, radius: np.ndarray, height: np.ndarray) -> np.ndarray:
    """First-order distance (n,) in mm of points from c (r^2 + (1 + K) z^2) = 2 z, z from the vertex."""
    curvature = 0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm
    z, k = height - mirror.vertex_mm, 1.0 + mirror.conic
    value = curvature * (radius**2 + k * z**2) - 2.0 * z
    slope = np.hypot(2.0 * curvature * radius, 2.0 * curvature * k * z - 2.0)
    return np.abs(value / slope)


@pytest.mark.parametrize("name", NAMES)
def test_ezdxf_reads_the_profiles_back_on_their_conics(name: str, tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf, which writes and reads drawings, is not installed")
    design = studied_design(name)
    (text,) = dxf_drawing(design).values()
    assert (text,) == tuple(dxf_drawing(design).values())
    (tmp_path / "profiles.dxf").write_text(text, encoding="utf-8")
    drawing = ezdxf.readfile(tmp_path / "profiles.dxf")
    assert not drawing.audit().has_errors
    assert drawing.units == ezdxf.units.MM
    for mirror in design.mirrors:
        (face,) = drawing.modelspace().query(f'*[layer=="{mirror.name} face"]')
        if mirror.radius_mm is None:
            points = np.array([face.dxf.start, face.dxf.end])
        else:
            points = np.array([tuple(point) for point in face.construction_tool().points(np.linspace(0.0, 1.0, 401))])
        assert distance_from_conic(mirror, points[:, 0], points[:, 1]).max() < 1e-9
        assert (np.diff(points[:, 0]) > 0.0).all()
        assert points[[0, -1], 0] == pytest.approx([mirror.inner_radius_mm, mirror.outer_radius_mm], abs=1e-12)
        # The substrate closes the outline: back and two edges, on the side away from the light.
        parts = drawing.modelspace().query(f'*[layer=="{mirror.name} substrate"]')
        assert len(parts) == 3
        edges = [part for part in parts if part.dxftype() == "LINE" and part.dxf.start.x == part.dxf.end.x]
        assert [edge.dxf.end.y - edge.dxf.start.y for edge in edges] == pytest.approx([mirror.back_offset_mm] * 2)


@pytest.mark.parametrize("name", NAMES)
def test_the_arc_is_the_conic(name: str) -> None:
    """The Bezier curve, evaluated here: on the conic everywhere, and the vertex sheet's half of it."""
    for mirror in studied_design(name).mirrors:
        arc, t = profile_arc(mirror), np.linspace(0.0, 1.0, 101)
        weights = np.stack([(1.0 - t) ** 2, 2.0 * arc.weight * t * (1.0 - t), t**2])
        radius, height = (np.array(arc.points).T @ weights) / weights.sum(axis=0)
        assert distance_from_conic(mirror, radius, height).max() < 1e-10
        if mirror.radius_mm is not None:
            assert (1.0 - (1.0 + mirror.conic) * (height - mirror.vertex_mm) / mirror.radius_mm > 0.0).all()


def test_weights_tell_the_conics_apart() -> None:
    """Ellipses weigh less than 1, parabolas 1, hyperbolas more; a circle's weight is the cosine of half its angle."""
    for name in NAMES:
        for mirror in studied_design(name).mirrors:
            weight = profile_arc(mirror).weight
            if mirror.kind in {"plane", "paraboloid"}:
                assert weight == pytest.approx(1.0, abs=1e-9)
            else:
                assert (weight > 1.0) == (mirror.kind == "hyperboloid")
    circle = (
        studied_design(NAMES[0])
        .mirrors[0]
        .model_copy(update={"conic": 0.0, "radius_mm": -40.0, "inner_radius_mm": 0.0, "outer_radius_mm": 20.0})
    )
    assert profile_arc(circle).weight == pytest.approx(math.cos(math.asin(0.5) / 2.0), rel=1e-12)


@pytest.mark.parametrize("changes", [{"name": "a/b"}, {"outer_radius_mm": 1e7}])
def test_what_no_drawing_holds_is_refused(changes: dict[str, object]) -> None:
    pytest.importorskip("ezdxf", reason="ezdxf, which writes drawings, is not installed")
    design = studied_design(NAMES[0])
    mirror = design.mirrors[2].model_copy(update=changes)
    with pytest.raises(InputError, match="mirror"):
        dxf_drawing(design.model_copy(update={"mirrors": (*design.mirrors[:2], mirror)}))
