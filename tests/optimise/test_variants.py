"""The 44 and their variants: the pairing rule, and signs that say what the mirrors do."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.configurations import FOLDING_PAIRS, MirrorKind, enumerate_configurations
from designer.optics.kinds import gain_of
from designer.optimise.variants import PAIRS_OF_ELLIPSOIDS, Variant, enumerate_variants
from designer.study.record import record_of
from designer.trace.bundles import elevation_angles, pinhole_directions
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from designer.verify.judge import judge
from support.closed_forms import half_tangent
from support.drawn_designs import folded_design, kind_of
from support.shipped_problems import CONFIGURATIONS, VARIANTS, problem_of, shipped_requirement, variant_name
from support.wide_search import nearest_to_feasible


def test_there_are_exactly_44():
    configurations = enumerate_configurations()
    assert len(configurations) == len({configuration.name for configuration in configurations}) == 44
    assert sum(configuration.family == "direct" for configuration in configurations) == 8
    assert sum(configuration.family == "folded" for configuration in configurations) == 36
    assert "folded-HyPl-Hy-upper_outer" in CONFIGURATIONS
    assert sum(configuration.topology == "upper_outer" for configuration in configurations) == 22


def test_the_rule_gives_nine_pairs():
    finite = {MirrorKind.PLANE, MirrorKind.HYPERBOLOID, MirrorKind.ELLIPSOID}
    written_out = {pair for pair in product(finite, finite) if pair != (MirrorKind.PLANE, MirrorKind.PLANE)}
    written_out.add((MirrorKind.PARABOLOID, MirrorKind.PARABOLOID))
    assert set(FOLDING_PAIRS) == written_out
    assert len(FOLDING_PAIRS) == 9


@pytest.mark.parametrize("variant", VARIANTS, ids=variant_name)
def test_the_signs_of_a_folding_pair_multiply(variant: Variant):
    """kappa = kappa_secondary kappa_primary: the ranges of the factors must agree with the pair's sign."""
    fold = variant.fold
    if fold is None or fold.primary_gains is None:
        return
    secondary_sign = 1 if fold.inverse_gains[0] > 0 else -1
    primary_sign = 1 if fold.primary_gains[0] > 0 else -1
    assert fold.gain_sign == secondary_sign * primary_sign
    assert fold.inverse_gains[0] <= fold.inverse_gains[1]
    assert fold.primary_gains[0] < fold.primary_gains[1]


def test_the_allowed_shapes_of_each_role():
    """The table of kinds by role (docs/theory.md, section 8), written as ranges of the gain."""

    def shape(gain: float) -> str:
        q = (1.0 - gain) / (1.0 + gain)
        return "ellipsoid" if abs(q) > 1.0 else "hyperboloid"

    for variant in VARIANTS:
        fold, mirrors = variant.fold, variant.configuration.mirror_kinds
        for name, sign in variant.direct_gain_signs:
            assert (sign > 0) == (mirrors[name] is MirrorKind.HYPERBOLOID)
        if fold is None or fold.primary_gains is None or fold.inverse_gains[0] == fold.inverse_gains[1]:
            continue
        for end in fold.inverse_gains:
            assert shape(1.0 / end) == mirrors["secondary"].name.lower()
        for end in fold.primary_gains:
            assert shape(end) == mirrors["primary"].name.lower()
            assert mirrors["primary"] is not MirrorKind.HYPERBOLOID or 0.0 < end < 1.0  # convex only


def test_two_kinds_of_hyperboloidal_secondary_and_of_paraboloidal_primary():
    labels = {
        name: {variant.label for variant in enumerate_variants(configuration)}
        for name, configuration in CONFIGURATIONS.items()
    }
    assert labels["folded-HyHy-Hy-upper_outer"] == {"convex secondary", "concave secondary"}
    assert labels["folded-PaPa-El-upper_inner"] == {"convex primary", "concave primary"}
    assert labels["folded-ElEl-Hy-upper_outer"] == {
        "concave primary, shared focus above",
        "convex primary, shared focus below",
        "convex primary, shared focus between pinhole and primary",
    }
    assert all(len(labels[name]) == 1 for name in labels if name.startswith("direct"))


