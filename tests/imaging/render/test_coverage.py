"""Scenes fill every band of the working volume, over the whole range of elevation, and the measure of that is right."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.design import Design, read_design
from designer.imaging.endtoend import noise
from designer.imaging.render.scenes import layout
from designer.imaging.render.scenes.library import SCENE_NAMES, build_world, calibration_world, make_world, round_wall
from designer.imaging.render.scenes.shapes import Rectangle
from support import DATA
from support.scene_coverage import band_coverage

CONFIGS = Path(__file__).parents[3] / "configs"
PROTOTYPE = read_design(DATA / "folded_hypl_hy.json")


def _working_in(elevation_deg: tuple[float, float], distance_mm: tuple[float, float]) -> Design:
    volume = PROTOTYPE.working_volume.model_copy(update={"elevation_deg": elevation_deg, "distance_mm": distance_mm})
    return PROTOTYPE.model_copy(update={"working_volume": volume})


def test_the_scenes_bands_are_the_checks() -> None:
    assert layout.BANDS == noise.BANDS


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda path: path.stem)
def test_each_shipped_volume_is_filled_in_every_band_at_every_elevation(path: Path) -> None:
    asked = tomllib.loads(path.read_text(encoding="utf-8"))["working_volume"]
    design = _working_in(tuple(asked["elevation_deg"]), tuple(asked["distance_mm"]))
    coverage = band_coverage(build_world("auto", design), design)
    assert coverage.seen_by_both.min() >= 0.15
    assert np.all(coverage.seen_by_both <= coverage.shares)
    # Each row of the volume has a place in each band, not only its middle.
    assert coverage.by_elevation.min() >= 0.03
    np.testing.assert_allclose(coverage.limits_mm, noise.distance_bands(design))


@settings(deadline=None, max_examples=25)
@given(st.floats(-60, 45), st.floats(10, 60), st.floats(80, 4000), st.floats(1.5, 10))
def test_any_volume_is_filled_in_every_band(low: float, spread: float, near: float, ratio: float) -> None:
    design = _working_in((low, min(low + spread, 60.0)), (near, near * ratio))
    coverage = band_coverage(build_world("auto", design), design, elevations=24, azimuths=360)
    assert coverage.seen_by_both.min() >= 0.05
    assert coverage.by_elevation.min() > 0.0


@pytest.mark.parametrize("name", [name for name in SCENE_NAMES if name != "cylinder"])
def test_a_scene_chosen_by_hand_has_things_in_every_band_too(name: str) -> None:
    design = _working_in((-16.0, 16.0), (1000.0, 5000.0))
    assert band_coverage(build_world(name, design), design).shares.min() > 0.05


def test_the_calibration_walls_spread_as_their_formula_says() -> None:
    design = _working_in((-16.0, 16.0), (1000.0, 5000.0))
    coverage = band_coverage(calibration_world(design), design)
    # log distance goes as the cosine of azimuth: a third of the circle in either outer half of it.
    np.testing.assert_allclose(coverage.shares, [1 / 3, 1 / 6, 1 / 6, 1 / 3], atol=0.02)
    np.testing.assert_array_equal(coverage.shares, coverage.seen_by_both)


def test_what_hides_from_one_view_is_not_seen_by_both() -> None:
    design = _working_in((-16.0, 16.0), (1000.0, 5000.0))
    middle = design.views.middle_mm
    wall = round_wall(2000.0, middle, 5000.0)
    # A level sheet above the middle: the view from above looks through it at what the middle sees below it.
    sheet = Rectangle((600.0, 0.0, middle + 20.0), (200.0, 0.0, 0.0), (0.0, 200.0, 0.0))
    free, hidden = (band_coverage(make_world("wall", shapes, 5000.0), design) for shapes in ([wall], [wall, sheet]))
    np.testing.assert_array_equal(free.seen_by_both, [0.0, 1.0, 0.0, 0.0])
    assert 0.0 < hidden.seen_by_both[1] < hidden.shares[1] < 1.0
    assert hidden.shares[[0, 2, 3]].max() == 0.0
