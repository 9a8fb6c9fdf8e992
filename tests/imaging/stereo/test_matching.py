"""Matching: the search against brute force, disparities against a known room, and every reason for dropping a pixel."""

import numpy as np
import pytest

from designer import api
from designer.files import InputError
from designer.imaging.stereo.costs import UNSEARCHED, equiangular_fit, least_sums, sums_beside
from designer.imaging.stereo.matching import MatchingOptions, MatchOutcome, search_range
from designer.imaging.stereo.panorama import panorama_grid
from designer.imaging.stereo.placement import ImagePlacement
from designer.imaging.stereo.reconstruction import disparity_from_distance, distance_from_disparity
from designer.imaging.stereo.rig import build_rig, match_image
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import SIGNS, coarse_prototype, with_views

COLUMNS = 900


def room(mean_mm=1700.0, swing=0.6):
    return eccentric_wall(mean_mm, swing)


def truth_of(rig, wall):
    grid = rig.grid
    distance = wall(grid.azimuth(np.arange(grid.columns)))[:, None]
    return disparity_from_distance(grid, np.arange(grid.rows)[None], distance, rig.design.baseline_mm)


def sums_by_hand(upper, lower, disparity, half):
    """The windowed sum at one disparity, pixel by pixel; the window repeats the outermost overlapping rows."""
    columns, rows = upper.shape[0] - 2 * half, upper.shape[1]
    first, last = max(disparity, 0), min(rows, rows + disparity) - 1
    sums = np.full((columns, rows), UNSEARCHED)
    for row in range(first, last + 1):
        window = np.clip(np.arange(row - half, row + half + 1), first, last)
        for column in range(columns):
            lines = slice(column, column + 2 * half + 1)
            pieces = upper[lines, window].astype(int) - lower[lines, window - disparity]
            sums[column, row] = np.abs(pieces).sum()
    return sums


def test_the_search_finds_the_least_sums_in_both_directions():
    rng = np.random.default_rng(0)
    half, lowest = 1, -3
    upper, lower = (rng.integers(0, 255, (6 + 2 * half, 20)).astype(np.uint8) for _ in range(2))
    spans = tuple((max(disparity, 0), min(20, 20 + disparity)) for disparity in range(lowest, 6))
    winners = least_sums(upper, lower, lowest, spans, 2 * half + 1)
    volume = np.stack([sums_by_hand(upper, lower, lowest + number, half) for number in range(len(spans))])
    np.testing.assert_array_equal(winners.best, volume.min(axis=0))
    np.testing.assert_array_equal(winners.index, volume.argmin(axis=0))
    padded = np.pad(volume, ((1, 1), (0, 0), (0, 0)), constant_values=UNSEARCHED)
    for costs, offset in ((winners.before, 0), (winners.after, 2)):
        expected = np.take_along_axis(padded, volume.argmin(axis=0)[None] + offset, axis=0)[0]
        np.testing.assert_array_equal(costs, expected)
    backwards = np.full(volume.shape, UNSEARCHED)
    for number in range(len(spans)):
        for row in range(20):
            if 0 <= row + lowest + number < 20:
                backwards[number, :, row] = volume[number, :, row + lowest + number]
    np.testing.assert_array_equal(winners.reverse_index, backwards.argmin(axis=0))
    whole = (winners.index.astype(np.int16) + lowest).astype(np.int16)
    before, best, after = sums_beside(upper, lower, whole, 2 * half + 1)
    np.testing.assert_array_equal(best, winners.best)
    searched = winners.before != UNSEARCHED
    np.testing.assert_array_equal(before[searched], winners.before[searched])
    searched = winners.after != UNSEARCHED
    np.testing.assert_array_equal(after[searched], winners.after[searched])


