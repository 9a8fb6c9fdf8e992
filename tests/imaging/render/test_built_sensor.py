"""Renders of a sensor that is not as designed, against what its departures were predicted to do."""

from __future__ import annotations

import numpy as np
import pytest

from designer.as_built.merits import Grid, errors_of, grid_of
from designer.as_built.parameters import values_of
from designer.as_built.projection import project, targets_of
from designer.departures import AsBuilt, CameraDeparture, MirrorDeparture
from designer.design import VIEW_NAMES, Design
from designer.imaging.render.dots import render_dots
from designer.imaging.render.raytracing import ground_truth, render
from designer.imaging.render.scenes.library import build_world
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels


def departed(design: Design, mirror: str) -> Design:
    """The design with one mirror decentred by 0.1 mm and tilted by 0.1 degrees, so that the two cannot cancel."""
    departure = MirrorDeparture(decentre_x_mm=0.1, tilt_x_deg=0.1)
    return design.model_copy(update={"as_built": AsBuilt(mirrors={mirror: departure})})


def centroids(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Centres (n, 2) of light in windows about places (n, 2), as (u, v)."""
    found = []
    for u, v in places:
        rows, columns = np.mgrid[round(v) - 5 : round(v) + 6, round(u) - 5 : round(u) + 6]
        light = image[rows, columns].astype(float)
        found.append([np.sum(light * columns), np.sum(light * rows)] / np.sum(light))
    return np.array(found)


def scattered(design: Design, azimuths: int = 18) -> Grid:
    """One point at each azimuth, so that no two dots overlap: elevations and distances take turns."""
    whole = grid_of(design, 3, 2, azimuths)
    kept = np.array([(azimuth % 6) * azimuths + azimuth for azimuth in range(azimuths)])
    points = whole.points_mm[kept]
    return Grid(
        points,
        np.full(azimuths, 1.0 / azimuths),
        whole.distance_mm[kept],
        whole.azimuth[kept],
        {view: targets_of(design, view, points) for view in VIEW_NAMES},
        {view: whole.slopes[view][kept] for view in VIEW_NAMES},
    )


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 8, 10])
def test_dots_show_the_epipolar_error_and_the_depth_bias_that_were_predicted(place):
    """Rendered dots are found by their light, and read by the tables of the design, which knows nothing of the tilt."""
    design = sharp_design(SHARP_NAMES[place])
    built = departed(design, design.views.lower.path[-1])
    grid = scattered(design)
    centre = np.array(design.camera.principal_point_px)
    seen, predicted = {}, {}
    for view in VIEW_NAMES:
        expected = project(design, view, grid.targets[view], values_of(built)[None]).pixels
        # One view at a time: where the other shows a dot, its light must not be taken for this one's.
        image = render_dots(built, grid.points_mm, views=[view])
        seen[view] = (centroids(image, expected[:, 0].T + centre) - centre).T[:, None]
        predicted[view] = expected
    (epipolar, bias), (foretold, bias_foretold) = (errors_of(design, grid, pixels) for pixels in (seen, predicted))
    for found, said in ((epipolar, foretold), (bias, bias_foretold)):
        size = np.sqrt(np.mean(said**2))
        assert np.sqrt(np.mean(found**2)) == pytest.approx(size, rel=0.05)
        assert np.sqrt(np.mean((found - said) ** 2)) < 0.1 * size


def test_a_sensor_built_as_designed_renders_as_the_design_does():
    design = with_coarse_pixels(sharp_design(SHARP_NAMES[0]), 8)
    world = build_world("auto", design, "rich", 0, None)
    plain = render(design, world, samples=1)
    built = design.model_copy(update={"as_built": AsBuilt()})
    assert np.mean(np.abs(render(built, world, samples=1) - plain) > 1e-3) < 1e-3
    through_lens = render(design, world, samples=1, aperture=True)
    assert np.mean(np.abs(render(built, world, samples=1, aperture=True) - through_lens) > 0.02) < 0.01


def test_the_truth_behind_pixels_is_where_the_built_sensor_projects_it():
    design = with_coarse_pixels(sharp_design(SHARP_NAMES[1]), 8)
    record = AsBuilt(
        mirrors={"direct": MirrorDeparture(tilt_x_deg=0.3, axial_shift_mm=0.2)},
        camera=CameraDeparture(
            shift_x_mm=0.3, tilt_y_deg=0.2, principal_distance_departure_mm=0.3, radial_distortion=-0.02
        ),
    )
    built = design.model_copy(update={"as_built": record})
    truth = ground_truth(built, build_world("auto", design, "rich", 0, None))
    centre = np.array(design.camera.principal_point_px)
    for number, view in ((1, "lower"), (2, "upper")):
        rows, columns = np.nonzero((truth.view == number) & np.isfinite(truth.distance_mm))
        assert len(rows) > 300
        chosen = np.arange(0, len(rows), 5)
        points = truth.point_mm[rows[chosen], columns[chosen]].astype(float)
        pixels = project(design, view, targets_of(design, view, points), values_of(built)[None]).pixels[:, 0]
        known = np.isfinite(pixels[0])
        assert known.mean() > 0.99
        off = pixels.T + centre - np.column_stack([columns, rows])[chosen]
        # Points are kept in single precision.
        assert np.abs(off[known]).max() < 1e-3
