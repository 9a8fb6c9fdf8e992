"""``designer render``: the raw image that the camera of a design records of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.cli.imaging_options import (
    check_electrons,
    design_argument,
    detector_of,
    detector_options,
    lens_option,
    scene_option,
    seed_option,
    texture_option,
)
from designer.extras import needs
from designer.files import InputError

if TYPE_CHECKING:
    from designer.design import Design
    from designer.imaging.render.scenes.world import World

MOST_SAMPLES = 16
FARTHEST_MM = 1e6
Pose = tuple[float, float, float, float, float, float]


@click.command()
@design_argument
@scene_option
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="PNG file to write.")
@click.option(
    "--samples", type=int, help="Rays along each side of a pixel (squared per pixel).  [default: 2; 3 with --lens]"
)
@lens_option("Render through the design's lens instead of a pinhole: f-number, focus, lost light, diffraction.")
@detector_options(read_noise_electrons=None)
@click.option("--bits", type=click.Choice(["8", "16"]), default="8", show_default=True, help="Bit depth.")
@texture_option
@click.option(
    "--sensor-height-mm", type=float, help="Height of the sensor above the floor.  [default: set by the scene]"
)
@seed_option
@click.option("--truth", type=click.Path(path_type=Path), help="Also write the ground truth of each pixel (.npz).")
@click.option(
    "--target",
    type=click.Path(path_type=Path),
    metavar="FILE.toml",
    help="Add a target written by designer target to the scene, which then has its natural textures.",
)
@click.option(
    "--target-pose",
    type=(float, float, float, float, float, float),
    metavar="AZIMUTH DISTANCE HEIGHT X Y Z",
    help="Position of the target's centre (azimuth in degrees, mm from the axis, mm above the middle of the baseline) "
    "and its rotation in degrees from facing the axis, about its right, down and forward axes.",
)
@needs("imaging")
def render(
    design: Path,
    scene: str,
    out: Path,
    samples: int | None,
    through_lens: bool,
    noise_electrons: float | None,
    full_well_electrons: float,
    bits: str,
    texture: str,
    sensor_height_mm: float | None,
    seed: int,
    truth: Path | None,
    target: Path | None,
    target_pose: Pose | None,
) -> None:
    """Render the raw image that the camera of DESIGN.json records of a scene, by ray tracing."""
    from designer.design import read_design

    if samples is not None and not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"--samples {samples}: must be from 1 to {MOST_SAMPLES}")
    check_electrons(noise_electrons, full_well_electrons)
    if out.suffix.lower() != ".png":
        raise InputError(f"{out}: must end in .png")
    if truth is not None and truth.suffix.lower() != ".npz":
        raise InputError(f"{truth}: must end in .npz")
    record = read_design(design)

    from designer.imaging.images import write_image
    from designer.imaging.render.detector import expose
    from designer.imaging.render.ground_truth_file import write_truth
    from designer.imaging.render.lens import RenderedLens, default_samples, describe_lens
    from designer.imaging.render.raytracing import ground_truth
    from designer.imaging.render.raytracing import render as render_image
    from designer.imaging.render.scenes.library import build_world

    world = build_world(scene, record, texture if target is None else "natural", seed, sensor_height_mm)
    if target is not None:
        world = _with_target(world, record, target, target_pose)
    elif target_pose is not None:
        raise InputError("--target-pose: needs --target, the file of the target")
    lens = RenderedLens() if through_lens else None
    samples = default_samples(lens) if samples is None else samples
    image = render_image(record, world, samples=samples, aperture=through_lens, seed=seed, lens=lens)
    detector = None if noise_electrons is None else detector_of(noise_electrons, full_well_electrons)
    write_image(out, expose(image, detector, bits=16 if bits == "16" else 8, seed=seed))
    glass = f", through {describe_lens(record.camera)}" if through_lens else ""
    click.echo(f"{out}: {record.camera.width_px} x {record.camera.height_px} pixels, scene {world.name}{glass}")
    if truth is not None:
        write_truth(truth, ground_truth(record, world))
        click.echo(f"{truth}: view, point, distance and surface of each pixel")


def _with_target(world: World, design: Design, path: Path, pose: Pose | None) -> World:
    """The scene with a target at its place; by default nearer than all that is to be measured, at azimuth 0."""
    from designer.calibration.target import MODULES, modules_of, read_target
    from designer.calibration.target_pose import facing_pose
    from designer.imaging.render.scenes.printed_board import with_board

    target = read_target(path)
    azimuth, distance, height, *turn = pose or (0.0, 0.6 * design.working_volume.distance_mm[0], 0.0, 0.0, 0.0, 0.0)
    if not all(abs(number) <= FARTHEST_MM for number in (azimuth, distance, height, *turn)) or distance <= 0.0:
        raise InputError(f"--target-pose: numbers must be within {FARTHEST_MM:g}, and the distance positive")
    if world.finishes is None:
        raise InputError("--target: needs a scene that has materials: office, pipe, hall or sky")
    x, y, z = turn
    placed = facing_pose(target.size_mm, azimuth, distance, design.views.middle_mm + height, (x, y, z))
    return with_board(world, modules_of(target), target.square_mm / MODULES, placed.turn, placed.place_mm)