@pytest.mark.parametrize("fraction", [-0.49, -0.2, 0.0, 0.3])
def test_the_fit_is_exact_on_a_valley_of_straight_sides(fraction):
    costs = [np.array([[round(2000 * abs(offset - fraction) + 100)]], np.uint16) for offset in (-1, 0, 1)]
    found, remaining = equiangular_fit(*costs)
    assert found[0, 0] == pytest.approx(fraction, abs=1e-3)
    assert remaining[0, 0] == pytest.approx(100, abs=1)


@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_the_search_covers_the_distances_at_every_row(sampling):
    design = coarse_prototype()
    grid = panorama_grid(design, sampling, COLUMNS)
    search = search_range(grid, design.baseline_mm, (800.0, 6000.0))
    rows = np.arange(grid.rows)
    for distance in (800.0, 1500.0, 6000.0):
        exact = disparity_from_distance(grid, rows, distance, design.baseline_mm)
        np.testing.assert_allclose(distance_from_disparity(grid, rows, exact, design.baseline_mm), distance, rtol=1e-9)
        for row in rows[(rows - exact >= 0) & (rows - exact <= grid.rows - 1)]:
            first, last = search.spans[round(exact[row]) - search.lowest]
            assert first <= row < last


@pytest.mark.parametrize("signs", SIGNS)
@pytest.mark.parametrize("sampling", ["spherical", "cylindrical"])
def test_a_room_is_matched_to_a_fraction_of_a_row(signs, sampling):
    design, wall = with_views(coarse_prototype(), signs), room()
    placement = ImagePlacement((402.0, 297.5), -0.4, 0.98)
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    rig = build_rig(design, sampling, COLUMNS, placement=placement)
    matches = match_image(rig, raw_image(design, wall, texture, placement))
    error = matches.disparities - truth_of(rig, wall)
    known = np.isfinite(error)
    assert known.mean() > 0.85
    assert abs(np.median(error[known])) < 0.02
    assert np.median(np.abs(error[known])) < 0.05
    assert np.mean(np.abs(error[known]) > 0.5) < 0.005
    # No column is lost at the seam, at +-180 degrees.
    assert known[np.r_[0:10, -10:0]].mean() > 0.85
    distance = wall(rig.grid.azimuth(np.arange(COLUMNS)))[:, None] + 0 * error
    relative = matches.distances_mm[known] / distance[known] - 1
    assert abs(np.median(relative)) < 0.005


def test_semi_global_matches_agree_with_the_room():
    design, wall = coarse_prototype(), room()
    rig = build_rig(design, columns=COLUMNS)
    raw = raw_image(design, wall, Waves(finest_deg=1.6, coarsest_deg=24.0, count=60), noise=2.0)
    error = match_image(rig, raw, MatchingOptions("semi_global")).disparities - truth_of(rig, wall)
    known = np.isfinite(error)
    assert known.mean() > 0.85
    assert abs(np.median(error[known])) < 0.02
    assert np.median(np.abs(error[known])) < 0.06
    assert known[np.r_[0:10, -10:0]].mean() > 0.8


@pytest.mark.parametrize("matcher", ["sad", "semi_global"])
def test_matching_knows_no_seam(matcher):
    design = coarse_prototype()
    raw = raw_image(design, room(), Waves(finest_deg=1.6, coarsest_deg=24.0, count=30), noise=3.0)
    centre, moved = design.camera.principal_point_px, COLUMNS // 2
    angles = (0.0, moved * 2 * np.pi / COLUMNS)
    first, second = (
        match_image(
            build_rig(design, columns=COLUMNS, placement=ImagePlacement(centre, angle)),
            raw,
            MatchingOptions(matcher),
        )
        for angle in angles
    )
    # Look-up tables differ in their last bit, which may turn a grey level, and semi-global paths begin elsewhere.
    agree = 0.999 if matcher == "sad" else 0.98
    outcomes = np.roll(first.outcomes, moved, axis=0)
    seam = np.r_[0:8, -8:0]
    for columns in (slice(None), seam, seam + moved):
        assert np.mean(outcomes[columns] == second.outcomes[columns]) > agree
        difference = np.abs(np.roll(first.disparities, moved, axis=0)[columns] - second.disparities[columns])
        assert np.mean(difference[np.isfinite(difference)] < 0.05) > agree


