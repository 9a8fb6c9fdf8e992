"""What the points of a sweep learn from one another."""

import itertools
from contextlib import nullcontext

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designer.optimise.again import WORTH_A_CHANGE
from designer.optimise.search import search
from designer.requirement import set_key
from designer.study.sweep import plan, rounds
from designer.study.sweep.definition import Axis, SweepDefinition
from designer.study.sweep.plan import MOST_AFRESH, plan_points
from designer.study.sweep.run import run_sweep
from designer.study.sweep.tables import read_sweep_results
from support.drone import InThisProcess, configuration, drone, drone_sweep

NAMES = ("folded-HyPl-Hy-upper_inner", "folded-HyEl-Hy-upper_inner")
FIRST = "first_stage_depth_error_rms"
KEYS = ["asked.baseline_mm", "asked.envelope.height_mm"]


def sweep_drone(folder, start, progress=None):
    base = set_key(drone(60.0, 75.0), "solve.configurations", list(NAMES))
    run_sweep(drone_sweep(start), base, folder, workers=nullcontext(InThisProcess()), progress=progress)
    return read_sweep_results(folder)


@pytest.fixture(scope="module")
def from_one_point(tmp_path_factory):
    """A sweep that searches one point alone from scratch: elsewhere it depends on what points tell each other."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(plan, "MOST_AFRESH", 1)
        return sweep_drone(tmp_path_factory.mktemp("drone"), -1)


@pytest.mark.slow
def test_a_point_that_following_leads_astray_is_as_good_as_a_study(from_one_point):
    """Following the higher envelope's design alone ends with 9.41 % of depth error at 54 mm and 75 mm, not 6.01 %."""
    at = from_one_point.set_index([*KEYS, "configuration"])[FIRST]
    for name in NAMES:
        study = search(drone(54.0, 75.0), configuration(name)).first.goals["depth_error"]
        assert at[54.0, 75.0, name] <= study * 1.001


@pytest.mark.slow
def test_no_point_is_worse_than_a_stricter_one(from_one_point):
    for _, rows in from_one_point.groupby(["configuration", "asked.baseline_mm"]):
        values = rows.sort_values("asked.envelope.height_mm")[FIRST].fillna(np.inf)
        for stricter, looser in itertools.pairwise(values):
            assert looser <= stricter * (1.0 + WORTH_A_CHANGE)


class Interruption(Exception):
    pass


@pytest.mark.slow
def test_resumed_in_any_round_the_table_is_the_same(from_one_point, tmp_path, monkeypatch):
    monkeypatch.setattr(plan, "MOST_AFRESH", 1)
    stops = {(0, 3), (1, 2), (2, 1), (3, 1)}

    def stop_once(state):
        if (state.round, state.done) in stops:
            stops.remove((state.round, state.done))
            raise Interruption

    for _ in range(3):
        with pytest.raises(Interruption):
            sweep_drone(tmp_path, -1, stop_once)
    pd.testing.assert_frame_equal(sweep_drone(tmp_path, -1), from_one_point, check_exact=True)


@pytest.mark.slow
def test_opposite_starts_find_the_same(tmp_path):
    """Following alone leaves 5 of the 12 designs of the one sweep worse than those of the other."""
    tables = [sweep_drone(tmp_path / str(start), start).set_index([*KEYS, "configuration"]) for start in (0, -1)]
    np.testing.assert_allclose(tables[0][FIRST], tables[1][FIRST], rtol=1e-3)
    assert (tables[0]["rank"] == tables[1]["rank"]).all()


def grid_of(lengths):
    axes = [
        Axis(key=key, values=list(range(1, n + 1)))
        for key, n in zip(("baseline_mm", "noise_px", "envelope.height_mm"), lengths, strict=False)
    ]
    return plan_points(SweepDefinition(name="s", requirement="r.toml", axis=axes))


@given(st.lists(st.integers(1, 7), min_size=1, max_size=3))
@settings(deadline=None, max_examples=30)
def test_neighbours_on_a_grid_are_one_step_away_and_the_ends_are_searched_from_scratch(lengths):
    points = grid_of(lengths)
    for point in points:
        places = np.array(list(point.coordinates.values()))
        steps = [np.abs(np.array(list(other.coordinates.values())) - places).sum() for other in points]
        assert point.neighbours == tuple(number for number, step in enumerate(steps) if step == 1)
    afresh = [tuple(point.coordinates.values()) for point in points if point.is_afresh]
    assert len(afresh) <= MOST_AFRESH + 1  # and the root
    assert len(afresh) == len(points) or len(points) > MOST_AFRESH
    assert set(itertools.product(*[{1, n} for n in lengths])) <= set(afresh)


@given(st.integers(2, 40), st.integers(1, 3), st.integers(0, 99))
@settings(deadline=None, max_examples=20)
def test_neighbours_in_a_hypercube_are_mutual_and_join_all_points(count, axes, seed):
    definition = SweepDefinition(
        name="s",
        requirement="r",
        plan="latin_hypercube",
        points=count,
        seed=seed,
        axis=[Axis(key=key, low=1, high=2) for key in ("baseline_mm", "noise_px", "envelope.height_mm")[:axes]],
    )
    points = plan_points(definition)
    assert sum(point.is_afresh for point in points) == min(count, MOST_AFRESH)
    for point in points:
        assert point.number not in point.neighbours
        assert all(point.number in points[other].neighbours for other in point.neighbours)
        assert point.parent is None or point.parent in point.neighbours


class Reached:
    """What a store says of a sweep of one configuration."""

    def __init__(self, values):
        self.values = values

    def feasible_before(self, number, column):
        return {(point, NAMES[0]): value for point, value in self.values.items()}

    def impossible_before(self, number):
        return set()


def test_what_is_worse_than_its_neighbours_suggest_stands_out_the_worst_first():
    base = set_key(drone(60.0, 75.0), "solve.configurations", [NAMES[0]])
    points = grid_of([9])
    smooth = {point.number: 0.05 * 1.01**point.number for point in points}
    assert rounds._standing_out(Reached(smooth), base, points, 1) == []
    spoilt = smooth | {2: smooth[2] * 1.03, 6: smooth[6] * 1.1}
    found = rounds._standing_out(Reached(spoilt), base, points, 1)
    assert [number for number, _ in found] == [6, 2]
    without = {number: value for number, value in smooth.items() if number != 4}
    assert rounds._standing_out(Reached(without), base, points, 1) == [(4, NAMES[0])]
