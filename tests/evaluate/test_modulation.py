"""Modulation against Fourier transforms by brute force, geometric and of waves; through focus against refocusing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j1

from designer.evaluate.focus import focus_of_design
from designer.evaluate.modulation import (
    GREEN_MM,
    lens_transfer,
    modulation_of_design,
    pixel_transfer,
)
from designer.evaluate.noise import MatcherPerformance
from designer.evaluate.resolution import angular_resolution_px_per_deg
from designer.evaluate.through_focus import (
    blur_limit_deg,
    depth_of_field_of_design,
    largest_blur_through_focus,
    sharp_range,
    sharpest_focus,
)
from designer.optics.focus import FocusedLens, lens_of_camera
from support.studied_designs import NAMES, studied_design

LENS = FocusedLens(13.0, 5.6, 1.0 / 145.0)


def test_a_wide_blur_transfers_what_the_fourier_transform_of_its_disc_says():
    size, pitch, diameter = 1024, 0.001, 0.2
    place = (np.arange(size) - size // 2) * pitch
    fine = (np.arange(8) - 3.5) / 8 * pitch
    disc = np.zeros((size, size))
    for down in fine:
        for across in fine:
            disc += np.hypot((place + down)[:, None], (place + across)[None, :]) <= diameter / 2
    frequency = np.fft.rfftfreq(size, pitch)[:30]
    spectrum = np.fft.rfft2(np.fft.ifftshift(disc))[0, :30].real / disc.sum()
    # Hardly any diffraction; the cells of the raster blur a little themselves.
    transfer = lens_transfer(frequency, diameter, LENS, wavelength=1e-9)
    np.testing.assert_allclose(spectrum, transfer * np.sinc(frequency * pitch), atol=2e-3)
    np.testing.assert_allclose(transfer[1:], 2 * j1(x := np.pi * diameter * frequency[1:]) / x, atol=1e-4)


def test_in_focus_only_diffraction_is_left():
    cut_off = LENS.pupil_diameter / (GREEN_MM * LENS.principal_distance)
    share = np.linspace(0.0, 1.0, 11)
    expected = 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))
    np.testing.assert_allclose(lens_transfer(share * cut_off, 0.0, LENS), expected, atol=1e-12)
    assert lens_transfer(1.5 * cut_off, 0.01, LENS) == 0.0


def test_a_pixel_averages_a_sine_over_its_side():
    frequency, pitch = 70.0, 0.0044
    inside = (np.arange(10_000) + 0.5) / 10_000 * pitch - pitch / 2
    assert pixel_transfer(frequency, pitch) == pytest.approx(np.cos(2 * np.pi * frequency * inside).mean(), rel=1e-6)


@pytest.mark.parametrize("blur", [0.002, -0.004, 0.012, 0.03, 0.1])
def test_defocus_and_diffraction_are_those_of_waves(blur):
    """The autocorrelation by brute force of a pupil whose defocus is a quadratic phase."""
    pupil, f = LENS.pupil_diameter, LENS.principal_distance
    place = (np.arange(801) - 400) / 400 * pupil / 2
    x, y = np.meshgrid(place, place)
    shifts = np.array([0, 10, 20, 40, 80, 160, 320, 640])
    inside = np.hypot(x, y) <= pupil / 2
    # The wavefront's slope at the rim, times f, is half of the blur.
    wave = np.where(inside, np.exp(2j * np.pi / GREEN_MM * blur * (x**2 + y**2) / (2.0 * pupil * f)), 0.0)
    transfers = [np.vdot(wave[:, : 801 - s], wave[:, s:]).real / inside.sum() for s in shifts]
    frequency = shifts * (place[1] - place[0]) / (GREEN_MM * f)
    np.testing.assert_allclose(lens_transfer(frequency, blur, LENS), transfers, atol=2e-3)


def test_modulation_is_that_of_a_pattern_as_the_matcher_sees_it():
    """At one elevation of one view, from the blur, the resolution and the window alone."""
    design = studied_design(NAMES[0])
    pitch, focus = design.camera.pixel_pitch_mm, focus_of_design(design, 3)
    found = modulation_of_design(design, MatcherPerformance(window=9, columns=1800), elevations=3)["upper"]
    pixels_per_degree = float(angular_resolution_px_per_deg(design, "upper", found.elevations_deg[1]))
    blur = focus.upper.blur_px[1, 1] * pitch
    for period_deg, modulation in ((1.8, found.of_window[1, 1]), (0.4, found.of_rows[1, 1])):
        frequency = 1.0 / (period_deg * pixels_per_degree * pitch)
        expected = lens_transfer(frequency, blur, lens_of_camera(design.camera)) * np.sinc(frequency * pitch)
        assert modulation == pytest.approx(float(expected), rel=1e-9)


@pytest.mark.parametrize("name", NAMES[:6])
def test_through_focus_passes_the_recorded_blur(name):
    design = studied_design(name)
    focus = focus_of_design(design)
    recorded = largest_blur_through_focus(design, [focus.lens.reciprocal_focus])
    assert recorded["upper"][0] == pytest.approx(focus.upper.largest_blur_deg, rel=1e-12)
    assert recorded["lower"][0] == pytest.approx(focus.lower.largest_blur_deg, rel=1e-12)


@pytest.mark.parametrize("name", NAMES[:6])
@pytest.mark.parametrize("view", ["upper", "lower"])
def test_a_view_blurs_by_the_limit_at_the_ends_of_its_depth_of_field(name, view):
    design = studied_design(name)
    # A limit that every view reaches somewhere in its working volume.
    limit = 1.2 * getattr(focus_of_design(design), view).largest_blur_deg
    ends = sharp_range(design, view, limit).common_mm
    assert ends is not None
    for end in ends:
        if not np.isfinite(end) or end < 1.5 * max(mirror.outer_radius_mm for mirror in design.mirrors):
            continue
        volume = design.working_volume.model_copy(update={"distance_mm": (end, end)})
        there = focus_of_design(design.model_copy(update={"working_volume": volume}))
        assert getattr(there, view).largest_blur_deg == pytest.approx(limit, rel=2e-3)


@pytest.mark.parametrize("name", NAMES[:6])
def test_no_focus_blurs_the_scene_less_than_the_sharpest(name):
    design = studied_design(name)
    best, blur = sharpest_focus(design)
    others = largest_blur_through_focus(design, best * np.linspace(0.7, 1.3, 61))
    assert np.maximum(others["upper"], others["lower"]).min() >= blur - 1e-9
    assert blur <= focus_of_design(design).largest_blur_deg + 1e-9


def test_a_design_is_sharp_where_both_views_are():
    design = studied_design(NAMES[0])
    limit = 1.2 * focus_of_design(design).largest_blur_deg
    both = depth_of_field_of_design(design, limit)
    ranges = [sharp_range(design, view, limit).common_mm for view in ("upper", "lower")]
    assert both == (max(near for near, _ in ranges), min(far for _, far in ranges))
    assert depth_of_field_of_design(design, 1e-6) is None
    assert blur_limit_deg(design.model_copy(update={"sharpness": None})) == 0.5
