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
from designer.as_built.parameters import parameters_of
from designer.as_built.tolerances import tolerances_of_grade
from designer.calibration.calibrate import Calibration, calibrate
from designer.calibration.findings import residuals_by_view
from designer.calibration.images import pixels_of
from designer.calibration.target import MODULES, make_target, modules_of
from designer.calibration.target_pose import TargetPose, facing_pose
from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import Design
from designer.imaging.endtoend.bands import judge_bands
from designer.imaging.endtoend.check import predicted_error, seen_by_both
from designer.imaging.endtoend.noise import Noise, calibrate_noise, record, true_points
from designer.imaging.images import Image
from designer.imaging.render.detector import Detector
from designer.imaging.render.lens import Lens
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
        + ", ".join(
            f"{view} {rms:.3f} px" for view, rms in residuals_by_view(found.sightings, found.adjusted).items()
        ),
        *corners_against_truth(design, found, poses),
        "",
    ]
    (scene_raw,) = taken(built, (office,), samples, (TARGETS,))
    walls = calibration_world(design, seed=1)
    walls_raw, ideal_raw = taken(design, (walls, office), samples, (TARGETS + 1, TARGETS + 2))
    options = {"equalise": True, "mirror_reflectivity": Lens().mirror_reflectivity}
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
    return record(design, worlds, Detector(), samples, seeds, Lens())


def rig_of(design: Design) -> StereoRig:
    """The rig of a built sensor."""
    near, far = design.working_volume.distance_mm
    return build_rig(
        design,
        distances_mm=(0.8 * near, 2.5 * far),
        equalise=True,
        mirror_reflectivity=Lens().mirror_reflectivity,
        as_built=True,
    )


def corners_against_truth(design: Design, found: Calibration, poses: list[TargetPose]) -> list[str]:
    """How far the corners found lie from the chief rays of the true sensor."""
    at = {(p.part, p.key): place for place, p in enumerate(parameters_of(design))}
    values = np.zeros(len(at) + 2)
    for name, mirror in ERRORS.mirrors.items():
        for key, value in mirror:
            if value:
                values[at[name, key]] = value
    for key, value in ERRORS.camera:
        if ("camera", key) in at:
            values[at["camera", key]] = value
    values[-2:] = ERRORS.camera.image_shift_x_px, ERRORS.camera.image_shift_y_px
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
