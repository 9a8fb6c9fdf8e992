"""A sensor in a tube, checked end to end in a pipe, where the wall's bias is many deviations: corrected, and not."""

from __future__ import annotations

import numpy as np
import pytest

from designer.imaging.endtoend.bands import LARGEST_BIAS_SIGMAS
from designer.imaging.endtoend.check import SEARCH_FARTHER, SEARCH_NEARER, CheckOptions, EndToEndCheck, check_design
from designer.imaging.render.lens import RenderedLens
from designer.imaging.stereo.rig import build_rig, match_image
from designer.optics.tube import shift_along_radius, slope_towards, uncorrected_bias, wall_of
from support.housings import with_struts, with_tube
from support.studied_designs import SHARP_NAMES, sharp_design, with_coarse_pixels

PIPE = next(name for name in SHARP_NAMES if name.startswith("pipe_inspection"))


@pytest.mark.slow
def test_the_correction_leaves_less_than_a_quarter_of_a_deviation_of_five_and_more():
    """Rendered through the tube; read by the design with it, then by the same design without, as if unknown."""
    design = with_tube(sharp_design(PIPE))
    check = check_design(design, CheckOptions(lens=None))
    assert check.passed
    assert check.untested == ()
    near, far = design.working_volume.distance_mm
    unaware = build_rig(
        design.model_copy(update={"housing": None}),
        distances_mm=(SEARCH_NEARER * near - design.tube.wall_mm, SEARCH_FARTHER * far),
    )
    uncorrected = match_image(unaware, check.raw, CheckOptions().matching).distances_mm - check.true_distance_mm
    slope_upper = np.asarray(check.rig.grid.slope("upper", np.arange(check.rig.grid.rows)))
    wall = wall_of(design)
    for bias, in_band in zip(biases_in_sigma(check), bands_of(check), strict=True):
        assert abs(bias) < LARGEST_BIAS_SIGMAS
        # What the closed form expects of these very points, from where they truly are.
        columns, rows = np.nonzero(in_band & np.isfinite(uncorrected))
        distance, upper = check.true_distance_mm[columns, rows], slope_upper[rows]
        rise = upper * (distance - shift_along_radius(upper, wall)) + design.baseline_mm
        expected = np.median(uncorrected_bias(slope_towards(rise, distance, wall), upper, wall))
        sigma = np.median(check.predicted[columns, rows] * distance)
        found = np.median(uncorrected[columns, rows])
        assert abs(found - expected) < LARGEST_BIAS_SIGMAS * sigma
        assert -found > 15.0 * sigma


@pytest.mark.slow
def test_through_the_lens_a_corrected_tube_adds_no_bias():
    """The lens has a bias of its own, with or without a tube: bundles that mirrors do not image quite evenly."""
    design = with_coarse_pixels(sharp_design(PIPE), 2)
    without, through = (check_design(each, CheckOptions(lens=RenderedLens())) for each in (design, with_tube(design)))
    assert through.passed
    added = np.subtract(biases_in_sigma(through), biases_in_sigma(without))
    assert np.abs(added).max() < LARGEST_BIAS_SIGMAS


@pytest.mark.slow
def test_struts_hide_their_azimuths_and_nothing_else():
    """Pixels behind a strut show no point of the scene, and all others what they show without struts."""
    design = with_coarse_pixels(sharp_design(PIPE), 4)
    behind = with_struts(design, number=3, width_mm=8.0)
    free, hidden = (check_design(each, CheckOptions(lens=None)) for each in (design, behind))
    shown = np.isfinite(free.true_distance_mm)
    lost = np.isnan(hidden.true_distance_mm) & shown
    columns = len(shown)
    assert lost.sum() / shown.sum() == pytest.approx(behind.housing.blocked_share, abs=3.0 / columns)
    azimuth = np.degrees(np.asarray(free.rig.grid.azimuth(np.arange(columns))))
    from_strut = np.abs(np.remainder(azimuth + 60.0, 120.0) - 60.0)
    is_dark = lost.any(axis=1)
    assert from_strut[is_dark].max() < behind.housing.half_width_deg
    assert from_strut[~is_dark].min() > behind.housing.half_width_deg
    # The image itself is dark there, in both zones.
    raw_of_struts = hidden.raw[free.raw > 60]
    assert np.mean(raw_of_struts < 20) == pytest.approx(behind.housing.blocked_share, rel=0.2)
    assert hidden.passed


def bands_of(check: EndToEndCheck) -> list[np.ndarray]:
    """Which pixels (columns, rows) each band judges."""
    distance = check.true_distance_mm
    return [
        check.both_see & (distance >= band.distance_mm[0]) & (distance < band.distance_mm[1]) for band in check.bands
    ]


def biases_in_sigma(check: EndToEndCheck) -> list[float]:
    """Median depth error of each band in predicted deviations."""
    found = np.isfinite(check.relative_error)
    return [float(np.median((check.relative_error / check.predicted)[pixels & found])) for pixels in bands_of(check)]
