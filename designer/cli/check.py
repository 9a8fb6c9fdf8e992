"""``designer check``: a design rendered, matched and reconstructed, and its depths compared with the truth."""

from __future__ import annotations

from pathlib import Path

import click

from designer.files import InputError

FAILED = 1


@click.command()
@click.argument("design", type=click.Path(path_type=Path), metavar="DESIGN.json")
@click.option(
    "--scene",
    default="auto",
    show_default=True,
    help="office, pipe, hall, sky or cylinder, auto (by the working volume), or a mesh file (mm, z up).",
)
@click.option("--texture", default="rich", show_default=True, help="rich, poor or repetitive.")
@click.option("--samples", type=click.IntRange(1, 16), default=2, show_default=True, help="Rays along a pixel's side.")
@click.option("--matcher", type=click.Choice(["sad", "semi-global"]), default="sad", show_default=True)
@click.option("--equalise/--no-equalise", default=True, help="Equalise the two views' resolution.  [default: on]")
@click.option("--noise-electrons", type=float, default=8.0, show_default=True, help="Read noise of the detector.")
@click.option(
    "--full-well-electrons", type=float, default=10_000.0, show_default=True, help="Electrons that white fills."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of textures and noise.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(
    design: Path,
    scene: str,
    texture: str,
    samples: int,
    matcher: str,
    equalise: bool,
    noise_electrons: float,
    full_well_electrons: float,
    seed: int,
    as_json: bool,
) -> None:
    """Check DESIGN.json end to end against ground truth; exit code 1 if it fails."""
    from designer.design import read_design

    if not 0.0 <= noise_electrons < float("inf"):
        raise InputError(f"--noise-electrons {noise_electrons:g}: must be at least 0")
    if not 1.0 <= full_well_electrons < float("inf"):
        raise InputError(f"--full-well-electrons {full_well_electrons:g}: must be at least 1")
    record = read_design(design)

    from dataclasses import replace

    from designer.imaging.endtoend.check import check_design, describe_check, summarise_check
    from designer.imaging.render.detector import Detector
    from designer.imaging.stereo.matching import ACCURATE_OPTIONS

    result = check_design(
        record,
        scene,
        texture=texture,
        samples=samples,
        detector=Detector(full_well_electrons, noise_electrons),
        options=replace(ACCURATE_OPTIONS, matcher="semi_global" if matcher == "semi-global" else "sad"),
        equalise=equalise,
        seed=seed,
    )
    if as_json:
        import json

        click.echo(json.dumps(summarise_check(result), indent=2, allow_nan=False))
    else:
        click.echo(describe_check(result))
    if not result.passed:
        raise SystemExit(FAILED)
