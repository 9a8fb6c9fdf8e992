"""``designer render``: the raw image that the camera of a design records of a scene."""

from __future__ import annotations

from pathlib import Path

import click

from designer.files import InputError

MOST_SAMPLES = 16


@click.command()
@click.argument("design", type=click.Path(path_type=Path), metavar="DESIGN.json")
@click.option(
    "--scene",
    default="auto",
    show_default=True,
    help="office, pipe, hall, sky or cylinder, auto (by the working volume), or a mesh file (mm, z up).",
)
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="PNG file to write.")
@click.option(
    "--samples", type=int, help="Rays along each side of a pixel, squared in all.  [default: 2; 4 with --aperture]"
)
@click.option("--aperture", is_flag=True, help="Rays all over the lens's pupil: shows defocus.")
@click.option("--noise-electrons", type=float, help="Read noise; shot noise comes with it.  [default: no noise]")
@click.option(
    "--full-well-electrons", type=float, default=10_000.0, show_default=True, help="Electrons that white fills."
)
@click.option("--bits", type=click.Choice(["8", "16"]), default="8", show_default=True, help="Bits of a pixel.")
@click.option("--texture", default="rich", show_default=True, help="rich, poor or repetitive.")
@click.option("--sensor-height-mm", type=float, help="Height over the floor.  [default: the scene's own]")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of textures and noise.")
@click.option("--truth", type=click.Path(path_type=Path), help="Also write what each pixel sees, as .npz.")
def render(
    design: Path,
    scene: str,
    out: Path,
    samples: int | None,
    aperture: bool,
    noise_electrons: float | None,
    full_well_electrons: float,
    bits: str,
    texture: str,
    sensor_height_mm: float | None,
    seed: int,
    truth: Path | None,
) -> None:
    """Render the raw image that the camera of DESIGN.json records of a scene, by ray tracing."""
    from designer.design import read_design

    samples = (4 if aperture else 2) if samples is None else samples
    if not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"--samples {samples}: must be from 1 to {MOST_SAMPLES}")
    if noise_electrons is not None and not 0.0 <= noise_electrons < float("inf"):
        raise InputError(f"--noise-electrons {noise_electrons:g}: must be at least 0")
    if not 1.0 <= full_well_electrons < float("inf"):
        raise InputError(f"--full-well-electrons {full_well_electrons:g}: must be at least 1")
    if out.suffix.lower() != ".png":
        raise InputError(f"{out}: must end in .png")
    if truth is not None and truth.suffix.lower() != ".npz":
        raise InputError(f"{truth}: must end in .npz")
    record = read_design(design)

    from designer.imaging.files import write_image, write_truth
    from designer.imaging.render.detector import Detector, expose
    from designer.imaging.render.raytracing import ground_truth
    from designer.imaging.render.raytracing import render as render_image
    from designer.imaging.render.scenes.library import build_world

    world = build_world(scene, record, texture, seed, sensor_height_mm)
    image = render_image(record, world, samples=samples, aperture=aperture, seed=seed)
    detector = None if noise_electrons is None else Detector(full_well_electrons, noise_electrons)
    write_image(out, expose(image, detector, bits=16 if bits == "16" else 8, seed=seed))
    click.echo(f"{out}: {record.camera.width_px} x {record.camera.height_px} pixels, scene {world.name}")
    if truth is not None:
        write_truth(truth, ground_truth(record, world))
        click.echo(f"{truth}: view, point, distance and surface of each pixel")
