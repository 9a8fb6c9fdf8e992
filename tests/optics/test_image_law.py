"""The lens's law from angle to image radius, against OpenCV and against the perspective lens."""

import casadi
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.design import Projection, Sense
from designer.optics.image_law import PERSPECTIVE, ImageLaw, most_favourable, pinhole_tangent
from designer.optics.view import half_angle_tangent, image_radius, image_radius_slope

FOCAL_MM = 3.7
LAWS = (
    ImageLaw("equidistant"),
    ImageLaw("equisolid"),
    ImageLaw("stereographic"),
    ImageLaw("equidistant", (-0.05, 0.01, -0.002, 0.0003)),
    ImageLaw("perspective", (-0.1, 0.02)),
    ImageLaw("perspective", (0.15, 0.03, 0.002)),
)
IDS = [f"{law.projection}{list(law.coefficients) or ''}" for law in LAWS]


def radii_of_opencv(law: ImageLaw, psi: np.ndarray) -> np.ndarray:
    """Image radii along +x of points at angles psi, by OpenCV's own projection."""
    points = np.stack([np.sin(psi), np.zeros_like(psi), np.cos(psi)], axis=-1)
    camera, none = np.diag([FOCAL_MM, FOCAL_MM, 1.0]), np.zeros(3)
    k = [*law.coefficients, 0.0, 0.0, 0.0, 0.0]
    if law.projection == "perspective":
        found, _ = cv2.projectPoints(points, none, none, camera, np.array([k[0], k[1], 0.0, 0.0, k[2]]))
    else:
        found, _ = cv2.fisheye.projectPoints(points[None], none, none, camera, np.array(k[:4]))
    return found.reshape(-1, 2)[:, 0]


@pytest.mark.parametrize("law", [LAWS[0], *LAWS[3:], PERSPECTIVE], ids=[IDS[0], *IDS[3:], "perspective"])
def test_image_radii_are_those_of_opencv(law: ImageLaw) -> None:
    psi = np.linspace(0.0, min(law.widest, 1.3), 200)
    assert FOCAL_MM * law.ratio(np.tan(psi / 2.0)) == pytest.approx(radii_of_opencv(law, psi), rel=1e-12)


@pytest.mark.parametrize(("projection", "radius"), [
    ("equisolid", lambda psi: 2.0 * np.sin(psi / 2.0)),
    ("stereographic", lambda psi: 2.0 * np.tan(psi / 2.0)),
    ("equidistant", lambda psi: psi),
])  # fmt: skip
def test_named_laws_are_what_their_names_say(projection: Projection, radius: object) -> None:
    psi = np.linspace(-1.5, 1.5, 101)
    assert ImageLaw(projection).ratio(np.tan(psi / 2.0)) == pytest.approx(radius(psi), abs=1e-15, rel=1e-14)  # type: ignore[operator]


@pytest.mark.parametrize("law", LAWS, ids=IDS)
@given(share=st.floats(-0.999, 0.999))
def test_the_inverse_undoes_the_law_and_its_slope_is_its_derivative(law: ImageLaw, share: float) -> None:
    psi = share * law.widest
    tangent = np.tan(psi / 2.0)
    assert law.half_tangent(law.ratio(tangent)) == pytest.approx(tangent, rel=1e-9, abs=1e-15)
    # By complex steps, exact to rounding: the law is analytic.
    step = 1e-20
    derivative = np.imag(law.ratio(np.tan((psi + 1j * step) / 2.0))) / step
    assert law.ratio_slope(tangent) == pytest.approx(derivative, rel=1e-10)


@pytest.mark.parametrize("law", LAWS, ids=IDS)
@pytest.mark.parametrize(("sense", "gain"), [("direct", 0.3), ("folded", -0.25)])
def test_the_image_radius_changes_with_elevation_as_its_slope_says(law: ImageLaw, sense: Sense, gain: float) -> None:
    phi, step = np.linspace(-0.6, 0.6, 13), 1e-20
    moved = image_radius(np.tan(phi + 1j * step), gain, FOCAL_MM, sense, law)
    slope = image_radius_slope(np.tan(phi), gain, FOCAL_MM, sense, law)
    assert slope == pytest.approx(np.imag(moved) / step, rel=1e-10)
    # dr/dphi = (dr/dpsi) sin(psi) / cos(phi), whatever the gain: what the limit rests on.
    tangent = abs(gain) * half_angle_tangent(np.tan(phi), sense)
    psi = 2.0 * np.arctan(tangent)
    assert np.abs(slope) == pytest.approx(FOCAL_MM * law.ratio_slope(tangent) * np.sin(psi) / np.cos(phi), rel=1e-12)


