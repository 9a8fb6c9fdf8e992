"""Predicted noise of matched image points against what rendered images give: ``python -m benchmarks.noise``.

Designs of every family, focused where their blur is least, look through their lenses at the calibration scene at
several f-numbers and in two lights. The images are matched, and the noise is measured in cells, strips of elevation by
bands of distance, and compared with the closed form (:mod:`designer.evaluate.noise`). Writes one row for each image
to ``benchmarks/results/noise.csv`` and what they say together to ``noise.txt``. ``--images`` keeps rendered images,
and uses those that are there; ``--cells`` compares cells measured before with the present formula.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from designer.design import VIEW_NAMES, Design, PerView
from designer.evaluate.noise import (
    MATCHER_PERFORMANCE,
    CameraSetting,
    CollectedLight,
    ImagePoint,
    equalising_sigma_px,
    matching_noise,
    rich_texture,
)
from designer.imaging.endtoend.noise import (
    FEWEST_PIXELS,
    STRIPS,
    distance_bands,
    error_per_pixel,
    robust_deviation,
    true_points,
)
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.raytracing import BLACK_PARTS_RADIANCE, pupil_of, ray_directions
from designer.imaging.render.scenes.library import calibration_world
from designer.imaging.render.scenes.world import World, first_surfaces, radiance
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, MatchingOptions, MatchOutcome
from designer.imaging.stereo.panorama import panorama_grid, view_images
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image
from designer.optics.focus import (
    chief_ray,
    lens_of_camera,
    light_path_of_design,
    reciprocal_along_ray,
    reciprocal_image_depth,
)
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.instrument import build_instrument

Floats = NDArray[np.float64]

DESIGNS = Path(__file__).parent / "noise_designs.json"
RESULTS = Path(__file__).parent / "results"
F_NUMBERS = (2.8, 4.0, 5.6, 8.0, 11.0)
# Cells of which fewer pixels have a match say what the matcher keeps rather than what it measures.
LEAST_KEPT = 0.6
# Electrons of white at f/5.6, with a read noise of 8.
LIGHTS = {"bright": 20_000.0, "dim": 4_000.0}
LIGHT_F_NUMBER, READ_NOISE = 5.6, 8.0
MATCHERS = {
    "sad": ACCURATE_OPTIONS,
    "semi_global": MatchingOptions(matcher="semi_global", follow_slants=True),
}
# Pixels twice as coarse render four times as fast.
COARSENESS = 2
FEWEST_CELLS = 4
KEYS = ["design", "index", "f_number", "light", "matcher"]
RAYS_PER_PIXEL = 16
PIXELS_PER_BLOCK = 4096
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def coarse(design: Design, factor: int) -> Design:
    """The same optics over fewer, larger pixels."""
    camera = design.camera
    circle = camera.image_circle_radius_px
    update = {
        "width_px": camera.width_px // factor,
        "height_px": camera.height_px // factor,
        "pixel_pitch_mm": camera.pixel_pitch_mm * factor,
        "image_circle_radius_px": circle and circle / factor,
    }
    return design.model_copy(update={"camera": camera.model_copy(update=update)})


def reciprocal_depths(design: Design, view_name: str, slopes: Floats, distances: Floats) -> Floats:
    """1 / z_V of points seen at slopes and horizontal distances."""
    ray = chief_ray(light_path_of_design(design, view_name), slopes)
    return np.asarray(reciprocal_image_depth(ray, reciprocal_along_ray(slopes, distances)))


def best_focused(design: Design) -> Design:
    """The design focused midway between its nearest and its farthest virtual image, principal distance kept."""
    depths = []
    for name in ("upper", "lower"):
        slopes = np.tan(np.radians(np.linspace(*getattr(design.views, name).elevation_deg, 9)))[:, None]
        depths.append(reciprocal_depths(design, name, slopes, np.array(design.working_volume.distance_mm)))
    middle = (np.min(depths) + np.max(depths)) / 2.0
    return with_camera(design, focus_distance_mm=float(1.0 / middle))


def with_camera(design: Design, **changes: float) -> Design:
    return design.model_copy(update={"camera": design.camera.model_copy(update=changes)})


def render_through_lens(design: Design, world: World) -> NDArray[np.float32]:
    """The image (h, w) through the entrance pupil, without the graininess of random rays.

    Every pixel sends the same rays: over pixel and pupil by sequences that fill them evenly. What lies between the
    rays is filled by seeing the texture through a Gaussian as wide as a ray's share of the whole spread of the
    pixel's rays in the world, so that the whole keeps its variance.
    """
    camera, pupil, count = design.camera, pupil_of(design.camera), RAYS_PER_PIXEL
    number, share = np.arange(count), np.pi / RAYS_PER_PIXEL
    within = np.outer(number, (0.7548776662466927, 0.5698402909980532)) % 1.0
    within = (within - within.mean(axis=0)) * np.sqrt((1.0 - share) / 12.0) / within.std(axis=0)
    turns, rings = number * GOLDEN_ANGLE, np.sqrt((number + 0.5) / count)
    disc = np.stack([rings * np.cos(turns), rings * np.sin(turns)], axis=-1)
    disc = (disc - disc.mean(axis=0)) * (np.sqrt(1.0 - share) / 2.0) / disc.std(axis=0)
    starts = np.column_stack([pupil.radius_mm * disc, np.zeros(count)])
    instrument = build_instrument(design)
    image = np.zeros((camera.height_px, camera.width_px), dtype=np.float32)
    rows, columns = (grid.ravel() for grid in np.mgrid[0 : (camera.height_px + 1) // 2, 0 : (camera.width_px + 1) // 2])
    if camera.image_circle_radius_px is not None:
        u0, v0 = camera.principal_point_px
        lit = np.hypot(columns - u0, rows - v0) <= camera.image_circle_radius_px
        rows, columns = rows[lit], columns[lit]
    for low in range(0, len(rows), PIXELS_PER_BLOCK):
        row, column = rows[low : low + PIXELS_PER_BLOCK], columns[low : low + PIXELS_PER_BLOCK]
        u = (column[:, None] + within[:, 0]).ravel()
        v = (row[:, None] + within[:, 1]).ravel()
        start = np.tile(starts, (len(row), 1))
        trace = trace_first_hits(instrument, ray_directions(camera, u, v, start, pupil), start)
        free = np.flatnonzero(trace.status == Status.ESCAPED)
        # Mirrors and camera are round: one quadrant's rays hold in the other three, reflected.
        for across in (1.0, -1.0):
            for down in (1.0, -1.0):
                signs = np.array([across, down, 1.0])[:, None]
                hits = first_surfaces(world, trace.exit_point[free].T * signs, trace.exit_direction[free].T * signs)
                places = np.full((3, len(u)), np.nan)
                places[:, free] = hits.points
                grouped = places.reshape(3, len(row), count)
                known = np.isfinite(grouped).all(axis=2).all(axis=0)
                # Of two axes on the surface; the third is along the ray.
                variance = np.where(known, np.nan_to_num(grouped.var(axis=2)).sum(axis=0) / 2.0, 0.0)
                spread = np.repeat(2.0 * np.sqrt(share * variance), count)[free]
                seen = np.full(len(u), BLACK_PARTS_RADIANCE, dtype=np.float32)
                seen[free] = radiance(world, hits, spread)
                target = (
                    row if down > 0 else camera.height_px - 1 - row,
                    column if across > 0 else camera.width_px - 1 - column,
                )
                image[target] = seen.reshape(-1, count).mean(axis=1)
    return image


def cells(
    rig: StereoRig, raw: NDArray[np.uint8], points: Floats, options: MatchingOptions
) -> Iterator[dict[str, float]]:
    """The measured noise in strips of elevation and bands of distance, and where each lies."""
    matches = match_image(rig, raw, options)
    distance = np.hypot(points[0], points[1])
    normalised = (matches.distances_mm / distance - 1.0) / error_per_pixel(rig, distance)
    inside = np.isfinite(distance)
    # What both views image at all, whether matched or not.
    inside &= matches.outcomes != MatchOutcome.OUTSIDE_ZONE
    inside &= matches.outcomes != MatchOutcome.BORDER
    for near, far in pairwise(distance_bands(rig.design)):
        for low, high in pairwise(np.linspace(0, rig.grid.rows, STRIPS + 1).astype(int)):
            here = inside[:, low:high] & (distance[:, low:high] >= near) & (distance[:, low:high] < far)
            errors = normalised[:, low:high][here]
            kept = errors[np.isfinite(errors)]
            if here.sum() >= FEWEST_PIXELS:
                yield {
                    "row": (low + high - 1) / 2.0,
                    "distance_mm": float(np.exp(np.mean(np.log(distance[:, low:high][here])))),
                    "pixels": int(here.sum()),
                    "kept": len(kept) / int(here.sum()),
                    "bias_px": float(np.median(kept)) if len(kept) else np.nan,
                    "measured_px": robust_deviation(kept) if len(kept) >= FEWEST_PIXELS / 2 else np.nan,
                }


def measure(f_numbers: Sequence[float], images: Path) -> pd.DataFrame:
    """All cells of all images."""
    rows: list[dict[str, object]] = []
    for index, record in enumerate(json.loads(DESIGNS.read_text(encoding="utf-8"))):
        design = best_focused(coarse(Design.model_validate(record), COARSENESS))
        near, far = design.working_volume.distance_mm
        rig = build_rig(design, distances_mm=(0.8 * near, 2.5 * far), equalise=True)
        world = calibration_world(design, seed=1)
        points = true_points(rig, design, [world])[0]
        for f_number in f_numbers:
            kept = images / f"{index}_{f_number:g}.npy"
            if not kept.exists():
                np.save(kept, render_through_lens(with_camera(design, f_number=f_number), world))
            for light, electrons in LIGHTS.items():
                detector = Detector(electrons * (LIGHT_F_NUMBER / f_number) ** 2, READ_NOISE)
                raw = np.asarray(expose(np.load(kept), detector, seed=index), dtype=np.uint8)
                for matcher, options in MATCHERS.items():
                    name = f"{record['requirement']}:{record['configuration']}"
                    given = {"design": name, "index": index, "f_number": f_number, "light": light, "matcher": matcher}
                    rows += [given | cell for cell in cells(rig, raw, points, options)]
            print(name, f_number, flush=True)
    return pd.DataFrame(rows)


def common_spacing_px(design: Design, columns: int) -> float:
    """Raw pixels from one panorama pixel to the next, of the smaller view, where that is most."""
    images = view_images(design)
    spacings = []
    for share in np.linspace(0.0, 1.0, 9):
        slopes = {
            name: np.tan(np.radians(low + share * (high - low)))
            for name, (low, high) in ((n, getattr(design.views, n).elevation_deg) for n in VIEW_NAMES)
        }
        spacings.append(min(abs(float(images[name].radius_px(slope))) for name, slope in slopes.items()))
        spacings.append(min(abs(float(images[name].radius_per_elevation_px(slope))) for name, slope in slopes.items()))
    return 2.0 * np.pi / columns * max(spacings)


def predict(measured: pd.DataFrame) -> pd.DataFrame:
    """The cells with what the closed form predicts for them, in pixels of equal noise in both views."""
    records = json.loads(DESIGNS.read_text(encoding="utf-8"))
    parts = []
    for (index, f_number, light_name, matcher), part in measured.groupby(["index", "f_number", "light", "matcher"]):
        design = best_focused(coarse(Design.model_validate(records[index]), COARSENESS))
        design = with_camera(design, f_number=f_number)
        camera, grid = design.camera, panorama_grid(design)
        distance = part["distance_mm"].to_numpy()
        slope_upper = grid.slope("upper", part["row"].to_numpy())
        slopes = {"upper": slope_upper, "lower": slope_upper + design.baseline_mm / distance}
        images, lens, points = view_images(design), lens_of_camera(camera), {}
        for name in VIEW_NAMES:
            slope = slopes[name]
            defocus = lens.blur(reciprocal_depths(design, name, slope, distance))
            radius = images[name].radius_px(slope) * camera.pixel_pitch_mm
            radius_slope = images[name].radius_per_elevation_px(slope) * camera.pixel_pitch_mm
            points[name] = ImagePoint(slope, radius, radius_slope, defocus)
        matching = MATCHER_PERFORMANCE[matcher]
        exposure = CameraSetting(
            camera.pixel_pitch_mm, f_number, equalising_sigma_px(common_spacing_px(design, matching.columns))
        )
        light = CollectedLight(LIGHTS[light_name], LIGHT_F_NUMBER, READ_NOISE)
        texture = rich_texture(design.working_volume.distance_mm[1])
        noise = matching_noise(PerView(**points), distance, texture, light, exposure, matching)
        # In each view the noise of the slope; equal noise in both would give the same sum of squares.
        per_mm = {name: (1.0 + point.slope**2) / point.radius_slope for name, point in points.items()}
        variance = sum((noise[name] * scale) ** 2 for name, scale in per_mm.items())
        equal = np.sqrt(variance / sum(scale**2 for scale in per_mm.values())) / camera.pixel_pitch_mm
        blurs = {f"blur_{n}_px": np.abs(points[n].defocus) / camera.pixel_pitch_mm for n in VIEW_NAMES}
        angles = {f"angle_{n}_deg": np.degrees(np.abs(points[n].defocus / points[n].radius_slope)) for n in VIEW_NAMES}
        parts.append(part.assign(predicted_px=equal, **blurs, **angles))
    return pd.concat(parts)


def summarise(cell: pd.DataFrame) -> pd.DataFrame:
    """One row for each image and matcher: medians over the cells that keep enough, and over all for the best stop."""
    rows = []
    for (design, index, f_number, light, matcher), part in cell.groupby(KEYS):
        judged = part[part["kept"] >= LEAST_KEPT]
        ratio = judged["predicted_px"] / judged["measured_px"]
        everywhere = part["measured_px"].where(part["kept"] >= LEAST_KEPT, np.inf)
        rows.append(
            {"design": design, "index": index, "f_number": f_number, "light": light, "matcher": matcher}
            | {"cells": len(part), "judged": len(judged), "kept": part["kept"].median()}
            | {name: judged[name].median() for name in ("measured_px", "predicted_px")}
            | {"ratio": ratio.median(), "ratio_10": ratio.quantile(0.1), "ratio_90": ratio.quantile(0.9)}
            | {"everywhere_measured_px": everywhere.median(), "everywhere_predicted_px": part["predicted_px"].median()}
            | {name: part[name].median() for name in ("angle_upper_deg", "angle_lower_deg")}
        )
    return pd.DataFrame(rows)


def verdict(table: pd.DataFrame) -> str:
    """What the images say together."""
    lines = []
    judged = table[table["judged"] >= FEWEST_CELLS]
    for matcher, of_matcher in judged.groupby("matcher"):
        lines.append(f"{matcher}: predicted over measured noise, median of each image's cells; 10 to 90 % of images")
        groups = {"all": of_matcher}
        groups |= {f"f/{f:g}": part for f, part in of_matcher.groupby("f_number")}
        groups |= {f"{light} light": part for light, part in of_matcher.groupby("light")}
        for name, part in groups.items():
            low, middle, high = part["ratio"].quantile([0.1, 0.5, 0.9])
            near = float((np.abs(np.log(part["ratio"])) <= np.log(1.2)).mean())
            count = f"{len(part)} images of {part['index'].nunique()} designs"
            lines.append(
                f"  {name:12s} {middle:5.2f} ({low:.2f} to {high:.2f}), {100 * near:3.0f} % within 20 %, {count}"
            )
        within, counted = 0, 0
        for _, part in table[table["matcher"] == matcher].groupby(["index", "light"]):
            measured, predicted = part["everywhere_measured_px"], part["everywhere_predicted_px"]
            if np.isfinite(measured).sum() >= 2:
                stops = part["f_number"].loc[[measured.idxmin(), predicted.idxmin()]].to_numpy()
                within += abs(2.0 * np.log2(stops[1] / stops[0])) <= 1.1
                counted += 1
        lines.append(f"  best f-number within one stop: {within} of {counted} (design and light)")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure or read cells, compare, write."""
    parser = argparse.ArgumentParser(description="Predicted noise of matched points against rendered images.")
    parser.add_argument("--images", type=Path, help="folder that keeps rendered images")
    parser.add_argument("--cells", type=Path, help="CSV of cells: read if it is there, else written")
    parser.add_argument("--f-numbers", type=float, nargs="+", default=F_NUMBERS)
    parser.add_argument("--out", type=Path, default=RESULTS)
    asked = parser.parse_args()
    if asked.cells and asked.cells.exists():
        measured = pd.read_csv(asked.cells)
    else:
        with TemporaryDirectory() as temporary:
            measured = measure(asked.f_numbers, asked.images or Path(temporary))
        if asked.cells:
            measured.to_csv(asked.cells, index=False, float_format="%.6g")
    table = summarise(predict(measured))
    table.to_csv(asked.out / "noise.csv", index=False, float_format="%.4g")
    (asked.out / "noise.txt").write_text(verdict(table), encoding="utf-8")
    print(verdict(table), end="")


if __name__ == "__main__":
    main()
