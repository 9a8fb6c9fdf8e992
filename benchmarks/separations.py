"""Do separations claim too much room? Held clearances of random designs against the distance of the shapes themselves.

A pair of light and solid, or of two solids, is held apart along one straight line; where either is hollow or bent, that
is stricter than its distance. Each pair that holds a feasible design is measured: both outlines are drawn as polygons
in the meridional plane, and their distance is taken from point to edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from benchmarks.problems import RESULTS
from designer.configurations import enumerate_configurations
from designer.optics.clearance import Pairs, pair_up
from designer.optics.conic import Surface
from designer.optics.layout import LegEnd
from designer.optimise.multistart import Candidate
from designer.optimise.program import forget_programs
from designer.optimise.search import search
from support.random_requirements import random_requirement

Outline = NDArray[np.float64]
HELD_MM = 1e-3
TOO_STRICT_MM = 0.05
POINTS = 400
Found = tuple[str, str, str, float]


@click.command()
@click.option("--requirements", default=200, show_default=True, help="How many random requirements.")
@click.option("--first", default=0, show_default=True, help="Seed of the first of them.")
@click.option("--processes", default=2, show_default=True)
def main(requirements: int, first: int, processes: int) -> None:
    seeds = range(first, first + requirements)
    designs, held = 0, []
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for place, (count, found) in enumerate(pool.map(_of_requirement, seeds), 1):
            designs += count
            held += found
            text = _report(place, first, designs, held)
            (RESULTS / "separations.txt").write_text(text, encoding="utf-8")
    click.echo(text, nl=False)


def _report(requirements: int, first: int, designs: int, held: list[Found]) -> str:
    strict = [each for each in held if each[3] > TOO_STRICT_MM]
    spoilt = {each[:2] for each in strict}
    lines = [
        f"{requirements} random requirements from seed {first}: {designs} feasible designs, "
        f"{len(held)} separations that hold them",
        f"stricter than the distance by more than {TOO_STRICT_MM} mm: {len(strict)}, in {len(spoilt)} designs",
    ]
    if held:
        excess = np.array([each[3] for each in held])
        lines.append(f"excess: median {np.median(excess):.2g} mm, 95 % {np.percentile(excess, 95):.2g} mm")
    for pair, count in Counter(each[2] for each in strict).most_common():
        worst = max(each[3] for each in strict if each[2] == pair)
        lines.append(f"  {count:4d}  {pair}: up to {worst:.2f} mm")
    lines += [f"  {each[0]} {each[1]}: {each[2]} {each[3]:.2f} mm" for each in sorted(strict, key=lambda e: -e[3])[:20]]
    return "\n".join(lines) + "\n"


def _of_requirement(seed: int) -> tuple[int, list[Found]]:
    """The number of feasible designs of both stages, and what each held pair claims beyond the distance."""
    requirement = random_requirement(np.random.default_rng(seed))
    count, held = 0, []
    for configuration in enumerate_configurations():
        found = search(requirement, configuration)
        designs = {"first": found.first, "best": found.best}
        for stage, design in designs.items():
            if design is not None:
                count += 1
                held += [(f"seed {seed}", f"{configuration.name} {stage}", *each) for each in _held(design)]
    forget_programs()
    return count, held


def _held(design: Candidate) -> Iterator[tuple[str, float]]:
    layout = design.layout
    pairs = pair_up(layout)
    claims = design.evaluation.clearances[:, 0]
    clearance = design.problem.specification.asked.manufacture.clearance_mm
    for row, name in enumerate(pairs.names):
        if abs(claims[row] - clearance) < HELD_MM:
            one, others = _outlines(pairs, row)
            yield name, min(_distance(one, other) for other in others) - float(claims[row])


def _outlines(pairs: Pairs, row: int) -> tuple[Outline, list[Outline]]:
    """One of a pair, and the other in as many pieces as the pairs have of it."""
    if row < len(pairs.leg_solid):
        leg, solid = pairs.leg_solid[row]
        return _leg(pairs.legs[leg]), [_solid(pairs.solids[solid])]
    part, other = pairs.solid_solid[row - len(pairs.leg_solid)]
    pieces = [
        _solid(pairs.solids[first])
        for first, second in pairs.solid_solid
        if second == other and pairs.solids[first].name == pairs.solids[part].name
    ]
    return _solid(pairs.solids[other]), pieces


def _solid(solid: Any) -> Outline:
    inner, outer = (solid.side * _number(radius) for radius in (solid.inner_radius, solid.outer_radius))
    face = _curve(solid.surface, (inner, outer))
    return np.concatenate([face, (face + np.array([0.0, _number(solid.depth)]))[::-1]])


def _leg(leg: Any) -> Outline:
    return np.concatenate([_end(leg.start), _end(leg.end)[::-1]])


def _end(end: LegEnd) -> Outline:
    points = np.array([[_number(across), _number(along)] for across, along in end.points])
    if end.surface is None:
        return points
    return _curve(end.surface, (points[0, 0], points[1, 0]))


def _curve(surface: Surface, radii: tuple[float, float]) -> Outline:
    across = np.linspace(*radii, POINTS)
    vertex, curvature, conic = (
        _number(value) for value in (surface.vertex_height, surface.curvature, surface.conic_term)
    )
    root = np.sqrt(np.maximum(1.0 - conic * across**2, 0.0))
    return np.column_stack([across, vertex + curvature * across**2 / (1.0 + root)])


def _number(value: object) -> float:
    return float(np.ravel(np.asarray(value, dtype=float))[0])


def _distance(one: Outline, other: Outline) -> float:
    """Least distance of two closed polygons that do not meet."""
    return min(_from_points(one, other), _from_points(other, one))


def _from_points(points: Outline, polygon: Outline) -> float:
    start, edge = polygon, np.roll(polygon, -1, axis=0) - polygon
    length = np.maximum((edge**2).sum(axis=1), 1e-30)
    off = points[:, None, :] - start[None]
    share = np.clip((off * edge).sum(axis=2) / length, 0.0, 1.0)
    return float(np.sqrt(((off - share[..., None] * edge) ** 2).sum(axis=2).min()))


if __name__ == "__main__":
    main()
