"""Which designs a descent goes on with."""

from types import SimpleNamespace

import numpy as np

from designer.optimise import multistart
from designer.optimise.solver import StageTarget


def test_the_best_different_designs_go_into_the_next_round(monkeypatch):
    """Whatever the order of the starts; each round here offers every design other separating directions."""
    rounds = {}

    def design(value):
        goals = {"height": value}
        return SimpleNamespace(
            goals=goals, scaled=np.array([value]), directions=0, is_feasible=True, keeps=lambda goal: True
        )

    def minimise(run, target):
        start, choice = run
        rounds.setdefault(choice, []).append(float(start[0]))
        return SimpleNamespace(scaled=start, status="solved")

    monkeypatch.setattr(multistart, "minimise", minimise)
    monkeypatch.setattr(
        multistart, "_examine_results", lambda task, results, choices: [design(float(r.scaled[0])) for r in results]
    )
    monkeypatch.setattr(multistart, "_rechosen", lambda task, choice, candidate: choice + 1)
    task = SimpleNamespace(
        note=lambda result: result,
        run_from=lambda start, choice: (start, choice),
    )
    starts = [design(value) for value in (9.0, 8.0, 7.0, 6.0, 5.0, 1.0, 2.0, 1.0)]
    best = multistart.improve(task, starts, StageTarget("height"))
    assert rounds[0] == [9.0, 8.0, 7.0, 6.0, 5.0, 1.0, 2.0, 1.0]
    assert rounds[1] == [1.0, 2.0, 5.0, 6.0]
    assert [found.goals["height"] for found in best] == [9.0, 8.0, 7.0, 6.0, 5.0, 1.0, 2.0, 1.0]
