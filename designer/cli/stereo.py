"""``designer stereo``: from a camera's raw image to panoramas, disparities, depths and a point cloud."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from designer.extras import needs
from designer.files import InputError

if TYPE_CHECKING:
    from designer.design import Design
    from designer.imaging.stereo.placement import Placement
    from designer.imaging.stereo.view_centring import FoundCentres

# Nothing nearer or farther than these stands around any rig; far beyond, numbers overflow.
NEAREST_MM, FARTHEST_MM = 1.0, 1e9
# Even a scene of little texture leaves more of a panorama than this share.
FEW_KEPT = 0.05
FARTHEST_CENTRE_PX, LARGEST_NOISE_PX = 1e6, 1000.0


@click.command()
@click.argument("design", type=click.Path(path_type=Path))
@click.argument("raw", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--center", type=(float, float), metavar="U V", help="Pixel on the axis of the mirrors.")
@click.option(
    "--find-center",
    is_flag=True,
    help="Estimate that pixel, one for each view if the image shows two, within 8 pixels of the given or nominal one.",
)
@click.option("--rotation-deg", type=float, default=0.0, help="Rotation of the image, from +u towards +v.")
@click.option("--scale", type=float, default=1.0, help="Magnification of the image relative to the design.")
@click.option(
    "--placement",
    type=click.Path(path_type=Path),
    metavar="FILE.toml",
    help="Center, rotation and scale of each view: the placement.toml of an earlier run, or your own.",
)
@click.option("--sampling", type=click.Choice(["spherical", "cylindrical"]), default="spherical", show_default=True)
@click.option("--columns", type=click.IntRange(90, 20000), default=1800, show_default=True, help="Panorama width.")
@click.option("--elevation-deg", type=(float, float), metavar="LOW HIGH", help="Elevation range of both panoramas.")
@click.option("--distance-mm", type=(float, float), metavar="NEAR FAR", help="Nearest and farthest distance to match.")
@click.option("--matcher", type=click.Choice(["sad", "semi-global"]), default="sad", show_default=True)
@click.option(
    "--window", type=click.IntRange(3, 15), default=9, show_default=True, help="Side of the matching window (odd)."
)
@click.option("--equalise/--no-equalise", default=True, help="Equalise the two views' resolution.  [default: on]")
@click.option("--level-brightness", is_flag=True, help="Compensate for unequal brightness of the views.")
@click.option(
    "--mirror-reflectivity",
    type=click.FloatRange(0.01, 1.0),
    metavar="R",
    help="Compensate for the light lost at mirrors of this reflectivity and towards the rim of the lens.",
)
@click.option("--noise-px", type=float, help="Noise of an image point, used for the uncertainties.")
@click.option("--slab-mm", type=(float, float), metavar="LOW HIGH", help="Range of heights z in the floor plan.")
@needs("imaging")
def stereo(design: Path, raw: Path, out: Path, **asked: Any) -> None:
    """Reconstruct a point cloud from RAW, an image taken by the camera of DESIGN.json."""
    from designer.design import read_design

    _check(asked)
    record = read_design(design)
    from designer.imaging.images import read_raw_image
    from designer.imaging.stereo.results import StereoRequest, process, rig_of_request, write_results

    image = read_raw_image(raw, record.camera)
    as_built = record.as_built is not None and not _is_placed(asked)
    placement = _placement(record, asked)
    if asked["find_center"]:
        from designer.imaging.stereo.rig import in_grey
        from designer.imaging.stereo.view_centring import find_centres

        found = find_centres(record, in_grey(image), placement, distances_mm=asked["distance_mm"])
        placement = found.placement
        _print_centres(found)
    request = StereoRequest(
        placement=placement,
        sampling=asked["sampling"],
        columns=asked["columns"],
        elevation_deg=asked["elevation_deg"],
        distances_mm=asked["distance_mm"],
        matcher=asked["matcher"].replace("-", "_"),
        window=asked["window"],
        equalise=asked["equalise"],
        level_brightness=asked["level_brightness"],
        mirror_reflectivity=asked["mirror_reflectivity"],
        noise_px=asked["noise_px"],
        slab_mm=asked["slab_mm"],
        as_built=as_built,
    )
    if as_built:
        click.echo("as built: the sensor is traced as the design file's as_built table has it")
    elif record.as_built is not None:
        click.echo("as built: not used, since the options say where the image lies")
    result = process(rig_of_request(record, request), image, request)
    inputs = {"design": design, "raw": raw}
    if asked["placement"]:
        inputs["placement"] = asked["placement"]
    write_results(result, request, out, inputs)
    outcomes = result.matches.fractions
    points = len(result.cloud.positions_mm)
    click.echo(f"{points} points ({100 * outcomes['kept']:.1f} % of the panorama), in {out}")
    dropped = {name: part for name, part in outcomes.items() if name != "kept" and part > 0}
    reasons = ", ".join(f"{name.replace('_', ' ')} {100 * part:.1f} %" for name, part in dropped.items())
    click.echo(f"rejected: {reasons or 'none'}")
    if outcomes["kept"] < FEW_KEPT:
        click.echo(
            "few points are left: check that the image and the design belong together, and --center (or "
            "--find-center), --rotation-deg and --scale (or --placement)",
            err=True,
        )
    if (shift := result.depth_shift) is not None:
        median, largest = (f"{0.1 * each:.2g} %" for each in shift)
        click.echo(f"systematic: 0.1 % of image scale shifts these distances by {median} (median), up to {largest}")


def _placement(design: Design, asked: dict[str, Any]) -> Placement:
    from math import radians

    from designer.imaging.stereo.placement import ImagePlacement
    from designer.imaging.stereo.placement_file import read_placement

    if asked["placement"]:
        return read_placement(asked["placement"])
    centre = asked["center"] or design.camera.principal_point_px
    return ImagePlacement(centre, radians(asked["rotation_deg"]), asked["scale"])


def _is_placed(asked: dict[str, Any]) -> bool:
    """Whether options say where the image lies, which a built sensor's file does."""
    moved = asked["rotation_deg"] != 0.0 or asked["scale"] != 1.0
    return moved or bool(asked["center"] or asked["placement"] or asked["find_center"])


