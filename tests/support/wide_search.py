"""A search with much wider ranges and no rules: what the optimiser calls infeasible must be so here too."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from designer.optimise.branch import goal_scales
from designer.optimise.multistart import Candidate, Task, make_feasible, start_around, start_at
from designer.optimise.problem import Problem
from designer.optimise.screening import screen
from designer.optimise.variables import Bounds, VariableBounds
from designer.requirement import Lens


def nearest_to_feasible(problem: Problem, lens: Lens, starts: int, seed: int) -> Candidate:
    """The design of least violation found from random starts over ranges that no rule and no requirement narrows."""
    wide = replace(problem, bounds=_widened(problem))
    task = Task(wide, lens, goal_scales(wide), Counter())
    random = np.random.default_rng(seed)
    reached = make_feasible(task, start_at(task, screen(wide, starts, random, least_gain_share=0.03)))
    nearest = min(reached, key=lambda candidate: candidate.violation)
    if nearest.is_feasible:
        return nearest
    return min([nearest, *make_feasible(task, start_around(task, nearest, random))], key=lambda each: each.violation)


def _widened(problem: Problem) -> VariableBounds:
    """Viewpoints as far off as a ray of the steepest slope from the widest mirror reaches, twice over; gains of a
    thousandth; a secondary's vertex from a millimetre to three envelopes up."""
    specification, bounds = problem.specification, dict(problem.bounds)
    envelope, front = specification.asked.envelope, specification.lens_front
    steepest = max(abs(np.tan(elevation)) for elevation in specification.elevations)
    parallax = bounds["baseline"].high / specification.distances[0]
    far = 4.0 * envelope.height_mm + envelope.diameter_mm * (1.0 + steepest + parallax)
    bounds["lower_viewpoint"] = Bounds(front - far - bounds["baseline"].high, front + far)
    bounds["secondary_height"] = Bounds(1.0, front + 3.0 * envelope.height_mm)
    for name in ("lower_gain", "upper_gain"):
        gain = bounds[name]
        bounds[name] = Bounds(gain.low / 1000.0, gain.high * 1.5, logarithmic=True)
    return bounds