def test_every_combination_of_signs_of_two_ellipsoids_is_a_variant_or_has_a_reason():
    """Two places of the shared focus, two faces of the primary, two ways of its gain: eight, each once."""
    folds = [case.fold for case in PAIRS_OF_ELLIPSOIDS]
    signs = {(fold.inverse_gains[0] < -1.0, fold.primary_side, fold.primary_gains[0] < -1.0) for fold in folds}
    assert len(signs) == len(folds) == 8
    for case in PAIRS_OF_ELLIPSOIDS:
        narrows = case.fold.primary_gains[0] < -1.0
        # The secondary's second focus, v (1 + kappa), which the light crosses on its way to a concave primary.
        crossings = [1.0 + 1.0 / inverse for inverse in case.fold.inverse_gains]
        is_inside_camera = case.fold.primary_side < 0 and max(crossings) < 0.0
        assert bool(case.why_left_out) == (narrows or is_inside_camera)
    assert {case.fold.label for case in PAIRS_OF_ELLIPSOIDS if case.fold.is_seldom_feasible} == {
        "convex primary, shared focus between pinhole and primary"
    }
    # Warm starts of sweeps know a variant by its place.
    assert [variant.label for variant in enumerate_variants(CONFIGURATIONS["folded-ElEl-Hy-upper_outer"])] == [
        "concave primary, shared focus above",
        "convex primary, shared focus below",
        "convex primary, shared focus between pinhole and primary",
    ]


def test_a_shared_focus_between_pinhole_and_primary_traced():
    """The pair of issue 12: its numbers belong to one variant, and every ray goes as it should."""
    vertex, radius, conic = 62.1079, -3.0506, -0.90418
    q_secondary = vertex / (vertex + radius)
    assert -1.0 / q_secondary**2 == pytest.approx(conic, abs=5e-5)
    shared = vertex * (1.0 + gain_of(q_secondary))
    q_primary = 1.0 / math.sqrt(0.37382)
    # Vertex at z_A - c (1 + q), radius -c (1 - q^2) / q, with c < 0.
    c_primary = -0.19210 * q_primary / (q_primary**2 - 1.0)
    assert shared - c_primary * (1.0 + q_primary) == pytest.approx(61.0385, abs=0.01)
    viewpoint, kappa = shared - 2.0 * c_primary, gain_of(q_secondary) * gain_of(q_primary)
    inverse = 1.0 / gain_of(q_secondary)
    holding = [
        variant.label
        for variant in enumerate_variants(CONFIGURATIONS["folded-ElEl-Hy-upper_outer"])
        if variant.fold.inverse_gains[0] < inverse < variant.fold.inverse_gains[1]
        and variant.fold.primary_gains[0] < gain_of(q_primary) < variant.fold.primary_gains[1]
        and variant.fold.primary_side > 0
    ]
    assert holding == ["convex primary, shared focus between pinhole and primary"]
    design = folded_design(kappa, inverse, vertex, viewpoint, (-5.0, 5.0))
    assert kind_of(design, "primary") == "convex ellipsoid"
    instrument = build_instrument(design)
    tangents = [kappa * half_tangent(phi, "folded") for phi in np.linspace(-5.0, 5.0, 51)]
    trace = trace_sequential(
        instrument, instrument.path(design.views.lower.path), pinhole_directions(2.0 * np.arctan(tangents))
    )
    assert (trace.missed < 0).all()
    elevations = np.degrees(elevation_angles(trace.direction))
    assert np.sort(elevations) == pytest.approx(np.linspace(-5.0, 5.0, 51), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["folded-ElEl-Hy-upper_outer", "folded-ElEl-El-upper_inner"])
def test_the_judge_accepts_designs_with_a_shared_focus_between_pinhole_and_primary(name):
    requirement = shipped_requirement("pipe_inspection")
    variant = enumerate_variants(CONFIGURATIONS[name])[2]
    lens = requirement.camera.lenses[0]
    design = nearest_to_feasible(problem_of(requirement, variant), lens, starts=40, seed=1)
    assert design.is_feasible
    record = record_of(requirement, design)
    assert kind_of(record, "primary") == "convex ellipsoid"
    assert judge(record).passed


@given(st.floats(-0.99, 30.0).filter(lambda q: abs(q) > 1e-3))
def test_the_gain_inverts(q):
    gain = gain_of(q)
    assert (1.0 - gain) / (1.0 + gain) == pytest.approx(q, rel=1e-9, abs=1e-9)
