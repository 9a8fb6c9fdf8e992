"""Finding the centre of each view: the law of the shifts, images of known centres, and a render of a built sensor."""

import numpy as np
import pytest

from designer.as_built.compensation import left_by_calibration
from designer.as_built.merits import grid_of, ideal_px
from designer.as_built.parameters import values_of
from designer.as_built.projection import project
from designer.departures import AsBuilt, MirrorDeparture
from designer.design import VIEW_NAMES
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.stereo.centring import find_centre
from designer.imaging.stereo.placement import ImagePlacement, ViewPlacements, centred
from designer.imaging.stereo.rig import build_rig, match_image, point_cloud
from designer.imaging.stereo.view_centring import find_centres, robust_least_squares, shift_factors
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import SIGNS, coarse_prototype, with_views
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels

TEXTURE = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
WALL = eccentric_wall(1700.0, 0.6)
# 4.2 px apart, as the published rig's.
APART = ViewPlacements(
    upper=ImagePlacement((402.6, 297.2), 0.3, 0.99), lower=ImagePlacement((400.0, 300.5), 0.303, 0.99)
)
START = ImagePlacement((399.5, 299.5), 0.3, 0.99)


def kept(design, raw, placement, columns=900, equalise=False):
    rig = build_rig(design, columns=columns, placement=placement, equalise=equalise)
    return match_image(rig, raw).fractions["kept"]


def test_least_squares_tell_centres_and_turn_from_noisy_shifts_within_their_errors():
    """Shifts by projection and back: what the true views see where the assumed ones look, a tenth of it nonsense."""
    truth = np.array([0.3, -0.2, -0.1, 0.25, 0.002])
    assumed = build_rig(coarse_prototype(), columns=900)
    u, v = assumed.images["upper"].placement.center_px
    true_placement = ViewPlacements(
        upper=ImagePlacement((u - truth[0], v - truth[1])),
        lower=ImagePlacement((u - truth[2], v - truth[3]), -truth[4]),
    )
    true = build_rig(coarse_prototype(), columns=900, placement=true_placement).images
    scores = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        columns, rows = rng.integers(0, 900, 4000), rng.integers(20, assumed.grid.rows, 4000)
        rows_lower = rows - rng.uniform(0.0, 20.0, 4000)
        azimuths = []
        for view, at in (("upper", rows), ("lower", rows_lower)):
            pixel = assumed.images[view].pixel_of(assumed.grid.slope(view, at), assumed.grid.azimuth(columns))
            azimuths.append(true[view].direction_of(*pixel)[1])
        shifts = np.remainder(azimuths[0] - azimuths[1] + np.pi, 2 * np.pi) - np.pi
        shifts += rng.normal(0.0, 0.002, 4000)
        shifts[:400] = rng.uniform(-0.05, 0.05, 400)
        factors = shift_factors(assumed, columns, rows, rows_lower)
        solution = robust_least_squares(factors, shifts, np.arange(4000))
        scores.append((solution.amounts - truth) / np.sqrt(np.diag(solution.covariance)))
        assert np.sqrt(solution.covariance[0, 0]) < 0.05
    assert 0.85 < np.sqrt(np.mean(np.square(scores))) < 1.15
    assert np.abs(np.mean(scores, axis=0)).max() < 0.6


@pytest.mark.parametrize("signs", SIGNS)
def test_two_centres_are_found_to_a_tenth_of_a_pixel(signs):
    design = with_views(coarse_prototype(), signs)
    found = find_centres(design, raw_image(design, WALL, TEXTURE, APART, noise=2.0), START)
    assert found.note == ""
    for view in VIEW_NAMES:
        error = found.standard_errors_px[view]
        centre, truth = (np.array(getattr(both, view).center_px) for both in (found.placement, APART))
        np.testing.assert_allclose(centre, truth, atol=0.1)
        assert np.hypot(*(centre - truth)) < 4.0 * error < 0.25
    assert found.placement.upper.rotation_rad == 0.3
    assert found.placement.lower.rotation_rad == pytest.approx(0.303, abs=4.0 * found.turn_error_rad)
    assert found.turn_error_rad < 2e-4


def test_one_centre_loses_most_points_and_two_lose_none():
    design = coarse_prototype()
    raw = raw_image(design, WALL, TEXTURE, APART, noise=2.0)
    whole = kept(design, raw_image(design, WALL, TEXTURE, START, noise=2.0), START)
    assert kept(design, raw, find_centre(design, raw, START)) < 0.5 * whole
    assert kept(design, raw, find_centres(design, raw, START).placement) > 0.95 * whole


