"""Walls rendered through a sensor with departures, matched by the tables of the design: the bias that was predicted."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.merits import Grid, errors_of
from designer.as_built.parameters import values_of
from designer.as_built.projection import project, targets_of
from designer.departures import AsBuilt, MirrorDeparture
from designer.design import VIEW_NAMES, Design
from designer.imaging.endtoend.check import CheckOptions, check_design
from designer.imaging.endtoend.noise import record, true_points
from designer.imaging.render.detector import Detector
from designer.imaging.render.scenes.library import calibration_world
from designer.imaging.stereo.matching import ACCURATE_OPTIONS
from designer.imaging.stereo.rig import build_rig, match_image
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels


def departed(design: Design, mirror: str) -> Design:
    departure = MirrorDeparture(decentre_x_mm=0.1, tilt_x_deg=0.1)
    return design.model_copy(update={"as_built": AsBuilt(mirrors={mirror: departure})})


@pytest.mark.slow
@pytest.mark.parametrize(("place", "mirror", "coarser"), [(2, "primary", 2), (10, "lower", 1)])
def test_matched_walls_are_as_far_off_as_predicted(place: int, mirror: str, coarser: int) -> None:
    design = with_coarse_pixels(sharp_design(SHARP_NAMES[place]), coarser)
    built = departed(design, mirror)
    near, far = design.working_volume.distance_mm
    rig = build_rig(design, distances_mm=(0.5 * near, 4.0 * far))
    world = calibration_world(design, seed=3)
    (raw,) = record(built, (world,), Detector(), 1, (5,), None)
    (points,) = true_points(rig, built, (world,))
    distance = np.hypot(points[0], points[1])
    error = match_image(rig, raw, ACCURATE_OPTIONS).distances_mm / distance - 1.0
    chosen = np.flatnonzero(np.isfinite(error) & (distance > near) & (distance < far))[::3]
    assert len(chosen) > 1000
    seen = points.reshape(3, -1)[:, chosen].T
    level = np.hypot(seen[:, 0], seen[:, 1])
    grid = Grid(
        seen,
        np.full(len(seen), 1.0 / len(seen)),
        level,
        np.arctan2(seen[:, 1], seen[:, 0]),
        {view: targets_of(design, view, seen) for view in VIEW_NAMES},
        {view: (seen[:, 2] - record_.viewpoint_mm) / level for view, record_ in design.views.by_name.items()},
    )
    pixels = {view: project(design, view, grid.targets[view], values_of(built)[None]).pixels for view in VIEW_NAMES}
    _, (predicted,) = errors_of(design, grid, pixels)
    found = error.ravel()[chosen]
    size = np.sqrt(np.mean(predicted**2))
    # The median, because a few matches are wrong altogether.
    large = np.abs(predicted) > size / 2.0
    assert large.sum() > 1000
    assert np.median(found[large] / predicted[large]) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_check_of_a_departed_sensor_predicts_the_noise_of_the_design_and_finds_more() -> None:
    design = with_coarse_pixels(sharp_design(SHARP_NAMES[2]), 4)
    options = CheckOptions(samples=1)
    plain, found = (check_design(system, options) for system in (design, departed(design, "primary")))
    assert found.noise.summary == plain.noise.summary
    assert max(abs(band.bias) for band in found.bands) > 2.0 * max(abs(band.bias) for band in plain.bands) or max(
        band.error / band.predicted for band in found.bands
    ) > 2.0 * max(band.error / band.predicted for band in plain.bands)
