"""Speed of the imaging core: ``python -m benchmarks.imaging``.

From a raw image of 1600 x 1200 pixels to two panoramas of 1800 x 160, SAD over 9 x 9 with reverse verification, and
depth, with tables built; beside it the same steps written directly with OpenCV's remap and block matcher, in the
same run and in turns. Prints frames per second and the ratio of times, wall clock and processor.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from designer.design import read_design
from designer.imaging.images import Image
from designer.imaging.stereo.matching import MatchingOptions
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image

DESIGN = Path(__file__).parents[1] / "tests" / "data" / "folded_hypl_hy.json"
ELEVATION_DEG = (-16.0, 16.0)
TARGET_FPS, TARGET_FPS_EQUALISED, TARGET_RATIO = 25.0, 5.0, 1.1
WINDOW = 9


def textured_wall(rig: StereoRig, distance_mm: float = 1900.0) -> Image:
    """A raw image of a round wall with a smoothed random texture, by the gain law."""
    camera = rig.design.camera
    noise = np.random.default_rng(0).integers(0, 256, (1000, 3600)).astype(np.uint8)
    texture = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 2.0), None, 0, 255, cv2.NORM_MINMAX)
    v, u = np.mgrid[0 : camera.height_px, 0 : camera.width_px]
    raw = np.zeros(u.shape, np.uint8)
    for image in rig.images.values():
        slope, azimuth = image.direction_of(u, v)
        height = (image.viewpoint_mm + distance_mm * slope) / distance_mm
        columns, rows = (azimuth + np.pi) / (2 * np.pi) * 3600, 500 - height * 3600 / (2 * np.pi)
        seen = cv2.remap(texture, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR)
        ends = np.sort(np.abs(image.radius_px(np.array(image.slopes))))
        radius = np.abs(image.radius_px(slope))
        zone = (radius >= ends[0]) & (radius <= ends[1])
        raw[zone] = seen[zone]
    return raw


def direct_opencv(rig: StereoRig, padded: bool) -> Callable[[Image], NDArray[np.float32]]:
    """The same steps with OpenCV's own functions: remap, block matching both ways, comparison, depth.

    Unpadded, the block matcher gives nothing within the search range of the border.
    """
    grid = rig.grid
    rows, columns = np.arange(grid.rows), np.arange(grid.columns)
    maps = []
    for name, image in rig.images.items():
        u, v = image.pixel_of(grid.slope(name, rows)[:, None], grid.azimuth(columns)[None])
        maps.append((u.astype(np.float32), v.astype(np.float32)))
    count = -(-len(rig.search.spans) // 16) * 16
    matcher = cv2.StereoBM.create(count, WINDOW)
    matcher.setMinDisparity(rig.search.lowest)
    matcher.setTextureThreshold(0)
    slope_upper = grid.slope("upper", rows).astype(np.float32)
    elevations_lower = (grid.top("lower") - (rows + 0.5) * grid.step).astype(np.float32)
    beside = count + abs(rig.search.lowest) + WINDOW if padded else 0
    around = WINDOW if padded else 0

    def scan_lines(raw: Image, maps_of_view: tuple[NDArray[np.float32], NDArray[np.float32]]) -> Image:
        lines = cv2.transpose(cv2.remap(raw, *maps_of_view, cv2.INTER_LINEAR))
        if padded:
            lines = cv2.copyMakeBorder(lines, around, around, 0, 0, cv2.BORDER_WRAP)
            lines = cv2.copyMakeBorder(lines, 0, 0, beside, beside, cv2.BORDER_REPLICATE)
        return np.asarray(lines, dtype=np.uint8)

    def run(raw: Image) -> NDArray[np.float32]:
        upper, lower = (scan_lines(raw, maps_of_view) for maps_of_view in maps)
        forward = matcher.compute(upper, lower)
        backward = cv2.flip(matcher.compute(cv2.flip(lower, 1), cv2.flip(upper, 1)), 1)
        inner = (slice(around, around + grid.columns), slice(beside, beside + grid.rows))
        forward, backward = forward[inner], backward[inner]
        matched = np.clip(rows - ((forward + 8) >> 4), 0, grid.rows - 1)
        agrees = np.abs(np.take_along_axis(backward, matched, axis=1) - forward) <= 16
        disparity = forward.astype(np.float32) / np.float32(16.0)
        slope_lower = np.tan(elevations_lower + np.float32(grid.step) * disparity)
        depth = np.float32(rig.design.baseline_mm) / (slope_lower - slope_upper)
        return np.where(agrees & (forward >= 16 * rig.search.lowest), depth, np.float32(np.nan))

    return run


def time_in_turns(runs: dict[str, Callable[[], object]], repeats: int) -> dict[str, tuple[float, float]]:
    """Median wall-clock and processor seconds of each, run in turns so that load falls on all alike."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
    for run in runs.values():
        run()
    for _ in range(repeats):
        for name, run in runs.items():
            wall, processor = time.perf_counter(), time.process_time()
            run()
            times[name].append((time.perf_counter() - wall, time.process_time() - processor))
    return {
        name: (float(np.median(taken, axis=0)[0]), float(np.median(taken, axis=0)[1])) for name, taken in times.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--design", type=Path, default=DESIGN)
    asked = parser.parse_args()
    design = read_design(asked.design)
    options = MatchingOptions(threads=2, window=WINDOW)
    cv2.setNumThreads(2)
    started = time.perf_counter()
    plain = build_rig(design, elevation_deg=ELEVATION_DEG)
    built = time.perf_counter() - started
    equalised = build_rig(design, elevation_deg=ELEVATION_DEG, equalise=True)
    raw = textured_wall(plain)
    lossy, padded = direct_opencv(plain, padded=False), direct_opencv(plain, padded=True)
    # Without the checks that the direct version does not make either.
    same_steps = replace(options, speckle_size=0, least_contrast=0.0, largest_difference=np.inf)
    times = time_in_turns(
        {
            "designer": lambda: match_image(plain, raw, same_steps),
            "OpenCV, borders lost": lambda: lossy(raw),
            "OpenCV, padded": lambda: padded(raw),
            "designer, all checks": lambda: match_image(plain, raw, options),
            "designer, equalised": lambda: match_image(equalised, raw, options),
            "designer, semi-global": lambda: match_image(plain, raw, replace(options, matcher="semi_global")),
        },
        asked.repeats,
    )
    print(f"raw {raw.shape[1]} x {raw.shape[0]}, panoramas {plain.grid.columns} x {plain.grid.rows}, ", end="")
    print(f"{len(plain.search.spans)} disparities; tables built in {1e3 * built:.0f} ms")
    for name, (wall, processor) in times.items():
        print(f"{name:22s} {1e3 * wall:7.1f} ms {1 / wall:7.1f} frames/s   processor {1e3 * processor:7.1f} ms")
    kept = match_image(plain, raw, options).distances_mm
    fractions = [np.isfinite(depth).mean() for depth in (kept, lossy(raw), padded(raw))]
    print("kept: designer {:.3f}, OpenCV with borders lost {:.3f}, padded {:.3f}".format(*fractions))
    walls = {name: wall for name, (wall, _) in times.items()}
    ratios = {name: walls["designer"] / walls[name] for name in ("OpenCV, padded", "OpenCV, borders lost")}
    rates = {name: 1 / wall for name, wall in walls.items()}
    checks = [
        (f"{name}: {rates[name]:.1f} frames/s >= {target:g}", rates[name] >= target)
        for name, target in (("designer, all checks", TARGET_FPS), ("designer, equalised", TARGET_FPS_EQUALISED))
    ]
    checks += [
        (f"time against {name} {ratio:.2f} <= {TARGET_RATIO:g}", ratio <= TARGET_RATIO)
        for name, ratio in ratios.items()
    ]
    for text, passed in checks:
        print(f"{'pass' if passed else 'FAIL'}  {text}")


if __name__ == "__main__":
    main()
