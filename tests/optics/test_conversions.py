"""Every form of a conic leads back to the one it came from, and describes the same points."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.optics.conic import FocalConic, conic_constant
from designer.optics.conversions import (
    BakerNayarForm,
    EccentricityForm,
    FocalForm,
    SemiAxesForm,
    Sheet,
    VertexForm,
    baker_nayar_from_focal,
    eccentricity_from_vertex,
    focal_from_baker_nayar,
    focal_from_semi_axes,
    focal_from_vertex,
    semi_axes_from_focal,
    vertex_from_eccentricity,
    vertex_from_focal,
)

signs = st.sampled_from([-1.0, 1.0])
hyperboloid_magnitudes = st.floats(0.02, 0.98)
ellipsoid_magnitudes = st.floats(1.02, 50.0)
curved_forms = st.builds(
    lambda c, side, q, sign: FocalForm(c * side, q * sign),
    st.floats(0.5, 500.0),
    signs,
    hyperboloid_magnitudes | ellipsoid_magnitudes,
    signs,
)
plane_forms = st.builds(lambda c, side: FocalForm(c * side, 0.0), st.floats(0.5, 500.0), signs)


def assert_same(first: FocalForm, second: FocalForm) -> None:
    assert second.half_focal_distance == pytest.approx(first.half_focal_distance, rel=1e-11)
    assert second.inverse_eccentricity == pytest.approx(first.inverse_eccentricity, rel=1e-11)


@given(curved_forms)
def test_vertex_form_round_trips(form: FocalForm) -> None:
    assert_same(form, focal_from_vertex(vertex_from_focal(form), form.sheet.second_focus))


@given(curved_forms | plane_forms)
def test_baker_nayar_form_round_trips(form: FocalForm) -> None:
    assert_same(form, focal_from_baker_nayar(baker_nayar_from_focal(form)))


@given(curved_forms | plane_forms)
def test_semi_axes_form_round_trips(form: FocalForm) -> None:
    assert_same(form, focal_from_semi_axes(semi_axes_from_focal(form)))


@given(curved_forms)
def test_eccentricity_form_round_trips(form: FocalForm) -> None:
    eccentricity = eccentricity_from_vertex(vertex_from_focal(form), form.sheet.second_focus)
    back = focal_from_vertex(vertex_from_eccentricity(eccentricity), eccentricity.sheet.second_focus)
    assert_same(form, back)


@given(st.floats(0.5, 500.0), signs, st.floats(-30.0, -0.01))
def test_vertex_form_survives_every_other_form(radius: float, sign: float, conic: float) -> None:
    if abs(conic + 1) < 0.01:
        return
    form = VertexForm(sign * radius, conic)
    for second_focus in ("ahead", "behind"):
        focal = focal_from_vertex(form, second_focus)
        for back in (
            focal_from_baker_nayar(baker_nayar_from_focal(focal)),
            focal_from_semi_axes(semi_axes_from_focal(focal)),
        ):
            assert back.sheet.second_focus == second_focus
            assert vertex_from_focal(back).radius == pytest.approx(form.radius, rel=1e-10)
            assert vertex_from_focal(back).conic_constant == pytest.approx(form.conic_constant, rel=1e-11)


@given(curved_forms)
def test_forms_agree_with_the_focal_conic_of_the_solver(form: FocalForm) -> None:
    conic = FocalConic(0.0, form.vertex_distance, 1 / form.gain)
    vertex = vertex_from_focal(form)
    assert conic.surface.curvature == pytest.approx(1 / vertex.radius, rel=1e-10)
    assert conic.surface.conic_term == pytest.approx((1 + vertex.conic_constant) / vertex.radius**2, rel=1e-9)
    assert conic_constant(conic.tangent_ratio) == pytest.approx(vertex.conic_constant, rel=1e-10)
    assert conic.other_focus_height == pytest.approx(2 * form.half_focal_distance, rel=1e-10)


@given(curved_forms, st.floats(0.05, 0.6))
def test_semi_axes_and_baker_nayar_hold_the_same_points(form: FocalForm, psi: float) -> None:
    c, q = form.half_focal_distance, form.inverse_eccentricity
    if abs(math.cos(psi) - q) < 1e-2:
        return
    rho = c * (1 - q * q) / (math.cos(psi) - q)
    radius, height = rho * math.sin(psi), rho * math.cos(psi)
    axes = semi_axes_from_focal(form)
    sign = 1.0 if form.kind == "ellipsoid" else -1.0
    terms = ((height - c) / axes.a) ** 2, sign * (radius / axes.b) ** 2
    assert sum(terms) - 1 == pytest.approx(0, abs=1e-10 * (1 + terms[0]))
    nayar = baker_nayar_from_focal(form)
    if form.kind == "ellipsoid":
        left = ((height - c) ** 2, radius**2 * (1 + 2 * c**2 / nayar.k))
        right = (nayar.k + 2 * c**2) / 2
    else:
        left = ((height - c) ** 2, -(radius**2) * (nayar.k / 2 - 1))
        right = c**2 * (nayar.k - 2) / nayar.k
    assert sum(left) - right == pytest.approx(0, abs=1e-10 * (left[0] + abs(left[1]) + right))


@given(st.floats(0.5, 500.0), signs)
def test_paraboloid_has_the_forms_that_exist(radius: float, sign: float) -> None:
    form = VertexForm(sign * radius, -1.0)
    assert form.kind == "paraboloid"
    assert vertex_from_eccentricity(eccentricity_from_vertex(form)) == form
    with pytest.raises(ValueError, match="infinity"):
        focal_from_vertex(form)


@given(plane_forms)
def test_plane_has_the_forms_that_exist(form: FocalForm) -> None:
    assert form.kind == "plane"
    assert form.gain == 1
    assert baker_nayar_from_focal(form).k == 2
    assert vertex_from_focal(form) == VertexForm(math.inf, 0.0)
    with pytest.raises(ValueError, match="where its foci are"):
        focal_from_vertex(vertex_from_focal(form))
    with pytest.raises(ValueError, match="infinite"):
        eccentricity_from_vertex(vertex_from_focal(form))


def test_published_mirror() -> None:
    """Upper hyperboloid of Jaramillo (2016): foci at 0 and 123.488, vertex 111.5648, radius 26.69995."""
    focal = focal_from_vertex(VertexForm(26.69995, -1.535920))
    assert 2 * focal.half_focal_distance == pytest.approx(123.488, abs=2e-3)
    assert focal.vertex_distance == pytest.approx(111.5648, abs=2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FocalForm(10.0, 1.0), "paraboloid"),
        (lambda: FocalForm(math.inf, 0.5), "finite foci"),
        (lambda: FocalForm(0.0, 0.5), "coincide"),
        (lambda: VertexForm(0.0, -1.0), "radius"),
        (lambda: focal_from_vertex(VertexForm(10.0, 0.3)), "on the axis"),
        (lambda: focal_from_vertex(VertexForm(10.0, 0.0)), "on the axis"),
        (lambda: eccentricity_from_vertex(VertexForm(10.0, 0.3)), "oblate"),
        (lambda: focal_from_baker_nayar(BakerNayarForm(50.0, 1.5, "hyperboloid", Sheet("convex"))), "above 2"),
        (lambda: focal_from_baker_nayar(BakerNayarForm(50.0, -1.0, "ellipsoid", Sheet("concave"))), "positive"),
        (lambda: focal_from_baker_nayar(BakerNayarForm(50.0, 3.0, "paraboloid", Sheet("concave"))), "limit"),
        (lambda: focal_from_baker_nayar(BakerNayarForm(50.0, 3.0, "hyperboloid", Sheet("flat"))), "flat sheet"),
        (lambda: focal_from_semi_axes(SemiAxesForm(30.0, 30.0, 50.0, Sheet("convex"))), "belong"),
        (lambda: focal_from_semi_axes(SemiAxesForm(-30.0, 40.0, 50.0, Sheet("convex"))), "negative"),
        (lambda: vertex_from_eccentricity(EccentricityForm(math.inf, 5.0, Sheet("flat"))), "plane"),
    ],
)
def test_what_is_no_such_conic_is_refused(make, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