def test_a_centre_common_to_both_views_is_found_as_such():
    design = coarse_prototype()
    raw = raw_image(design, WALL, TEXTURE, ImagePlacement((402.6, 297.2), 0.3, 0.99), noise=3.0)
    found = find_centres(design, raw, START)
    assert found.placement == find_centre(design, raw, START)
    assert "same centre" in found.note


def test_views_whose_radii_keep_their_ratio_do_not_tell_two_centres():
    """Both direct: the image radii rise together, and shifting one centre looks like shifting the other."""
    design = with_views(coarse_prototype(), (1.0, 1.0), ("direct", "direct"))
    raw = raw_image(design, WALL, TEXTURE, APART, noise=2.0)
    found = find_centres(design, raw, START)
    assert found.placement == find_centre(design, raw, START)
    assert found.standard_errors_px is None
    assert "does not determine" in found.note
    again = find_centres(design, raw, ViewPlacements(upper=APART.lower, lower=APART.upper))
    moves = [
        np.subtract(getattr(again.placement, view).center_px, start.center_px)
        for view, start in (("upper", APART.lower), ("lower", APART.upper))
    ]
    np.testing.assert_allclose(moves[0], moves[1], atol=1e-9)
    assert "both were moved alike" in again.note


def test_equal_placements_of_both_views_are_one_placement():
    raw = raw_image(coarse_prototype(), WALL, TEXTURE, START, noise=2.0)
    clouds = []
    for placement in (START, ViewPlacements(upper=START, lower=START)):
        rig = build_rig(coarse_prototype(), columns=900, placement=placement, equalise=True)
        clouds.append(point_cloud(rig, raw, match_image(rig, raw)))
    assert len(clouds[0].positions_mm) > 10_000
    np.testing.assert_array_equal(clouds[0].positions_mm, clouds[1].positions_mm)


@pytest.mark.slow
def test_the_views_of_a_rendered_built_sensor_are_brought_together():
    """A decentred mirror shifts its image not quite evenly: columns tell a centre near that of a full calibration."""
    design = with_coarse_pixels(sharp_design(SHARP_NAMES[0]), 2)
    departure = MirrorDeparture(decentre_x_mm=0.38, decentre_y_mm=-0.228)
    built = design.model_copy(update={"as_built": AsBuilt(mirrors={"direct": departure})})
    grid = grid_of(design)
    ideal = {view: ideal_px(design, grid.targets[view]) for view in VIEW_NAMES}
    off = {
        view: project(design, view, grid.targets[view], values_of(built)[None]).pixels - ideal[view][:, None]
        for view in VIEW_NAMES
    }
    _, calibrated = left_by_calibration(design, grid, off, "views")
    apart = np.hypot(*(calibrated["upper"] - calibrated["lower"])[:2, 0])
    assert apart == pytest.approx(4.2, abs=0.1)
    # What the azimuths alone tell of two centres and a turn.
    columns, shifts = [], 0.0
    for view, sign in (("upper", 1.0), ("lower", -1.0)):
        (x, y), (right, down) = ideal[view], off[view][:, 0]
        inverse = sign / (x**2 + y**2)
        shifts = shifts + inverse * (x * down - y * right)
        columns += [-inverse * y, inverse * x]
    root = np.sqrt(grid.weights)[:, None]
    told = np.linalg.lstsq(np.column_stack([*columns, -np.ones(len(root))]) * root, shifts * root[:, 0], rcond=None)[0]
    world = build_world("auto", design, "rich", 0, None)
    raw, plain = (
        np.asarray(expose(render(each, world, samples=2, seed=0), Detector(10_000.0, 8.0), seed=0))
        for each in (built, design)
    )
    start = centred(design.camera)
    found = find_centres(design, raw, start)
    for place, view in enumerate(VIEW_NAMES):
        centre = np.array(getattr(found.placement, view).center_px) - start.center_px
        np.testing.assert_allclose(centre, told[2 * place : 2 * place + 2], atol=0.1)
        assert np.hypot(*(centre - calibrated[view][:2, 0])) < 0.2 * apart
    # As the command does by default.
    whole, of_two, of_one = (
        kept(design, image, placement, columns=1800, equalise=True)
        for image, placement in ((plain, start), (raw, found.placement), (raw, find_centre(design, raw, start)))
    )
    assert of_two > 0.95 * whole
    assert of_one < 0.5 * whole
