"""Resolution equalisation: equation (10) against finite differences, the smoothing against a frequency chart."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from designer.files import InputError
from designer.imaging.stereo import equalisation
from designer.imaging.stereo.equalisation import (
    build_equaliser,
    factors_of_rows,
    fine_samples,
    reference_sigma_px,
    scale_factors,
)
from designer.imaging.stereo.panorama import imaged_rows, panorama_grid, view_images
from designer.imaging.stereo.placement import ImagePlacement
from designer.imaging.stereo.rig import build_rig, panoramas
from support.analytic_room import raw_image
from support.imaging_designs import SENSES, SIGNS, coarse_prototype, prototype, with_views


def far_wall(azimuth):
    return np.full(azimuth.shape, 1e9)


@given(st.sampled_from(SIGNS), st.sampled_from(SENSES), st.floats(0.02, 0.2), st.floats(0.02, 0.2), st.floats(-35, 35))
def test_equation_10_is_the_ratio_of_finite_differences(signs, senses, gain_upper, gain_lower, elevation_deg):
    design = with_views(prototype(), signs, senses)
    gains = {"upper": gain_upper * signs[0], "lower": gain_lower * signs[1]}
    views = {name: getattr(design.views, name).model_copy(update={"gain": gain}) for name, gain in gains.items()}
    images = view_images(design.model_copy(update={"views": design.views.model_copy(update=views)}))
    outer, inner = images["upper"], images["lower"]
    phi, step = np.radians(elevation_deg), 1e-5

    def radius(image, angle):
        return abs(float(image.radius_px(np.tan(angle))))

    steepness = {
        name: abs(radius(image, phi + step) - radius(image, phi - step)) / (2 * step) for name, image in images.items()
    }
    assume(radius(outer, phi) > radius(inner, phi))
    of_inner, of_outer = scale_factors(inner, outer, np.array([np.tan(phi)]))
    assert of_inner.radial[0] == pytest.approx(max(1, steepness["lower"] / steepness["upper"]), rel=1e-6)
    assert of_outer.radial[0] == pytest.approx(max(1, steepness["upper"] / steepness["lower"]), rel=1e-6)
    assert of_inner.circular[0] == 1
    assert of_outer.circular[0] == pytest.approx(radius(outer, phi) / radius(inner, phi), rel=1e-9)
    # What it is for: the same blur in elevation and in azimuth, that of the coarser view.
    blur_inner, blur_outer = of_inner.radial[0] / steepness["lower"], of_outer.radial[0] / steepness["upper"]
    assert blur_inner == pytest.approx(blur_outer, rel=1e-6)
    assert blur_inner == pytest.approx(1 / min(steepness.values()), rel=1e-6)
    assert of_outer.circular[0] / radius(outer, phi) == pytest.approx(of_inner.circular[0] / radius(inner, phi))


def test_near_the_sensor_rows_are_compared_at_the_same_point():
    design = prototype()
    grid, images = panorama_grid(design), view_images(design)
    for distance in (1000.0, np.inf):
        factors = factors_of_rows(grid, images, "lower", distance)
        rows = np.arange(20, grid.rows - 20)
        seen_upper = grid.slope("upper", rows)
        partner = grid.row("lower", seen_upper + design.baseline_mm / distance)
        blur_upper = factors["upper"].radial[rows] / np.abs(images["upper"].radius_per_elevation_px(seen_upper))
        lower_slopes = grid.slope("lower", np.arange(grid.rows))
        blurs_lower = factors["lower"].radial / np.abs(images["lower"].radius_per_elevation_px(lower_slopes))
        inside = (partner > 0) & (partner < grid.rows - 1)
        np.testing.assert_allclose(
            blur_upper[inside], np.interp(partner[inside], np.arange(grid.rows), blurs_lower), rtol=1e-4
        )


def test_elevations_that_no_view_images_make_nothing_finer():
    design = prototype()
    images = view_images(design)
    sigmas = []
    for limits in ((-19.0, 19.0), (-30.0, 75.0)):
        grid = panorama_grid(design, elevation_deg=limits)
        sigmas.append(reference_sigma_px(grid, images, factors_of_rows(grid, images, "lower", np.inf)))
        for view, image in images.items():
            rows, columns = fine_samples(grid, image, view)
            # No finer than pixels: along the radius over a row, and around the largest circle imaged.
            slopes = grid.slope(view, np.flatnonzero(imaged_rows(grid, image, view)))
            assert columns == np.ceil(max(1.0, np.abs(image.radius_px(slopes)).max() * 2 * np.pi / grid.columns))
            steepest = np.abs(image.radius_per_elevation_px(slopes)).max() * grid.step
            assert rows == np.ceil(max(1.0, steepest))
    # The same directions are imaged, in rows that lie elsewhere by a part of a row.
    assert sigmas[1] == pytest.approx(sigmas[0], rel=0.01)


def test_tables_beyond_the_memory_allowed_are_refused(monkeypatch):
    design = prototype()
    grid, images = panorama_grid(design), view_images(design)
    factors = factors_of_rows(grid, images, "lower", np.inf)
    monkeypatch.setattr(equalisation, "MOST_FINE_SAMPLES", 1000)
    with pytest.raises(InputError, match=r"at most 0.001 million .* --no-equalise"):
        build_equaliser(grid, images["upper"], "upper", factors["upper"], 0.5)


def amplitude_along(rig, chart, view):
    """Amplitudes of a panorama by row and by periods around the circle."""
    panorama = panoramas(rig, chart)[view].astype(float)
    return np.abs(np.fft.rfft(panorama, axis=1)) * 2 / panorama.shape[1]


@pytest.mark.parametrize(("sigma_px", "periods"), [(0.6, 150), (1.2, 100)])
def test_circular_smoothing_on_a_frequency_chart(sigma_px, periods):
    design = prototype()
    chart = raw_image(design, far_wall, lambda azimuth, slope: 127.5 + 110 * np.cos(periods * azimuth))
    rig = build_rig(design, equalise=True, sigma_px=sigma_px, reference_distance_mm=np.inf)
    for view, image in rig.images.items():
        amplitude = amplitude_along(rig, chart, view)[:, periods] / 110
        slopes = rig.grid.slope(view, np.arange(rig.grid.rows))
        inner_radius = np.abs(rig.images["lower"].radius_px(slopes))
        frequency = periods / (2 * np.pi)  # cycles a radian; both views have the inner one's blur in azimuth
        expected = np.exp(-2 * np.pi**2 * (sigma_px / inner_radius) ** 2 * frequency**2)
        middle = slice(8, -8)
        np.testing.assert_allclose(amplitude[middle], expected[middle], atol=0.02)
        assert image.gain > 0


@pytest.mark.parametrize(("sigma_px", "period_deg"), [(0.6, 1.6), (1.2, 2.0)])
def test_radial_smoothing_on_a_frequency_chart(sigma_px, period_deg):
    design = prototype()
    frequency = 1 / np.radians(period_deg)
    rig = build_rig(design, equalise=True, sigma_px=sigma_px, reference_distance_mm=np.inf)
    waves = []
    for phase in (0.0, np.pi / 2):  # in quadrature, so that the amplitude shows at every row

        def stripes(azimuth, slope, phase=phase):
            return 127.5 + 110 * np.cos(2 * np.pi * frequency * np.arctan(slope) + phase)

        waves.append(panoramas(rig, raw_image(design, far_wall, stripes)))
    for view in ("upper", "lower"):
        means = [wave[view].astype(float).mean(axis=1) - 127.5 for wave in waves]
        amplitude = np.hypot(*means) / 110
        slopes = rig.grid.slope(view, np.arange(rig.grid.rows))
        coarser = np.minimum(*(np.abs(image.radius_per_elevation_px(slopes)) for image in rig.images.values()))
        expected = np.exp(-2 * np.pi**2 * (sigma_px / coarser) ** 2 * frequency**2)
        middle = slice(10, -10)
        np.testing.assert_allclose(amplitude[middle], expected[middle], atol=0.02)


def test_plain_sampling_keeps_what_equalising_removes():
    design = prototype()
    chart = raw_image(design, far_wall, lambda azimuth, slope: 127.5 + 110 * np.cos(250 * azimuth))
    upper, lower = (amplitude_along(build_rig(design), chart, view)[40:-40, 250].mean() for view in ("upper", "lower"))
    rig = build_rig(design, equalise=True, sigma_px=1.0, reference_distance_mm=np.inf)
    both = [amplitude_along(rig, chart, view)[40:-40, 250].mean() for view in ("upper", "lower")]
    assert upper - lower > 3.0
    assert abs(both[0] - both[1]) < (upper - lower) / 2


@pytest.mark.parametrize("equalise", [False, True])
def test_the_seam_is_a_column_like_any_other(equalise):
    design = coarse_prototype()
    raw = np.random.default_rng(3).integers(0, 255, (600, 800)).astype(np.uint8)
    centre = design.camera.principal_point_px
    columns, moved = 900, 450
    straight, turned = (
        build_rig(design, columns=columns, equalise=equalise, placement=ImagePlacement(centre, rotation_rad=angle))
        for angle in (0.0, moved * 2 * np.pi / columns)
    )
    for view in ("upper", "lower"):
        first, second = panoramas(straight, raw)[view], panoramas(turned, raw)[view]
        difference = np.roll(first, moved, axis=1).astype(int) - second
        assert np.abs(difference).max() <= 1


def test_smoothing_keeps_a_flat_image_flat():
    rig = build_rig(prototype(), equalise=True)
    for panorama in panoramas(rig, np.full((1200, 1600, 3), 93, np.uint8)).values():
        assert (panorama == 93).all()
