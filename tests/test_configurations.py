"""What a configuration's topology and its design record say of the image zones, and the words for kinds."""

from __future__ import annotations

from typing import get_args

import pytest

from designer.configurations import (
    TOPOLOGIES,
    VIEW_OF_SINGLE_MIRROR,
    MirrorKind,
    enumerate_configurations,
    outer_view,
    with_article,
)
from designer.design import VIEW_NAMES, ConicKind, read_design
from support import DATA


def test_the_topologies_differ_in_the_outer_view():
    assert {topology: outer_view(topology) for topology in TOPOLOGIES} == {
        "upper_outer": "upper",
        "upper_inner": "lower",
    }


@pytest.mark.parametrize("configuration", enumerate_configurations(), ids=lambda item: item.name)
def test_the_two_views_take_the_two_zones(configuration):
    assert {configuration.outer_view, configuration.inner_view} == set(VIEW_NAMES)
    assert configuration.zone_of(configuration.outer_view) == "outer"
    assert configuration.zone_of(configuration.inner_view) == "inner"
    assert configuration.name.endswith(f"-upper_{configuration.zone_of('upper')}")


def test_a_design_record_knows_its_outer_view():
    views = read_design(DATA / "folded_hypl_hy.json").views
    assert list(views.by_name) == list(VIEW_NAMES)
    assert (views.outer, views.inner) == ("upper", "lower")
    assert (views.by_name[views.outer].zone, views.by_name[views.inner].zone) == ("outer", "inner")
    zones = {"upper": views.upper.model_copy(update={"zone": "inner"}), "lower": views.lower}
    turned = views.model_copy(update=zones)
    assert (turned.outer, turned.inner) == ("lower", "upper")


def test_every_kind_has_its_word_adjective_and_article():
    assert {kind.word for kind in MirrorKind} == set(get_args(ConicKind))
    assert [with_article(kind.adjective) for kind in MirrorKind] == [
        "a plane",
        "a hyperboloidal",
        "an ellipsoidal",
        "a paraboloidal",
    ]


def test_mirrors_that_give_a_view_alone_are_those_of_single_kinds():
    names = {name for item in enumerate_configurations() for name in item.mirror_kinds}
    assert names - set(VIEW_OF_SINGLE_MIRROR) == {"primary", "secondary"}
