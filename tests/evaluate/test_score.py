"""The summary of a design is plain JSON, agrees with its parts, and refuses what is no stereo pair."""

from __future__ import annotations

import json

import numpy as np
import pytest

from designer.design import Design
from designer.evaluate.depth import (
    StereoPair,
    depth_error_map,
    depth_error_rms,
    noise_mm_of,
    slopes_of_point,
    stereo_pair_of,
    volume_of,
)
from designer.evaluate.limit import ImageBounds, arrangement_of, limit_gains
from designer.evaluate.score import depth_score, evaluate_design, recorded_fabrication_notes
from designer.files import InputError
from designer.optics.view import elevation_tangent, elevation_tangents_of_views, image_half_tangent, image_radius
from designer.trace.bundles import pinhole_directions
from designer.trace.first_hit import trace_first_hits
from designer.trace.instrument import build_instrument


@pytest.mark.parametrize("name", ["published", "crossing"])
def test_summary_is_plain_json_with_what_was_asked(name: str, request):
    design: Design = request.getfixturevalue(name)
    summary = evaluate_design(design).as_json()
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert summary["limit_ratio"] == pytest.approx(summary["depth_error_rms"] / summary["depth_error_limit"])
    assert summary["limit_ratio"] >= 1
    assert summary["first_order_valid"] is True
    assert summary["depth_error_worst"] > summary["depth_error_rms"]
    rounding = summary["quantisation"]
    assert rounding["brute_force_rms"] == pytest.approx(rounding["first_order_rms"], rel=0.01)
    assert [mirror["name"] for mirror in summary["mirrors"]] == ["direct", "primary", "secondary"]


@pytest.mark.parametrize("name", ["published", "crossing"])
def test_a_point_counts_noise_and_scale_as_the_score_does(name: str, request):
    design: Design = request.getfixturevalue(name).model_copy(update={"scale_uncertainty": 0.002})
    pair, (low, high) = stereo_pair_of(design), volume_of(design).elevations
    middle = np.array((low + high) / 2.0)
    for point in evaluate_design(design).points:
        distance = np.array(point.distance_mm)
        relative = [float(depth_error_map(pair, middle, distance, noise_mm_of(design), u)) for u in (0.002, 0.0)]
        assert point.sigma_distance_mm == pytest.approx(relative[0] * point.distance_mm, rel=1e-12)
        assert point.sigma_distance_mm_by_noise == pytest.approx(relative[1] * point.distance_mm, rel=1e-12)
        # Distance and height of the point that a camera of another scale reads, from image radii and back.
        epsilon, slope = 1e-6, float(np.tan(middle))
        read = []
        seen = slopes_of_point(slope, point.distance_mm, pair.baseline)
        for tangent, gain, sense in (
            (seen.lower, pair.gain_lower, pair.sense_lower),
            (seen.upper, pair.gain_upper, pair.sense_upper),
        ):
            radius = (1.0 + epsilon) * image_radius(tangent, gain, pair.principal_distance, sense)
            read.append(elevation_tangent(image_half_tangent(radius, pair.principal_distance) / gain, sense))
        far = pair.baseline / (read[0] - read[1])
        shifts = far - point.distance_mm, far * (read[0] + read[1]) / 2.0 - point.distance_mm * slope
        for shift, counted in zip(
            shifts, (point.sigma_distance_mm_by_scale, point.sigma_height_mm_by_scale), strict=True
        ):
            assert counted == pytest.approx(0.002 * abs(shift) / epsilon, rel=1e-3)
        assert point.sigma_height_mm == pytest.approx(
            np.hypot(point.sigma_height_mm_by_noise, point.sigma_height_mm_by_scale), rel=1e-12
        )