def _print_centres(found: FoundCentres) -> None:
    from math import degrees

    from designer.design import VIEW_NAMES
    from designer.imaging.stereo.placement import ImagePlacement, placement_of_view

    placement, errors = found.placement, found.standard_errors_px
    if isinstance(placement, ImagePlacement):
        click.echo("center: {:.2f} {:.2f}".format(*placement.center_px))
    else:
        for name in VIEW_NAMES:
            known = f" (standard error {errors[name]:.2g} px)" if errors else ""
            click.echo("{} center: {:.2f} {:.2f}".format(name, *placement_of_view(placement, name).center_px) + known)
        turn = degrees(placement.lower.rotation_rad - placement.upper.rotation_rad)
        known = "" if found.turn_error_rad is None else f" (standard error {degrees(found.turn_error_rad):.1g} degrees)"
        click.echo(f"the lower view is turned by {turn:.3f} degrees against the upper one{known}")
    if found.note:
        click.echo(found.note)


def _check(asked: dict[str, Any]) -> None:
    """Raise InputError for options that no image could satisfy."""
    for name, unit in (("elevation_deg", "degrees"), ("distance_mm", "mm"), ("slab_mm", "mm")):
        limits = asked[name]
        if limits and not limits[0] < limits[1]:
            raise InputError(
                f"--{name.replace('_', '-')} {limits[0]:g} {limits[1]:g}: give the lower limit ({unit}) first"
            )
    if asked["elevation_deg"] and not -89 <= asked["elevation_deg"][0] < asked["elevation_deg"][1] <= 89:
        raise InputError("--elevation-deg: must be between -89 and 89 degrees")
    if asked["distance_mm"] and not NEAREST_MM <= asked["distance_mm"][0] < asked["distance_mm"][1] <= FARTHEST_MM:
        raise InputError(f"--distance-mm: must be from {NEAREST_MM:g} to {FARTHEST_MM:g} mm")
    if not 0.1 <= asked["scale"] <= 10:
        raise InputError(f"--scale {asked['scale']:g}: must be between 0.1 and 10; 1 is the design scale")
    if asked["placement"] and (asked["center"] or asked["rotation_deg"] != 0.0 or asked["scale"] != 1.0):
        raise InputError(
            f"--placement {asked['placement']}: gives the center, rotation and scale of each view; leave out --center, "
            "--rotation-deg and --scale"
        )
    if asked["window"] % 2 == 0:
        raise InputError(f"--window {asked['window']}: must be odd")
    if asked["noise_px"] is not None and not 0 < asked["noise_px"] <= LARGEST_NOISE_PX:
        raise InputError(f"--noise-px {asked['noise_px']:g}: must be positive, and at most {LARGEST_NOISE_PX:g}")
    numbers = [value for item in asked.values() for value in (item if isinstance(item, tuple) else (item,))]
    if any((isinstance(value, float) and abs(value) == float("inf")) or value != value for value in numbers):
        raise InputError("numbers in options must be finite")
    if asked["center"] and max(abs(place) for place in asked["center"]) > FARTHEST_CENTRE_PX:
        raise InputError(f"--center: must be within {FARTHEST_CENTRE_PX:g} pixels")
