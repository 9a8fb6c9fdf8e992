"""The closed form of matching noise against realisations of its texture, brute-force estimators and its own limits."""

from dataclasses import replace

import casadi
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.ndimage import gaussian_filter, uniform_filter
from scipy.special import dawsn, j1

from designer.design import PerView
from designer.evaluate import noise
from designer.evaluate.depth import slope_error
from designer.evaluate.noise import (
    MATCHER_PERFORMANCE,
    CameraSetting,
    CollectedLight,
    ImagePoint,
    TextureSpectrum,
    blur_variance,
    equalising_sigma_px,
    matching_noise,
    pixel_variance,
    rich_texture,
    texture_gradient_energy,
)
from designer.imaging.render.textures import make_texture
from designer.optics.view import image_radius, image_radius_slope

DISTANCE = 2000.0
TEXTURE = rich_texture(5000.0)
LIGHT = CollectedLight(10_000.0, 5.6, 8.0)
EXPOSURE = CameraSetting(pixel_pitch=0.0088, f_number=5.6)
UPPER = ImagePoint(slope=-0.05, radius=2.0, radius_slope=-2.4, defocus=0.02)
LOWER = ImagePoint(slope=0.0, radius=1.2, radius_slope=1.5, defocus=0.01)


def noise_of(upper=UPPER, lower=LOWER, light=LIGHT, exposure=EXPOSURE, texture=TEXTURE, distance=DISTANCE):
    points = PerView(upper=upper, lower=lower)
    found = matching_noise(points, distance, texture, light, exposure, MATCHER_PERFORMANCE["sad"])
    return found.upper, found.lower


@pytest.mark.parametrize(("along", "across"), [(5.0, 5.0), (12.0, 12.0), (40.0, 40.0), (10.0, 30.0), (30.0, 10.0)])
def test_gradient_energy_is_that_of_the_rendered_texture(along: float, across: float) -> None:
    energies = []
    for seed in range(60):
        for octave in make_texture("rich", 5000.0, seed).octaves:
            # Any two perpendicular directions on a surface, since the headings are turned at random.
            of_along, of_across = octave.waves[2].astype(float), octave.waves[0].astype(float)
            seen = np.exp(-((of_along * along) ** 2) - (of_across * across) ** 2)
            energies.append(octave.amplitude**2 / 2.0 * np.sum(of_along**2 * seen))
    drawn = np.sum(energies) / 60
    # The texture is squeezed between -1 and 1 by a tanh, whose rms slope at its contrast is 0.928.
    assert texture_gradient_energy(TEXTURE, along, across) == pytest.approx(drawn * 0.928**2, rel=0.07)


def test_tanh_leaves_the_stated_share_of_the_slope() -> None:
    normal = np.random.default_rng(0).standard_normal(200_000) * 0.3
    assert np.sqrt(np.mean((1.0 - np.tanh(normal) ** 2) ** 2)) == pytest.approx(0.928, abs=2e-3)


def test_a_scale_free_texture_loses_gradient_as_the_square_of_the_blur() -> None:
    texture = TextureSpectrum(0.1, 1e-6, 1e9)
    power = 0.1**2 / np.log(2.0)
    for along, across in ((1.0, 1.0), (2.0, 5.0)):
        expected = power / (2.0 * along * (along + across))
        assert texture_gradient_energy(texture, along, across) == pytest.approx(expected, rel=1e-6)


def test_dawson_remainder_is_near_dawsons_integral() -> None:
    root = np.geomspace(1e-3, 30.0, 200)
    exact = np.where(root < 0.02, 2.0 / 3.0, (1.0 - dawsn(root) / root) / root**2)
    np.testing.assert_allclose(noise._dawson_remainder(root**2), exact, rtol=0.013)


def test_a_disc_and_a_perfect_lens_leave_what_their_gaussians_leave() -> None:
    def energy(transfer, end: float) -> float:
        return float(quad(lambda q: q * transfer(q) ** 2, 0.0, end, limit=2000)[0])

    diameter = 3.0
    disc = energy(lambda q: 2.0 * j1(q * diameter / 2.0) / (q * diameter / 2.0) if q else 1.0, 2000.0)
    variance = blur_variance(CameraSetting(0.0, 1.0), diameter)
    assert disc == pytest.approx(1.0 / (2.0 * variance), rel=2e-3)
    wavelength, f_number = 0.00055, 8.0
    cut_off = 2.0 * np.pi / (wavelength * f_number)
    lens = energy(
        lambda q: 2.0 / np.pi * (np.arccos(q / cut_off) - q / cut_off * np.sqrt(1 - (q / cut_off) ** 2)), cut_off
    )
    variance = blur_variance(CameraSetting(0.0, f_number, wavelength=wavelength), 0.0)
    assert lens == pytest.approx(1.0 / (2.0 * variance), rel=2e-3)


