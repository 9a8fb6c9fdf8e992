"""Everything that one raw image gives, and the folder that holds it.

The folder: ``upper.png`` and ``lower.png`` (panoramas), ``disparity.png`` (for the eye), ``outcomes.png`` (why pixels
were dropped, by colour), ``depth.png`` (16 bits), ``stereo.npz`` (the same as numbers), ``points.ply``,
``floor_plan.png``, ``placement.toml`` (where the image lay) and ``summary.json``, written last: a folder without it was
not finished.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.evaluate.noise import Matcher
from designer.files import make_folder, write_atomically
from designer.imaging.images import Image, write_arrays, write_image
from designer.imaging.stereo.cloud import FloorPlan, floor_plan, heights_at_every_distance
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, Matches, MatchOutcome
from designer.imaging.stereo.panorama import DEFAULT_COLUMNS, Sampling
from designer.imaging.stereo.placement import Placement, ViewPlacements
from designer.imaging.stereo.placement_file import write_placement
from designer.imaging.stereo.ply import write_ply
from designer.imaging.stereo.reconstruction import PointCloud, depth_shifts_per_scale
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image, panoramas, point_cloud
from designer.notebook_html import html_table, percent
from designer.own_files import described_inputs, described_run

SUMMARY, PLACEMENT = "summary.json", "placement.toml"
# Blue, green, red of each outcome in outcomes.png; kept pixels are white. Legible to the colour-blind.
OUTCOME_COLOURS = {
    MatchOutcome.KEPT: (255, 255, 255),
    MatchOutcome.OUTSIDE_ZONE: (0, 0, 0),
    MatchOutcome.NO_TEXTURE: (153, 153, 153),
    MatchOutcome.BORDER: (66, 228, 240),
    MatchOutcome.OUT_OF_RANGE: (0, 159, 230),
    MatchOutcome.REVERSE_CHECK: (0, 94, 213),
    MatchOutcome.SPECKLE: (178, 114, 0),
    MatchOutcome.UNLIKE: (167, 121, 204),
}


@dataclass(frozen=True, slots=True)
class StereoRequest:
    """How one raw image is processed; see :func:`designer.imaging.stereo.rig.build_rig` and the matching options."""

    placement: Placement | None = None
    sampling: Sampling = "spherical"
    columns: int = DEFAULT_COLUMNS
    elevation_deg: tuple[float, float] | None = None
    distances_mm: tuple[float, float] | None = None
    matcher: Matcher = "sad"
    window: int = 9
    equalise: bool = True
    level_brightness: bool = False
    mirror_reflectivity: float | None = None
    noise_px: float | None = None
    slab_mm: tuple[float, float] | None = None
    as_built: bool = False


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StereoResult:
    """What one raw image gave."""

    rig: StereoRig
    upper: Image
    lower: Image
    matches: Matches
    cloud: PointCloud
    plan: FloorPlan

    @property
    def depth_shift(self) -> tuple[float, float] | None:
        """Median and largest relative depth shift of the points, per relative error of the image's scale.

        Systematic: the points' standard deviations leave it out. None without points.
        """
        shifts = np.abs(depth_shifts_per_scale(self.rig.design, self.cloud))
        return (float(np.median(shifts)), float(shifts.max())) if len(shifts) else None

    def _repr_html_(self) -> str:
        dropped = {name: part for name, part in self.matches.fractions.items() if name != "kept" and part > 0}
        rows = [
            ("points", len(self.cloud.positions_mm)),
            ("kept", percent(self.matches.fractions["kept"])),
            *((name.replace("_", " "), percent(part)) for name, part in dropped.items()),
        ]
        return html_table(f"{self.rig.design.configuration}, reconstructed", ("", "of the panorama"), rows)


def rig_of_request(design: Design, request: StereoRequest) -> StereoRig:
    """The rig that a request describes; it serves every image that is taken in the same way."""
    return build_rig(
        design,
        sampling=request.sampling,
        columns=request.columns,
        elevation_deg=request.elevation_deg,
        placement=request.placement,
        distances_mm=request.distances_mm,
        equalise=request.equalise,
        mirror_reflectivity=request.mirror_reflectivity,
        as_built=request.as_built,
    )


def process(rig: StereoRig, raw: Image, request: StereoRequest) -> StereoResult:
    """Take one raw image all the way to a point cloud and a floor plan."""
    options = replace(
        ACCURATE_OPTIONS,
        matcher=request.matcher,
        window=request.window,
        level_brightness=request.level_brightness,
    )
    matches = match_image(rig, raw, options)
    pair = panoramas(rig, raw)
    cloud = point_cloud(rig, raw, matches, request.noise_px, colours=pair["upper"])
    plan = floor_plan(cloud, request.slab_mm or heights_at_every_distance(rig.design), rig.search.distances_mm[1])
    return StereoResult(rig, pair["upper"], pair["lower"], matches, cloud, plan)


def write_results(result: StereoResult, request: StereoRequest, folder: Path, inputs: Mapping[str, Path]) -> None:
    """Write the folder of results. ``inputs`` are the files that it was made from."""
    make_folder(folder)
    # An earlier run's must not vouch for what this one leaves if it is interrupted.
    (folder / SUMMARY).unlink(missing_ok=True)
    unit_mm = _depth_unit_mm(result.rig.search.distances_mm[1])
    write_image(folder / "upper.png", result.upper)
    write_image(folder / "lower.png", result.lower)
    write_image(folder / "disparity.png", disparity_picture(result.matches))
    write_image(folder / "outcomes.png", outcome_picture(result.matches))
    write_image(folder / "depth.png", _depth_picture(result.matches, unit_mm))
    write_image(folder / "floor_plan.png", result.plan.picture())
    write_ply(folder / "points.ply", result.cloud)
    images = result.rig.images
    # A traced sensor's image lies where its design file says.
    if result.rig.is_traced:
        (folder / PLACEMENT).unlink(missing_ok=True)
    else:
        apart = ViewPlacements(upper=images["upper"].placement, lower=images["lower"].placement)
        write_placement(folder / PLACEMENT, apart)
    grid = result.rig.grid
    rows = np.arange(grid.rows)
    write_arrays(
        folder / "stereo.npz",
        {
            "disparity": result.matches.disparities.T,
            "distance_mm": result.matches.distances_mm.T,
            "outcome": result.matches.outcomes.T,
            "azimuth_deg": np.degrees(grid.azimuth(np.arange(grid.columns))),
            "elevation_upper_deg": np.degrees(np.arctan(grid.slope("upper", rows))),
            "elevation_lower_deg": np.degrees(np.arctan(grid.slope("lower", rows))),
        },
    )
    summary = _summary(result, request, inputs, unit_mm)
    write_atomically(folder / SUMMARY, json.dumps(summary, indent=2, allow_nan=False) + "\n")


def disparity_picture(matches: Matches) -> Image:
    """Disparities as grey, (rows, columns): near is bright, dropped is black."""
    known = np.isfinite(matches.disparities)
    if not known.any():
        return np.zeros(matches.disparities.T.shape, np.uint8)
    low, high = np.percentile(matches.disparities[known], (0.5, 99.5))
    grey = 40.0 + 215.0 * np.clip((matches.disparities - low) / max(float(high - low), 1e-6), 0.0, 1.0)
    return np.where(known, np.nan_to_num(np.rint(grey)), 0).astype(np.uint8).T


def outcome_picture(matches: Matches) -> Image:
    """What became of each pixel, by colour, (rows, columns, 3) in OpenCV's order."""
    palette = np.array([OUTCOME_COLOURS[outcome] for outcome in MatchOutcome], np.uint8)
    return np.asarray(palette[matches.outcomes.T])