def outcomes_in(texture, wall=None, design=None, **asked):
    design = design or coarse_prototype()
    raw = raw_image(design, wall or room(), texture)
    rig = build_rig(design, columns=COLUMNS, **asked)
    matches = match_image(rig, raw)
    assert np.array_equal(np.isfinite(matches.disparities), matches.outcomes == MatchOutcome.KEPT)
    assert np.array_equal(np.isfinite(matches.distances_mm), matches.outcomes == MatchOutcome.KEPT)
    assert sum(matches.fractions.values()) == pytest.approx(1.0)
    return rig, matches


def test_without_texture_nothing_is_matched():
    def half_blank(azimuth, height):
        return np.where(azimuth > 0, Waves(count=20)(azimuth, height), 120.0)

    rig, matches = outcomes_in(half_blank)
    blank = np.zeros(COLUMNS, bool)
    blank[rig.grid.azimuth(np.arange(COLUMNS)) < 0] = True
    away = blank & np.roll(blank, 10) & np.roll(blank, -10)
    assert np.mean(matches.outcomes[away] == MatchOutcome.NO_TEXTURE) > 0.9
    assert np.mean(matches.outcomes[~blank] == MatchOutcome.NO_TEXTURE) < 0.02


def test_stripes_along_the_scan_line_are_no_texture():
    _, matches = outcomes_in(lambda azimuth, height: 127 + 100 * np.cos(60 * azimuth))
    assert matches.fractions["no_texture"] + matches.fractions["outside_zone"] > 0.95


def test_a_wall_nearer_than_asked_is_not_taken_for_one_in_range():
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    _, matches = outcomes_in(texture, wall=lambda azimuth: np.full(azimuth.shape, 600.0))
    assert matches.fractions["kept"] < 0.03
    assert matches.fractions["unlike"] > 0.1
    _, matches = outcomes_in(texture, wall=lambda azimuth: np.full(azimuth.shape, 600.0), distances_mm=(500.0, 5000.0))
    assert matches.fractions["kept"] > 0.75


def test_distances_just_beyond_the_range_are_named_so():
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    _, matches = outcomes_in(
        texture, wall=lambda azimuth: np.full(azimuth.shape, 1400.0), distances_mm=(1500.0, 5000.0)
    )
    assert matches.fractions["out_of_range"] > 0.7


def test_what_falls_off_the_sensor_is_outside_the_zone():
    placement = ImagePlacement((460.0, 299.5))
    rig = build_rig(coarse_prototype(), columns=COLUMNS, placement=placement)
    raw = raw_image(coarse_prototype(), room(), Waves(count=20), placement)
    matches = match_image(rig, raw)
    beyond = ~rig.tables["upper"].imaged
    assert beyond.any()
    assert (matches.outcomes[beyond] == MatchOutcome.OUTSIDE_ZONE).all()


def test_an_island_of_other_disparities_is_a_speckle():
    design = coarse_prototype()

    def wall(azimuth):
        return np.where(np.abs(azimuth - 1.0) < np.radians(1.2), 1050.0, 4500.0)

    raw = raw_image(design, wall, Waves(finest_deg=1.6, coarsest_deg=24.0, count=60))
    rig = build_rig(design, columns=COLUMNS)
    kept, filtered = (match_image(rig, raw, MatchingOptions(window=3, speckle_size=size)) for size in (0, 2000))
    island = np.abs(rig.grid.azimuth(np.arange(COLUMNS)) - 1.0) < np.radians(0.9)
    near = kept.distances_mm[island] < 1300
    assert near.mean() > 0.3
    assert (filtered.outcomes[island][near] == MatchOutcome.SPECKLE).mean() > 0.95


