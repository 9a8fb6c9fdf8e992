"""Speed of the tracer beside optiland's: ``python -m benchmarks.tracing``.

Both trace the same rays through the same two mirrors, and only rays that meet both mirrors inside their apertures in
both tracers. Positions are compared before anything is timed. Both do the same work: they intersect given surfaces in
a given order, test apertures, reflect, and keep the point on each mirror. Ours are NumPy's arrays and the compiled
loops; compilation, ours and theirs, is not timed. Written to ``results/tracing.txt``.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from benchmarks.problems import RESULTS, ROOT
from designer.design import Design, Mirror
from designer.trace.compiled import trace_many
from designer.trace.first_hit import compare_with_path, trace_first_hits
from designer.trace.instrument import Instrument, build_instrument
from designer.trace.sequential import SequentialTrace, trace_sequential

DESIGNS = ROOT / "tests" / "data" / "studied_designs.json"
# Plane and convex hyperboloid (the paper's prototype), two convex hyperboloids, concave and convex ellipsoid.
CONFIGURATIONS = ("folded-HyPl-Hy-upper_outer", "folded-HyHy-Hy-upper_outer", "folded-ElEl-Hy-upper_inner")
TARGET_RATIO, TOLERANCE_MM = 3.0, 1e-9
WAVELENGTH_UM = 0.55
# The full tracer is some thirty times slower than the sequential one: it gets no more rays than this.
MOST_FULL_RAYS = 100_000

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Prescription:
    """The folded view of a design, for both tracers; optiland's system with and without apertures."""

    configuration: str
    instrument: Instrument
    path: tuple[int, ...]
    theirs: dict[bool, Any]


def optiland_system(mirrors: list[Mirror], apertures: bool) -> Any:
    """Optiland's system of these mirrors, in the order in which light from the pinhole meets them.

    Vertices are given in world coordinates, so no thickness has to change its sign after a reflection; a positive
    radius has its centre above the vertex, as ours. Surface 0 is the object, which the traces here skip.
    """
    from optiland.optic import Optic
    from optiland.physical_apertures import RadialAperture

    optic = Optic()
    optic.surfaces.add(index=0, z=0.0)
    for index, mirror in enumerate(mirrors, start=1):
        optic.surfaces.add(
            index=index,
            z=mirror.vertex_mm,
            radius=np.inf if mirror.radius_mm is None else mirror.radius_mm,
            conic=mirror.conic,
            material="mirror",
            is_stop=index == 1,
            aperture=RadialAperture(mirror.outer_radius_mm, mirror.inner_radius_mm) if apertures else None,
        )
    return optic


def optiland_rays(directions: Array) -> Any:
    """Optiland's rays from the pinhole with directions (n, 3)."""
    from optiland.rays import RealRays

    zeros, ones = np.zeros(len(directions)), np.ones(len(directions))
    along = (np.ascontiguousarray(column) for column in directions.T)
    return RealRays(zeros, zeros, zeros, *along, ones, WAVELENGTH_UM * ones)


def optiland_hits(system: Any) -> list[Array]:
    """Points (n, 3) of the last trace on each mirror, world frame, mm."""
    return [np.stack([surface.x, surface.y, surface.z], axis=-1) for surface in system.surfaces.surfaces[1:]]


def prescription_of(design: Design) -> Prescription:
    instrument = build_instrument(design)
    names = design.views.lower.path
    by_name = {mirror.name: mirror for mirror in design.mirrors}
    mirrors = [by_name[name] for name in names]
    theirs = {apertures: optiland_system(mirrors, apertures) for apertures in (True, False)}
    return Prescription(design.configuration, instrument, tuple(instrument.path(names)), theirs)


def common_rays(design: Design, prescription: Prescription, number: int) -> tuple[Array, int, int]:
    """Directions (number, 3) of pinhole rays that meet both mirrors in both tracers.

    Drawn evenly over the image circle. Also how many were drawn, and how many met both mirrors in one tracer only.
    """
    camera = design.camera
    random = np.random.default_rng(0)
    kept: list[Array] = []
    drawn = disputed = 0
    while sum(map(len, kept)) < number:
        radius = camera.image_radius_mm * np.sqrt(random.uniform(size=number))
        azimuth = random.uniform(-np.pi, np.pi, number)
        image = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.full(number, camera.focal_length_mm)])
        directions = (image / np.linalg.norm(image, axis=0)).T
        ours = trace_sequential(prescription.instrument, prescription.path, directions).missed < 0
        rays = optiland_rays(directions)
        prescription.theirs[True].surfaces.trace(rays, skip=1)
        theirs = np.isfinite(rays.x) & (rays.i > 0.0)
        kept.append(directions[ours & theirs])
        drawn += number
        disputed += int((ours != theirs).sum())
    return np.concatenate(kept)[:number], drawn, disputed


def largest_differences(prescription: Prescription, directions: Array) -> tuple[float, float]:
    """Largest distance in mm between the tracers' points on a mirror, and largest difference of exit directions."""
    system, rays = prescription.theirs[True], optiland_rays(directions)
    system.surfaces.trace(rays, skip=1)
    exits = np.stack([rays.L, rays.M, rays.N], axis=-1)
    both = [trace(prescription.instrument, prescription.path, directions) for trace in (trace_sequential, trace_many)]
    points = max(
        float(np.linalg.norm(hit - their_hit, axis=1).max())
        for ours in both
        for hit, their_hit in zip(ours.hits, optiland_hits(system), strict=True)
    )
    return points, max(float(np.abs(ours.direction - exits).max()) for ours in both)


