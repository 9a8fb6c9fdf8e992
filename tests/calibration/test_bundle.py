"""Bundle adjustment of exact and noisy points: derivatives, truth within what is stated, outliers, what is open."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from designer.as_built.parameters import CAMERA, parameters_of
from designer.as_built.tolerances import tolerance_values, tolerances_of_grade
from designer.as_built.yields import draw_departures
from designer.calibration.bundle import Adjusted, BundleProblem, Sighting, adjust
from designer.calibration.findings import (
    depth_slopes,
    depth_uncertainty,
    residuals_by_region,
    residuals_by_view,
    still_open,
    undetermined,
)
from designer.calibration.images import pixels_of, point_images
from designer.calibration.target_pose import TargetPose, point_slopes, varied
from designer.calibration.unknowns import Unknowns, unknowns_of
from designer.design import VIEW_NAMES, Design
from designer.files import InputError
from support.calibration_targets import board_points, in_camera_frame, poses_around, sightings_of
from support.studied_designs import sharp_design

FOLDED, DIRECT = "indoor_robot:folded-HyHy-Hy-upper_outer", "ceiling_watch:direct-HyHy-upper_outer"
NOISE_PX = 0.1


def trial(design: Design, seed: int, poses: int = 12) -> tuple[np.ndarray, list[TargetPose], list[Sighting]]:
    """A sensor of coarse parts in the frame of its own camera, and noisy sightings of targets around it."""
    random = np.random.default_rng(seed)
    grade = tolerances_of_grade("coarse")
    departures = draw_departures(tolerance_values(design, parameters_of(design), grade), 1, seed)[0]
    values = np.append(departures, 10.0 * random.standard_normal(2))
    near = 0.5 * design.working_volume.distance_mm[0]
    around = poses_around(design, poses, near, seed)
    sightings = sightings_of(design, values, around, board_points(6, 5, 0.08 * near), NOISE_PX, seed)
    values, turn, place = in_camera_frame(design, values)
    return values, [TargetPose(turn @ pose.turn, turn @ pose.place_mm + place) for pose in around], sightings


def rough(poses: list[TargetPose], seed: int) -> list[TargetPose]:
    random = np.random.default_rng(seed)
    return [
        varied(pose, np.concatenate([0.02 * random.standard_normal(3), 5.0 * random.standard_normal(3)]))
        for pose in poses
    ]


def off(unknowns: Unknowns, found: Adjusted, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the free departures, and their covariance."""
    free = np.flatnonzero(unknowns.free)
    return (found.values - values)[free], found.covariance[np.ix_(free, free)]


@pytest.mark.parametrize("name", [FOLDED, DIRECT])
def test_derivatives_are_those_of_central_differences(name: str):
    design = sharp_design(name)
    values, poses, sightings = trial(design, 4, poses=3)
    # The camera's own pose is free too, so that every departure is tried.
    unknowns = unknowns_of(design, tolerances_of_grade("coarse"), [m.name for m in design.mirrors] + [CAMERA])
    assert unknowns.free.all()
    problem = BundleProblem(design, unknowns, tuple(sightings), tuple(poses))
    problem.noise_px = dict.fromkeys(VIEW_NAMES, 1.0)
    random = np.random.default_rng(0)
    poses_off = 0.05 * random.standard_normal(18) * np.tile([1, 1, 1, 9, 9, 9], 3)
    at = np.concatenate([values, poses_off, 0.02 * random.standard_normal(2 * len(sightings))])
    exact = problem.jacobian(at)
    steps = np.concatenate(
        [
            0.02 * unknowns.prior_sigma,
            np.tile([1e-4, 1e-4, 1e-4, 0.05, 0.05, 0.05], 3),
            np.full(2 * len(sightings), 0.01),
        ]
    )
    for place, step in enumerate(steps):
        far_below, below, above, far_above = (
            problem.residuals(at + share * step * np.eye(len(at))[place]) for share in (-2.0, -1.0, 1.0, 2.0)
        )
        different = (far_below - 8.0 * below + 8.0 * above - far_above) / (12.0 * step)
        size = np.abs(exact[:, place]).max()
        assert np.abs(different - exact[:, place]).max() < 1e-5 * size + 1e-9 / step, place


@pytest.mark.slow
def test_the_true_sensor_lies_within_what_is_stated_in_nine_of_ten_runs():
    """All departures at once in the 95 % ellipsoid, and each in its own 95 % interval, over 100 seeds."""
    design = sharp_design(FOLDED)
    unknowns = unknowns_of(design, tolerances_of_grade("coarse"))
    distances, normalised, depths = [], [], []
    slopes, weights = depth_slopes(design)
    for seed in range(100):
        values, poses, sightings = trial(design, seed, poses=8)
        found = adjust(design, unknowns, sightings, rough(poses, seed))
        error, covariance = off(unknowns, found, values)
        bias = np.sqrt(((found.values - values) @ slopes) ** 2 @ weights)
        depths.append(bias / depth_uncertainty(design, found))
        distances.append(error @ np.linalg.solve(covariance, error))
        normalised.append(error / np.sqrt(np.diag(covariance)))
    assert np.sum(np.array(distances) < chi2.ppf(0.95, unknowns.free.sum())) >= 90
    each = np.sum(np.abs(normalised) < 1.96, axis=0)
    assert (each >= 90).all(), dict(zip(np.flatnonzero(unknowns.free), each, strict=True))
    # Stated deviations are not just large: the normalised errors scatter by what a Gaussian does.
    assert 0.85 < np.sqrt(np.mean(np.square(normalised))) < 1.1
    # So it is with the distances that follow.
    assert 0.7 < np.sqrt(np.mean(np.square(depths))) < 1.15