@pytest.mark.parametrize("law", [*LAWS, PERSPECTIVE], ids=[*IDS, "plain perspective"])
def test_what_an_error_of_scale_is_worth_in_angle(law: ImageLaw) -> None:
    """A radius that is larger by a share is that of another angle: by central differences of the inverse."""
    psi, step = np.linspace(0.05, 0.9, 30) * min(law.widest, 1.4), 1e-6
    ratio = law.ratio(np.tan(psi / 2.0))
    low, high = (2.0 * np.arctan(law.half_tangent(ratio * scale)) for scale in (1.0 - step, 1.0 + step))
    share = (high - low) / (2.0 * step) / np.sin(psi)
    np.testing.assert_allclose(law.scale_share(np.tan(psi / 2.0)), share, rtol=1e-6)


def test_no_distortion_is_the_perspective_lens_to_the_last_bit() -> None:
    slope, gain = np.linspace(-0.9, 0.9, 50), 0.2
    zeros = ImageLaw("perspective", (0.0, 0.0, 0.0))
    for function in (image_radius, image_radius_slope):
        assert np.array_equal(function(slope, gain, 5.0, "direct", zeros), function(slope, gain, 5.0, "direct"))


def test_a_fisheye_polynomial_fitted_to_the_tangent_is_the_perspective_lens() -> None:
    # tan(psi) = psi (1 + psi^2/3 + 2 psi^4/15 + 17 psi^6/315 + 62 psi^8/2835 + ...); the rest is below 1e-12 at 0.05.
    law = ImageLaw("equidistant", (1.0 / 3.0, 2.0 / 15.0, 17.0 / 315.0, 62.0 / 2835.0))
    slope = np.linspace(-0.3, 0.3, 21)
    for function in (image_radius, image_radius_slope):
        fitted, exact = function(slope, 0.03, 12.0, "folded", law), function(slope, 0.03, 12.0, "folded")
        assert fitted == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_a_law_is_the_same_for_symbols(law: ImageLaw) -> None:
    tangent = casadi.SX.sym("tangent")
    named = (law.ratio, law.ratio_slope, law.scale_share, law.largest_stretch)
    function = casadi.Function("law", [tangent], [each(tangent) for each in named])
    for value in (0.05, 0.3):
        assert [float(part) for part in function(value)] == pytest.approx([float(each(value)) for each in named])


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_stretches_are_what_differences_of_the_two_images_say(law: ImageLaw) -> None:
    psi, step = np.linspace(0.05, 0.9 * min(law.widest, 1.2), 20), 1e-6

    def images(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return law.ratio(np.tan(angle / 2.0)), np.tan(angle)

    along, across = law.stretch(np.tan(psi / 2.0))
    (high, high_flat), (low, low_flat) = images(psi + step), images(psi - step)
    assert along == pytest.approx((high - low) / (high_flat - low_flat), rel=1e-8)
    assert across == pytest.approx(np.divide(*images(psi)), rel=1e-12)
    assert law.stretch(0.0) == pytest.approx((1.0, 1.0))
    assert pinhole_tangent(np.tan(psi / 2.0)) == pytest.approx(np.tan(psi))


@pytest.mark.parametrize("law", LAWS, ids=IDS)
def test_the_most_favourable_law_bounds_a_lens_at_every_smaller_angle(law: ImageLaw) -> None:
    psi = np.linspace(1e-3, 0.999 * law.widest, 700)
    tangent, bound = np.tan(psi / 2.0), most_favourable(law)
    resolved, best = law.ratio_slope(tangent) * np.sin(psi), bound.ratio_slope(tangent) * np.sin(psi)
    assert np.all(best >= np.maximum.accumulate(resolved) * (1.0 - 1e-6))
    assert np.all(bound.scale_share(tangent) <= np.minimum.accumulate(law.scale_share(tangent)) * (1.0 + 1e-6))
    # And it is no looser than it has to be.
    assert best == pytest.approx(np.maximum.accumulate(resolved), rel=1e-3)


def test_an_equisolid_lens_resolves_elevation_best_at_70_5_degrees() -> None:
    # d/dpsi of cos(psi/2) sin(psi) vanishes where sin^2(psi/2) = 1/3.
    law, psi = ImageLaw("equisolid"), np.radians([60.0, 70.5287794, 84.0])
    best = most_favourable(law).ratio_slope(np.tan(psi / 2.0)) * np.sin(psi)
    assert best[1] == pytest.approx(best[2], rel=1e-6)
    assert best[0] == pytest.approx(np.cos(psi[0] / 2.0) * np.sin(psi[0]), rel=1e-12)


def test_a_law_ends_where_its_radius_stops_rising() -> None:
    # x (1 + k x^2) has its maximum at x^2 = -1 / (3 k).
    law = ImageLaw("perspective", (-0.2,))
    stops = 2.0 * np.arctan(1.03 * np.tan(law.widest / 2.0))
    assert np.tan(stops) ** 2 == pytest.approx(1.0 / 0.6, rel=1e-9)
    assert law.half_tangent(10.0) == pytest.approx(np.tan(law.widest / 2.0))
