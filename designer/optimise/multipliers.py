"""What each requirement costs: the derivative of a design's first objective by a key, from Lagrange's multipliers.

At a minimum the objective changes with a parameter as the Lagrangian does with everything else held (the envelope
theorem), so one solution tells what one more millimetre of anything is worth. It belongs to the first stage, and holds
while the same constraints hold the design.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from designer.files import InputError
from designer.optimise.branch import problem_of
from designer.optimise.multistart import Candidate
from designer.optimise.program import problem_parameters
from designer.optimise.solver import Run, StageTarget, minimise_for_multipliers
from designer.requirement import Requirement, set_key
from designer.requirement.design_quantities import design_quantities, number_at

# Share of a key's value by which it is moved to see which parameters follow it; they follow smoothly.
KEY_STEP = 1e-6
WHERE_IT_IS_ZERO = 1e-6
# Solved again, an optimum comes back to within this, as a share.
SAME_OPTIMUM = 1e-6

F_NUMBER = "camera.lens.f_number"
"""The f-number of the lens that a design has, whichever of a catalogue's it is; its unit is one stop."""
F_NUMBERS_PER_STOP = math.log(2.0) / 2.0
"""Change of an f-number with stops, as a share of itself: a stop halves the light, and f-numbers go with its root."""

KEYS = (*design_quantities(), F_NUMBER)
"""Keys that hold or shape a design in any requirement."""


def first_stage_multipliers(
    requirement: Requirement, first: Candidate, keys: Sequence[str] = KEYS
) -> dict[str, float] | None:
    """Derivative of the least first objective by each key, in the objective's unit for each unit of the key.

    Parameters
    ----------
    requirement
        The one that ``first`` is the first-stage optimum of.
    first
        A candidate as the search gives it.
    keys
        Dotted names of numeric keys; those whose value is free, infinite or cannot be moved both ways are left out.
        The unit of the f-number is one stop, a factor of the root of two; that of any other key is in its name.

    Returns
    -------
    None if the solver does not confirm the optimum. A negative value says that more of it lowers the objective.
    """
    goal = requirement.objective.minimise
    run = Run(first.problem, first.directions, first.scaled, first.scales)
    result = minimise_for_multipliers(run, StageTarget(goal))
    scale = dict(zip(first.goals, first.scales, strict=True))[goal]
    reached, expected = result.objective * scale, first.goals[goal]
    if not result.converged or abs(reached - expected) > SAME_OPTIMUM * expected:
        return None
    lens = requirement.camera.lenses.index(first.lens)
    slopes = {}
    for key in keys:
        moves = _parameter_slopes(requirement, first, lens, key)
        if moves is not None:
            slopes[key] = scale * float(result.slopes[: len(moves)] @ moves)
    return slopes


def _parameter_slopes(requirement: Requirement, first: Candidate, lens: int, key: str) -> NDArray[np.float64] | None:
    """Change of the program's parameters with a key, for one of its units; None if the key cannot be moved."""
    is_catalogue = isinstance(requirement.camera.lens, tuple)
    place = f"camera.lens.{lens}.f_number" if key == F_NUMBER and is_catalogue else key
    value = number_at(requirement, place)
    if value is None or math.isinf(value):
        return None
    step = KEY_STEP * abs(value) or WHERE_IT_IS_ZERO
    ends = []
    for moved in (value - step, value + step):
        try:
            changed = set_key(requirement, place, moved)
        except InputError:
            return None
        ends.append(problem_parameters(problem_of(changed, changed.camera.lenses[lens], first.problem.variant)))
    unit = F_NUMBERS_PER_STOP * value if key == F_NUMBER else 1.0
    return np.asarray((ends[1] - ends[0]) / (2.0 * step)) * unit