def test_the_centre_of_each_view_is_known_to_a_twentieth_of_a_pixel():
    """The frame may turn and shift, which no image of loose targets tells; it is brought to the true one first."""
    design = sharp_design(FOLDED)
    unknowns = unknowns_of(design, tolerances_of_grade("coarse"))
    values, poses, sightings = trial(design, 7)
    found = adjust(design, unknowns, sightings, rough(poses, 7))
    assert all(abs(rms - NOISE_PX) < 0.01 for rms in residuals_by_view(sightings, found).values())
    assert all(abs(noise - NOISE_PX) < 0.015 for noise in found.noise_px.values())
    regions = residuals_by_region(design, sightings, found)
    assert sum(region.points for region in regions) == sum(len(sighting.pixels) for sighting in sightings)
    azimuth, distance = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False), design.working_volume.distance_mm, indexing="ij"
    )
    points = np.column_stack(
        [(distance * np.cos(azimuth)).ravel(), (distance * np.sin(azimuth)).ravel(), 0.0 * distance.ravel()]
    )
    missed, by_frame = [], []
    for view in VIEW_NAMES:
        images = point_images(design, view, points, found.values)
        missed.append(images.pixels - pixels_of(design, view, points, values))
        by_frame.append(images.by_point @ point_slopes(TargetPose(np.eye(3), np.zeros(3)), np.zeros(6), points))
    moved = np.linalg.lstsq(np.concatenate(by_frame).reshape(-1, 6), np.concatenate(missed).ravel(), rcond=None)[0]
    for off_px, slopes in zip(missed, by_frame, strict=True):
        left = off_px - slopes @ moved
        assert np.hypot(*left.mean(axis=0)) < 0.05


def test_tilt_and_decentre_of_a_mirror_are_found_where_the_images_tell_them():
    """With the image's place on the chip known, the mirror of the direct view is told to 0.01 degrees and 0.02 mm."""
    design = sharp_design(FOLDED)
    free = [f"{p.part}.{p.key}" for p in parameters_of(design) if p.part != CAMERA]
    free += ["principal_distance_departure_mm", "radial_distortion"]
    unknowns = unknowns_of(design, tolerances_of_grade("coarse"), free)
    values, poses, _ = trial(design, 3)
    values[-2:] = 0.0
    points = board_points(6, 5, 0.08 * 0.5 * design.working_volume.distance_mm[0])
    found = adjust(design, unknowns, sightings_of(design, values, poses, points, 0.05, 3), rough(poses, 3))
    sigma = np.sqrt(np.diagonal(found.covariance))
    told = 0
    for place, parameter in enumerate(unknowns.parameters):
        largest = {"decentre": 0.02, "tilt": 0.01}.get(parameter.key.split("_")[0])
        if unknowns.free[place] and largest is not None and 2.0 * sigma[place] < largest:
            told += 1
            assert abs(found.values[place] - values[place]) < largest, parameter.name
    assert told >= 4


def test_a_few_wrong_points_do_no_harm():
    design = sharp_design(DIRECT)
    unknowns = unknowns_of(design, tolerances_of_grade("coarse"))
    values, poses, sightings = trial(design, 5)
    for sighting in sightings[::3]:
        sighting.pixels[4] += (9.0, -14.0)
    error, covariance = off(unknowns, adjust(design, unknowns, sightings, rough(poses, 5)), values)
    assert error @ np.linalg.solve(covariance, error) < chi2.ppf(0.999, len(error))


def test_what_no_image_tells_is_named():
    """A sensor moved as a whole shows the same: three shifts and two tilts, if the camera is free to move."""
    design = sharp_design(DIRECT)
    _, poses, sightings = trial(design, 2)
    everything = unknowns_of(design, tolerances_of_grade("coarse"), ["lower", "upper", CAMERA])
    found = adjust(design, everything, sightings, rough(poses, 2))
    # Rounding leaves up to 1e-9 of nothing; the next combination has 1e-8.
    assert sum(each.information < 5e-9 for each in undetermined(everything, found)) == 5
    for keys in (("decentre_x_mm", "shift_x_mm"), ("decentre_y_mm", "shift_y_mm"), ("axial_shift_mm",)):
        moved = np.array([parameter.key in keys for parameter in everything.parameters], dtype=float)
        one = np.array([parameter.key in keys and parameter.part == "lower" for parameter in everything.parameters])
        together, alone = (way @ found.information @ way for way in (moved, one.astype(float)))
        assert abs(together) < 1e-9 * alone
    sigma = np.sqrt(np.diagonal(found.covariance))
    assert "camera axial shift" in still_open(everything, sigma)
    held = unknowns_of(design, tolerances_of_grade("coarse"))
    told = adjust(design, held, sightings, rough(poses, 2))
    assert not any(each.information < 1e-10 for each in undetermined(held, told))
    # The frame does not change what the sensor is: both explain the images equally well.
    assert np.allclose(*(list(residuals_by_view(sightings, each).values()) for each in (found, told)), rtol=1e-3)


def test_what_is_free_must_exist_and_have_a_tolerance():
    design = sharp_design(DIRECT)
    grade = tolerances_of_grade("coarse")
    with pytest.raises(InputError, match=r"--free third: must be a part \(lower, upper, camera\)"):
        unknowns_of(design, grade, ["third"])
    none = grade.model_copy(update={"camera": grade.camera.model_copy(update={"radial_distortion": 0.0})})
    with pytest.raises(InputError, match="nothing to calibrate"):
        unknowns_of(design, none, ["radial_distortion"])
