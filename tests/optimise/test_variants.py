"""The 44 and their variants: the pairing rule, and signs that say what the mirrors do."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from designer.configurations import FOLDING_PAIRS, MirrorKind, enumerate_configurations
from designer.optics.kinds import gain_of
from designer.optimise.variants import Variant, enumerate_variants
from support.shipped_problems import CONFIGURATIONS, VARIANTS, variant_name


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
    """The design notes' table of allowed q by role, written as ranges of the gain."""

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
    }
    assert all(len(labels[name]) == 1 for name in labels if name.startswith("direct"))


@given(st.floats(-0.99, 30.0).filter(lambda q: abs(q) > 1e-3))
def test_the_gain_inverts(q):
    gain = gain_of(q)
    assert (1.0 - gain) / (1.0 + gain) == pytest.approx(q, rel=1e-9, abs=1e-9)
