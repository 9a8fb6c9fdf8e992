"""``designer calibrate``: the sensor as it was built, from images of a target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.extras import needs
from designer.files import InputError

if TYPE_CHECKING:
    from designer.calibration.calibrate import CalibratedSensor

HEADER = ("departure", "found", "+/-", "known before", "unit")


@click.command()
@click.argument("design", type=click.Path(path_type=Path), metavar="DESIGN.json")
@click.argument("images", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="IMAGES...")
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Design file to write.")
@click.option(
    "--target",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FILE.toml",
    help="Target file written by designer target.",
)
@click.option("--tolerances", type=click.Path(path_type=Path), help="TOML file of tolerances (docs/tolerances.md).")
@click.option("--grade", help="coarse, standard or precision, instead of a file.  [default: coarse]")
@click.option(
    "--free",
    multiple=True,
    metavar="NAME",
    help="What to estimate: a part, a key of as_built, or PART.KEY; may be repeated.  "
    "[default: all mirrors, lens and image shift]",
)
@needs("imaging")
def calibrate(
    design: Path,
    images: tuple[Path, ...],
    out: Path,
    target: Path,
    tolerances: Path | None,
    grade: str | None,
    free: tuple[str, ...],
) -> None:
    """Find how the sensor built to DESIGN.json departs from it, from raw IMAGES of a target at different places.

    The file written is the design with an as_built table: designer stereo then uses the traced geometry.
    """
    from designer.design import read_design, write_design

    if tolerances is not None and grade is not None:
        raise InputError("--tolerances and --grade: give one; a file has a key grade of its own")
    if out.suffix.lower() != ".json":
        raise InputError(f"{out}: must end in .json")
    record = read_design(design)
    from designer.as_built.tolerances import read_tolerances, tolerances_of_grade
    from designer.calibration.calibrate import calibrate as find
    from designer.calibration.provenance import calibrated_design
    from designer.calibration.target import read_target
    from designer.imaging.images import read_raw_image
    from designer.imaging.stereo.rig import in_grey

    asked = read_tolerances(tolerances, record) if tolerances is not None else tolerances_of_grade(grade or "coarse")
    board = read_target(target)
    raws = [in_grey(read_raw_image(path, record.camera)) for path in images]
    found = find(record, raws, board, asked, free, [str(path) for path in images], click.echo)
    inputs = {"design": design, "target": target, **{f"image {n + 1}": path for n, path in enumerate(images)}}
    write_design(calibrated_design(found, board, inputs), out)
    click.echo("\n".join(describe_calibration(found)))
    click.echo(f"{out} written")


def describe_calibration(found: CalibratedSensor) -> list[str]:
    """The departures with their 95 % intervals, the residuals, and what the images do not tell."""
    from designer.calibration.findings import (
        depth_uncertainty,
        residuals_by_region,
        residuals_by_view,
        still_open,
        undetermined,
        undetermined_in_words,
    )
    from designer.calibration.provenance import OF_95_PERCENT
    from designer.cli.table import format_table

    unknowns, sigma = found.unknowns, found.sigma
    rows = [
        (p.name, f"{value:.4f}", f"{OF_95_PERCENT * error:.4f}", f"{OF_95_PERCENT * before:.4f}", p.unit)
        for p, value, error, before, is_free in zip(
            unknowns.parameters, found.adjusted.values, sigma, unknowns.prior_sigma, unknowns.free, strict=True
        )
        if is_free
    ]
    corners = sum(len(sighting.pixels) for sighting in found.sightings)
    lines = [
        f"{found.design.configuration}: {corners} corners in {len(found.images)} images",
        "",
        "Departures against the camera, with 95 % intervals, and what the tolerances alone say:",
        format_table(HEADER, rows, HEADER[1:4]),
        "",
        "residuals: "
        + ", ".join(
            f"{view} view {rms:.3f} px rms" for view, rms in residuals_by_view(found.sightings, found.adjusted).items()
        ),
    ]
    regions = residuals_by_region(found.design, found.sightings, found.adjusted)
    worst = max(regions, key=lambda region: region.rms_px)
    low, high = worst.sector_deg
    lines.append(
        f"largest in the {worst.ring} half of the {worst.view} view, {low:g} to {high:g} degrees from right towards "
        f"down: {worst.rms_px:.3f} px rms, mean {worst.bias_px:.3f} px, of {worst.points} corners"
    )
    if names := still_open(unknowns, sigma):
        lines.append(f"poorly determined by the images: {', '.join(names)}")
    as_designed = found.design.model_copy(update={"as_built": None})
    left = 100.0 * depth_uncertainty(as_designed, found.adjusted)
    lines.append(
        f"what is left unknown of the sensor makes distances uncertain by {left:.2g} % (standard deviation, rms)"
    )
    return [*lines, *undetermined_in_words(undetermined(unknowns, found.adjusted), int(unknowns.free.sum()))]
