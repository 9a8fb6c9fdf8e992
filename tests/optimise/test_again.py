"""What neighbours tell each other: a poor optimum is left for a neighbour's, and nothing gets worse."""

import pytest

from designer.optimise.again import Fresh, search_again
from designer.optimise.search import search
from support.drone import configuration, drone

NAME = "folded-HyPl-Hy-upper_inner"


@pytest.fixture(scope="module")
def trapped():
    """Designs that follow those of a higher envelope, into an optimum half as bad again as another at its side."""
    high = search(drone(54.0, 100.0), configuration(NAME))
    return search(
        drone(54.0, 76.0),
        configuration(NAME),
        search(drone(54.0, 85.0), configuration(NAME), high.warm_starts).warm_starts,
    )


@pytest.fixture(scope="module")
def stricter():
    return search(drone(54.0, 75.0), configuration(NAME))


def depth_error(result):
    return result.first.goals["depth_error"]


def test_what_a_stricter_requirement_allows_a_looser_one_has(trapped, stricter):
    assert depth_error(trapped) > 1.3 * depth_error(stricter)
    better = search_again(drone(54.0, 76.0), configuration(NAME), trapped.warm_starts, [stricter.warm_starts])
    assert better.first.is_feasible
    assert better.best.is_feasible
    assert depth_error(better) <= depth_error(stricter) * (1.0 + 1e-6)
    assert better.best.goals["height"] <= 76.0 * (1.0 + 1e-6)


def test_what_is_better_stays(trapped, stricter):
    own = search(drone(54.0, 76.0), configuration(NAME)).warm_starts
    assert (
        search_again(drone(54.0, 76.0), configuration(NAME), own, [trapped.warm_starts, stricter.warm_starts]) is None
    )


def test_a_neighbours_design_is_found_where_there_was_none(stricter):
    found = search_again(drone(54.0, 76.0), configuration(NAME), (), [stricter.warm_starts])
    assert depth_error(found) <= depth_error(stricter) * (1.0 + 1e-6)


def test_fresh_starts_find_what_a_search_does(trapped, stricter):
    """All of them, and the seed of the requirement: the result of a search, or better."""
    alone = search(drone(54.0, 76.0), configuration(NAME))
    again = search_again(drone(54.0, 76.0), configuration(NAME), trapped.warm_starts, [], Fresh())
    assert depth_error(again) <= depth_error(alone) * (1.0 + 1e-7)
