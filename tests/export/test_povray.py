"""POV-Ray scenes: their quadrics traced by a few lines of this page, and the whole scene rendered by POV-Ray."""

import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from sequential_rays import reflected

from designer.export.povray import povray_scene
from designer.export.sequential import sequential_views
from designer.imaging.render.camera_rays import ray_directions
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support.studied_designs import NAMES, studied_design, with_coarse_pixels

NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"
FACE = re.compile(
    rf"quadric \{{\s*<{NUMBER}, {NUMBER}, {NUMBER}>, <0, 0, 0>, <0, 0, {NUMBER}>, 0\s*clipped_by \{{([^\n]*)\}}\s*"
    rf"texture \{{ Reflecting \}}[^\n]*\s*translate <0, 0, {NUMBER}>"
)
TUBE = re.compile(rf"cylinder \{{ <0, 0, {NUMBER}>, <0, 0, {NUMBER}>, {NUMBER} \}}")


def faces_of(scene: str) -> list[dict[str, float]]:
    """The reflecting quadrics of a scene and the cylinders that clip them."""
    faces = []
    for x2, y2, z2, z1, clip, vertex in FACE.findall(scene):
        assert x2 == y2
        (low, high, outer), *hole = TUBE.findall(clip)
        scale = -2.0 / float(z1)
        faces.append(
            {
                "curvature": float(x2) * scale,
                "squared": float(z2) * scale,
                "vertex": float(vertex),
                "inner": float(hole[0][2]) if hole else 0.0,
                "outer": float(outer),
                "low": float(low),
                "high": float(high),
                # The outside, where the quadric is positive, reflects: below a face of positive scale.
                "down": float(scale > 0.0),
            }
        )
    return faces


@pytest.mark.parametrize("name", NAMES)
def test_the_quadrics_send_pinhole_rays_where_the_tracer_does(name: str) -> None:
    design = studied_design(name)
    (scene,) = povray_scene(design).values()
    by_vertex = {face["vertex"]: face for face in faces_of(scene)}
    assert len(by_vertex) == len(design.mirrors)
    instrument = build_instrument(design)
    for view_name, view in sequential_views(design).items():
        tangents = np.array(view.sensor_heights_mm) / view.principal_distance_mm
        ahead = np.stack([0.6 * tangents, -0.8 * tangents, np.ones_like(tangents)], axis=-1)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        path = design.views.by_name[view_name].path
        traced = trace_sequential(instrument, instrument.path(path), ahead)
        point = np.zeros_like(ahead)
        for mirror_name, ours in zip(path, traced.hits, strict=True):
            mirror = design.mirror(mirror_name)
            face = by_vertex[mirror.vertex_mm]
            conic = face["squared"] / face["curvature"] - 1.0 if face["curvature"] else 0.0
            point, ahead = reflected(point, ahead, face["vertex"], face["curvature"], conic)
            assert np.linalg.norm(point - ours, axis=1).max() < 1e-9
            assert (face["inner"], face["outer"]) == (mirror.inner_radius_mm, mirror.outer_radius_mm)
            assert face["down"] == (mirror.faces == "down")
            height = point[:, 2] - face["vertex"]
            assert ((height > face["low"]) & (height < face["high"])).all()
        assert np.abs(ahead - traced.direction).max() < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_the_clip_leaves_one_sheet_and_its_used_zone(name: str) -> None:
    """At every radius of the face exactly one of the two roots of the quadric lies between the clip's ends."""
    (scene,) = povray_scene(studied_design(name)).values()
    for face in faces_of(scene):
        if face["curvature"] == 0.0:
            continue
        for radius in np.linspace(face["inner"], face["outer"], 20):
            roots = np.roots([face["squared"], -2.0, face["curvature"] * radius**2])
            assert sum(face["low"] < root < face["high"] for root in roots.real) == 1


@pytest.mark.parametrize("name", NAMES[:4])
def test_povray_renders_the_heights_and_azimuths_that_we_trace(name: str, tmp_path: Path) -> None:
    """The wall's tone encodes one coordinate; every pixel must show that of the point where our ray meets the wall."""
    povray = shutil.which("povray")
    if povray is None:
        pytest.skip("povray, the independent renderer, is not installed")
    design = with_coarse_pixels(studied_design(name), 4)
    camera = design.camera
    (scene,) = povray_scene(design).values()
    wall_mm = next(iter(sequential_views(design).values())).wall_mm
    reach = 2.0 * wall_mm
    rows, columns = (grid.ravel() for grid in np.mgrid[0 : camera.height_px, 0 : camera.width_px])
    directions = ray_directions(camera, columns.astype(float), rows.astype(float), None, None)
    trace = trace_first_hits(build_instrument(design), directions)
    start, ahead = trace.exit_point, trace.exit_direction
    with np.errstate(all="ignore"):
        a = (ahead[:, :2] ** 2).sum(axis=1)
        b = (start[:, :2] * ahead[:, :2]).sum(axis=1)
        c = (start[:, :2] ** 2).sum(axis=1) - wall_mm**2
        met = start + ((np.sqrt(b * b - a * c) - b) / a)[:, None] * ahead
    bounces = np.abs(directions - ahead).max(axis=1) > 1e-9
    visible = (trace.status == Status.ESCAPED) & bounces & (np.abs(met[:, 2]) < 0.9 * reach)
    for axis, letter in enumerate("xyz"):
        tone = f"gradient {letter} color_map {{ [0 rgb 0] [1 rgb 1] }} scale {2.0 * reach} translate -{reach}"
        coded = re.sub(r"pigment \{ checker .*\}\n", f"pigment {{ {tone} * {letter} }}\n", scene)
        (tmp_path / "scene.pov").write_text(coded, encoding="utf-8")
        size = [f"+W{camera.width_px}", f"+H{camera.height_px}"]
        words = [povray, "+Iscene.pov", "+Oscene.png", "+FN16", "-D", "-A", "File_Gamma=1.0", *size]
        subprocess.run(words, cwd=tmp_path, check=True, capture_output=True)
        image = cv2.imread(str(tmp_path / "scene.png"), cv2.IMREAD_UNCHANGED)[..., 0].ravel() / 65535.0
        seen = (2.0 * image - 1.0) * reach
        shown = image > 0.0
        # Edges fall on one side of a pixel's centre or the other only by rounding.
        assert (shown != visible).mean() < 1e-3
        both = shown & visible
        assert both.mean() > 0.2
        assert np.abs(seen - met[:, axis])[both].max() < 2.0 * reach / 65535.0