def scale_free_field(random: np.random.Generator, side: int) -> np.ndarray:
    """A field of spectral density 1 / (2 pi q^2) per unit cell, periodic, without its longest waves."""
    q = 2.0 * np.pi * np.fft.fftfreq(side)
    length = np.hypot(*np.meshgrid(q, q))
    length[0, 0] = 1.0
    spectrum = np.fft.fft2(random.standard_normal((side, side))) * np.sqrt(2.0 * np.pi) / length
    spectrum[length < 2.0 * np.pi / 100.0] = 0.0
    return np.fft.ifft2(spectrum).real


@pytest.mark.parametrize("blur", [1.5, 2.5])
def test_least_squares_reaches_the_bound_of_cramer_and_rao(blur: float) -> None:
    random = np.random.default_rng(3)
    side, window, sigma = 512, 25, 0.01
    scene = gaussian_filter(scale_free_field(random, side), blur, mode="wrap")
    first, second = (scene + sigma * random.standard_normal(scene.shape) for _ in range(2))
    gradient = np.gradient(scene, axis=1)
    mean = uniform_filter(gradient * (second - first), window, mode="wrap") / uniform_filter(
        gradient**2, window, mode="wrap"
    )
    # A unit of this field has C^2 = 1: contrast per octave sqrt(log 2).
    texture = TextureSpectrum(np.sqrt(np.log(2.0)), 1e-6, 100.0)
    bound = np.sqrt(2.0 * sigma**2 / (window**2 * texture_gradient_energy(texture, blur, blur)))
    assert np.std(mean[::7, ::7]) == pytest.approx(bound, rel=0.15)


@pytest.mark.parametrize("blur_px", [0.0, 0.25])
def test_aliasing_disturbs_as_much_as_pixels_that_fold(blur_px: float) -> None:
    """Two sensors whose grids lie a quarter of a pixel apart, panoramas two rows to a pixel, no noise at all."""
    random = np.random.default_rng(5)
    fine, rows, sigma, side = 8, 2, 0.6, 1024
    q = 2.0 * np.pi * np.fft.fftfreq(side) * fine
    qx, qy = np.meshgrid(q, q)
    spectrum = np.fft.fft2(scale_free_field(random, side))
    spectrum *= np.sinc(qx / 2 / np.pi) * np.sinc(qy / 2 / np.pi) * np.exp(-(qx**2 + qy**2) * blur_px**2 / 2)
    panoramas = []
    for shift in (0.0, 0.25):
        pixels = np.fft.ifft2(spectrum * np.exp(1j * (qx + qy) * shift)).real[::fine, ::fine]
        k = 2.0 * np.pi * np.fft.fftfreq(len(pixels) * rows) * rows
        kx, ky = np.meshgrid(k, k)
        smooth = np.exp(-(kx**2 + ky**2) * sigma**2 / 2 - 1j * (kx + ky) * shift)
        panoramas.append(np.fft.ifft2(np.tile(np.fft.fft2(pixels), (rows, rows)) * rows**2 * smooth).real)
    upper, lower = panoramas
    gradient = (np.roll(upper + lower, -1, 1) - np.roll(upper + lower, 1, 1)) / 4.0
    found = uniform_filter(gradient * (lower - upper), 9, mode="wrap") / uniform_filter(gradient**2, 9, mode="wrap")
    error_px = 1.4826 * np.median(np.abs(found[::5, ::5])) / rows
    texture = TextureSpectrum(np.sqrt(np.log(2.0)), 1e-6, 100.0)
    row = 1.0 / rows
    seen = 1.0 / 12.0 + sigma**2 + blur_px**2
    signal = texture_gradient_energy(texture, np.sqrt(seen + row**2 / 6.0), np.sqrt(seen))
    aliased = noise._aliasing(texture, 1.0, blur_px**2, seen + row**2 / 3.0 + sigma**2, seen + sigma**2)
    predicted = np.sqrt(2.0 * aliased / (81.0 * row**2 * signal**2))
    assert predicted == pytest.approx(error_px, rel=0.3)


