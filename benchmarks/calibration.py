"""A sensor with known errors rendered, calibrated and used: ``python -m benchmarks.calibration``.

Targets around the sensor and an office are rendered through its real lens with the detector's noise; the sensor is
calibrated from the targets, and distances in the office are compared with ground truth, by the design's own tables, by
the true departures, by those found, and for a sensor without errors. Written to ``results/calibration.txt``.
"""

from __future__ import annotations

import json
import platform
import time
from pathlib import Path

import click
import numpy as np

from benchmarks.problems import RESULTS, ROOT
from designer.as_built.dual import Array
from designer.as_built.parameters import parameters_of, values_of
from designer.as_built.tolerances import tolerances_of_grade
from designer.calibration.calibrate import CalibratedSensor, calibrate
from designer.calibration.findings import residuals_by_view
from designer.calibration.images import pixels_of, point_images
from designer.calibration.target import MODULES, make_target, modules_of
from designer.calibration.target_pose import TargetPose, facing_pose, point_slopes
from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import VIEW_NAMES, Design
from designer.imaging.endtoend.bands import judge_bands
from designer.imaging.endtoend.check import predicted_error, seen_by_both
from designer.imaging.endtoend.noise import Noise, calibrate_noise, record, true_points
from designer.imaging.images import Image
from designer.imaging.render.detector import Detector
from designer.imaging.render.lens import RenderedLens
from designer.imaging.render.scenes.library import build_world, calibration_world
from designer.imaging.render.scenes.printed_board import with_board
from designer.imaging.render.scenes.world import World
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, MatchOutcome
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image

DESIGNS = ROOT / "tests" / "data" / "sharp_designs.json"
NAME = ("indoor_robot", "folded-HyHy-Hy-upper_outer")
TARGETS = 8
ERRORS = AsBuilt(
    mirrors={
        "primary": MirrorDeparture(decentre_x_mm=0.1, tilt_y_deg=-0.1),
        "secondary": MirrorDeparture(tilt_x_deg=0.1, decentre_y_mm=0.1),
        "direct": MirrorDeparture(decentre_y_mm=-0.1, tilt_y_deg=0.1),
    },
    camera=CameraDeparture(shift_x_mm=0.05, shift_y_mm=-0.05, image_shift_x_px=3.0, image_shift_y_px=-2.0),
)


