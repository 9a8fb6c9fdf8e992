"""The optics of study.html, in JavaScript, against those of this package and its tracer."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sample_study import prototype, two_direct_mirrors

from designer.design import VIEW_NAMES, Design, read_design
from designer.evaluate.depth import (
    FIRST_ORDER_BOUND,
    SECOND_ORDER_BOUND,
    depth_error_map,
    depth_error_rms,
    second_order,
    slopes_of_point,
    stereo_pair_of,
    volume_of,
)
from designer.evaluate.score import evaluate_design
from designer.optics.focus import (
    chief_ray,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from designer.optics.view import image_radius, image_radius_slope
from designer.report.html.payload import described, payload_of_design, predicted_noise, predicted_noise_px
from designer.requirement import PREDICTED, Requirement, read_requirement
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from support import DATA
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design

SCRIPTS = Path(__file__).parents[2] / "designer" / "report" / "html" / "js"
CONFIGS = Path(__file__).parents[2] / "configs"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed: the page's scripts cannot be run")
SHARES = (0.0, 0.13, 0.5, 0.77, 1.0)
"""Where in the working volume: of its elevations, and of the logarithm of its distances."""
PROGRAM = """
import { readFileSync } from "node:fs";
import { FIRST_ORDER_BOUND, SECOND_ORDER_BOUND, imagedPoint, imageRadiusSlope, secondOrder } from "%s/optics.mjs";
const { designs, points } = JSON.parse(readFileSync(0, "utf8"));
const found = designs.map((design, place) => points[place].map(([elevation, distance]) => {
  const at = imagedPoint(design, elevation, distance);
  const views = Object.fromEntries(Object.entries(at.views).map(([name, view]) => [name, {
    ...view,
    perRadian: imageRadiusSlope(view.slope, design.views[name], design.camera.focal_length_mm),
  }]));
  return { ...at, views, secondOrder: secondOrder(at.depthError), bounds: [FIRST_ORDER_BOUND, SECOND_ORDER_BOUND] };
}));
console.log(JSON.stringify(found));
"""


def run_node(designs: list[Any], points: list[list[tuple[float, float]]]) -> list[list[dict[str, Any]]]:
    """What the page says of points (elevation from the middle in rad, distance in mm) in each design."""
    assert NODE is not None
    ended = subprocess.run(
        [NODE, "--input-type=module", "--eval", PROGRAM % SCRIPTS.as_posix()],
        input=json.dumps({"designs": designs, "points": points}),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert ended.returncode == 0, ended.stderr
    return list(json.loads(ended.stdout))


def designs_of_all_kinds() -> list[Design]:
    """Direct and folded designs, of all kinds of conics, with gains of both signs."""
    made = [prototype(), prototype(topology="upper_inner"), prototype(direct_kind="ellipsoid"), two_direct_mirrors()]
    return [
        *made,
        read_design(DATA / "folded_hypl_hy.json"),
        *map(studied_design, NAMES),
        *map(sharp_design, SHARP_NAMES),
    ]


def points_in(design: Design) -> list[tuple[float, float]]:
    low, high = np.radians(design.working_volume.elevation_deg)
    near, far = design.working_volume.distance_mm
    return [(low + (high - low) * a, near * (far / near) ** b) for a in SHARES for b in SHARES]


@pytest.fixture(scope="module")
def shown() -> list[tuple[Design, list[tuple[float, float]], list[dict[str, Any]]]]:
    designs = designs_of_all_kinds()
    points = [points_in(design) for design in designs]
    payloads = [payload_of_design(design)["designs"][design.configuration] for design in designs]
    return list(zip(designs, points, run_node(payloads, points), strict=True))


def test_gain_law_and_image_points_equal_pythons(shown) -> None:
    for design, points, found in shown:
        camera = design.camera
        for (elevation, distance), at in zip(points, found, strict=True):
            slopes = slopes_of_point(np.tan(elevation), distance, design.baseline_mm)
            for name, view in design.views.by_name.items():
                slope = slopes[name]
                arguments = (slope, view.gain, camera.focal_length_mm, view.sense)
                radius_px = image_radius(*arguments) / camera.pixel_pitch_mm
                assert at["views"][name]["slope"] == pytest.approx(slope, abs=1e-12)
                assert at["views"][name]["radiusPx"] == pytest.approx(radius_px, rel=1e-12)
                assert at["views"][name]["pointPx"][0] == pytest.approx(camera.principal_point_px[0] + radius_px)
                assert at["views"][name]["perRadian"] == pytest.approx(image_radius_slope(*arguments), rel=1e-12)


def test_the_ray_path_equals_the_tracers(shown) -> None:
    """The page intersects and reflects; so does the tracer, in three dimensions and from the same pinhole ray."""
    for design, _, found in shown:
        instrument = build_instrument(design)
        for name in VIEW_NAMES:
            view = design.views.by_name[name]
            rays = [at["views"][name]["ray"] for at in found]
            radii = np.array([at["views"][name]["radiusPx"] for at in found]) * design.camera.pixel_pitch_mm
            psi = np.arctan(radii / design.camera.focal_length_mm)
            trace = trace_sequential(instrument, instrument.path(view.path), pinhole_directions(psi))
            points = np.array([ray["points"] for ray in rays])
            for place, hits in enumerate(trace.hits, start=1):
                np.testing.assert_allclose(points[:, place], hits[:, [0, 2]], rtol=0.0, atol=1e-9)
            directions = np.array([ray["direction"] for ray in rays])
            np.testing.assert_allclose(directions, trace.direction[:, [0, 2]], rtol=0.0, atol=1e-9)
            assert all(ray["isInside"] for ray in rays)


def test_the_rays_of_both_views_meet_in_the_scene_point(shown) -> None:
    for _, points, found in shown:
        for (_, distance), at in zip(points, found, strict=True):
            for view in at["views"].values():
                (radius, height), (along_r, along_z) = view["ray"]["points"][-1], view["ray"]["direction"]
                side = np.sign(along_r)
                there = height + (distance - side * radius) / abs(along_r) * along_z
                assert there == pytest.approx(at["point"][1], abs=1e-6 * distance)


def test_blur_and_depth_error_equal_pythons(shown) -> None:
    for design, points, found in shown:
        pair, lens, pitch = stereo_pair_of(design), lens_of_camera(design.camera), design.camera.pixel_pitch_mm
        noise = design.noise_px * pitch
        for (elevation, distance), at in zip(points, found, strict=True):
            error = depth_error_map(pair, np.array(elevation), np.array(distance), noise, design.scale_uncertainty)
            assert at["depthError"] == pytest.approx(float(error), rel=1e-11)
            assert at["secondOrder"] == pytest.approx(float(second_order(error)), rel=1e-11)
            assert at["bounds"] == [FIRST_ORDER_BOUND, SECOND_ORDER_BOUND]
            for name in VIEW_NAMES:
                slope = at["views"][name]["slope"]
                ray = chief_ray(light_path_of_design(design, name), slope)
                blur = lens.blur(reciprocal_image_depth(ray, reciprocal_along_ray(slope, distance))) / pitch
                assert at["views"][name]["blurPx"] == pytest.approx(abs(blur), rel=1e-8, abs=1e-8)


def test_the_page_and_evaluate_agree_on_the_error_at_a_point_and_say_what_they_count(shown) -> None:
    """The table of ``designer evaluate`` and the live ray, of designs whose noise is the same everywhere."""
    for given, _, _ in shown:
        design = given.model_copy(update={"scale_uncertainty": 0.001})
        payload: Any = payload_of_design(design)["designs"][design.configuration]
        scores = evaluate_design(design).points
        middle = float(np.radians(np.mean(design.working_volume.elevation_deg)))
        found = run_node([payload], [[(middle, score.distance_mm) for score in scores]])[0]
        for score, at in zip(scores, found, strict=True):
            assert score.sigma_distance_mm == pytest.approx(at["depthError"] * score.distance_mm, rel=1e-9)


def test_the_page_says_what_it_counts() -> None:
    design, asked = predicted_cases()[0]
    design = design.model_copy(update={"scale_uncertainty": 0.001})
    program = f"""import {{ countedInWords }} from "{SCRIPTS}/readings.mjs"; import {{ readFileSync }} from "node:fs";
    console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(countedInWords)));"""
    payloads = [described(design, asked), described(design, None)]
    ended = subprocess.run(
        [str(NODE), "--input-type=module", "-e", program],
        input=json.dumps(payloads),
        capture_output=True,
        text=True,
        check=True,
    )
    predicted, constant = json.loads(ended.stdout)
    assert "the noise predicted at this point" in predicted
    assert "px of noise in each view, the same everywhere, and a scale of the image known to 0.1 %" in constant


def test_another_law_of_the_lens_has_no_image_point() -> None:
    design = prototype()
    payload: Any = payload_of_design(design)["designs"][design.configuration]
    for key, value in (("projection", "equidistant"), ("distortion", [0.01])):
        other = payload | {"camera": payload["camera"] | {key: value}}
        at = run_node([other], [[(0.1, 2000.0)]])[0][0]
        assert at["depthError"] is None
        for view in at["views"].values():
            assert view["pointPx"] is None
            assert view["radiusPx"] is None
            assert view["blurPx"] is None
            assert len(view["ray"]["points"]) >= 2
    perspective = payload | {"camera": payload["camera"] | {"projection": "perspective", "distortion": []}}
    assert run_node([perspective], [[(0.1, 2000.0)]])[0][0]["depthError"] > 0.0


def predicted_cases() -> list[tuple[Design, Requirement]]:
    """Sharp designs, each with the shipped requirement that it was made for, which predicts the noise."""
    cases = []
    for name in SHARP_NAMES:
        asked = read_requirement(CONFIGS / f"{name.partition(':')[0]}.toml")
        assert asked.noise_px == PREDICTED
        cases.append((sharp_design(name), asked))
    return cases


def test_interpolated_noise_is_within_one_percent_of_the_predicted() -> None:
    cases = predicted_cases()
    payloads: list[Any] = [described(*case) for case in cases]
    assert all("noise_table" in payload for payload in payloads)
    shares = np.linspace(0.0, 1.0, 23)
    points = []
    for design, _ in cases:
        (low, high), (near, far) = np.radians(design.working_volume.elevation_deg), design.working_volume.distance_mm
        points.append([(low + (high - low) * a, near * (far / near) ** b) for a in shares for b in shares])
    for (design, asked), at, found in zip(cases, points, run_node(payloads, points), strict=True):
        noise = predicted_noise_px(design, asked, *np.array(at).T)
        for name in VIEW_NAMES:
            interpolated = np.array([each["views"][name]["noisePx"] for each in found])
            np.testing.assert_allclose(interpolated, noise[name], rtol=0.01, err_msg=f"{design.configuration} {name}")


def test_the_table_of_noise_gives_the_score_of_the_study() -> None:
    """What the page shows, in root mean square over the working volume, is the score that Python integrates."""
    cases = predicted_cases()[:4]
    shares = (np.arange(24) + 0.5) / 24
    points = []
    for design, _ in cases:
        (low, high), (near, far) = np.radians(design.working_volume.elevation_deg), design.working_volume.distance_mm
        points.append([(low + (high - low) * a, near * (far / near) ** b) for a in shares for b in shares])
    for (design, asked), found in zip(cases, run_node([described(*case) for case in cases], points), strict=True):
        score = depth_error_rms(
            stereo_pair_of(design), volume_of(design), predicted_noise(design, asked), design.scale_uncertainty
        )
        shown_rms = np.sqrt(np.mean([at["depthError"] ** 2 for at in found]))
        assert shown_rms == pytest.approx(float(score), rel=0.01)
