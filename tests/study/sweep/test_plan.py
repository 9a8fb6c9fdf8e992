from random import Random

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

from designer.study.sweep.definition import Axis, SweepDefinition
from designer.study.sweep.plan import plan_points, spanning_tree
from designer.study.sweep.schedule import Schedule

KEYS = ("baseline_mm", "noise_px", "envelope.height_mm")


def grid_of(lengths):
    axes = [Axis(key=key, values=list(range(1, n + 1))) for key, n in zip(KEYS, lengths, strict=False)]
    return SweepDefinition(name="s", requirement="r.toml", axis=axes)


@given(st.lists(st.integers(1, 6), min_size=1, max_size=3))
def test_grid_is_a_tree_of_single_steps(lengths):
    points = plan_points(grid_of(lengths))
    assert len(points) == np.prod(lengths)
    assert [point.number for point in points] == list(range(len(points)))
    assert sum(point.parent is None for point in points) == 1
    for point in points:
        if point.parent is not None:
            steps = [abs(point.coordinates[key] - points[point.parent].coordinates[key]) for key in point.coordinates]
            assert sorted(steps) == [0] * (len(steps) - 1) + [1]


@given(st.lists(st.integers(1, 5), min_size=3, max_size=3), st.integers(0, 4), st.integers(0, 4))
def test_grid_is_rooted_where_its_axes_start(lengths, first, last):
    starts = (min(first, lengths[0] - 1) + 1, None, min(last, lengths[2] - 1) + 1)
    axes = [
        Axis(key=key, values=list(range(1, n + 1)), **({} if start is None else {"start": start}))
        for key, n, start in zip(KEYS, lengths, starts, strict=True)
    ]
    points = plan_points(SweepDefinition(name="s", requirement="r.toml", axis=axes))
    (root,) = [point for point in points if point.parent is None]
    assert tuple(root.coordinates.values()) == (starts[0], lengths[1] // 2 + 1, starts[2])
    for point in points:
        steps = 0
        while point.parent is not None:
            point, steps = points[point.parent], steps + 1
        assert point is root
        assert steps <= sum(lengths)


@given(st.integers(2, 40), st.integers(1, 3), st.integers(0, 99))
@settings(deadline=None, max_examples=30)
def test_spanning_tree_is_as_short_as_scipys(count, axes, seed):
    places = np.random.default_rng(seed).random((count, axes))
    parents = spanning_tree(places)
    length = sum(np.linalg.norm(places[i] - places[up]) for i, up in enumerate(parents) if up is not None)
    assert parents.count(None) == 1
    assert np.isclose(length, minimum_spanning_tree(cdist(places, places)).sum(), rtol=1e-12)


def test_hypercube_covers_every_axis_evenly():
    axes = [Axis(key="baseline_mm", low=90, high=110), Axis(key="noise_px", low=0.01, high=1, spacing="logarithmic")]
    definition = SweepDefinition(name="s", requirement="r", plan="latin_hypercube", points=20, seed=3, axis=axes)
    points = plan_points(definition)
    assert plan_points(definition) == points
    shares = [(point.coordinates["baseline_mm"] - 90) / 20 for point in points]
    assert sorted(int(share * 20) for share in shares) == list(range(20))
    logs = [(np.log10(point.coordinates["noise_px"]) + 2) / 2 for point in points]
    assert sorted(int(share * 20) for share in logs) == list(range(20))


@given(st.lists(st.integers(1, 5), min_size=1, max_size=3), st.integers(0, 999), st.integers(1, 3))
@settings(deadline=None)
def test_every_task_runs_once_after_its_parent_whatever_was_finished_or_lost(lengths, seed, chunks):
    random = Random(seed)
    points = plan_points(grid_of(lengths))
    first = Schedule(points, chunks, ())
    finished = []
    for _ in range(random.randint(0, first.total)):
        finished.append(first.take())
        first.finish(finished[-1])
    again = Schedule(points, chunks, finished)
    parents = {point.number: point.parent for point in points}
    done = set(finished)
    while again:
        task = again.take()
        assert task not in done
        if random.random() < 0.2:
            again.give_back(task)
            continue
        assert parents[task[0]] is None or (parents[task[0]], task[1]) in done
        done.add(task)
        again.finish(task)
    assert len(done) == again.total == len(points) * chunks
