"""The order of results: equal in the first objective, then by the second; the rest by the first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from designer.requirement import set_key
from designer.study.ranking import rank
from support.shipped_problems import CONFIGURATIONS, shipped_requirement

CONFIGURATION = CONFIGURATIONS["folded-HyPl-Hy-upper_outer"]
scores = st.tuples(st.floats(0.01, 0.02), st.floats(50.0, 150.0))


def feasible(first: float, second: float, then: str = "height") -> Any:
    """As much of a result as ranking looks at."""
    key = {"volume": "volume_cm3", "depth_error": "depth_error_rms"}.get(then, f"{then}_mm")
    return SimpleNamespace(
        configuration=CONFIGURATION,
        status="feasible",
        first=SimpleNamespace(goals={"depth_error": first, "height": first, "volume": first}),
        design=SimpleNamespace(score={"second_stage": {key: second}}),
    )


def other(status: str, number: int) -> Any:
    return SimpleNamespace(configuration=CONFIGURATION, status=status, first=None, design=None, number=number)


@given(
    st.lists(scores, max_size=12), st.sampled_from([0.0, 1.0, 20.0]), st.sampled_from(["height", "diameter", "volume"])
)
def test_near_ties_rank_by_the_second_objective(pairs, percent, then):
    objective = {"minimise": "depth_error", "then": then, "within_percent": percent}
    requirement = set_key(shipped_requirement("indoor_robot"), "objective", objective)
    given_results = [feasible(first, second, then) for first, second in pairs]
    ranked = rank(requirement, given_results)
    assert sorted(map(id, ranked)) == sorted(map(id, given_results))
    if not ranked:
        return
    firsts = [result.first.goals["depth_error"] for result in ranked]
    seconds = [next(iter(result.design.score["second_stage"].values())) for result in ranked]
    # Solvers end some billionths apart at one optimum: nobody asks to rank by that.
    bound = min(firsts) * (1.0 + max(percent / 100.0, 1e-7))
    equal = sum(first <= bound for first in firsts)
    assert all(first <= bound for first in firsts[:equal])
    assert seconds[:equal] == sorted(seconds[:equal])
    assert firsts[equal:] == sorted(firsts[equal:])


@given(st.lists(st.sampled_from(["impossible", "failed", "infeasible", "feasible"]), max_size=20))
def test_what_is_not_feasible_follows_in_the_order_given(statuses):
    results = [
        feasible(0.01, float(number)) if status == "feasible" else other(status, number)
        for number, status in enumerate(statuses)
    ]
    ranked = rank(shipped_requirement("indoor_robot"), results)
    order = ("feasible", "infeasible", "failed", "impossible")
    places = [order.index(result.status) for result in ranked]
    assert places == sorted(places)
    for status in order[1:]:
        numbers = [result.number for result in ranked if result.status == status]
        assert numbers == sorted(numbers)


def test_another_objective_ranks_by_its_own_name():
    objective = {"minimise": "volume", "then": "depth_error", "within_percent": 1.0}
    requirement = set_key(shipped_requirement("indoor_robot"), "objective", objective)
    better, worse = feasible(1.0, 0.2, "depth_error"), feasible(1.005, 0.1, "depth_error")
    assert rank(requirement, [better, worse]) == [worse, better]
