"""Brightness evened out by closed form, against images whose light was traced through the whole pupil."""

import numpy as np
import pytest

from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.lens import RenderedLens
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.stereo.illumination import LARGEST_FACTOR, brightened, brightening
from designer.imaging.stereo.panorama import panorama_grid, view_images
from designer.imaging.stereo.rig import build_rig, panoramas
from support.imaging_designs import coarse_prototype

QUIET = Detector(read_noise_electrons=0.0, full_well_electrons=1e9)
REFLECTIVITY = 0.8
COLUMNS = 900


def rows_of(mirror_reflectivity):
    """Mean brightness of the rows of both panoramas of a plain round wall, where both views see all of it."""
    design = coarse_prototype()
    world = build_world("cylinder", design, "poor")
    radiance = render(design, world, samples=2, aperture=True, lens=RenderedLens(mirror_reflectivity=REFLECTIVITY))
    raw = np.asarray(expose(radiance, QUIET, seed=0), dtype=np.uint8)
    rig = build_rig(design, columns=COLUMNS, mirror_reflectivity=mirror_reflectivity)
    found = {}
    for view, panorama in panoramas(rig, raw).items():
        elevation = np.degrees(np.arctan(rig.grid.slope(view, np.arange(rig.grid.rows))))
        low, high = getattr(design.views, view).elevation_deg
        # Edges of zones are in half-shadow.
        inside = (elevation > low + 4.0) & (elevation < high - 4.0)
        found[view] = panorama.mean(axis=1)[inside]
    return found


def test_a_plain_wall_is_equally_bright_in_both_views_at_every_elevation():
    recorded, evened = rows_of(None), rows_of(REFLECTIVITY)
    every = np.concatenate(list(evened.values()))
    assert np.ptp(every) < 0.03 * every.mean()
    assert recorded["lower"].mean() < 0.85 * recorded["upper"].mean()


def test_nothing_grows_darker_and_the_brightest_row_stays():
    design = coarse_prototype()
    grid = panorama_grid(design, columns=COLUMNS)
    factors = brightening(design, grid, view_images(design), REFLECTIVITY)
    every = np.concatenate(list(factors.values()))
    assert every.min() == pytest.approx(1.0, rel=1e-12)
    assert every.max() <= LARGEST_FACTOR


@pytest.mark.parametrize("channels", [(), (3,)])
def test_rows_are_multiplied_in_grey_and_in_colour(channels):
    lines = np.random.default_rng(1).integers(0, 256, (50, 7, *channels)).astype(np.uint8)
    factors = np.linspace(1.0, 3.0, 7)
    expected = np.rint(lines * factors.reshape(1, 7, *(1,) * len(channels))).clip(0, 255)
    assert np.abs(brightened(lines, factors).astype(float) - expected).max() <= 1.0
