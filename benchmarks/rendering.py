"""Speed and noise of full-aperture rendering: ``python -m benchmarks.rendering``.

Images of 1600 x 1200 pixels of the office through the pinhole and through the lens of the paper's requirement, beside
the plain method that follows each ray to the first surface it meets, in one thread, a quadrant at a time, with places
in pixel and pupil drawn in cells. Then the noise that the few rays of a pixel leave, against 256 of them, on patches
spread over the image. Written to ``results/rendering.txt``.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from benchmarks.problems import RESULTS
from benchmarks.tracing import DESIGNS
from designer.design import Design
from designer.imaging.render.camera_rays import angular_spacing, on_sensor, ray_directions, sample_places
from designer.imaging.render.full_aperture import IDENTITY, Optics, PixelBlock, render_block
from designer.imaging.render.lens import LOSSLESS, RenderedLens, diffract, pupil_of
from designer.imaging.render.passage import BLACK_PARTS_RADIANCE
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.render.scenes.world import World, first_surfaces, radiance
from designer.trace.first_hit import Status, trace_first_hits
from designer.trace.instrument import build_instrument

# The winner of version 0.1, far out of focus, and the prototype of the paper.
CONFIGURATIONS = ("folded-ElEl-Hy-upper_inner", "folded-HyPl-Hy-upper_outer")
TARGET_SECONDS = 8.0
RAYS_PER_BLOCK = 16384
REFERENCE_SAMPLES, PATCHES, PATCH_PX, MARGIN_PX = 16, 24, 32, 8

Pixels = NDArray[np.intp]
Image = NDArray[np.float64]


def plain_render(design: Design, world: World, samples: int) -> Image:
    """The whole image, each ray followed to the first surface it meets, with four reflections of one quadrant."""
    camera = design.camera
    u0, v0 = camera.principal_point_px
    rows, columns = (grid.ravel() for grid in np.mgrid[0 : camera.height_px // 2, 0 : camera.width_px // 2])
    lit = np.hypot(columns - u0, rows - v0) <= (camera.image_circle_radius_px or np.inf)
    rows, columns = rows[lit], columns[lit]
    image = np.zeros((camera.height_px, camera.width_px))
    step = RAYS_PER_BLOCK // samples**2
    for low in range(0, len(rows), step):
        block = rows[low : low + step], columns[low : low + step]
        for (flip_u, flip_v), seen in plain_pixels(design, world, *block, samples, seed=low).items():
            row = camera.height_px - 1 - block[0] if flip_v < 0 else block[0]
            column = camera.width_px - 1 - block[1] if flip_u < 0 else block[1]
            image[row, column] = seen
    return image


def plain_pixels(
    design: Design, world: World, rows: Pixels, columns: Pixels, samples: int, seed: int, quadrants: int = 4
) -> dict[tuple[float, float], Image]:
    """Radiances (n,) of pixels, and of their reflections in the image, by drawn rays."""
    camera, pupil, instrument = design.camera, pupil_of(design.camera), build_instrument(design)
    u, v, starts = sample_places(rows, columns, samples, pupil, np.random.default_rng(seed))
    trace = trace_first_hits(instrument, ray_directions(camera, u, v, starts, pupil), starts)
    free = np.flatnonzero(trace.status == Status.ESCAPED)
    spacing = _spacing(design)(np.hypot(*on_sensor(camera, u, v)))[free] / samples
    results = {}
    for flips in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))[:quadrants]:
        signs = np.array([*flips, 1.0])[:, None]
        hits = first_surfaces(world, trace.exit_point[free].T * signs, trace.exit_direction[free].T * signs)
        seen = np.full(len(u), BLACK_PARTS_RADIANCE)
        seen[free] = radiance(world, hits, np.where(hits.surface >= 0, hits.distance, 0.0) * spacing)
        results[flips] = seen.reshape(-1, samples**2).mean(axis=1)
    return results


_SPACINGS: dict[str, Callable[[Image], Image]] = {}


def _spacing(design: Design) -> Callable[[Image], Image]:
    if design.configuration not in _SPACINGS:
        _SPACINGS[design.configuration] = angular_spacing(design, build_instrument(design))
    return _SPACINGS[design.configuration]


def seconds_of(runs: dict[str, Callable[[], object]], repeats: int) -> dict[str, tuple[float, float]]:
    """Median wall and processor time of each, in turns."""
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            wall, processor = time.perf_counter(), time.process_time()
            run()
            taken[name].append((time.perf_counter() - wall, time.process_time() - processor))
    return {
        name: (statistics.median(wall for wall, _ in times), statistics.median(processor for _, processor in times))
        for name, times in taken.items()
    }


def patch_pixels(design: Design) -> tuple[Pixels, Pixels]:
    """Rows and columns (patches, side, side) of square patches spread over the image circle."""
    camera = design.camera
    index = np.arange(PATCHES)
    reach = (camera.image_circle_radius_px or camera.height_px / 2.0) - PATCH_PX
    radius, angle = reach * np.sqrt((index + 0.5) / PATCHES), index * np.pi * (3.0 - np.sqrt(5.0))
    u0, v0 = camera.principal_point_px
    steps = np.arange(PATCH_PX) - PATCH_PX // 2
    rows = np.rint(v0 + radius * np.sin(angle)).astype(int)[:, None, None] + steps[:, None]
    columns = np.rint(u0 + radius * np.cos(angle)).astype(int)[:, None, None] + steps
    return tuple(np.broadcast_to(grid, (PATCHES, PATCH_PX, PATCH_PX)) for grid in (rows, columns))  # type: ignore[return-value]


def noise_lines(design: Design, world: World) -> list[str]:
    """What few rays leave of error, of the whole image and as the matcher's windows see it, without detector noise.

    The noise is what another turn of the places in the pupil (or another draw) changes; the deviation from 256 rays
    also holds what few rays have in common, since they stand in for a disc.
    """
    optics, (rows, columns) = Optics.of(design), patch_pixels(design)

    def ours(samples: int, turn: float) -> Image:
        values = []
        for row, column in zip(rows, columns, strict=True):
            block = PixelBlock(row.ravel(), column.ravel(), (IDENTITY,))
            ((_, _, (seen,)),) = render_block(optics, [world], block, samples, LOSSLESS, turn)
            values.append(seen.reshape(row.shape))
        return np.array(values, dtype=float)

    def plain(samples: int, seed: int) -> Image:
        values = []
        for patch, (row, column) in enumerate(zip(rows, columns, strict=True)):
            seeds = PATCHES * seed + patch
            seen = plain_pixels(design, world, row.ravel(), column.ravel(), samples, seeds, quadrants=1)
            values.append(seen[1.0, 1.0].reshape(row.shape))
        return np.array(values)

    def diffracted(patches: Image) -> Image:
        wavelength = RenderedLens().wavelength_nm
        assert wavelength is not None
        return np.array([diffract(patch.astype(np.float32), design.camera, wavelength) for patch in patches])

    def rms(error: Image) -> float:
        return float(np.sqrt(np.square(error[:, MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX]).mean()))

    reference = ours(REFERENCE_SAMPLES, 0.1)
    contestants: list[tuple[str, Image, Image]] = [
        *((f"{count**2:2d} rays", ours(count, 0.1), ours(count, 0.35)) for count in (2, 3, 4)),
        ("16 rays, plain method", plain(4, 0), plain(4, 1)),
    ]
    lines = []
    for name, image, again in contestants:
        noise = rms(image - again) / np.sqrt(2.0)
        sharp, soft = diffracted(image), diffracted(again)
        lines.append(
            f"    {name:22}  noise {noise:.4f}, after diffraction {rms(sharp - soft) / np.sqrt(2.0):.4f};"
            f" deviation from 256 rays {rms(image - reference):.4f}, {rms(sharp - diffracted(reference)):.4f}"
        )
    return lines


@click.command()
@click.option("--repeats", default=3, show_default=True, help="Runs of each, of which the median counts.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "rendering.txt", show_default=True)
def main(repeats: int, results: Path) -> None:
    """Measure, print, and write."""
    cores = len(os.sched_getaffinity(0))
    lines = [
        f"{platform.machine()}, {cores} cores, Python {platform.python_version()}, NumPy {np.__version__}",
        f"load at the start: {os.getloadavg()[0]:.2f}; medians of {repeats} runs in turns, 1600 x 1200 pixels",
    ]
    records = {record["configuration"]: record for record in json.loads(DESIGNS.read_text(encoding="utf-8"))}
    for configuration in CONFIGURATIONS:
        design = Design.model_validate(records[configuration])
        world = build_world("auto", design)
        lines += ["", f"{configuration}, scene {world.name}: seconds, wall (processor)"]
        runs: dict[str, Callable[[], object]] = {
            "pinhole, 4 rays": lambda design=design, world=world: render(design, world),
            "lens, 9 rays": lambda design=design, world=world: render(
                design, world, samples=3, aperture=True, lens=RenderedLens()
            ),
            "lens, 16 rays": lambda design=design, world=world: render(
                design, world, samples=4, aperture=True, lens=RenderedLens()
            ),
            "plain method, 16 rays": lambda design=design, world=world: plain_render(design, world, 4),
        }
        seconds = seconds_of(runs, repeats)
        lines += [f"    {name:22} {wall:6.2f} ({processor:.2f})" for name, (wall, processor) in seconds.items()]
        plain = seconds["plain method, 16 rays"]
        for name in ("lens, 9 rays", "lens, 16 rays"):
            wall, processor = seconds[name]
            verdict = "pass" if wall <= TARGET_SECONDS else "FAIL"
            faster = f"{plain[0] / wall:.2f} times as fast as the plain method ({plain[1] / processor:.2f} of one core)"
            lines.append(f"    {verdict}  {name}: {wall:.2f} s <= {TARGET_SECONDS:g} s, {faster}")
        lines += [
            "  noise of a pixel, of white 1 (shot noise of white in a full well of 10,000 electrons: 0.01)",
            *noise_lines(design, world),
        ]
    text = "\n".join(lines)
    click.echo(text)
    results.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