@pytest.mark.parametrize(("along", "across"), [(0.6, 0.0), (0.0, 0.6), (0.6, 0.6)])
def test_unequal_blur_disturbs_a_window_by_its_edges(along: float, across: float) -> None:
    """Two views of one scene, without noise, whose blurs differ in variance by so much of their mean."""
    random, side, mean = np.random.default_rng(2), 1024, 1.44
    q = 2.0 * np.pi * np.fft.fftfreq(side)
    qx, qy = np.meshgrid(q, q)
    spectrum = np.fft.fft2(scale_free_field(random, side))
    upper, lower = (
        np.fft.ifft2(
            spectrum * np.exp(-(qx**2 * mean * (1 + half * along) + qy**2 * mean * (1 + half * across)) / 2)
        ).real
        for half in (-0.5, 0.5)
    )
    gradient = np.gradient((upper + lower) / 2.0, axis=1)
    found = uniform_filter(gradient * (lower - upper), 9, mode="wrap") / uniform_filter(gradient**2, 9, mode="wrap")
    deviation = 1.4826 * np.median(np.abs(found[::5, ::5]))
    variance = noise._edge_variance([0.0, along * mean], [0.0, across * mean], 9.0, 9.0)
    assert np.sqrt(variance) == pytest.approx(deviation, rel=0.15)


def test_more_light_is_less_noise_and_more_blur_is_more() -> None:
    dim = noise_of(light=replace(LIGHT, electrons_of_white=500.0))
    usual = noise_of()
    bright = noise_of(light=replace(LIGHT, electrons_of_white=40_000.0))
    assert all(a > b > c for a, b, c in zip(dim, usual, bright, strict=True))
    dark = replace(LIGHT, electrons_of_white=1000.0)
    blurred = [
        noise_of(replace(UPPER, defocus=0.024 * times), replace(LOWER, defocus=0.015 * times), light=dark)
        for times in (1.0, 2.0, 4.0)
    ]
    assert all(np.all(np.diff(view) > 0.0) for view in zip(*blurred, strict=True))
    assert noise_of(texture=replace(TEXTURE, contrast_per_octave=0.03))[0] > usual[0]
    assert noise_of(exposure=replace(EXPOSURE, wavelength=0.002))[0] > usual[0]


def test_one_view_out_of_focus_disturbs_more_than_both_alike() -> None:
    # The same blur in elevation and azimuth in both, and no light to be short of.
    light = replace(LIGHT, electrons_of_white=1e9, read_noise_electrons=0.0)
    alike = replace(LOWER, slope=UPPER.slope, radius=UPPER.radius, radius_slope=-UPPER.radius_slope)
    same = noise_of(UPPER, replace(alike, defocus=UPPER.defocus), light=light)
    unlike = noise_of(UPPER, replace(alike, defocus=3.0 * UPPER.defocus), light=light)
    assert same[0] == pytest.approx(same[1])
    assert unlike[0] > 1.5 * same[0]


def test_signs_and_order_of_views_do_not_matter() -> None:
    mirrored = replace(UPPER, radius=-UPPER.radius, radius_slope=-UPPER.radius_slope, defocus=-UPPER.defocus)
    np.testing.assert_allclose(noise_of(mirrored), noise_of(), rtol=1e-12)
    level = replace(UPPER, slope=0.0)
    np.testing.assert_allclose(noise_of(LOWER, level), noise_of(level, LOWER)[::-1], rtol=1e-12)


def test_lengths_scale_on_the_sensor_and_in_the_scene() -> None:
    usual = np.array(noise_of())
    texture = replace(TEXTURE, finest_mm=10 * TEXTURE.finest_mm, coarsest_mm=10 * TEXTURE.coarsest_mm)
    np.testing.assert_allclose(noise_of(texture=texture, distance=10 * DISTANCE), usual, rtol=1e-9)

    def larger(view: ImagePoint) -> ImagePoint:
        return ImagePoint(view.slope, 3 * view.radius, 3 * view.radius_slope, 3 * view.defocus)

    exposure = replace(EXPOSURE, pixel_pitch=3 * EXPOSURE.pixel_pitch)
    np.testing.assert_allclose(noise_of(larger(UPPER), larger(LOWER), exposure=exposure), 3 * usual, rtol=1e-9)


