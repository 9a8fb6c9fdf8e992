"""``designer check``: a design rendered, matched and reconstructed, and its depths compared with the truth."""

from __future__ import annotations

from pathlib import Path

import click

from designer.cli.imaging_options import (
    check_electrons,
    design_argument,
    detector_of,
    detector_options,
    scene_option,
    seed_option,
    texture_option,
)
from designer.extras import needs

FAILED = 1


@click.command()
@design_argument
@scene_option
@texture_option
@click.option("--pinhole", is_flag=True, help="Check through a pinhole too, to test the geometry without any blur.")
@click.option(
    "--samples", type=click.IntRange(1, 16), help="Rays along each side of a pixel.  [default: 3; 2 through a pinhole]"
)
@click.option("--matcher", type=click.Choice(["sad", "semi-global"]), default="sad", show_default=True)
@click.option("--equalise/--no-equalise", default=True, help="Equalise the two views' resolution.  [default: on]")
@detector_options(read_noise_electrons=8.0)
@seed_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@needs("imaging")
def check(
    design: Path,
    scene: str,
    texture: str,
    pinhole: bool,
    samples: int | None,
    matcher: str,
    equalise: bool,
    noise_electrons: float,
    full_well_electrons: float,
    seed: int,
    as_json: bool,
) -> None:
    """Check DESIGN.json end to end against ground truth; exit code 1 if it fails.

    A scene is rendered through the design's lens, focused and stopped down as in the design: blur, diffraction, and
    light lost at mirrors and towards the rim. The image is matched and reconstructed, and its depths are compared with
    the true ones. With --pinhole the same is done through a pinhole, and the numbers of points are compared.
    """
    from designer.design import read_design

    check_electrons(noise_electrons, full_well_electrons)
    record = read_design(design)

    from dataclasses import replace

    from designer.imaging.endtoend.check import CheckOptions, check_design, check_with_control
    from designer.imaging.endtoend.description import (
        describe_check,
        describe_comparison,
        summarise_check,
        summarise_comparison,
    )
    from designer.imaging.stereo.matching import ACCURATE_OPTIONS

    options = CheckOptions(
        scene=scene,
        texture=texture,
        samples=samples,
        detector=detector_of(noise_electrons, full_well_electrons),
        matching=replace(ACCURATE_OPTIONS, matcher="semi_global" if matcher == "semi-global" else "sad"),
        equalise=equalise,
        seed=seed,
    )
    both = check_with_control(record, options) if pinhole else None
    found = both.lens if both else check_design(record, options)
    if as_json:
        import json

        summary = summarise_comparison(both) if both else summarise_check(found)
        click.echo(json.dumps(summary, indent=2, allow_nan=False))
    else:
        click.echo(describe_comparison(both) if both else describe_check(found))
    if not found.passed or (both and not both.pinhole.passed):
        raise SystemExit(FAILED)