def test_views_that_show_nothing_in_common_are_not_matched():
    noise = np.random.default_rng(0).integers(0, 255, (600, 800)).astype(np.uint8)
    matches = match_image(build_rig(coarse_prototype(), columns=COLUMNS), noise)
    assert matches.fractions["kept"] < 0.01
    assert matches.fractions["reverse_check"] > 0.3
    assert matches.fractions["unlike"] > 0.05


def test_reverse_verification_rejects_what_only_one_view_sees():
    """Above a near ledge the lower view sees the far wall where the upper view's sight is cut off."""
    design, ledge = coarse_prototype(), 1100.0
    texture = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)
    top = design.views.lower.viewpoint_mm  # the ledge ends at the height of the lower viewpoint
    raw = raw_image(design, lambda azimuth: np.full(azimuth.shape, 4500.0), texture).copy()
    near = raw_image(design, lambda azimuth: np.full(azimuth.shape, ledge), texture)
    rig = build_rig(design, columns=COLUMNS)
    v, u = np.mgrid[0:600, 0:800]
    for image in rig.images.values():
        slope, _ = image.direction_of(u, v)
        ends = np.sort(np.abs(image.radius_px(np.array(image.slopes))))
        radius = np.abs(image.radius_px(slope))
        zone = (radius > ends[0] - 3) & (radius < ends[1] + 3)
        below = zone & (image.viewpoint_mm + ledge * slope < top)
        raw[below] = near[below]
    matches = match_image(rig, raw, MatchingOptions(window=5))
    # The upper view sees the far wall down to the edge of the ledge; the lower one only from the horizon upwards.
    slopes = rig.grid.slope("upper", np.arange(rig.grid.rows))
    far_heights = design.views.upper.viewpoint_mm + 4500.0 * slopes
    edge = (top - design.views.upper.viewpoint_mm) / ledge
    hidden = (slopes > edge) & (far_heights < top)
    away = hidden & np.roll(hidden, 2) & np.roll(hidden, -2)
    assert away.sum() >= 5
    outcomes = matches.outcomes[:, away]
    assert np.mean(outcomes == MatchOutcome.REVERSE_CHECK) > 0.6
    assert np.mean(outcomes == MatchOutcome.KEPT) < 0.1


def test_views_of_unequal_brightness_need_levelling():
    design, wall = coarse_prototype(), room()
    raw = raw_image(design, wall, Waves(finest_deg=1.6, coarsest_deg=24.0, count=60), noise=2.0)
    rig = build_rig(design, columns=COLUMNS)
    v, u = np.mgrid[0:600, 0:800]
    outer = np.abs(rig.images["upper"].radius_px(rig.images["upper"].slopes[0])) - 3
    dimmed = np.where(np.hypot(u - 399.5, v - 299.5) > outer, 0.8 * raw, raw).astype(np.uint8)
    plain, levelled = (match_image(rig, dimmed, MatchingOptions(level_brightness=level)) for level in (False, True))
    assert plain.fractions["kept"] < 0.1
    assert levelled.fractions["kept"] > 0.8
    error = levelled.disparities - truth_of(rig, wall)
    assert abs(np.nanmedian(error)) < 0.02


def test_options_that_cannot_be():
    for window in (8, 17, -1):
        with pytest.raises(ValueError, match="window must be odd"):
            MatchingOptions(window=window)


def test_a_search_that_leaves_semi_global_matching_no_room_is_refused():
    design = coarse_prototype()
    rig = api.stereo_rig(
        design, columns=200, elevation_deg=(-4.976, 27.948), distances_mm=(10.0, 30.0), sampling="cylindrical"
    )
    image = np.zeros((design.camera.height_px, design.camera.width_px), np.uint8)
    with pytest.raises(InputError, match="--columns 200: semi-global matching needs panoramas higher than"):
        api.reconstruct(rig, image, matcher="semi_global")
