"""The calibration scene and the noise measured on it."""

import numpy as np
import pytest

from designer.imaging.endtoend.noise import Noise, distance_bands
from designer.imaging.render.scenes.library import calibration_world
from designer.imaging.render.scenes.world import first_surfaces
from support.studied_designs import NAMES, studied_design

NOISE = Noise(
    table_px=np.array([[0.1, 0.2, 0.3], [0.3, 0.4, 0.5]]),
    log_distances=np.log([100.0, 400.0]),
    contrasts=np.array([2.0, 6.0]),
    factors=np.array([1.5, 0.5]),
)


@pytest.mark.parametrize("name", [NAMES[0], NAMES[1], NAMES[2]])
def test_the_calibration_walls_stand_at_all_working_distances_and_close_the_ring(name: str) -> None:
    design = studied_design(name)
    near, far = design.working_volume.distance_mm
    azimuth = np.linspace(-np.pi, np.pi, 20_001)
    middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2.0
    start = np.repeat([[0.0], [0.0], [middle]], azimuth.size, axis=1)
    # Straight ahead, and steeply up: no gap for a ray to escape through.
    for elevation in (0.0, 1.2):
        heading = np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)])
        heading = np.concatenate([heading, np.full((1, azimuth.size), np.sin(elevation))])
        points = first_surfaces(calibration_world(design), start, heading).points
        distance = np.hypot(points[0], points[1])
        assert 0.95 * near <= distance.min() <= 1.02 * near
        assert 0.95 * far <= distance.max() <= far * (1 + 1e-9)
    share, _ = np.histogram(distance, distance_bands(design))
    assert share.min() > 0.1 * azimuth.size


def test_noise_is_interpolated_in_the_logarithm_of_distance_and_in_contrast() -> None:
    distance = np.array([[100.0, 200.0, 400.0], [50.0, 900.0, np.nan]])
    contrast = np.array([[4.0, 4.0, 4.0], [2.0, 6.0, 4.0]])
    expected = [[0.1, 0.3, 0.5], [0.15, 0.2, np.nan]]
    np.testing.assert_allclose(NOISE.at(distance, contrast), expected, rtol=1e-12)


def test_noise_beyond_what_was_measured_is_that_of_the_nearest() -> None:
    ends = NOISE.at(np.array([[1.0, 1e9, 100.0]]), np.array([[0.0, 100.0, 0.0]]))
    np.testing.assert_allclose(ends, [[0.15, 0.2, 0.45]], rtol=1e-12)


def test_nothing_measured_is_not_a_number() -> None:
    nothing = Noise(np.empty((0, 3)), np.empty(0), np.ones(1), np.ones(1))
    assert np.isnan(nothing.at(np.full((2, 3), 100.0), np.ones((2, 3)))).all()
    assert all(np.isnan(value) for value in nothing.summary.values())