@pytest.mark.parametrize("gap_px", [0.0, 40.0])
def test_the_limit_keeps_the_gap_that_the_record_asks_for(published: Design, gap_px: float):
    """At the limiting gains the inner zone ends that many pixels before the outer one begins."""
    design = changed(published, ("zone_gap_px",), gap_px)
    camera, slopes = design.camera, np.tan(np.radians([-8.0, 8.0]))
    ranges = elevation_tangents_of_views(slopes, (500.0, 2000.0), design.baseline_mm)
    bounds = ImageBounds(camera.image_radius_mm, gap_px * camera.pixel_pitch_mm)
    arrangement, volume = arrangement_of("folded", "upper_outer"), volume_of(design)
    gains = limit_gains(arrangement, volume, design.baseline_mm, camera.focal_length_mm, bounds)
    outer_begins = min(image_radius(slope, gains.upper, camera.focal_length_mm, "direct") for slope in ranges.upper)
    inner_ends = max(image_radius(slope, gains.lower, camera.focal_length_mm, "folded") for slope in ranges.lower)
    assert (outer_begins - inner_ends) / camera.pixel_pitch_mm == pytest.approx(gap_px, abs=1e-9)
    pair = StereoPair(gains.lower, "folded", gains.upper, "direct", design.baseline_mm, camera.focal_length_mm)
    error = depth_error_rms(pair, volume, design.noise_px * camera.pixel_pitch_mm)
    assert evaluate_design(design).depth.depth_error_limit == pytest.approx(error, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "view_name", "edges"),
    [
        ("published", "upper", (0, 1)),
        ("published", "lower", (1,)),  # a mirror without a hole
        ("crossing", "upper", (1,)),  # the secondary hides the inner edge
    ],
)
def test_rims_are_where_rays_begin_and_cease_to_meet_the_mirror(name: str, view_name: str, edges, request):
    """Pinhole rays a thousandth of a pixel on either side of each rim, followed by the tracer."""
    design: Design = request.getfixturevalue(name)
    scene, camera = build_instrument(design), design.camera
    index = scene.path(getattr(design.views, view_name).path)[0]
    rims = evaluate_design(design).rims_px[view_name]
    for edge in edges:
        towards_face = (1e-3, -1e-3)[edge]
        radii_px = np.array([rims[edge] + towards_face, rims[edge] - towards_face])
        psi = np.arctan(radii_px * camera.pixel_pitch_mm / camera.focal_length_mm)
        meets = trace_first_hits(scene, pinhole_directions(psi)).sequence[:, 0] == index
        assert meets.tolist() == [True, False]


def test_rims_lie_beyond_the_zones_asked_for(published: Design):
    score = evaluate_design(published)
    for view_name in ("upper", "lower"):
        (rim_inner, rim_outer), (low, high) = score.rims_px[view_name], score.zones_px[view_name]
        assert rim_inner < low < high < rim_outer


def test_an_edge_below_the_pinhole_has_no_image(published: Design):
    below = published.model_dump(mode="json", by_alias=True)
    below["mirrors"][2]["vertex_mm"] = -5.0
    assert evaluate_design(Design.model_validate(below)).rims_px["lower"] == (None, None)


@pytest.mark.parametrize(
    ("farthest", "first", "second"), [(2000.0, True, True), (8_000.0, False, True), (60_000.0, False, False)]
)
def test_each_order_is_valid_up_to_its_bound(published: Design, farthest: float, first: bool, second: bool):
    depth = evaluate_design(changed(published, ("working_volume", "distance_mm"), [500.0, farthest])).depth
    assert (depth.first_order_valid, depth.second_order_valid) == (first, second)
    worst, corrected = depth.depth_error_worst, depth.depth_error_worst_second_order
    assert corrected == pytest.approx(worst * (1 + 9 * worst**2) ** 0.5)
    assert (corrected < 1.02 * worst) == first
    assert depth.depth_error_rms < depth.depth_error_rms_second_order < corrected


def test_the_depth_errors_alone_are_those_of_the_whole_score(published: Design):
    assert depth_score(published) == evaluate_design(published).depth


@pytest.mark.parametrize("key", ["fabrication_notes", "remarks"])
def test_fabrication_notes_are_found_in_files_of_every_version(key: str, published: Design):
    recorded = published.model_copy(update={"score": {key: ["thin"]}})
    assert recorded_fabrication_notes(recorded) == ("thin",)
    assert recorded_fabrication_notes(published.model_copy(update={"score": {}})) == ()


def test_far_away_rounding_reaches_infinity(published: Design):
    far = changed(published, ("working_volume", "distance_mm"), [500.0, 60_000.0])
    assert evaluate_design(far).quantisation.brute_force_rms is None


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("baseline_mm",), -10.0, "baseline_mm = -10"),
        (("working_volume", "elevation_deg"), [8.0, -8.0], "working_volume.elevation_deg"),
        (("working_volume", "distance_mm"), [0.0, 2000.0], "working_volume.distance_mm"),
        (("views", "upper", "gain"), 0.0, "views.upper.gain"),
        (("views", "lower", "gain"), 2.5, "views.lower.gain = 2.5"),
        (("views", "lower", "elevation_deg"), [10.0, 95.0], "views.lower.elevation_deg"),
    ],
)
def test_what_is_no_stereo_pair_is_refused(published: Design, keys, value, message: str):
    with pytest.raises(InputError, match=message):
        evaluate_design(changed(published, keys, value))


def changed(design: Design, keys: tuple[str, ...], value: object) -> Design:
    record = design.model_dump(mode="json", by_alias=True)
    part = record
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    return Design.model_validate(record)