def test_casadi_computes_the_same_and_its_derivatives_are_those_of_differences() -> None:
    names = ("slope", "radius", "radius_slope", "defocus")
    values = np.array([getattr(view, name) for view in (UPPER, LOWER) for name in names] + [5.6, DISTANCE])

    def of(given):
        upper, lower = ImagePoint(*(given[i] for i in range(4))), ImagePoint(*(given[i] for i in range(4, 8)))
        return noise_of(upper, lower, exposure=replace(EXPOSURE, f_number=given[8]), distance=given[9])

    symbol = casadi.MX.sym("x", len(values))
    both = casadi.vertcat(*of(symbol))
    function = casadi.Function("noise", [symbol], [both, casadi.jacobian(both, symbol)])
    computed, jacobian = (np.array(part) for part in function(values))
    np.testing.assert_allclose(computed.ravel(), of(values), rtol=1e-12)
    for place, value in enumerate(values):
        step = 1e-6 * max(abs(value), 0.01)
        moved = [np.array(of(np.where(np.arange(len(values)) == place, value + s, values))) for s in (step, -step)]
        np.testing.assert_allclose(jacobian[:, place], (moved[0] - moved[1]) / (2 * step), rtol=1e-5, atol=1e-12)


def test_depth_error_is_the_error_of_the_matched_height_over_the_baseline() -> None:
    """Both parts of the noise are heights on the surface, whatever the view that they are written in."""
    principal_distance, gain = 8.0, 0.5
    for sense in ("direct", "folded"):
        slope = 0.1
        radius = image_radius(slope, gain, principal_distance, sense)
        radius_slope = image_radius_slope(slope, gain, principal_distance, sense)
        point = ImagePoint(slope, radius, radius_slope, 0.01)
        sigma = noise_of(point, replace(LOWER, slope=slope))[0]
        height = sigma * DISTANCE * (1.0 + slope**2) / abs(radius_slope)
        assert abs(slope_error(slope, gain, sense, principal_distance, sigma)) == pytest.approx(height / DISTANCE)


def test_the_best_f_number_lies_between_blur_and_darkness() -> None:
    f_number = np.geomspace(1.0, 64.0, 200)

    def at(light: CollectedLight) -> float:
        # Blur in both views of as many radians at each f-number, 0.02 mm at f/5.6 in the upper one.
        upper = replace(UPPER, defocus=0.02 * 5.6 / f_number)
        lower = replace(LOWER, defocus=0.02 * 5.6 / f_number * 1.5 / 2.4)
        values = noise_of(upper, lower, light=light, exposure=replace(EXPOSURE, f_number=f_number))[1]
        best = int(np.argmin(values))
        assert 0 < best < len(f_number) - 1
        return float(f_number[best])

    assert at(replace(LIGHT, electrons_of_white=500.0)) < at(LIGHT)


def test_a_pixel_of_many_electrons_has_the_noise_of_counting_them() -> None:
    light = CollectedLight(10_000.0, 5.6, 0.0, tone=1.0, grey_levels=1e9)
    assert pixel_variance(light, 5.6) == pytest.approx(1e-4)
    assert pixel_variance(light, 11.2) == pytest.approx(4e-4)
    assert pixel_variance(replace(light, read_noise_electrons=100.0), 5.6) == pytest.approx(2e-4)


def test_equalising_sigma_is_half_a_pixel_of_raw_image_or_panorama() -> None:
    assert equalising_sigma_px(0.2) == pytest.approx(0.5, rel=1e-3)
    assert equalising_sigma_px(3.0) == pytest.approx(1.5, rel=1e-3)
    assert 0.5 < equalising_sigma_px(1.0) < 0.52


def test_a_view_with_half_the_light_is_as_noisy_as_with_half_the_exposure() -> None:
    dim = replace(LIGHT, electrons_of_white=LIGHT.electrons_of_white / 2, grey_levels=LIGHT.grey_levels / 2)
    halves = noise_of(replace(UPPER, illumination=0.5), replace(LOWER, illumination=0.5))
    np.testing.assert_allclose(halves, noise_of(light=dim), rtol=1e-12)
    upper, lower = noise_of(replace(UPPER, illumination=0.5))
    assert upper > noise_of()[0]
    assert lower == pytest.approx(noise_of()[1], rel=1e-3)


def test_a_stretched_disc_is_a_disc_if_it_is_stretched_evenly() -> None:
    even = [replace(view, stretch=(1.0, 1.0)) for view in (UPPER, LOWER)]
    assert noise_of(*even) == pytest.approx(noise_of(), rel=1e-12)
    wider = [replace(view, stretch=(1.7, 1.7)) for view in (UPPER, LOWER)]
    assert noise_of(*wider) == pytest.approx(
        noise_of(*(replace(view, defocus=1.7 * view.defocus) for view in (UPPER, LOWER))), rel=1e-12
    )
    # Blur along the meridian costs more gradient along it than blur across does.
    alike = replace(UPPER, defocus=0.1)
    plain, along, across = (
        noise_of(*[replace(alike, stretch=each)] * 2)[0] for each in ((1.0, 1.0), (1.7, 1.0), (1.0, 1.7))
    )
    assert plain < across < along