@click.command()
@click.option("--samples", default=2, show_default=True, help="Rays along each side of a pixel.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "calibration.txt", show_default=True)
def main(samples: int, results: Path) -> None:
    """Render, calibrate, measure, print, and write."""
    records = json.loads(DESIGNS.read_text(encoding="utf-8"))
    design = Design.model_validate(next(r for r in records if (r["requirement"], r["configuration"]) == NAME))
    built = design.model_copy(update={"as_built": ERRORS})
    office, target = build_world("office", design, "natural"), make_target(9, 6, 40.0)
    near, far = design.working_volume.distance_mm
    raws, poses = [], []
    for number in range(TARGETS):
        random = np.random.default_rng(number)
        poses.append(
            facing_pose(
                target.size_mm,
                360.0 * number / TARGETS,
                near * random.uniform(0.32, 0.45),
                design.views.middle_mm + near * random.uniform(-0.04, 0.04),
                tuple(random.uniform(-28.0, 28.0, 3).tolist()),
            )
        )
        pose = poses[-1]
        scene = with_board(office, modules_of(target), target.square_mm / MODULES, pose.turn, pose.place_mm)
        raws += taken(built, (scene,), samples, (number,))
        click.echo(f"target {number + 1} of {TARGETS} rendered")
    began = time.perf_counter()
    found = calibrate(design, raws, target, tolerances_of_grade("coarse"), progress=click.echo)
    lines = [
        f"{platform.machine()}, Python {platform.python_version()}; {NAME[0]}, {NAME[1]}; lens, detector noise, "
        f"{samples**2} rays for each pixel",
        f"calibrated from {len(found.images)} images in {time.perf_counter() - began:.0f} s: residual "
        + ", ".join(f"{view} {rms:.3f} px" for view, rms in residuals_by_view(found.sightings, found.adjusted).items()),
        *corners_against_truth(design, found, poses),
        *departures_against_truth(design, found),
        "",
    ]
    (scene_raw,) = taken(built, (office,), samples, (TARGETS,))
    walls = calibration_world(design, seed=1)
    walls_raw, ideal_raw = taken(design, (walls, office), samples, (TARGETS + 1, TARGETS + 2))
    options = {"equalise": True, "mirror_reflectivity": RenderedLens().mirror_reflectivity}
    ideal = build_rig(design, distances_mm=(0.8 * near, 2.5 * far), **options)
    noise = calibrate_noise(ideal, walls_raw, true_points(ideal, design, (walls,))[0])
    points = {}
    for name, rig, raw, truth in (
        ("sensor without errors", ideal, ideal_raw, design),
        ("design's own tables", ideal, scene_raw, built),
        ("true departures", rig_of(built), scene_raw, built),
        ("calibrated", rig_of(found.design), scene_raw, built),
    ):
        rows, points[name] = against_truth(rig, raw, truth, office, noise)
        lines += [f"{name}: {points[name]} points", *rows]
    for name in ("true departures", "sensor without errors"):
        lines.append(f"points kept, calibrated over {name}: {100.0 * points['calibrated'] / points[name]:.1f} %")
    click.echo("\n".join(lines))
    results.write_text("\n".join(lines) + "\n", encoding="utf-8")


def taken(design: Design, worlds: tuple[World, ...], samples: int, seeds: tuple[int, ...]) -> list[Image]:
    """What the camera records through the lens."""
    return record(design, worlds, Detector(), samples, seeds, RenderedLens())


def rig_of(design: Design) -> StereoRig:
    """The rig of a built sensor."""
    near, far = design.working_volume.distance_mm
    return build_rig(
        design,
        distances_mm=(0.8 * near, 2.5 * far),
        equalise=True,
        mirror_reflectivity=RenderedLens().mirror_reflectivity,
        as_built=True,
    )


def corners_against_truth(design: Design, found: CalibratedSensor, poses: list[TargetPose]) -> list[str]:
    """How far the corners found lie from the chief rays of the true sensor."""
    values = true_values(design)
    off = [
        s.pixels - pixels_of(design, s.view, poses[found.images[s.target]].points(s.points_mm), values)
        for s in found.sightings
    ]
    every = np.concatenate(off)
    means = np.array([part.mean(axis=0) for part in off])
    return [
        f"corners against the true sensor's chief rays: {np.sqrt(np.mean(every**2)):.3f} px rms; of the means of each "
        f"board and view {np.sqrt(np.mean(means**2)):.3f} px"
    ]


def true_values(design: Design) -> Array:
    """The departures (parameters,) of the sensor, image shift last."""
    return np.append(values_of(design, ERRORS), [ERRORS.camera.image_shift_x_px, ERRORS.camera.image_shift_y_px])


def departures_against_truth(design: Design, found: CalibratedSensor) -> list[str]:
    """How many departures lie within their intervals, and how far off the image of each view is on average.

    In the frame of the camera, which is shifted and not tilted. The frame may have turned and moved, which no image of
    loose targets tells: it is brought to the true one first, by least squares over the working volume.
    """
    true = true_values(design)
    shift = {"decentre_x_mm": ERRORS.camera.shift_x_mm, "decentre_y_mm": ERRORS.camera.shift_y_mm}
    for place, parameter in enumerate(parameters_of(design)):
        if parameter.part == "camera" and parameter.key.startswith("shift"):
            true[place] = 0.0
        true[place] -= shift.get(parameter.key, 0.0)
    free = found.unknowns.free
    off = np.abs(found.adjusted.values - true)[free]
    within = off < 1.96 * found.sigma[free]
    lines = [f"departures within their 95 % intervals: {within.sum()} of {free.sum()}"]
    told = []
    for place, parameter in enumerate(found.unknowns.parameters):
        largest = {"decentre": 0.02, "tilt": 0.01}.get(parameter.key.split("_")[0])
        if free[place] and largest is not None and 1.96 * found.sigma[place] < largest:
            told.append(
                f"{parameter.name} off by {abs(found.adjusted.values[place] - true[place]):.4f} {parameter.unit}"
            )
    lines.append(f"decentres told to 0.02 mm, tilts to 0.01 degrees: {', '.join(told) or 'none'}")
    azimuth = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    points = np.concatenate(
        [
            np.column_stack([d * np.cos(azimuth), d * np.sin(azimuth), np.full(24, design.views.middle_mm)])
            for d in design.working_volume.distance_mm
        ]
    )
    missed, by_frame = [], []
    for view in VIEW_NAMES:
        images = point_images(design, view, points, found.adjusted.values)
        missed.append(images.pixels - pixels_of(design, view, points, true))
        by_frame.append(images.by_point @ point_slopes(TargetPose(np.eye(3), np.zeros(3)), np.zeros(6), points))
    moved = np.linalg.lstsq(np.concatenate(by_frame).reshape(-1, 6), np.concatenate(missed).ravel(), rcond=None)[0]
    for view, off_px, slopes in zip(VIEW_NAMES, missed, by_frame, strict=True):
        left = off_px - slopes @ moved
        lines.append(f"centre of the {view} view off by {np.hypot(*left.mean(axis=0)):.3f} px")
    return lines


def against_truth(rig: StereoRig, raw: Image, built: Design, world: World, noise: Noise) -> tuple[list[str], int]:
    """A line for each band of distance, and the number of points."""
    matches = match_image(rig, raw, ACCURATE_OPTIONS)
    (points,) = true_points(rig, built, (world,))
    distance = np.hypot(points[0], points[1])
    both = seen_by_both(rig, world, points)
    predicted = predicted_error(rig, noise, raw, distance, ACCURATE_OPTIONS)
    bands = judge_bands(rig.design, matches, distance, both, predicted, matches.distances_mm / distance - 1.0)
    rows = [
        f"  {band.distance_mm[0]:6.0f} to {band.distance_mm[1]:6.0f} mm: kept {100.0 * band.kept:5.1f} %, bias "
        f"{100.0 * band.bias:+7.3f} %, predicted sigma {100.0 * band.predicted:6.3f} %, "
        f"bias over sigma {band.bias / band.predicted:+6.3f}"
        for band in bands
    ]
    return rows, int((both & (matches.outcomes == MatchOutcome.KEPT)).sum())


if __name__ == "__main__":
    main()
