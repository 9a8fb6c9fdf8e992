"""Kinds of conic: signs and gains against the two-focus construction and against every design that was studied."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.configurations import FLATTEST, MOST_PARABOLIC, VIEW_OF_SINGLE_MIRROR, MirrorKind
from designer.design import Design
from designer.optics.kinds import (
    CONVEX_HYPERBOLOID_GAINS,
    ELLIPSOID_GAINS,
    conic_with_focus,
    inverse_eccentricities,
    kind_of_conic,
    kind_of_single_mirror,
    radius_signs,
)
from support import DATA
from support.closed_forms import conic_mirror

DESIGNS = [Design.model_validate(record) for record in json.loads((DATA / "studied_designs.json").read_text("utf-8"))]
single_mirrors = st.floats(0.05, 0.95) | st.floats(1.05, 20.0)


def two_foci(q: float, viewpoint: float) -> dict[str, float]:
    """A mirror with foci at the pinhole and at a viewpoint, from its points: where their two distances keep their sum.

    The vertex is the point on the axis; a second point fixes the radius through z = c R^2 / 2 + ..., K through both.
    """
    mirror = conic_mirror("mirror", 0.0, viewpoint, q, "down", (0.0, 1e-3))
    return {key: mirror[key] for key in ("vertex_mm", "radius_mm", "conic")}


@pytest.mark.parametrize(
    ("conic", "kind"),
    [
        (-1.0 - 1e-12, MirrorKind.HYPERBOLOID),
        (-1.0, MirrorKind.PARABOLOID),
        (-1.0 + 1e-12, MirrorKind.ELLIPSOID),
        (0.0, MirrorKind.ELLIPSOID),
    ],
)
def test_the_conic_constant_decides_the_kind(conic, kind):
    assert kind_of_conic(conic) is kind


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_every_mirror_of_every_studied_design_is_of_the_kind_and_sign_allowed(design):
    kinds = {mirror.name: mirror.kind for mirror in design.mirrors}
    both_ellipsoids = kinds.get("primary") == kinds.get("secondary") == "ellipsoid"
    for mirror in design.mirrors:
        if mirror.radius_mm is None:
            continue
        kind = kind_of_conic(mirror.conic)
        assert kind.word == mirror.kind
        assert math.copysign(1, mirror.radius_mm) in radius_signs(
            mirror.name, kind, may_share_focus_below=both_ellipsoids
        )


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.configuration)
def test_every_way_to_the_inverse_eccentricity_of_a_studied_mirror_agrees(design):
    checked = 0
    for name, view_name in VIEW_OF_SINGLE_MIRROR.items():
        mirror = next((mirror for mirror in design.mirrors if mirror.name == name), None)
        if mirror is None or mirror.radius_mm is None:
            continue
        view = design.views.by_name[view_name]
        given_numbers = {"vertex_mm": mirror.vertex_mm, "radius_mm": mirror.radius_mm, "conic": mirror.conic}
        ways = inverse_eccentricities(given_numbers, {"viewpoint_mm": view.viewpoint_mm, "gain": view.gain})
        assert len(ways) == 5
        assert len({words for words, _ in ways}) == 5
        for _, q in ways:
            assert q == pytest.approx(ways[0][1], rel=1e-9)
            assert kind_of_single_mirror(q).word == mirror.kind
        checked += 1
    assert checked > 0


@given(single_mirrors, st.floats(5.0, 300.0))
def test_a_mirror_between_two_foci_has_a_focus_where_its_conic_constant_says(q, viewpoint):
    mirror = two_foci(q, viewpoint)
    for focus in (0.0, viewpoint):
        assert conic_with_focus(mirror["vertex_mm"] - focus, mirror["radius_mm"]) == pytest.approx(
            mirror["conic"], rel=1e-9
        )
    assert conic_with_focus(0.0, mirror["radius_mm"]) == -math.inf
    # The vertex lies as far along q as the ratio of its distances from the foci: they differ by 2 c q in all.
    to_pinhole, to_viewpoint = abs(mirror["vertex_mm"]), abs(mirror["vertex_mm"] - viewpoint)
    across = to_pinhole - to_viewpoint if q < 1 else to_pinhole + to_viewpoint
    assert across == pytest.approx(viewpoint * q, rel=1e-9)


@given(single_mirrors, st.floats(5.0, 300.0))
def test_any_two_numbers_of_a_single_mirror_give_its_inverse_eccentricity(q, viewpoint):
    mirror = two_foci(q, viewpoint)
    for keys in (("conic",), ("vertex_mm", "radius_mm")):
        ((_, found),) = inverse_eccentricities({key: mirror[key] for key in keys}, {})
        assert found == pytest.approx(q, rel=1e-9)
    for key in ("vertex_mm", "radius_mm"):
        ((_, found),) = inverse_eccentricities({key: mirror[key]}, {"viewpoint_mm": viewpoint})
        assert found == pytest.approx(q, rel=1e-9, abs=1e-9)


def test_gains_of_folding_pairs_stay_away_from_the_neighbouring_kinds():
    low, high = CONVEX_HYPERBOLOID_GAINS
    assert 0 < low < high < 1
    # Eccentricity 1 / q of a hyperboloid, of an ellipsoid: q from the gain by kappa (1 + q) = 1 - q.
    assert (1 - low) / (1 + low) == pytest.approx(MOST_PARABOLIC)
    assert (1 - high) / (1 + high) == pytest.approx(FLATTEST)
    least, greatest = ELLIPSOID_GAINS
    assert -1 < least < greatest < 0
    assert (1 + least) / (1 - least) == pytest.approx(FLATTEST)
    assert (1 + greatest) / (1 - greatest) == pytest.approx(MOST_PARABOLIC)
