"""``designer check``: a design rendered, matched and reconstructed, and its depths compared with the truth."""

from __future__ import annotations

from pathlib import Path

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

FAILED = 1


@click.command()
@design_argument
@scene_option
@texture_option
@lens_option("Check through the design's own lens too: f-number, focus, lost light, diffraction.")
@click.option(
    "--samples", type=click.IntRange(1, 16), help="Rays along each side of a pixel.  [default: 2; 3 through the lens]"
)
@click.option("--matcher", type=click.Choice(["sad", "semi-global"]), default="sad", show_default=True)
@click.option("--equalise/--no-equalise", default=True, help="Equalise the two views' resolution.  [default: on]")
@detector_options(read_noise_electrons=8.0)
@seed_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(
    design: Path,
    scene: str,
    texture: str,
    through_lens: bool,
    samples: int | None,
    matcher: str,
    equalise: bool,
    noise_electrons: float,
    full_well_electrons: float,
    seed: int,
    as_json: bool,
) -> None:
    """Check DESIGN.json end to end against ground truth; exit code 1 if it fails.

    Images are rendered through a pinhole, which proves the geometry: depth is as precise as predicted wherever the
    image is sharp. With --lens the same is done through the lens, focused and stopped down as the design says.
    """
    from designer.design import read_design

    check_electrons(noise_electrons, full_well_electrons)
    record = read_design(design)

    from dataclasses import replace

    from designer.imaging.endtoend.check import CheckOptions, check_design
    from designer.imaging.endtoend.check import through_lens as with_lens
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
    pinhole = check_design(record, options)
    lens = check_design(record, with_lens(options)) if through_lens else None
    if as_json:
        import json

        summary = summarise_check(pinhole) if lens is None else summarise_comparison(pinhole, lens)
        click.echo(json.dumps(summary, indent=2, allow_nan=False))
    else:
        click.echo(describe_check(pinhole) if lens is None else describe_comparison(pinhole, lens))
    if not pinhole.passed or (lens is not None and not lens.passed):
        raise SystemExit(FAILED)
