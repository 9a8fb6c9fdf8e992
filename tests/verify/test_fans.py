"""Fans of rays against single rims: distances from points all along the rays, obstructions by containment."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import Design
from designer.trace.bundles import pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from designer.verify.fans import FanClearance, fan_clearance
from designer.verify.solids import Rims
from support.closed_forms import direct_ellipsoid_pair, folded_hypl_hy, half_tangent, paraboloid_pair
from support.studied_designs import studied_design

RAYS, RIMS = 25, 50
# No rim lies farther out than this much of the last leg.
WORLD_MM = 400.0
STEP_MM = 0.2


def pair_with_a_focus_between() -> Design:
    """The light of its lower view crosses the axis between the secondary and the primary."""
    return studied_design("pipe_inspection:folded-PlEl-El-upper_inner")


DESIGNS = [folded_hypl_hy, direct_ellipsoid_pair, paraboloid_pair, pair_with_a_focus_between]


def rays_of(design: Design, name: str) -> tuple[tuple[int, ...], np.ndarray, np.ndarray]:
    """A view's path, rising pinhole angles over its elevations, and the rays' corners (rays, corners, 2) as (x, z)."""
    view, instrument = design.views.by_name[name], build_instrument(design)
    path = instrument.path(view.path)
    ends = [2.0 * np.arctan(abs(view.gain) * half_tangent(phi, view.sense)) for phi in view.elevation_deg]
    psi = np.linspace(min(ends), max(ends), RAYS)
    trace = trace_sequential(instrument, path, pinhole_directions(psi), apertures=False)
    corners = [np.zeros((RAYS, 3)), *trace.hits, trace.point + WORLD_MM * trace.direction]
    return path, psi, np.stack(corners, axis=1)[:, :, [0, 2]]


def clearance(design: Design, name: str, psi: np.ndarray, rim: tuple[float, float], owner: int) -> FanClearance:
    instrument = build_instrument(design)
    rims = Rims(np.array([rim]), np.array([owner]), ("rim",))
    return fan_clearance(instrument, instrument.path(design.views.by_name[name].path), psi, rims)


def holds(polygon: np.ndarray, point: np.ndarray) -> bool:
    """Whether a polygon, which may cross itself, goes around a point: how often a line from it to the right is met."""
    met = 0
    for (x_1, z_1), (x_2, z_2) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if (z_1 > point[1]) != (z_2 > point[1]):
            met += x_1 + (point[1] - z_1) / (z_2 - z_1) * (x_2 - x_1) > point[0]
    return met % 2 == 1


def nearest_on(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point from all the points of some segments, closely sampled."""
    share = np.linspace(0.0, 1.0, int(np.linalg.norm(end - start, axis=1).max() / STEP_MM) + 2)[:, None, None]
    return float(np.linalg.norm(start + share * (end - start) - point, axis=-1).min())


@pytest.mark.parametrize("name", ["upper", "lower"])
@pytest.mark.parametrize("build", DESIGNS, ids=lambda f: f.__name__)
def test_distances_and_obstructions_are_those_of_sampled_rays(build, name):
    design, random = build(), np.random.default_rng(6)
    path, psi, corners = rays_of(design, name)
    inside, outside = 0, 0
    for _ in range(RIMS):
        rim = (random.uniform(0.5, 60.0), random.uniform(-20.0, corners[:, :, 1].max()))
        owner = int(random.integers(-1, len(design.mirrors)))
        distances, around = {}, set()
        is_clear = True
        for leg in range(len(path) + 1):
            start, end = corners[:, leg], corners[:, leg + 1]
            if leg == 0 and owner < 0:
                continue
            for side in (1.0, -1.0):
                point = np.array([side * rim[0], rim[1]])
                # The rims beside which the light starts or ends: of that mirror, where the light meets it.
                met = [
                    corners[0, place + 1, 0]
                    for place in (leg - 1, leg)
                    if place in range(len(path)) and path[place] == owner
                ]
                if any(side * x > 0.0 for x in met):
                    continue
                distances[leg] = min(distances.get(leg, np.inf), nearest_on(start, end, point))
                # At either end of a leg faces are curved and quadrilaterals are not.
                is_clear &= (
                    min(np.linalg.norm(start - point, axis=1).min(), np.linalg.norm(end - point, axis=1).min()) > 1.5
                )
                if any(holds(np.array([start[i], start[i + 1], end[i + 1], end[i]]), point) for i in range(RAYS - 1)):
                    around.add((leg, "rim"))
        found = clearance(design, name, psi, rim, owner)
        if not distances:
            assert found.distance_mm == np.inf
            continue
        least = min(distances.values())
        assert found.distance_mm == pytest.approx(least, abs=STEP_MM / 2)
        assert distances[found.leg] == pytest.approx(least, abs=STEP_MM)
        if is_clear:
            assert set(found.obstructions) == around
            inside, outside = inside + bool(around), outside + (not around)
    assert min(inside, outside) > 0
