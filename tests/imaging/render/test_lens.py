"""The lens: diffraction against the analytic pupil, light against projected areas, electrons against the f-number."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j1

from designer.imaging.render.detector import Detector, Exposure, expose
from designer.imaging.render.lens import RenderedLens, diffract, diffraction_transfer, working_f_number
from designer.imaging.render.raytracing import NO_VIEW, UPPER_VIEW, ground_truth, render
from designer.imaging.render.scenes.shapes import Sphere
from designer.imaging.render.scenes.world import World
from designer.imaging.render.textures import Texture
from support.studied_designs import studied_design, with_coarse_pixels

PROTOTYPE = "indoor_robot:folded-HyPl-Hy-upper_outer"
WAVELENGTH_NM = 550.0


def _white_world() -> World:
    out_of_sight = Sphere((0.0, 0.0, -1e6), 1.0)
    return World("white", (out_of_sight,), np.array([1.0]), np.zeros((1, 3)), Texture(()), background=1.0)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.7, 0.95, 1.0, 1.3])
def test_diffractions_transfer_is_the_overlap_of_two_pupils(share: float) -> None:
    """Goodman: the transfer is the area that two copies of the pupil share, shifted apart; here counted on a grid."""
    camera = studied_design(PROTOTYPE).camera
    cut_off = 1.0 / (WAVELENGTH_NM * 1e-6 * camera.focal_length_mm / (2.0 * camera.pupil_radius_mm))
    y, x = np.mgrid[-1:1:2001j, -1:1:2001j]
    inside = x**2 + y**2 <= 1
    overlap = (inside & ((x - 2 * share) ** 2 + y**2 <= 1)).sum() / inside.sum()
    assert float(diffraction_transfer(share * cut_off, camera, WAVELENGTH_NM)) == pytest.approx(overlap, abs=2e-4)


def test_a_wave_on_the_sensor_keeps_the_contrast_that_the_pupil_passes() -> None:
    camera = studied_design(PROTOTYPE).camera.model_copy(update={"width_px": 512, "height_px": 256})
    columns = np.arange(512)
    for cycles_per_px in (0.03125, 0.125, 0.25, 0.4375):
        wave = np.tile(0.5 + 0.25 * np.cos(2 * np.pi * cycles_per_px * columns), (256, 1)).astype(np.float32)
        # Far from the dark surroundings, over whole periods.
        middle = diffract(wave, camera, WAVELENGTH_NM)[96:160, 128:384].astype(float)
        amplitude = 2 * np.abs((middle * np.exp(-2j * np.pi * cycles_per_px * columns[128:384])).mean(axis=1))
        expected = 0.25 * diffraction_transfer(cycles_per_px / camera.pixel_pitch_mm, camera, WAVELENGTH_NM)
        np.testing.assert_allclose(amplitude, expected, rtol=4e-3)


def test_a_point_becomes_airys_disc() -> None:
    """With pixels much finer than the spot, a bright pixel spreads into (2 J1(x) / x)^2, dark at 1.22 lambda N."""
    fine = studied_design(PROTOTYPE).camera.model_copy(
        update={"width_px": 257, "height_px": 257, "pixel_pitch_mm": 0.0004}
    )
    point = np.zeros((257, 257), dtype=np.float32)
    point[128, 128] = 1.0
    spot = diffract(point, fine, WAVELENGTH_NM)
    rows, columns = np.mgrid[-128:129, -128:129]
    f_number = fine.focal_length_mm / (2.0 * fine.pupil_radius_mm)
    x = np.pi * np.hypot(rows, columns) * fine.pixel_pitch_mm / (WAVELENGTH_NM * 1e-6 * f_number) + 1e-12
    airy = (2 * j1(x) / x) ** 2
    near = x < 8.0
    np.testing.assert_allclose(spot[near] / spot.max(), airy[near], atol=2e-3)
    assert spot.sum() == pytest.approx(1.0, abs=0.03)
    first_dark = 1.22 * WAVELENGTH_NM * 1e-6 * f_number / fine.pixel_pitch_mm
    profile = spot[128, 128:]
    assert abs(int(np.argmin(profile[: round(1.5 * first_dark)])) - first_dark) <= 1.0


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 1.2), st.floats(8.0, 16.0))
def test_light_falls_as_the_projected_pupil_and_the_pixels_solid_angle_do(psi: float, f_number: float) -> None:
    """Irradiance of a small pupil at the place of the sensor that the angle psi images to, by rings and sectors."""
    focal = 12.0
    radius, height = focal / f_number / 2.0, focal * np.tan(psi)
    reach, angle = np.meshgrid(radius * np.sqrt((np.arange(50) + 0.5) / 50), 2 * np.pi * np.arange(50) / 50)
    # Radiance 1: the cosines at pupil and sensor over the distance squared.
    squared = focal**2 + (height - reach * np.cos(angle)) ** 2 + (reach * np.sin(angle)) ** 2
    expected = (focal**2 / squared**2).mean() * focal**2
    direction = np.array([[np.sin(psi), 0.0, np.cos(psi)]])
    share = float(RenderedLens(mirror_reflectivity=1.0).transmission(direction, np.array([0]))[0])
    assert share == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("aperture", [False, True])
def test_a_white_world_has_the_radiance_of_its_reflections_and_angle(aperture: bool) -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 8)
    lens = RenderedLens(wavelength_nm=None, mirror_reflectivity=0.8)
    image = render(design, _white_world(), samples=3, aperture=aperture, lens=lens)
    plain = render(design, _white_world(), samples=3, aperture=aperture)
    camera, view = design.camera, ground_truth(design, _white_world()).view
    # Where every ray of a pixel sees the world, which is white, by the same view as around it.
    free = (plain > 1.0 - 1e-6) & (view != NO_VIEW)
    reach = 3 if aperture else 1
    for down, right in product((-reach, 0, reach), repeat=2):
        free &= np.roll(view, (down, right), (0, 1)) == view
    assert min((free & (view == number)).sum() for number in (1, 2)) > 100
    rows, columns = np.nonzero(free)
    u0, v0 = camera.principal_point_px
    tangent = np.hypot(columns - u0, rows - v0) * camera.pixel_pitch_mm / camera.focal_length_mm
    mirrors = np.where(view[free] == UPPER_VIEW, len(design.views.upper.path), len(design.views.lower.path))
    np.testing.assert_allclose(image[free], 0.8**mirrors / (1 + tangent**2) ** 2, rtol=2e-3)
    # The folded view meets one mirror more.
    assert len(design.views.lower.path) == len(design.views.upper.path) + 1


def test_energy_is_kept_by_diffraction() -> None:
    design = with_coarse_pixels(studied_design(PROTOTYPE), 8)
    images = [
        render(design, _white_world(), samples=2, aperture=True, lens=RenderedLens(wavelength_nm=wavelength))
        for wavelength in (None, 550.0, 1100.0)
    ]
    for image in images[1:]:
        assert image.sum() == pytest.approx(float(images[0].sum()), rel=5e-3)
    # Twice the wavelength, softer edges.
    steepest = [float(np.abs(np.diff(image, axis=1)).max()) for image in images]
    assert steepest[0] > steepest[1] > steepest[2]


def test_the_working_f_number_counts_the_focus() -> None:
    camera = studied_design(PROTOTYPE).camera
    # A lens of 12 mm that focuses at 100 mm sits 13.64 mm from the sensor.
    assert working_f_number(camera) == pytest.approx(5.6 * 100.0 / (100.0 - 12.0), rel=1e-9)


def test_electrons_fall_with_the_square_of_the_f_number_and_so_does_the_signal() -> None:
    light = Exposure(white_electrons=8000.0, f_number=2.8)
    assert light.electrons_at(5.6) == pytest.approx(2000.0)
    grey = np.full((300, 400), 0.5, dtype=np.float32)
    detector = Detector(10_000.0, 5.0, white_electrons=light.electrons_at(5.6))
    counts = expose(grey, detector, bits=16).astype(float) / 65535 * 10_000.0
    assert counts.mean() == pytest.approx(1000.0, abs=1.0)
    assert counts.std() == pytest.approx(np.sqrt(1000.0 + 25.0), rel=0.01)
    # Ten thousand electrons fill a pixel: a lens opened to f/1.4 shows white where half grey stands.
    open_wide = Detector(10_000.0, 5.0, white_electrons=light.electrons_at(1.4))
    assert np.all(expose(grey, open_wide) == 255)


def test_a_detector_without_given_light_is_filled_by_white() -> None:
    ramp = np.linspace(0, 1, 5000, dtype=np.float32).reshape(50, 100)
    given_light = Detector(9000.0, 8.0, white_electrons=9000.0)
    np.testing.assert_array_equal(expose(ramp, Detector(9000.0, 8.0), seed=3), expose(ramp, given_light, seed=3))