def _depth_picture(matches: Matches, unit_mm: float) -> NDArray[np.uint16]:
    """Distances in whole units, (rows, columns); 0 where dropped."""
    return np.asarray(np.rint(np.nan_to_num(matches.distances_mm.T / unit_mm)), dtype=np.uint16)


def _depth_unit_mm(far_mm: float) -> float:
    """The smallest of ... 0.01, 0.1, 1, 10 ... mm with which the farthest distance fits into 16 bits."""
    return float(10.0 ** np.ceil(np.log10(far_mm / 65535.0)))


def _summary(
    result: StereoResult, request: StereoRequest, inputs: Mapping[str, Path], unit_mm: float
) -> dict[str, Any]:
    cloud, grid = result.cloud, result.rig.grid
    relative = cloud.sigma_distance_mm / np.hypot(*cloud.positions_mm[:, :2].T)
    known = len(relative) > 0
    return {
        "configuration": result.rig.design.configuration,
        "points": len(cloud.positions_mm),
        "outcomes": result.matches.fractions,
        "median_distance_mm": float(np.nanmedian(result.matches.distances_mm)) if known else None,
        "median_relative_sigma_distance": float(np.median(relative)) if known else None,
        "depth_shift_per_scale": {"median": shift[0], "largest": shift[1]} if (shift := result.depth_shift) else None,
        "depth_png_unit_mm": unit_mm,
        "distances_mm": list(result.rig.search.distances_mm),
        "floor_plan": {"heights_mm": list(result.plan.heights_mm), "extent_mm": result.plan.extent_mm},
        "panorama": {"rows": grid.rows, "columns": grid.columns, "sampling": grid.sampling},
        "equalisation_sigma_px": result.rig.sigma_px,
        "request": asdict(request),
        "provenance": {
            **described_run({"numpy": np.__version__, "scipy": version("scipy"), "opencv": cv2.__version__}),
            "inputs": described_inputs(inputs),
            "placements": {view: asdict(image.placement) for view, image in result.rig.images.items()},
        },
    }
