"""The order of results: equal in the first objective, then by the second; the rest by the first."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from designer.requirement import set_key
from designer.study.ranking import ranking, tied_with_best
from designer.study.row import Row
from support.shipped_problems import shipped_requirement

scores = st.tuples(st.floats(0.01, 0.02), st.floats(50.0, 150.0))
PLACES = {status: place for place, status in enumerate(("feasible", "infeasible", "failed", "impossible"))}


def feasible(first: float, second: float, minimise: str = "depth_error_rms", then: str = "height_mm") -> Row:
    """As much of a row as ranking looks at."""
    return Row({"status": "feasible", f"first_stage_{minimise}": first, then: second})


@given(
    st.lists(scores, max_size=12),
    st.sampled_from([0.0, 1.0, 20.0]),
    st.sampled_from([("height", "height_mm"), ("diameter", "diameter_mm"), ("volume", "volume_cm3")]),
)
def test_near_ties_rank_by_the_second_objective(pairs, percent, then):
    goal, column = then
    objective = {"minimise": "depth_error", "then": goal, "within_percent": percent}
    requirement = set_key(shipped_requirement("indoor_robot"), "objective", objective)
    order = ranking(requirement, [feasible(first, second, then=column) for first, second in pairs])
    assert sorted(order) == list(range(len(pairs)))
    firsts, seconds = ([pairs[place][part] for place in order] for part in (0, 1))
    # Solvers end some billionths apart at one optimum: a ranking by that would mean nothing.
    bound = min(firsts, default=0.0) * (1.0 + max(percent / 100.0, 1e-7))
    equal = sum(first <= bound for first in firsts)
    assert all(first <= bound for first in firsts[:equal])
    assert seconds[:equal] == sorted(seconds[:equal])
    assert firsts[equal:] == sorted(firsts[equal:])
    assert tied_with_best(requirement.objective, [feasible(*pair, then=column) for pair in pairs]) == equal


@given(st.lists(st.sampled_from(["impossible", "failed", "infeasible", "feasible"]), max_size=20))
def test_what_is_not_feasible_follows_in_the_order_given(statuses):
    rows = [
        feasible(0.01, float(number)) if status == "feasible" else Row({"status": status})
        for number, status in enumerate(statuses)
    ]
    order = ranking(shipped_requirement("indoor_robot"), rows)
    assert order == sorted(range(len(rows)), key=lambda number: (PLACES[statuses[number]], number))


def test_another_objective_ranks_by_its_own_name():
    objective = {"minimise": "volume", "then": "depth_error", "within_percent": 1.0}
    requirement = set_key(shipped_requirement("indoor_robot"), "objective", objective)
    better, worse = (
        feasible(first, then, "volume_cm3", "depth_error_rms") for first, then in ((1.0, 0.2), (1.005, 0.1))
    )
    assert ranking(requirement, [better, worse]) == [1, 0]