def processor_seconds(runs: dict[str, Callable[[], Callable[[], object]]], repeats: int) -> dict[str, float]:
    """Median processor time of each, after one run that does not count; preparing is not timed.

    They take turns, so that load falls on all alike, and another begins each round: a run that gives much memory back
    to the system makes the next one pay for it.
    """
    taken: dict[str, list[float]] = {name: [] for name in runs}
    names = list(runs)
    for repeat in range(repeats + 1):
        first = repeat % len(names)
        for name in names[first:] + names[:first]:
            run = runs[name]()
            started = time.process_time()
            run()
            if repeat:
                taken[name].append(time.process_time() - started)
    return {name: statistics.median(seconds) for name, seconds in taken.items()}


def measure(prescription: Prescription, directions: Array, repeats: int) -> dict[str, float]:
    """Median processor time in seconds of every contestant on the same rays."""
    instrument, path = prescription.instrument, prescription.path

    def ours(apertures: bool) -> Callable[[], SequentialTrace]:
        return lambda: trace_sequential(instrument, path, directions, apertures=apertures)

    def compiled(apertures: bool) -> Callable[[], SequentialTrace]:
        return lambda: trace_many(instrument, path, directions, apertures=apertures)

    def theirs(apertures: bool) -> Callable[[], object]:
        rays = optiland_rays(directions)
        return lambda: prescription.theirs[apertures].surfaces.trace(rays, skip=1)

    runs: dict[str, Callable[[], Callable[[], object]]] = {
        "designer": lambda: ours(True),
        "designer, compiled": lambda: compiled(True),
        "optiland": lambda: theirs(True),
        "designer, no apertures": lambda: ours(False),
        "designer, compiled, no apertures": lambda: compiled(False),
        "optiland, no apertures": lambda: theirs(False),
    }
    seconds = processor_seconds(runs, repeats)
    if len(directions) <= MOST_FULL_RAYS:
        full = {
            "designer, obstruction too": lambda: (
                lambda: compare_with_path(trace_first_hits(instrument, directions), path)
            )
        }
        seconds |= processor_seconds(full, repeats)
    return seconds


def evaluation(design: Design, numbers: tuple[int, ...], repeats: int) -> list[str]:
    """What one design's folded view gives, as lines."""
    prescription = prescription_of(design)
    mirrors = [prescription.instrument.mirrors[face] for face in prescription.path]
    kinds = {mirror.name: mirror.kind for mirror in design.mirrors}
    lines = [f"{design.configuration}: " + ", ".join(f"{name} {kinds[name]}" for name in mirrors)]
    for number in numbers:
        directions, drawn, disputed = common_rays(design, prescription, number)
        points, exits = largest_differences(prescription, directions)
        passed = "pass" if points <= TOLERANCE_MM else "FAIL"
        lines.append(f"  {number} rays that meet both mirrors; of {drawn} drawn, {disputed} do so in one tracer only")
        lines.append(f"    {passed}  positions differ by at most {points:.1e} mm <= {TOLERANCE_MM:g}")
        lines.append(f"          exit directions differ by at most {exits:.1e}")
        seconds = measure(prescription, directions, repeats)
        lines += [f"    {name:33s} {number / spent / 1e6:6.2f} million rays/s" for name, spent in seconds.items()]
        for suffix in ("", ", no apertures"):
            numpy, loops = (
                seconds[f"optiland{suffix}"] / seconds[f"designer{how}{suffix}"] for how in ("", ", compiled")
            )
            passed = "pass" if loops >= TARGET_RATIO else "FAIL"
            lines.append(
                f"    {passed}  {loops:.2f} times optiland's rate{suffix} >= {TARGET_RATIO:g} (NumPy {numpy:.2f})"
            )
    return lines


@click.command()
@click.option("--rays", "numbers", multiple=True, type=click.IntRange(1), default=(100_000, 1_000_000))
@click.option("--repeats", type=click.IntRange(1), default=8, show_default=True)
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS / "tracing.txt", show_default=True)
def main(numbers: tuple[int, ...], repeats: int, results: Path) -> None:
    """Compare, print it, and write it down."""
    try:
        optiland = version("optiland")
    except PackageNotFoundError:
        raise click.UsageError(
            "optiland is not installed: .venv/bin/uv pip install --python .venv/bin/python --group opponents"
        ) from None
    # Numba compiles optiland's intersections at their first call and remarks on its own intermediate code.
    warnings.simplefilter("ignore")
    lines = [
        f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, NumPy {np.__version__}, "
        f"optiland {optiland}, Numba {version('numba')}",
        f"load at the start: {os.getloadavg()[0]:.2f}; medians of processor time over {repeats} runs in turns",
    ]
    designs = {record["configuration"]: record for record in json.loads(DESIGNS.read_text(encoding="utf-8"))}
    for configuration in CONFIGURATIONS:
        lines += ["", *evaluation(Design.model_validate(designs[configuration]), numbers, repeats)]
    click.echo("\n".join(lines))
    results.parent.mkdir(parents=True, exist_ok=True)
    results.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
